"""
What is in the model?
=====================

Two wheels on elastic supports, coupled by a spring whose stiffness changes as tooth pairs enter and leave the contact,
by a damper, and by backlash. The transmission error is the excitation.
"""

import matplotlib.pyplot as plt

import gearchaos as gc

figure, axes = plt.subplot_mosaic([["model", "stiffness"], ["model", "backlash"]], figsize=(8.5, 6),
                                  layout="constrained")
gc.plot.schematic(axes["model"])
gc.plot.stiffness(ax=axes["stiffness"])
ax = gc.plot.backlash(axes["backlash"])
