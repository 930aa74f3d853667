"""
How hard a knock changes the motion?
====================================

Each stable motion stands a certain shock: a sudden change of the state after which it still comes back. The arrows are
the smallest changes after which it does not: they lead from the orbits (dots) just across the boundary of their basins.
The unit is half the backlash.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.05, omega=0.7, q0=0.1, eps1=0.05)
found = gc.attractors(model, starts=64, kicks=64)
ax = gc.plot.basins(gc.basins(model, "z=0.6:1.6:150", "z_dot=-0.3:0.4:105"))
for name, start, change, size in zip(
        gc.plot.attractor_names(found), found.attractor_kick_point.values, found.attractor_kick_change.values,
        found.attractor_kick.values, strict=True):
    ax.annotate("", start + change, start, arrowprops={"arrowstyle": "-|>", "color": "#c03a1e", "linewidth": 1.6})
    print(f"{name} leaves after a change of {size:.3f}")
