"""The picture of the result of any study."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos.datasets import gridded_variable
from gearchaos.errors import InputError
from gearchaos.plot._datasets import check_dataset, check_name, figure_of
from gearchaos.plot._dynamic_factor import dynamic_factor
from gearchaos.plot._fit import fit
from gearchaos.plot._modes import campbell
from gearchaos.plot._orders import orders
from gearchaos.plot._overlays import agreement, skeleton
from gearchaos.plot._runup import runup
from gearchaos.plot._scatter import scatter
from gearchaos.plot.axes import axis_label, new_axes
from gearchaos.plot.classes import named_classes
from gearchaos.plot.diagrams import bifurcation, lyapunov, response, response_curve
from gearchaos.plot.maps import level, zones
from gearchaos.plot.motions import motion, portrait
from gearchaos.plot.states import attractors, basins, manifolds
from gearchaos.plot.theme import INK, STROBE, adapt
from gearchaos.studies.core.registry import STUDIES

MOTION = "motion"  # the colouring of a map by kind of motion; the other colourings are names of variables


def default_colour(ds: xr.Dataset) -> str:
    """What a picture shows if nothing is chosen: of a map of given gears what is to be avoided, or the contact of the
    teeth, the worst of the motions found in each cell; of any other result the motion."""
    if ds.attrs.get("study") != "zones" or "gears" not in ds.attrs:
        return MOTION
    return next((name for name in ("to_avoid", "contact_worst", "contact") if name in ds), MOTION)


def result(
    ds: xr.Dataset, colour: str | None = None, *, hatch: bool = False, over: xr.Dataset | None = None
) -> Figure:
    """Draw the result of any study, or two that belong together in one picture.

    The picture is a map of zones, a bifurcation diagram (without points, the Lyapunov exponents), basins, attractors,
    the dynamic factor along the speed, the response along a branch of orbits, curves of events over two parameters, how
    far these explain a map, the manifolds of saddles, or, of a simulation, the motion in four views (without
    samples, the stroboscopic portrait).

    Parameters
    ----------
    ds : Dataset
        From any study, or from `gearchaos.load`.
    colour : str, optional
        What the colours of a map of zones show, or the values of a diagram along one parameter: "motion", or a variable
        such as "v_rms" or "contact". If left out, "motion"; for a map of given gears the contact of the teeth, with
        several starts the worst one of each cell.
    hatch : bool
        Tell the classes of a map or the basins apart by hatching instead of colours.
    over : Dataset, optional
        What is drawn over it: curves of `gearchaos.skeleton` or `gearchaos.curve` over a map of the same parameters, or
        a second diagram of `gearchaos.bifurcation` along the same parameter, such as the sweep down over that up, or a
        measured run-up over a computed one. Two diagrams show a variable, ``colour``; by default "dynamic_factor" or,
        without static load, "v_rms".

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        For a Dataset that is not the result of a study, a colour that is not one of its variables, hatching of what
        is no map of classes, or two results that do not belong together.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> figure = gc.plot.result(zones, "contact")
    >>> figure.savefig("contact.png")  # doctest: +SKIP
    """
    check_dataset(ds)
    kind = str(ds.attrs.get("study", ""))
    draw = _PICTURES.get(kind) or (_by_shape if kind in STUDIES and gridded_variable(ds) else None)
    if draw is None:
        if kind and kind not in STUDIES:
            raise STUDIES.unknown("dataset.study", kind)
        raise InputError("dataset", "must be the result of a study", kind or sorted(map(str, ds.variables)),
                         f"It carries the name of its study in attrs['study']: {', '.join(_PICTURES)}.")
    check_colour(ds, colour)
    if hatch and kind not in _HATCHED:
        raise InputError("hatch", f"must be left out for a result that is not of {', '.join(_HATCHED)}", kind)
    if over is not None and kind == "bifurcation":
        return figure_of(_two_diagrams(ds, over, colour))
    if over is not None and kind == "runup":
        return runup(ds, against=over)
    options = {"hatch": True} if hatch else {}
    colour = default_colour(ds) if colour is None else colour
    artist = draw(ds, **options) if colour == MOTION else _COLOURED[kind][1](ds, colour, **options)
    if over is not None:
        check_dataset(over)
        if ds.attrs["study"] != "zones" or over.attrs.get("study") not in ("skeleton", "curve"):
            raise InputError("over", "must be a skeleton or curve over a map, or a second bifurcation diagram over one",
                             f"{over.attrs.get('study')} over {ds.attrs['study']}")
        assert isinstance(artist, Axes)
        settings, names = json.loads(over.attrs["settings"]), tuple(map(str, reversed(ds["label"].dims)))
        _check_same("parameters", names, (settings["x"][0], settings["y"][0]))
        _check_same("units", *([part[n].attrs.get("units") for n in names] for part in (ds, over)))
        skeleton(over, artist, special=True)
    return figure_of(artist)


def _by_shape(ds: xr.Dataset) -> Axes:
    """Draw the first variable over the axes of a study that has no picture of its own, as a line or a map."""
    name = gridded_variable(ds)
    assert name is not None
    shown, ax = ds[name], new_axes(None)
    *vertical, horizontal = map(str, shown.dims)
    if vertical:
        image = ax.pcolormesh(ds[horizontal].values, ds[vertical[0]].values, shown.values)
        ax.figure.colorbar(image, ax=ax, label=axis_label(shown, name))
    else:
        ax.plot(ds[horizontal].values, shown.values, color=adapt(INK), linewidth=0.8)
    ax.set(xlabel=axis_label(ds[horizontal], horizontal),
           ylabel=axis_label(ds[vertical[0]], vertical[0]) if vertical else axis_label(shown, name))
    return ax


def _two_diagrams(ds: xr.Dataset, over: xr.Dataset, name: str | None) -> Axes:
    """Draw a variable of two diagrams along the same parameter, each by how it was swept."""
    check_dataset(over)
    _check_same("study", ds.attrs["study"], over.attrs.get("study"))
    _check_same("parameter", *(str(part["label"].dims[0]) for part in (ds, over)))
    loaded = bool(np.isfinite(ds["dynamic_factor"]).any())
    name = name or ("dynamic_factor" if loaded else "v_rms")
    for part in (ds, over):
        check_name(part, "colour", name, 1)
        if named_classes(part, name) is not None:
            raise InputError("colour", "must be a number where two diagrams are drawn", name, "E.g. v_rms.")
    _check_same("units", *(part[name].attrs.get("units") for part in (ds, over)))
    ax = response(ds, name)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    response(over, name, ax, strip=False)
    ax.set_xlim(min(left, ax.get_xlim()[0]), max(right, ax.get_xlim()[1]))
    ax.set_ylim(min(low, ax.get_ylim()[0]), max(high, ax.get_ylim()[1]))
    ax.lines[-1].set(color=adapt(STROBE), linestyle="--", zorder=3)
    modes = [json.loads(part.attrs["settings"])["mode"] for part in (ds, over)]
    ax.legend(ax.lines[-2:], [_SWEPT[m] for m in modes], loc="best", fontsize="small")
    return ax


_SWEPT = {"fixed": "from the initial values", "up": "sweep up", "down": "sweep down"}
"""How a bifurcation diagram was computed, in words."""


def _check_same(what: str, first: object, second: object) -> None:
    """Raise `InputError` unless two results have the same parameters, units, …"""
    if first != second:
        raise InputError("over", f"must have the {what} of the result below", str(second), f"It has {first}.")


def check_colour(ds: xr.Dataset, colour: str | None) -> None:
    """Raise `InputError` unless a result has a picture of this variable; None is always possible."""
    if colour is None:
        return
    if (kind := str(ds.attrs.get("study"))) not in _COLOURED:
        raise InputError("colour", f"must be left out for a result that is not of {', '.join(_COLOURED)}", colour,
                         f"It is of {kind}.")
    if colour != MOTION:
        check_name(ds, "colour", colour, _COLOURED[kind][0], also=(MOTION,))


_PICTURES: dict[str, Callable[..., Axes | Figure]] = {
    "zones": zones,
    "bifurcation": lambda ds: bifurcation(ds) if "point" in ds.dims else lyapunov(ds),
    "basins": basins,
    "branch": response_curve,
    "curve": lambda ds: skeleton(ds, special=True),
    "skeleton": lambda ds: skeleton(ds, special=True),
    "agreement": agreement,
    "manifolds": manifolds,
    "attractors": attractors,
    "dynamic_factor": dynamic_factor,
    "speeds_to_avoid": dynamic_factor,
    "natural_frequencies": campbell,
    "runup": runup,
    "orders": orders,
    "fit": fit,
    "scatter": scatter,
    "simulate": lambda ds: motion(ds) if "tau" in ds.dims else portrait(ds),
}

_COLOURED: dict[str, tuple[int, Callable[..., Axes]]] = {
    "zones": (2, level), "bifurcation": (1, response), "dynamic_factor": (1, response),
}
"""Studies whose single variables have pictures: the number of dimensions of these variables, and the picture."""

_HATCHED = ("zones", "basins")  # studies whose pictures are maps of classes, which can be hatched
