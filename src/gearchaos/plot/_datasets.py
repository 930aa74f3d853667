"""The Datasets of pictures: checked before they are drawn, and kept to be saved beside the picture.

The error of a check names the picture that can draw the Dataset.
"""

from __future__ import annotations

import io
import os
from collections import Counter
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import xarray as xr
from matplotlib import rc_context, rcParams, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos.datasets import netcdf_bytes
from gearchaos.errors import InputError, unknown_name
from gearchaos.files import check_target, write_bytes
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.quantities import Rule
from gearchaos.validation import LARGEST, check_rule, to_float

Dims = int | tuple[str, ...]  # number of dimensions of a variable, each with a coordinate; or the names of them

_INTEGERS = (
    "label", "period", "attractor", "attractor_label", "attractor_period", "branch", "unstable", "event_point",
    "event_branch", "curve", "curve_period", "manifold", "manifold_stable", "manifold_saddle", "cause",
)
_TEXTS = ("event_kind", "curve_kind", "special_kind", "line")
_LABELS = ("label", "attractor_label")  # their codes have names, in the CF attributes flag_values and flag_meanings
_MAY_BE_EMPTY = (("number",), ("event",), ("special",), ("side",))  # no attractors, e.g., if all motions are undecided
_MAY_HAVE_NO_POINTS = ("curve", "manifold", "z", "z_dot")  # variables over the points of curves and manifolds
_DRAWN_BY = {
    "zones": "zones or level", "bifurcation": "bifurcation, lyapunov or response", "basins": "basins",
    "attractors": "attractors", "branch": "response_curve or branch", "curve": "skeleton",
    "skeleton": "skeleton", "agreement": "agreement", "manifolds": "manifolds", "dynamic_factor": "dynamic_factor",
    "speeds_to_avoid": "dynamic_factor", "natural_frequencies": "campbell or modes", "runup": "runup",
    "orders": "orders", "fit": "fit", "scatter": "scatter",
    "simulate": "portrait, or with samples by phase, history, spectrum or motion",
}


def check(dataset: Any, study: str, **variables: Dims) -> None:
    """Raise `InputError` unless a Dataset has these variables with these dimensions, as results of the study have."""
    check_dataset(dataset)
    if not all(_fits(dataset, name, dims) for name, dims in variables.items()):
        own = str(dataset.attrs.get("study", ""))
        advice = f"It is drawn by gearchaos.plot.{_DRAWN_BY[own]}." if own in _DRAWN_BY else ""
        if own == "simulate" and study.startswith(own):
            advice = "Call simulate with samples=64."
        found = f"a result of {own}" if own else f"a Dataset of {', '.join(map(str, dataset.data_vars))}"
        raise InputError("dataset", f"must be a result of {study}, with {', '.join(variables)}", found, advice)
    over_axes = [name for name, dims in variables.items() if isinstance(dims, int)]
    axes = dataset[over_axes[0]].dims if over_axes else ("tau",) if "tau" in variables else ()
    faults = [_fault(dataset[name]) for name in variables]
    faults += [f"{name} over other dims than {over_axes[0]}" for name in over_axes if dataset[name].dims != axes]
    for axis in (dataset[axis] for axis in axes):
        faults.append(_fault(axis))
        if not faults[-1] and not np.isfinite(axis.values).all():
            faults.append(f"{axis.name} that is not finite")
        elif not faults[-1] and not (np.diff(axis.values) > 0).all() and not (np.diff(axis.values) < 0).all():
            faults.append(f"{axis.name} that neither rises nor falls throughout")  # a user may have reversed the axis
    if fault := next(filter(None, faults), ""):
        raise InputError("dataset", f"must be a result of {study}, as it was computed", fault,
                         "Compute it again, or load the file that was saved.")


def check_dataset(dataset: Any) -> None:
    if not isinstance(dataset, xr.Dataset):
        raise InputError("dataset", "must be an xarray.Dataset, as the studies return", described(dataset),
                         "gearchaos.load reads one from a file.")


def check_design(design: Any) -> None:
    if not isinstance(design, GearDesign):
        raise InputError("design", "must be a GearDesign", described(design),
                         "gearchaos.GearDesign describes a pair by its drawing.")


def check_gears(gears: Any) -> None:
    if not isinstance(gears, (GearPair, GearDesign)):
        raise InputError("gears", "must be a GearPair or a GearDesign", described(gears))


def described(value: object) -> object:
    """A value for an error message: a text as it is, any other value by its type."""
    return value if isinstance(value, str) else f"a {type(value).__name__}"


def check_name(
    dataset: xr.Dataset, field: str, name: str, dims: Dims, prefix: str = "", also: tuple[str, ...] = ()
) -> None:
    """Raise `InputError` unless a Dataset has the variable ``prefix + name`` with these dimensions.

    The message lists the names that are accepted, and those in ``also``.
    """
    fitting = [str(n) for n in dataset.data_vars if str(n).startswith(prefix) and _fits(dataset, str(n), dims)]
    fitting = [n for n in fitting if not _fault(dataset[n])]
    if f"{prefix}{name}" not in fitting:
        raise unknown_name(field, str(name), [*also, *(n.removeprefix(prefix) for n in fitting)])


def check_positive(field: str, value: Any, most: float = LARGEST) -> float:
    """The value as a float; raises `InputError` unless it is greater than 0 and at most ``most``."""
    number = to_float(field, value)
    check_rule(field, number, Rule(lambda v: 0 < v <= most, f"must be greater than 0, at most {most:g}"), value)
    return number


def _fits(dataset: xr.Dataset, name: str, dims: Dims) -> bool:
    """Whether a Dataset has a variable with these dimensions."""
    if name not in dataset.variables:
        return False
    found = dataset[name].dims
    if isinstance(dims, tuple):
        return found == dims
    return len(found) == dims and all(d in dataset.coords for d in found)


def _fault(array: xr.DataArray) -> str:
    """What is wrong with a variable; an empty text if nothing is."""
    kinds = "biu" if array.name in _INTEGERS else "OUT" if array.name in _TEXTS else "biuf"
    no_text = array.name in _TEXTS and array.size == 0  # files have no type for texts of which there are none
    if array.dtype.kind not in kinds and not no_text:
        return f"{array.name} of type {array.dtype}"
    no_points = array.dims == ("point",) and array.name in _MAY_HAVE_NO_POINTS
    if array.size == 0 and array.dims not in _MAY_BE_EMPTY and not no_points:
        return f"{array.name} without values"
    return "" if array.name not in _LABELS or flags(array) else f"{array.name} whose codes are not named"


def flags(array: xr.DataArray) -> dict[int, str]:
    """Names of the codes of a variable, from its CF attributes; empty if these are missing or inconsistent."""
    codes, names = np.ravel(array.attrs.get("flag_values", ())), array.attrs.get("flag_meanings", "")
    if codes.dtype.kind not in "iu" or not isinstance(names, str) or len(codes) != len(names.split()):
        return {}
    return dict(zip(codes.tolist(), names.split(), strict=True))


P = ParamSpec("P")
Drawn = TypeVar("Drawn", bound=Axes | Figure)

_SUFFIXES = (".png", ".pdf", ".svg")
_SAVING: tuple[Any, ...] = ("savefig.dpi", "pdf.fonttype", "svg.fonttype", "hatch.linewidth")
"""The settings of matplotlib of a style that matter when a picture is saved."""

_DATASETS: WeakKeyDictionary[Figure, list[xr.Dataset]] = WeakKeyDictionary()  # in the order in which they were drawn
_SETTINGS: WeakKeyDictionary[Figure, Any] = WeakKeyDictionary()
"""Those of the settings `_SAVING` that were not matplotlib's defaults when each figure was drawn."""


def keeps_data(draw: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """Let a picture, whose first argument is a Dataset, note for `save_with_data` what it shows and in which style."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Drawn:
        artist = draw(*args, **kwargs)
        figure, dataset = figure_of(artist), args[0] if args else kwargs["ds"]
        known = _DATASETS.setdefault(figure, [])
        _SETTINGS.setdefault(figure, {n: rcParams[n] for n in _SAVING if rcParams[n] != rcParamsDefault[n]})
        if isinstance(dataset, xr.Dataset) and not any(dataset is other for other in known):
            known.append(dataset)
        return artist

    return drawn


def figure_of(shown: Axes | Figure) -> Figure:
    """The whole figure to which an Axes or a part of a figure belongs."""
    figure = shown.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def save_with_data(shown: Axes | Figure, path: str | os.PathLike[str]) -> list[Path]:
    """Save a picture, and beside it the data that it shows as NetCDF files.

    The picture is saved in the style in which it was drawn, also after the block of `style`. From the data
    `gearchaos.load` and `gearchaos.plot.result` make it again, and readers of a paper can plot it in another way. Each
    file contains the model, the settings and the versions of packages.

    Parameters
    ----------
    shown : Axes or Figure
        Drawn by functions of `gearchaos.plot` that take a Dataset.
    path : path
        The picture: .png, .pdf or .svg. The data of ``map.pdf`` are ``map.nc``, or if there are several Datasets
        ``map-basins.nc``, ``map-manifolds.nc``, ..., by the study of each; older files are replaced.

    Returns
    -------
    list of Path
        The files written, the picture first.

    Raises
    ------
    InputError
        If the figure shows no Dataset, or the path has another suffix or cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)
    >>> ax = gc.plot.history(gc.simulate(model, 4, samples=32))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print([file.name for file in gc.plot.save_with_data(ax, f"{folder}/motion.svg")])
    ['motion.svg', 'motion.nc']
    """
    if not isinstance(shown, (Axes, Figure)):
        raise InputError("shown", "must be an Axes or a Figure", f"a {type(shown).__name__}")
    target, figure = Path(path), figure_of(shown)
    if target.suffix.lower() not in _SUFFIXES:
        raise InputError("path", f"must end in {', '.join(_SUFFIXES)}", str(target))
    datasets = _DATASETS.get(figure, [])
    if not datasets:
        raise InputError("shown", "must show a Dataset", "a figure without one",
                         "Pictures of models and designs are made of their parameters; figure.savefig saves them.")
    studies = [str(ds.attrs.get("study", "data")) for ds in datasets]
    several, names = Counter(studies), [target.with_suffix(".nc")]
    if len(datasets) > 1:  # Datasets of the same study are numbered
        numbers = [f"-{studies[: i + 1].count(study)}" if several[study] > 1 else "" for i, study in enumerate(studies)]
        names = [target.with_name(f"{target.stem}-{study}{n}.nc") for study, n in zip(studies, numbers, strict=True)]
    files = dict(zip(names, map(netcdf_bytes, datasets), strict=True))
    picture = io.BytesIO()
    with rc_context(_SETTINGS[figure]):
        figure.savefig(picture, format=target.suffix[1:].lower())
    files = {target: picture.getbuffer(), **files}
    for file in files:
        check_target("path", file)
    for file, content in files.items():
        write_bytes(file, content)
    return list(files)
