"""
What excites the mesh?
======================

The transmission error of the unloaded gears: how far the driven wheel lags behind the ideal ratio, over one mesh period
and by harmonics of the mesh frequency. Here it follows from the accuracy grade.
"""

import matplotlib.pyplot as plt

import gearchaos as gc

design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
    quality={"standard": "ISO 1328-1:1995", "grade": 7}, transmission_error="from quality")
figure, ax = plt.subplots(figsize=(8, 3.6), layout="constrained")
ax = gc.plot.transmission_error(design, ax)
