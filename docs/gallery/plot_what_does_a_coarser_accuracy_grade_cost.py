"""
What does a coarser accuracy grade cost?
========================================

The same pair of gears, made to ISO grades 5, 7 and 9: a typical transmission error of each grade sets the excitation.
With the best grade the largest dynamic factor is 3.6, with the worst one 15, and the teeth separate over nearly all of
the speed range.
"""

from dataclasses import replace

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 5}, transmission_error="from quality (typical)",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
ax = None
for grade, colour in ((5, "#1b7a4b"), (7, "#2f6db5"), (9, "#c03a1e")):
    made = replace(design, quality={"standard": "ISO 1328-1:1995", "grade": grade})
    found = gc.dynamic_factor(made, "500:8000:150", torque="150 N*m")
    ax = gc.plot.response(found, "dynamic_factor", ax, strip=False)
    ax.lines[-1].set(color=colour, label=f"grade {grade}")
ax.set_ylim(1, None)
legend = ax.legend()
