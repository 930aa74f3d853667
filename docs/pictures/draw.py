"""The figures of the explanations: ``python docs/pictures/draw.py`` draws them anew, beside this file."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import gearchaos as gc

HERE = Path(__file__).parent
RED, BLUE, GREY = "#c03a1e", "#14648c", "#6b6b6b"


def save(name: str) -> None:
    """Write the current figure and close it."""
    plt.savefig(HERE / f"{name}.png", dpi=110, bbox_inches="tight", pil_kwargs={"optimize": True})
    plt.close("all")


def model() -> None:
    """The pair, and what makes its equations nonlinear and periodic."""
    figure = plt.figure(figsize=(9.5, 4.2), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1))
    gc.plot.schematic(ax=left.subplots())
    above, below = right.subplots(2, 1)
    gc.plot.backlash(ax=above)
    gc.plot.stiffness(ax=below)
    save("model")


def method() -> None:
    """One mesh period: steps, contact switches and segments."""
    start = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    motion = gc.steady(start, gc.regime(start))
    count = motion.sizes["tau"] // motion.sizes["period"]
    share, z = np.arange(count + 1) / count, motion.z.values[: count + 1]
    _, ax = plt.subplots(figsize=(8, 3.2), layout="constrained")
    ax.axhspan(1, 1.9, color=BLUE, alpha=0.12, lw=0)
    ax.axhspan(-1.9, -1, color=RED, alpha=0.12, lw=0)
    ax.plot(share, z, color="black")
    for step in np.linspace(0, 1, 17):
        ax.axvline(step, color=GREY, lw=0.5, ls=":")
    switches = np.flatnonzero((np.abs(z[1:]) > 1) != (np.abs(z[:-1]) > 1))
    at = share[switches] + np.diff(share)[0] * (np.abs(z[switches]) - 1) / (
        np.abs(z[switches]) - np.abs(z[switches + 1]))
    ax.plot(at, np.sign(z[switches]), "o", color=RED, zorder=3)
    ax.set(xlim=(0, 1), ylim=(-1.9, 1.9), xlabel="share of the mesh period", ylabel="displacement $z$")
    for y, words in ((1.62, "front flanks touch"), (0.0, "free flight"), (-1.62, "back flanks touch")):
        ax.text(0.985, y, words, ha="right", va="center", color=GREY)
    save("method")


def box(ax: Axes, x: float, y: float, words: str, colour: str) -> None:
    """A text in a frame."""
    frame = {"boxstyle": "round,pad=0.45", "facecolor": colour, "edgecolor": GREY}
    ax.text(x, y, words, ha="center", va="center", fontsize=9, bbox=frame)


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], words: str = "") -> None:
    """An arrow, with words beside its middle."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": GREY, "shrinkA": 0, "shrinkB": 0})
    x, y = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    sideways = start[1] == end[1]
    ax.text(x if sideways else x + 0.08, y + 0.13 if sideways else y, words, fontsize=8.5, color=GREY,
            ha="center" if sideways else "left", va="center")


def verdicts() -> None:
    """From a motion to its label."""
    _, ax = plt.subplots(figsize=(8.5, 4.4), layout="constrained")
    ax.set(xlim=(0.6, 9.4), ylim=(0.6, 5.8))
    ax.axis("off")
    questions = [(5.3, "1  Transient: does the motion\nreturn to its state, twice in a row?"),
                 (3.9, "2  Does Newton's method find an orbit there,\nstable, and does the motion approach it?"),
                 (2.5, "3  Lyapunov exponents: is the largest\none above zero by its 99 % interval?"),
                 (1.1, "4  Followed for the longest transient:\nis it still above zero?")]
    for y, words in questions:
        box(ax, 3.2, y, words, "#f4f1e8")
    arrow(ax, (3.2, 4.85), (3.2, 4.35), "yes")
    arrow(ax, (3.2, 3.45), (3.2, 2.95), "no")
    arrow(ax, (3.2, 2.05), (3.2, 1.55), "yes")
    ax.plot([1.95, 0.9, 0.9], [5.3, 5.3, 2.5], color=GREY, lw=1)
    arrow(ax, (0.9, 2.5), (1.78, 2.5))
    ax.text(1.0, 4.5, "no", fontsize=8.5, color=GREY)
    for y, left, label, colour in ((3.9, 4.9, "1T, 2T, …", "#abcdff"), (1.1, 4.6, "chaotic", "#e8a598")):
        arrow(ax, (left, y), (8.0, y), "yes")
        box(ax, 8.5, y, label, colour)
    arrow(ax, (4.65, 2.6), (7.85, 3.0))
    ax.text(6.1, 3.08, "zero, on a smooth curve", fontsize=8.5, color=GREY, ha="center")
    box(ax, 8.5, 3.0, "quasi-periodic", "#f8dd80")
    arrow(ax, (4.65, 2.4), (7.95, 2.1))
    ax.text(6.5, 1.93, "neither, after longer runs", fontsize=8.5, color=GREY, ha="center")
    box(ax, 8.5, 2.1, "undecided", "#d5d5d5")
    save("verdicts")


def continuation() -> None:
    """A resonance curve: stable and unstable arms, folds and jumps."""
    single = gc.MeshModel.of(kind="single", omega=0.64, zeta=0.025, q0=0.1, eps1=0.05)
    _, ax = plt.subplots(figsize=(8, 3.6), layout="constrained")
    gc.plot.backbone(gc.branch(single, "omega=0.57:0.66"), ax=ax)
    save("continuation")


def basins() -> None:
    """What a saddle has to do with basins of attraction."""
    single = gc.MeshModel.of(kind="single", omega=0.7, zeta=0.025, q0=0.1, eps1=0.05)
    _, ax = plt.subplots(figsize=(6.5, 4), layout="constrained")
    gc.plot.basins(gc.basins(single, "z=-2:3:260", "z_dot=-1.2:1.2:220"), ax=ax)
    saddle = next(o for o in gc.orbits(single, period=1) if o.unstable)
    ax.plot(saddle.state["z"], saddle.state["z_dot"], "X", color="black", markersize=9)
    ax.annotate("saddle", (saddle.state["z"], saddle.state["z_dot"]), (12, 10), textcoords="offset points")
    save("basins")


if __name__ == "__main__":
    mpl.use("Agg")
    for draw in (model, method, verdicts, continuation, basins):
        draw()
