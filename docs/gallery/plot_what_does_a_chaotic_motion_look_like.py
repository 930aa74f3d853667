"""
What does a chaotic motion look like?
=====================================

Four views of one motion: the displacement over time never repeats, the trajectory fills a region of the phase plane,
the states once per mesh period form a strange attractor, and the spectrum has a continuous floor between the orders.
"""

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.1, eps1=0.23)
verdict = gc.regime(model)
title = f"{verdict.label}, $\\lambda_1$ = {verdict.lyapunov[0]:.3f}"
figure = gc.plot.motion(gc.steady(model, verdict), title=title)
