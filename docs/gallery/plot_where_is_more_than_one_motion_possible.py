"""
Where is more than one motion possible?
=======================================

Each cell is computed from eight initial states and by slow sweeps of the frequency in both directions. The colours
count the different motions that were found. In cells with two or more, a measurement depends on its history.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", q0=0.1)
zones = gc.zones(model, "omega=0.3:2.6:48", "eps1=0.01:0.15:24", starts=8)
ax = gc.plot.level(zones, "attractors")
