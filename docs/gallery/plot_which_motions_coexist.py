"""
Which motions coexist?
======================

The motion that a test finds may not be the only one. Here 256 initial states lead to several attractors at one
operating point. Each is marked by its state once per mesh period; the shares are those of the initial states.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="single", zeta=0.025, omega=2.3, q0=0.1, eps1=0.05)
found = gc.attractors(model, starts=256)
ax = gc.plot.attractors(found)

# %%
# The loudest of them vibrates much more than the quietest:

for name, velocity in zip(gc.plot.attractor_names(found), found.attractor_v_rms.values, strict=True):
    print(f"{name}: V_RMS {velocity:.3f}")
