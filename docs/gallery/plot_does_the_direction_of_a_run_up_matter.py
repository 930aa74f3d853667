"""
Does the direction of a run-up matter?
======================================

Between two speeds two motions exist, and the gears keep the one that they have. So with rising speed the response jumps
at another speed than with falling speed, and in between it is many times as large after a run-down.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05)
up, down = (gc.bifurcation(model, "omega=0.3:1.15:250", points=0, mode=mode) for mode in ("up", "down"))
ax = gc.plot.response(up, "z_peak_to_peak", strip=False)
ax.lines[0].set_label("rising speed")
ax.plot(down.omega, down.z_peak_to_peak, ".", color="#c03a1e", markersize=3, label="falling speed")
ax.set_ylim(0, 3)
legend = ax.legend()
