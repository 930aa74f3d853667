"""
What is a quasi-periodic motion?
================================

On elastic supports a mesh can vibrate with a second frequency that has no common multiple with the mesh frequency. The
state once per mesh period then runs around a closed curve, the section of a torus, and never returns to a point.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.04)
motion = gc.simulate(model, 4000, transient=3000)
print(gc.regime(model).label)
ax = gc.plot.portrait(motion, "z")
