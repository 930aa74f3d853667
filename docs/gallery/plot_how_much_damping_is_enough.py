"""
How much damping is enough?
===========================

Damping is the least known input of every gear model. The map shows what depends on it: below a damping ratio of about
0.1 this mesh is chaotic near ω = 1.7, at 0.06 from ω = 1.4 to 1.8. The doubling of the period (2T) ends only at 0.18,
far above the usual 0.03 to 0.1.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", q0=0.1, eps1=0.1)
zones = gc.zones(model, "omega=0.3:2.6:160", "zeta=0.01:0.2:110", refine=4)
ax = gc.plot.zones(zones)
