"""
Which lines show a cracked tooth?
=================================

A tooth of wheel 1 has a crack 2 mm deep, which takes 7 % of the stiffness of its pairs. The spectrum of the mesh force
gets lines at whole turns of that wheel beside the mesh harmonics (dots: the healthy pair), strongest where the pair
resonates. They are nearly equal over many turns, since a tooth is a short event.

Pitch errors make the same kind of lines. Those of the lower picture are drawn at random within grade 6, and hide the
crack.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import gearchaos as gc

healthy = gc.GearDesign(
    teeth=(23, 46), module="3 mm", face_width="20 mm", bore="25 mm", damping_ratio=0.05, torque="100 N*m",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality", speed="2000 rpm",
    quality={"standard": "ISO 1328-1:1995", "grade": 6})
cracked = {"faults": [{"wheel": 1, "tooth": 5, "crack_depth": "2 mm"}]}
pitch = {"pitch_errors": {"seed": 1}}

fig, axes = plt.subplots(2, 1, sharex=True, sharey=True, figsize=(6.4, 6), layout="constrained")
for ax, known, title in zip(axes, ({}, pitch), ("a crack", "a crack and pitch errors"), strict=True):
    found = gc.physical(gc.orders(replace(healthy, **known, **cracked), against=replace(healthy, **known)))
    shown = found.sel(order=slice(150, 260))
    ax.vlines(shown.order, 0.1, shown.order_force, color="C0", lw=0.9, label=title)
    ax.plot(shown.order, shown.against_order_force.where(shown.against_order_force > 0.1), ".", color="C3", ms=4,
            label="without the crack")
    ax.set(yscale="log", ylim=(1, 3000), ylabel="mesh force (N)")
    ax.legend(fontsize=7, loc="upper right")
axes[1].set_xlabel("order of the turn of wheel 1; the mesh has 23, 46, …")
