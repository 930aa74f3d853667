"""
What shape has chaos?
=====================

Once per mesh period the state of a chaotic motion is marked, 30 000 times. The points lie on a strange attractor: a
folded curve with the same structure at every scale. A chaotic gear mesh is irregular, but by no means random.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.014, eps1=0.1)
motion = gc.simulate(model, 30_000, transient=500)
ax = gc.plot.portrait(motion)
