"""
Which speeds to avoid?
======================

At which speeds do the teeth of this pair separate, and how large is the mesh force there?

The pair is given as on its drawing. The motion from rest, those that slow sweeps of rising and falling speed pass, and
those after changes of the load are computed. The largest mesh force of each is divided by the static one. Dots mark
motions in which the flanks separate and hit each other again.
"""

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="from quality (typical)",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
found = gc.speeds_to_avoid(design, "500:8000:60", torque="150 N*m")
ax = gc.plot.dynamic_factor(found.dataset)

# %%
# The same as a list, with the events of orbits as edges.

for each in found.windows:
    print(f"{each.words}: up to {each.dynamic_factor:.2f} times the static force, at {each.speed_of_largest:.0f} rpm; "
          f"{', '.join(m.motion for m in each.reached)}")
print(f"Tried: {found.tried}.")
