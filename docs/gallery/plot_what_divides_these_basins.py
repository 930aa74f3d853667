"""
What divides these basins?
==========================

One gear pair, one speed, one torque, and several motions: which of them appears depends on the state at the start. The
colours show the motion that each initial state leads to. The boundaries are the stable manifolds of saddles, which are
unstable periodic orbits: states on a boundary stay on it, and approach the saddle.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, omega=0.8, q0=0.1, eps1=0.1)
basins = gc.basins(model, "z=-3:4:180", "z_dot=-3:3:140")
saddles = gc.manifolds(model, period=1, length=30)
ax = gc.plot.basins(basins)
gc.plot.manifolds(saddles, ax=ax, unstable=False)
