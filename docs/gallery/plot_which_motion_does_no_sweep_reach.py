"""
Which motion does no sweep reach?
=================================

Over the diagram of a slow sweep lie the orbits of period 3, solid where they are stable, dashed where they are not.
They form a closed curve, an isola, whose other end lies to the left of the picture, at ω = 1.14. It is not connected
with the motion of the sweep: only a sudden change of the state leads there.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", omega=2.3, q0=0.1, eps1=0.1)
sweep = gc.bifurcation(model, "omega=1.8:2.9:250", mode="up")
isola = gc.branch(model, "omega=1:3.2", period=3)
ax = gc.plot.bifurcation(sweep)
ax.set_ylim(0.2, 1.5)
ax = gc.plot.branch(isola, ax=ax)
