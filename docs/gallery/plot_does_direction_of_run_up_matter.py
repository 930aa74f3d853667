"""
Does it matter whether the speed rises or falls?
================================================

Between two speeds two motions exist, and the gears keep the one that they have. So a run-up jumps at another speed
than a run-down. Both sweeps are drawn in one picture; between the jumps they differ.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05)
up, down = (gc.bifurcation(model, "omega=0.3:1.3:250", points=0, mode=mode) for mode in ("up", "down"))
ax = gc.plot.response(up, "z_peak_to_peak")
ax.plot(down.omega, down.z_peak_to_peak, ".", color="#c03a1e", markersize=3, label="falling speed", zorder=1)
ax.lines[0].set_label("rising speed")
legend = ax.legend(loc="upper left")
