"""
How much damping is enough?
===========================

Damping is the least known input of every gear model. The map shows what depends on it: with a damping ratio above 0.06
this mesh repeats with every tooth at nearly all speeds; below it, it does not.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", q0=0.1, eps1=0.1)
zones = gc.zones(model, "omega=0.3:2.6:120", "zeta=0.01:0.12:80", refine=4)
ax = gc.plot.zones(zones)
