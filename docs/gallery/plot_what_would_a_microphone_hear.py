"""
What would a microphone hear?
=============================

Spectra of three motions of one pair, in orders of the mesh frequency. A 1T motion sounds at whole orders alone; a
doubled period (2T) adds half orders; chaos adds noise between them.
"""

import matplotlib.pyplot as plt

import gearchaos as gc

model = gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.1)
figure, axes = plt.subplots(3, 1, sharex=True, figsize=(6.4, 7), layout="constrained")
for ax, eps1 in zip(axes, (0.05, 0.1, 0.23), strict=True):
    point = model.with_values({"eps1": eps1})
    gc.plot.spectrum(gc.simulate(point, 256, transient=1000, samples=64), "z_dot", ax, orders=4)
    ax.set_title(f"$\\varepsilon_1$ = {eps1}: {gc.regime(point).label}", loc="left")
    ax.set(ylabel="amplitude of $\\dot{z}$", xlabel=ax.get_xlabel() if ax is axes[-1] else "")
