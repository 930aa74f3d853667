"""Natural modes of a train: where their energy is, and at which speeds the orders of excitations meet them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D

from gearchaos.errors import InputError, whole_number
from gearchaos.plot._datasets import check, check_positive, keeps_data
from gearchaos.plot.axes import draw_legend, new_axes
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt, adapt_scale

_COLOURS = (STROBE, "#1b7a4b", "#8a5a00", "#6a3d9a", "#2f6db5")  # of excitations
_DASHES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (5, 1.5, 1, 1.5)))  # of harmonics
_SHARES = LinearSegmentedColormap.from_list("energy", ["white", "#9db4d6", "#3d5a94"])
_LEAST_SHARE = 0.005  # that is written
_LINE_HEIGHT = 1.25  # over the size of the font
_MOST_HARMONICS, _ABOVE = 20, 1.25  # range of speeds over the speed of the train


@keeps_data
def campbell(ds: xr.Dataset, ax: Axes | None = None, *, speed: float | None = None, harmonics: int = 3) -> Axes:
    """Draw a Campbell diagram: natural frequencies over the speed, and the orders of all excitations.

    Dots are the resonant speeds, where an order or harmonic of a mesh has a natural frequency; the vertical line is the
    speed of the train. Frequencies do not depend on the speed.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.natural_frequencies`.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    speed : float, optional
        Largest speed of the first body in rpm, by default 1.25 times that of the train.
    harmonics : int
        Number of harmonics of each mesh order, at most 20. Orders of motions and torques have none.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.natural_frequencies`, or for a speed or number that is not
        positive.

    Examples
    --------
    >>> import gearchaos as gc
    >>> bodies = [gc.Body(name="a", inertia=1e-3), gc.Body(name="b", inertia=2e-3)]
    >>> train = gc.Train(speed="6000 rpm", bodies=bodies, meshes=[gc.Mesh(
    ...     between=("a", "b"), teeth=(20, 30), base_radii=("30 mm", "45 mm"), stiffness="2e8 N/m",
    ...     backlash="0.1 mm")])
    >>> ax = gc.plot.campbell(gc.natural_frequencies(train), harmonics=2)
    >>> [text.get_text() for text in ax.get_legend().get_texts()]
    ['20: mesh a/b', 'natural frequency']
    """
    check(ds, "natural_frequencies", natural_frequency=("mode",), order=("excitation",), speed=())
    count = whole_number("harmonics", harmonics, 1, _MOST_HARMONICS)
    fastest = _ABOVE * float(ds["speed"]) if speed is None else check_positive("speed", speed)
    ax = new_axes(ax)
    found = ds["natural_frequency"].values[~ds["rigid"].values]
    if not found.size:
        raise InputError("dataset", "must have a mode that deflects something", "none")
    excitations: dict[float, list[str]] = {}  # by their order
    for name, order in zip(ds["excitation"].values.tolist(), ds["order"].values.tolist(), strict=True):
        excitations.setdefault(order, []).append(name)
    rays = [(k, n * order, n) for k, (order, names) in enumerate(excitations.items())
            for n in range(1, (count if any(name.startswith("mesh ") for name in names) else 1) + 1)]
    reached = max(order for _, order, _ in rays) * fastest / 60
    highest = 1.06 * min(found.max(), max(1.06 * reached, found.min()))
    ax.set(xlim=(0, fastest), ylim=(0, highest), xlabel="speed of the first body [rpm]", ylabel="frequency [Hz]")
    ax.hlines(found, 0, fastest, color=adapt(INK), linewidth=0.9)
    ax.axvline(float(ds["speed"]), color=adapt("0.45"), linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
    for k, order, n in rays:
        colour = adapt(_COLOURS[k % len(_COLOURS)])
        ax.plot([0, fastest], [0, order * fastest / 60], color=colour, linewidth=0.9,
                linestyle=_DASHES[min(n, len(_DASHES)) - 1])
        met = 60 * found / order
        inside = (met <= fastest) & (found <= highest)
        ax.plot(met[inside], found[inside], "o", color=colour, markersize=3.6, markeredgewidth=0.6,
                markeredgecolor=adapt(BACKGROUND), zorder=3)
        if n > 1:
            end = min(fastest, 60 * highest / order)
            ax.annotate(f"{n} ×", (end, order * end / 60), (-3, 1 if end == fastest else -1), ha="right",
                        va="bottom" if end == fastest else "top", textcoords="offset points", color=colour,
                        fontsize=0.8 * rcParams["font.size"])
    _write_frequencies(ax, found[found <= highest], fastest)
    draw_legend(ax, [*(Line2D([], [], color=adapt(_COLOURS[k % len(_COLOURS)]), linewidth=0.9, label=(
        f"{order:.5g}: {names[0]}" + (f" and {len(names) - 1} more" if len(names) > 1 else "")))
        for k, (order, names) in enumerate(excitations.items())),
        Line2D([], [], color=adapt(INK), linewidth=0.9, label="natural frequency")])
    return ax


def _write_frequencies(ax: Axes, found: np.ndarray, right: float) -> None:
    """Write natural frequencies beside their lines, but for those that are too close to one below."""
    points = ax.get_window_extent().height / ax.figure.dpi * 72
    apart = _LINE_HEIGHT * rcParams["font.size"] * 0.8 / points * ax.get_ylim()[1]
    last = -np.inf
    for value in np.sort(found):
        if value - last > apart:
            ax.annotate(f"{value:.0f}", (right, value), (3, 0), textcoords="offset points", va="center",
                        fontsize=0.8 * rcParams["font.size"], color=adapt(INK), annotation_clip=False)
            last = value


@keeps_data
def modes(ds: xr.Dataset, ax: Axes | None = None, *, most: int = 16) -> Axes:
    """Draw where the energy of natural modes is: the kinetic one of bodies, the strain of meshes, shafts and supports.

    A row is a mode, and cells have shares of its energy in per cent, those of bodies with the sign of their angle in
    their own sense of rotation: bodies with the same sign move forwards at the same time.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.natural_frequencies`.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    most : int
        Number of modes that are drawn at most, those of the lowest frequencies.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.natural_frequencies`, or the number is not positive.

    Examples
    --------
    >>> import gearchaos as gc
    >>> bodies = [gc.Body(name=name, inertia=1e-3) for name in ("a", "idler", "b")]
    >>> mesh = {"teeth": (20, 20), "base_radii": (0.03, 0.03), "stiffness": 2e8, "backlash": 1e-4}
    >>> train = gc.Train(speed=600, bodies=bodies, meshes=[
    ...     gc.Mesh(between=("a", "idler"), **mesh), gc.Mesh(between=("idler", "b"), **mesh)])
    >>> ax = gc.plot.modes(gc.natural_frequencies(train))
    >>> [text.get_text() for text in ax.get_xticklabels()]
    ['a', 'idler', 'b', 'a/idler', 'idler/b']
    """
    check(ds, "natural_frequencies", kinetic_energy=("mode", "body"), strain_energy=("mode", "element"))
    shown = ds.isel(mode=slice(0, whole_number("most", most, 1)))
    ax = new_axes(ax)
    bodies, elements = shown.sizes["body"], shown.sizes["element"]
    share = np.concatenate([shown["kinetic_energy"].values, np.full((shown.sizes["mode"], 1), np.nan),
                            shown["strain_energy"].values], axis=1)
    ax.pcolormesh(share, cmap=adapt_scale(_SHARES), vmin=0, vmax=1, edgecolors=adapt(BACKGROUND), linewidth=0.5)
    centres = [*range(bodies), *range(bodies + 1, bodies + 1 + elements)]
    ax.set_xticks(np.array(centres) + 0.5, [*shown["body"].values.tolist(), *shown["element"].values.tolist()],
                  rotation=90, fontsize="small")
    rows = zip(*(shown[name].values for name in ("rigid", "natural_frequency", "damping_ratio")), strict=True)
    ax.set_yticks(np.arange(len(share)) + 0.5, [
        "turning as a whole" if rigid else f"{frequency:.0f} Hz, ζ {100 * damping:.2g} %"
        for rigid, frequency, damping in rows], fontsize="small")
    ax.tick_params(length=0)
    for side in ax.spines.values():
        side.set_visible(False)
    ax.invert_yaxis()
    for first, count, name in ((0, bodies, "kinetic energy"), (bodies + 1, elements, "strain energy")):
        ax.text(first + count / 2, -0.2, name, ha="center", va="bottom", fontsize="small")
    box = ax.get_window_extent()
    cell = min(box.width / share.shape[1] / 2.6, box.height / len(share) / _LINE_HEIGHT) * 72 / ax.figure.dpi
    size, angle = min(0.8 * rcParams["font.size"], cell), shown["mode_angle"].values
    for i, column in np.argwhere(share >= _LEAST_SHARE).tolist() if size >= 4 else ():
        value, sign = share[i, column], "" if column >= bodies else "−" if angle[i, column] < 0 else "+"
        ax.text(column + 0.5, i + 0.5, f"{sign}{100 * value:.0f}", ha="center", va="center", fontsize=size,
                color=adapt("black") if value < 0.6 else adapt(BACKGROUND))
    return ax
