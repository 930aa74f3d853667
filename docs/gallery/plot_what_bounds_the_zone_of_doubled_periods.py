"""
What bounds the zone of doubled periods?
========================================

A map tells which motion occurs, bifurcation theory why it ends. The curves are followed by continuation, independently
of the map: on a flip curve the period doubles, on a fold curve a motion appears or vanishes. Where the map changes and
no curve lies, as at the left edge of 2T, both motions are stable, and the initial values decide.
"""

import gearchaos as gc

if __name__ == "__main__":
    model = gc.MeshModel.of(kind="torsional", q0=0.1)
    zones = gc.zones(model, "omega=1.6:2.4:120", "eps1=0.01:0.1:80", refine=4)
    curves = gc.skeleton(model, "omega=1.6:2.4:8", "eps1=0.01:0.1:4", period=2, lines=(2, 1), workers=1)
    ax = gc.plot.zones(zones)
    gc.plot.skeleton(curves, ax=ax, grazes=False)
