"""
How does it look in print without colour?
=========================================

``gc.plot.style("paper", width="column")`` sets the size of one column of a journal and fonts that are embedded;
``hatch=True`` gives every class its own hatching, so that a map can be read without any colour.
"""

import gearchaos as gc

zones = gc.zones(gc.MeshModel.of(kind="torsional", q0=0.1), "omega=0.2:3:120", "eps1=0:0.3:90", refine=4)
with gc.plot.style("paper", width="column"):
    ax = gc.plot.zones(zones, hatch=True)
