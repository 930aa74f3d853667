"""
Does a loose gear rattle?
=========================

The second order of an engine shakes the driver of a wheel that nothing loads but the drag of the oil. Where the drag
falls below the inertia torque, contact is lost; the dashed line is the closed form. Below it the wheel flies between
both flanks, and touches them for a few per cent of the time.

Motions are those from rest, and after slow sweeps of the drag in both directions.
"""

import matplotlib.pyplot as plt

import gearchaos as gc

driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"), stiffness="2e8 N/m",
               damping="60 N*s/m", backlash="0.12 mm")
train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
found = gc.physical(gc.rattle(train, "loose.torque=-0.16:-0.04:13")).isel(mesh=0)
drag = -found["loose.torque"]

fig, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(6.4, 5), layout="constrained")
for history, mark in (("rest", "o"), ("rising", "^"), ("falling", "v")):
    one = found.sel(history=history)
    above.plot(drag, 100 * one.mesh_front_share, mark, color="C0", mfc="none", label=f"front flank, {history}")
    above.plot(drag, 100 * one.mesh_back_share, mark, color="C1", mfc="none", label=f"back flank, {history}")
    below.plot(drag, one.mesh_impacts, mark, color="C2", mfc="none")
for ax in (above, below):
    ax.axvline(-float(found.onset_linear[0]), color="0.5", lw=0.8, ls="--")
above.set(ylabel="share of the time (%)", yscale="log")
above.legend(fontsize=7)
below.set(xlabel="drag torque (N m)", ylabel="impacts per second")
