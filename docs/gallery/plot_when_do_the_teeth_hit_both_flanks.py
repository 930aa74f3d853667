"""
When do the teeth hit both flanks?
==================================

Over speed and torque: in which states of contact the teeth run. "Separation" is a loss of contact with impacts on the
driving flanks; with "both flanks" the teeth also hit their back flanks. The line is a first estimate without any
simulation, where permanent contact would end if the mesh stiffness were constant.
"""

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 7}, transmission_error="from quality",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
found = gc.operating_map(design, "500:8000:60", "40:300:36")
ax = gc.plot.level(found, "contact")
ax = gc.plot.separation_line(design, ax)
