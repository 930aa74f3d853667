"""
Which motion is where?
======================

Every cell of the map is one operating point: a mesh frequency, and an amplitude of the transmission error. Its colour
is the kind of motion that begins from rest there. 1T repeats with every tooth, 2T with every second one.

``refine=4`` computes every fourth row and column first, and more cells only where neighbours differ.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", q0=0.1)
zones = gc.zones(model, "omega=0.2:3:160", "eps1=0:0.3:120", refine=4)
ax = gc.plot.zones(zones)
