"""
How stiff is the mesh?
======================

The stiffness of the tooth contact over one mesh period: high with two pairs of teeth in contact, low with one. Two
methods are compared; they agree in shape but not in the mean (thin lines), as is usual among published methods.
"""

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
ax = gc.plot.mesh_stiffness(design.at(speed="3000 rpm", torque=300))
