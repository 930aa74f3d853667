"""
How hard a knock changes the motion?
====================================

Each stable motion stands a certain shock: a sudden change of the state after which it still comes back. The smallest
shock that makes it leave is the distance of its orbit from the boundary of its basin. The cross is the state to which
that shock leads.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, omega=0.8, q0=0.1, eps1=0.1)
found = gc.attractors(model, starts=64, kicks=64)
ax = gc.plot.basins(gc.basins(model, "z=-2:4:120", "z_dot=-2:2:90"))
for name, start, change, size in zip(
        gc.plot.attractor_names(found), found.attractor_kick_point.values, found.attractor_kick_change.values,
        found.attractor_kick.values, strict=True):
    ax.annotate("", start + change, start, arrowprops={"arrowstyle": "-|>", "linewidth": 1.4})
    print(f"{name}: leaves after a change of {size:.3f}")
