"""
How much damping is enough?
===========================

Damping is the least known input of every gear model. The map shows what depends on it: below a damping ratio of about
0.1 this mesh is chaotic near ω = 1.7, at 0.06 over a third of the range of resonance. The doubling of the period (2T)
remains up to 0.12 and beyond: damping cannot remove it.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", q0=0.1, eps1=0.1)
zones = gc.zones(model, "omega=0.3:2.6:160", "zeta=0.01:0.12:110", refine=4)
ax = gc.plot.zones(zones)
