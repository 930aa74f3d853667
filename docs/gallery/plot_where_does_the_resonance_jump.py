"""
Where does the resonance jump?
==============================

The complete resonance curve, with its unstable part, which no sweep and no experiment shows. Loss of contact makes the
mesh softer on average, so that the peak bends towards lower frequencies. At a fold the stable motion ends, and the
response jumps along the arrow.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, omega=0.7, q0=0.1, eps1=0.05)
resonance = gc.branch(model, "omega=0.3:1.6")
ax = gc.plot.response_curve(resonance, "z_peak_to_peak")
