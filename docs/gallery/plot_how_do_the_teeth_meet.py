"""
How do the teeth meet?
======================

The transverse section of a pair to scale, with the flanks that the basic rack generates. Contact runs along the red
path, from A to E; dots mark the points where flanks touch.
"""

import matplotlib.pyplot as plt

import gearchaos as gc

design = gc.GearDesign(teeth=(16, 24), module="4.5 mm", face_width="14 mm", centre_distance="91.5 mm",
                       profile_shift=(0.1817, 0.1715), bore="30 mm")
figure, ax = plt.subplots(figsize=(8, 5), layout="constrained")
ax = gc.plot.gear_pair(design, ax)
