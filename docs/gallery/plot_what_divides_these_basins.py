"""
What divides these basins?
==========================

One gear pair, one speed, one torque, and two motions: a quiet one (dark) and one that loses contact (light). The state
at the start decides. The boundary is the stable manifold of a saddle, an unstable periodic orbit (cross): a motion that
begins on it stays on it, and approaches the saddle.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.05, omega=0.7, q0=0.1, eps1=0.05)
basins = gc.basins(model, "z=-2:3:300", "z_dot=-1.5:1.5:220")
saddle = gc.manifolds(model, period=1, length=30)
ax = gc.plot.basins(basins)
ax = gc.plot.manifolds(saddle, ax=ax, unstable=False)
