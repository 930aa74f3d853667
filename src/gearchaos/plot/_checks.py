"""Checks of the Datasets and arguments of pictures; an error names the picture that can draw the Dataset."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.quantities import Rule
from gearchaos.validation import LARGEST, check_rule, to_float

Dims = int | tuple[str, ...]
"""Number of dimensions that a variable must have, each with a coordinate; or the names of its dimensions."""

_INTEGERS = (
    "label", "period", "attractor", "attractor_label", "attractor_period", "branch", "unstable", "event_point",
    "event_branch", "curve", "curve_period", "manifold", "manifold_stable",
    "manifold_saddle", "cause",
)
"""Variables that must hold integers."""

_LABELS = ("label", "attractor_label")
"""Variables whose codes must have names, in the CF attributes ``flag_values`` and ``flag_meanings``."""

_TEXTS = ("event_kind", "curve_kind", "special_kind")
"""Variables that must hold texts."""

_MAY_BE_EMPTY = (("number",), ("event",), ("special",), ("side",))
"""The dimensions of attractors, curves and manifolds, of events, of points of codimension 2, and of sides of cells.
There are no attractors if all motions are undecided."""

_MAY_HAVE_NO_POINTS = ("curve", "manifold", "z", "z_dot")
"""Variables over the points of curves and manifolds, of which there may be none."""

_DRAWN_BY = {
    "zones": "zones or level", "bifurcation": "bifurcation, lyapunov or response", "basins": "basins",
    "attractors": "attractors", "branch": "backbone or branch", "curve": "skeleton",
    "skeleton": "skeleton", "agreement": "agreement", "manifolds": "manifolds", "dynamic_factor": "dynamic_factor",
    "speeds_to_avoid": "dynamic_factor",
    "simulate": "portrait, or with samples by phase, history, spectrum or dossier",
}


def check(dataset: Any, study: str, **variables: Dims) -> None:
    """Raise `InputError` unless a Dataset is a result with these variables.

    Parameters
    ----------
    dataset : Dataset
        What the picture is to show.
    study : str
        The study whose results have these variables, for the message.
    variables : int or tuple of str
        Dimensions of each variable, see `Dims`, by the name of the variable.
    """
    check_dataset(dataset)
    if not all(_fits(dataset, name, dims) for name, dims in variables.items()):
        raise _other_study(dataset, study, variables)
    over_axes = [name for name, dims in variables.items() if isinstance(dims, int)]
    axes = dataset[over_axes[0]].dims if over_axes else ("tau",) if "tau" in variables else ()
    faults = [_fault(dataset[name]) for name in variables]
    faults += [f"{name} over other dims than {over_axes[0]}" for name in over_axes if dataset[name].dims != axes]
    faults += [_axis_fault(dataset[axis]) for axis in axes]
    if found := next(filter(None, faults), ""):
        raise InputError("dataset", f"must be a result of {study}, as it was computed", found,
                         "Compute it again, or load the file that was saved.")


def _other_study(dataset: xr.Dataset, study: str, variables: Iterable[str]) -> InputError:
    """The error of a Dataset without these variables: it names the picture that can draw it."""
    own = str(dataset.attrs.get("study", ""))
    advice = f"It is drawn by gearchaos.plot.{_DRAWN_BY[own]}." if own in _DRAWN_BY else ""
    if own == "simulate" and study.startswith(own):
        advice = "Call simulate with samples=64."
    found = f"a result of {own}" if own else f"a Dataset of {', '.join(map(str, dataset.data_vars))}"
    return InputError("dataset", f"must be a result of {study}, with {', '.join(variables)}", found, advice)


def check_dataset(dataset: Any) -> None:
    """Raise `InputError` unless this is a Dataset."""
    if not isinstance(dataset, xr.Dataset):
        raise InputError("dataset", "must be an xarray.Dataset, as the studies return", _described(dataset),
                         "gearchaos.load reads one from a file.")


def check_design(design: Any) -> None:
    """Raise `InputError` unless this is a gear design."""
    if not isinstance(design, GearDesign):
        raise InputError("design", "must be a GearDesign", _described(design),
                         "gearchaos.GearDesign describes a pair by its drawing.")


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


def _axis_fault(axis: xr.DataArray) -> str:
    """What is wrong with the coordinate of a dimension; an empty text if nothing is."""
    if fault := _fault(axis):
        return fault
    if not np.isfinite(axis.values).all():
        return f"{axis.name} that is not finite"
    rising = np.diff(axis.values) > 0
    monotonic = np.all(rising) or np.all(np.diff(axis.values) < 0)  # a user may have reversed the axis
    return "" if monotonic else f"{axis.name} that neither rises nor falls throughout"


def flags(array: xr.DataArray) -> dict[int, str]:
    """Names of the codes of a variable, from its CF attributes; empty if these are missing or inconsistent."""
    codes, names = np.ravel(array.attrs.get("flag_values", ())), array.attrs.get("flag_meanings", "")
    if codes.dtype.kind not in "iu" or not isinstance(names, str) or len(codes) != len(names.split()):
        return {}
    return dict(zip(codes.tolist(), names.split(), strict=True))


def _described(value: object) -> object:
    """A value for an error message: a text as it is, any other value by its type."""
    return value if isinstance(value, str) else f"a {type(value).__name__}"
