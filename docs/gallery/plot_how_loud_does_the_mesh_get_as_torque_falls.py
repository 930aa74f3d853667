"""
How loud does the mesh get as torque falls?
===========================================

The torque falls slowly from right to left at 3000 rpm, and every motion begins where the previous one ended. The teeth
separate, and the vibration falls with the torque, down to 64 N m. There the teeth begin to hit both flanks, and nothing
brakes them in between: the mesh is 17 times as loud, and grows louder as it carries less.
"""

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 7}, transmission_error="from quality",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
running = design.at(speed="3000 rpm", torque=200)
falling = gc.physical(gc.bifurcation(running, "torque=40:200:300", points=0, mode="down"))
ax = gc.plot.response(falling, "v_rms")
