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


def harris_map() -> None:
    """The mesh deflection of the pair of many papers with a tip relief."""
    design = gc.GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm",
                           tip_relief={"amount": "12 um", "start_diameter": "152.3 mm"})
    _, ax = plt.subplots(figsize=(6.5, 4.4), layout="constrained")
    gc.plot.harris_map(design, [60, 120, 180, 240, 300], ax)
    save("harris_map")


def contact_pattern() -> None:
    """The line load of a helical pair with a crowned lead."""
    design = gc.GearDesign(teeth=(27, 35), module="3 mm", helix_angle="20 deg", face_width="25 mm", torque="200 N*m",
                           lead_crowning="10 um")
    _, ax = plt.subplots(figsize=(6.5, 4.4), layout="constrained")
    gc.plot.contact_pattern(design, ax)
    save("contact_pattern")


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
    ax.set(xlim=(0.1, 9.4), ylim=(0.6, 5.8))
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
    ax.plot([1.8, 0.4, 0.4], [1.1, 1.1, 3.9], color=GREY, lw=1)
    arrow(ax, (0.4, 3.9), (1.55, 3.9))
    ax.text(0.5, 1.25, "no, it has settled", fontsize=8.5, color=GREY)
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
    gc.plot.response_curve(gc.branch(single, "omega=0.57:0.66"), ax=ax)
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


def gears() -> None:
    """The dynamic factor of a pair along the speed, beside those of the standards."""
    design = gc.GearDesign(
        teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
        quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="from quality (typical)",
        backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05)
    _, ax = plt.subplots(figsize=(8, 4.2), layout="constrained")
    gc.plot.dynamic_factor(gc.dynamic_factor(design, "500:8000:200", torque="300 N*m"), ax)
    save("gears")


def covering() -> None:
    """A set that covers another, and three sets that cover each other along a loop."""
    _, (pair, loop) = plt.subplots(1, 2, figsize=(8.5, 3), layout="constrained")
    for ax in (pair, loop):
        ax.axis("off")
    for x, name in ((-4.2, "N"), (0.0, "M")):
        pair.add_patch(mpl.patches.Rectangle((x - 1, -1), 2, 2, fc="#f4f1e8", ec=GREY))
        pair.text(x - 0.75, 0.75, name, va="center", ha="center")
    for side, words in ((-1, "a = −1"), (1, "a = 1")):
        pair.plot([side - 4.2, side - 4.2], [-1, 1], color=RED, lw=2.5)
        pair.text(side - 4.2, -1.25, words, ha="center", va="top", fontsize=9)
    a = np.linspace(-1.8, 1.8, 80)
    middle = 0.15 * np.sin(1.6 * a)
    pair.fill_between(a, middle - 0.3, middle + 0.3, color=BLUE, alpha=0.35, lw=0)
    for end in (0, -1):
        pair.plot([a[end], a[end]], [middle[end] - 0.3, middle[end] + 0.3], color=RED, lw=2.5)
    pair.text(1.95, middle[-1], "P(N)", va="center", color=BLUE)
    pair.annotate("", (-2.0, 0), (-3.0, 0), arrowprops={"arrowstyle": "-|>", "color": GREY})
    pair.text(-2.5, 0.15, "P", ha="center", color=GREY)
    pair.set(xlim=(-5.6, 3.0), ylim=(-1.9, 1.4), aspect="equal")
    pair.set_title("N covers M", fontsize=10)
    places = {"N₀": (0.0, 0.0), "N₁": (2.2, 0.9), "N₂": (2.2, -0.9)}
    for name, (x, y) in places.items():
        box(loop, x, y, name, "#f4f1e8")
    for start, end in (("N₀", "N₁"), ("N₁", "N₂"), ("N₂", "N₀")):
        loop.annotate("", places[end], places[start],
                      arrowprops={"arrowstyle": "-|>", "color": GREY, "shrinkA": 18, "shrinkB": 18})
    loop.annotate("", (-0.32, -0.12), (-0.32, 0.12), arrowprops={
        "arrowstyle": "-|>", "color": GREY, "connectionstyle": "arc3,rad=2.6", "shrinkA": 2, "shrinkB": 2})
    loop.set(xlim=(-1.4, 3.2), ylim=(-1.6, 1.5))
    loop.set_title("a graph of sets: N₀ covers itself and N₁", fontsize=10)
    save("covering")


def store() -> None:
    """Tiles of a map that is half computed, and where their results are."""
    _, ax = plt.subplots(figsize=(8, 3.2), layout="constrained")
    ax.set(xlim=(0, 16), ylim=(-0.9, 4.6), aspect="equal")
    ax.axis("off")
    for block, count in enumerate((8, 8, 3, 0)):
        left, below = 4 * (block % 2), 2 * (block // 2)
        for tile in range(8):
            colour = "white" if tile >= count else "#abcdff" if count < 8 else BLUE
            ax.add_patch(mpl.patches.Rectangle((left + tile % 4, below + tile // 4), 1, 1, fc=colour, ec=GREY, lw=0.6))
        ax.add_patch(mpl.patches.Rectangle((left, below), 4, 2, fill=False, ec="black", lw=1.6))
    ax.text(4, -0.5, "map: tiles (thin) in blocks (thick)", ha="center", fontsize=9)
    for y, colour, words in ((3.4, BLUE, "block is written: one file for each array"),
                             (2.0, "#abcdff", "tile is done: a file of its own in run/tiles"),
                             (0.6, "white", "tile is not computed: the next run computes it")):
        ax.add_patch(mpl.patches.Rectangle((9, y - 0.3), 0.6, 0.6, fc=colour, ec=GREY, lw=0.6))
        ax.text(9.9, y, words, va="center", fontsize=9)
    save("store")


if __name__ == "__main__":
    mpl.use("Agg")
    for draw in (model, method, verdicts, continuation, basins, gears, harris_map, contact_pattern, covering, store):
        draw()
