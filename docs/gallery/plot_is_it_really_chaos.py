"""
Is it really chaos?
===================

A motion is called chaotic if neighbouring motions separate exponentially: if the largest Lyapunov exponent is above
zero by more than its statistical uncertainty. The band is the 99 % confidence interval. It narrows with the length of
the run, which is doubled a few times if the sign is not certain.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.1)
exponents = gc.bifurcation(model, "eps1=0.19:0.24:250", points=0)
ax = gc.plot.lyapunov(exponents)
