"""
What does tip relief do?
========================

A tooth that bends under load meets the next one early, with its tip corner. Tip relief takes material off the tips, so
that each pair takes up its load little by little. How much is right, and what does it change?

The pair is given as on its drawing. Its tooth pairs share the load. Each is a spring with a gap of its own, which the
relief opens, and which goes on beyond the path of contact.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize_scalar

import gearchaos as gc


def pair(relief):
    """27 and 35 teeth with this tip relief in µm, which is linear and begins where one pair begins to carry alone."""
    return gc.GearDesign(
        teeth=(27, 35), module="3 mm", face_width="25 mm", bore="30 mm", damping_ratio=0.07, torque="382 N*m",
        speed="2000 rpm", backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="none",
        tip_relief={"amount": f"{relief} um", "start_diameter": ["82 mm", "106.17 mm"]})


# %%
# At rest the mesh gives way by the mesh deflection. Without relief it is largest where one pair carries alone.

cycle, reliefs = np.linspace(0, 1, 401), (0, 15, 30, 45)
fig, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
for relief in reliefs:
    model = pair(relief).to_model()
    deflection = gc.static_deflection(model.stiffness, model.q1, cycle) - 1
    ax.plot(cycle, deflection * 60, label=f"{relief} µm")
ax.set(xlabel="mesh cycle", ylabel="mesh deflection (µm)")
ax.legend(title="tip relief", ncols=2)

# %%
# In motion this variation excites the mesh. The dynamic factor falls with the relief, until the gap is more than the
# teeth bend.

fig, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
for relief in reliefs:
    found = gc.dynamic_factor(pair(relief), "1000:4000:151")
    ax.plot(found["speed"], found["dynamic_factor"], label=f"{relief} µm")
ax.set(xlabel="speed of wheel 1 (rpm)", ylabel="dynamic factor, damping in contact")
ax.legend(title="tip relief", ncols=2)

# %%
# The relief that makes the mesh deflection vary least, and the one that makes the largest factor between 1000
# and 4000 rpm least, are close to each other here. They need not be.


def variation(relief):
    """Peak to peak of the mesh deflection, µm."""
    model = pair(relief).to_model()
    return float(np.ptp(gc.static_deflection(model.stiffness, model.q1, cycle))) * 60


def largest(relief):
    """The largest dynamic factor between 1000 and 4000 rpm."""
    return float(gc.dynamic_factor(pair(relief), "1000:4000:61")["dynamic_factor"].max())


at_rest = minimize_scalar(variation, bounds=(5, 60), method="bounded", options={"xatol": 0.1})
in_motion = minimize_scalar(largest, bounds=(5, 60), method="bounded", options={"xatol": 0.5})
print(f"At rest:   {at_rest.x:.0f} µm, {at_rest.fun:.2f} µm peak to peak (without relief {variation(0):.2f} µm)")
print(f"In motion: {in_motion.x:.0f} µm, largest factor {in_motion.fun:.2f} (without relief {largest(0):.2f})")
