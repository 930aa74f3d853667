"""
What if the damping stops with contact?
=======================================

A loose gear is carried along by a driver whose speed fluctuates with the second order of an engine. Drag brakes it.
Does it rattle, and does it reach both flanks?

The damper of the paper's model also acts across the open gap. Oil does so a little, steel does not. With ``contact``
the damper works while flanks touch. With ``unilateral`` the flanks also never pull.

The closed form says where the teeth begin to separate: where the drag falls below the moment of inertia times the
angular acceleration of the wheel, here 0.1 N m. All laws agree on that. Just below it they do not: with damping in the
gap the wheel stays near one flank, and its long contact does not exist with the others. Far below it all laws let the
wheel hit both flanks.
"""

import matplotlib.pyplot as plt
import numpy as np

import gearchaos as gc

inertia, radius, driver, acceleration = 5e-4, 0.045, 0.030, 300.0  # kg m², m, m, rad/s²
stiffness, damping, half_backlash = 2e8, 60.0, 60e-6  # N/m, N s/m, m
mass, order = inertia / radius**2, 2 * 2 * np.pi * 800 / 60  # second order of 800 rpm
omega0, force = np.sqrt(stiffness / mass), stiffness * half_backlash

model = gc.MeshModel.of(
    kind="single", omega=order / omega0, zeta=damping / (2 * mass * omega0),
    eps1=driver * acceleration / order**2 / half_backlash, stiffness=gc.TwoLevelStiffness(0, 0))
drag = gc.Axis("q0", 0.02 / radius / force, 0.14 / radius / force, 49)  # 0.02 to 0.14 N m

fig, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
for law, colour, mark in (("always", "C0", "o"), ("contact", "C1", "s"), ("unilateral", "C2", "x")):
    found = gc.bifurcation(model.with_values({"damping_law": law}), drag, points=0)
    torque, share = found["q0"].values * radius * force, 100 * found["contact_fraction"].values
    both = found["contact"].values == 2
    ax.plot(torque, share, "-", color=colour, lw=0.8, label=f"{law}")
    ax.plot(torque[both], share[both], mark, color=colour, ms=5, mfc="none", label=f"{law}: both flanks")
ax.axvline(inertia * acceleration * driver / radius, color="0.6", lw=0.8)
ax.set(xlabel="drag torque (N m)", ylabel="share of the time in contact (%)", yscale="log")
ax.legend(fontsize="small")

# %%
# For a loaded pair the law matters where its teeth separate. There several motions exist at one speed, and the law also
# decides which of them is reached from rest: the factor jumps from speed to speed. The mesh is one spring here: tooth
# pairs that share the load have one damper, which cannot be kept from pulling pair by pair.

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="from quality", torque="60 N*m",
    load_sharing="prescribed",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)

fig, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
for law, colour in (("always", "C0"), ("contact", "C1"), ("unilateral", "C2")):
    found = gc.dynamic_factor(gc.GearDesign(**{
        name: getattr(design, name) for name in design.__dataclass_fields__ if name != "damping_law"
        and name != "diametral_pitch"}, damping_law=law), "2000:8000:121")
    ax.plot(found["speed"], found["dynamic_factor"], color=colour, label=law)
ax.set(xlabel="speed of wheel 1 (rpm)", ylabel="dynamic factor")
ax.legend(title="damping law")
