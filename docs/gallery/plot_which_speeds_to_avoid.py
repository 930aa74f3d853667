"""
Which speeds to avoid?
======================

At which speeds do the teeth of this pair separate, and how large is the mesh force there?

The pair is given as on its drawing. From rest at each speed the steady motion is computed, and the largest mesh force
is divided by the static one. Dots mark the speeds at which the flanks separate and hit each other again.
"""

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="from quality",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
factors = gc.dynamic_factor(design, "500:8000:300", torque="150 N*m")
ax = gc.plot.dynamic_factor(factors)

# %%
# The same as a list: each range begins and ends at a computed speed.

for found in gc.speeds_to_avoid(factors):
    print(f"{found.start:.0f} to {found.stop:.0f} rpm: up to {found.dynamic_factor:.2f} times the static force, "
          f"at {found.speed_of_largest:.0f} rpm")
