"""Axes: one parameter with equally spaced values; the cells of a map over two; a design at the start of its axes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.operation.operating import OperatingModel, is_design, operating_value
from gearchaos.model import STIFFNESS_KINDS, Batch, MeshModel, check, vary
from gearchaos.model.switched import coordinates
from gearchaos.quantities import OPERATION, find, parameter_owner, quantity

MAX_COUNT = 1_000_000
"""Largest number of values of an axis."""

_MOST_TORQUES = 256
"""Most torques of an axis that are checked before any work: each needs the gears at this torque, some milliseconds."""

_EXAMPLES = {"speed": "500:8000:200", "torque": "20:400:150"}
"""Examples of axes whose values depend on the gears; those of the others are the ranges of their quantities."""

_WITH_UNITS = tuple(q.name for q in OPERATION)
"""Names of axes whose ends may have units."""


@dataclass(frozen=True)
class Axis:
    """Equally spaced values of one parameter, both ends included.

    Parameters
    ----------
    name : str
        A parameter, a pair of parameters (``q0``) or an initial value of any kind of model.
    start, stop : float
        First and last value; ``start < stop``, or equal if ``count`` is 1.
    count : int
        Number of values; with 1 the only value is ``start``.

    Raises
    ------
    InputError
        For a name that no model has, an end outside the range of its parameter, or ``start >= stop`` with more than one
        value.

    Examples
    --------
    >>> Axis("eps1", 0.0, 0.3, 4).values
    array([0. , 0.1, 0.2, 0.3])
    """

    name: str
    start: float
    stop: float
    count: int

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InputError("axis name", "must be a text", self.name, "E.g. Axis('eps1', 0, 0.3, 400).")
        owner, dot, own = self.name.rpartition(".")
        if dot:  # of a part of a train, whose name may have characters that no variable has
            object.__setattr__(self, "name", f"{parameter_owner(owner)}.{own}")
        singles = _single_names(self.name)
        example, count = f"E.g. {axis_example(self.name)}.", self.count
        for end in ("start", "stop"):
            field, value = f"axis {self.name} {end}", getattr(self, end)
            if isinstance(value, (str, bytes, bool)) or not hasattr(value, "__float__") or np.ndim(value):
                raise InputError(field, "must be a number", value, example)
            if not math.isfinite(number := float(value)):
                raise InputError(field, "must be a finite number", number)
            object.__setattr__(self, end, number)
        if isinstance(count, bool) or not hasattr(count, "__index__") or not 1 <= count.__index__() <= MAX_COUNT:
            rule = f"must be a whole number from 1 to {MAX_COUNT}"
            raise InputError(f"axis {self.name} count", rule, count, example)
        object.__setattr__(self, "count", count.__index__())
        if self.start > self.stop or (self.start == self.stop and self.count > 1):
            ends = f"{self.start:g}:{self.stop:g}"
            raise InputError(f"axis {self.name}", "must run from a smaller to a larger value", ends,
                             f"E.g. {axis_example(self.name)}; one value alone is {self.start:g}:{self.start:g}:1.")
        for single in singles:
            check(single, [self.start, self.stop])

    @property
    def values(self) -> np.ndarray:
        """The values, shape (count,)."""
        return np.linspace(self.start, self.stop, self.count)


def as_axis(axis: Any, field: str = "axis") -> Axis:
    """The axis itself, or the axis that a text describes; raises `InputError` for anything else."""
    if isinstance(axis, str):
        return parse_axis(axis, field)
    if not isinstance(axis, Axis):
        raise InputError(field, "must be an Axis or a text", f"a {type(axis).__name__}",
                         "E.g. Axis('eps1', 0, 0.3, 400) or 'eps1=0:0.3:400'.")
    return axis


def as_range(axis: Any, field: str = "axis", count: int = 2) -> Axis:
    """The axis itself, or that of a text; one without a number of values, "eps1=0:0.3", has ``count`` of them."""
    if not isinstance(axis, str):
        return as_axis(axis, field)
    if re.fullmatch(r"[^=:]*=[^:]*:[^:]*", axis):
        return parse_axis(f"{axis}:{count}", field)
    if axis.count(":") != 2:
        raise InputError(field, "must read name=start:stop", axis, "E.g. eps1=0:0.3.")
    return parse_axis(axis, field)


def parse_axis(text: str, field: str = "axis") -> Axis:
    """An axis from ``name=start:stop:count``, e.g. ``eps1=0:0.3:400``.

    The ends of a speed or torque may have units: ``speed=600 rpm:9000 rpm:20``.
    """
    match = re.fullmatch(r"\s*([^=:]*[^=:\s])\s*=([^:]*):([^:]*):([^:]*)", text)
    if not match:
        raise _unreadable(field, text)
    name, *ends, number = match.groups()
    try:
        start, stop = (_end(name, end) for end in ends)
        count = int(number)
    except InputError as error:
        raise InputError(field, error.rule, error.value, f"It is an end of {text!r}; a plain number is in "
                         f"{quantity(name).unit}. E.g. {axis_example(name)}.") from None
    except ValueError:
        raise _unreadable(field, text) from None
    return Axis(name, start, stop, count)


def _end(name: str, text: str) -> float:
    """One end of an axis; that of a speed or torque, in rpm or N m, may have a unit. Raises ValueError for no number.

    Rounding to 15 digits undoes that of the conversion: 11 rpm would be 10.999999999999998.
    """
    try:
        return float(text)
    except ValueError:
        if name not in _WITH_UNITS or not any(map(str.isdigit, text)):
            raise
        return float(f"{operating_value(name, text.strip()):.15g}")


def _unreadable(field: str, text: str) -> InputError:
    """The error for a text that describes no axis, with an example of an axis of the same name."""
    name = text.partition("=")[0].strip()
    comma = "Numbers have a decimal point, no comma. " if "," in text else ""
    return InputError(field, "must read name=start:stop:count", text, f"{comma}E.g. {axis_example(name)}.")


def axis_example(name: str) -> str:
    """An axis of this name as a text, for error messages: ``speed=500:8000:200``; of eps1 for a name without range."""
    found = find(name)
    if found is None or found.range is None:
        return axis_example("eps1")
    return f"{name}={_EXAMPLES.get(name, f'{found.range.low:g}:{found.range.high:g}:400')}"


def _single_names(name: str) -> tuple[str, ...]:
    """Names of the single parameters that an axis of this name sets, in the first kind of model that has them."""
    if name in _WITH_UNITS or "." in name:  # parameters of a model of given gears, or of the parts of a train
        return (name,)
    find(name)  # asks other packages for one that gearchaos has not
    models = [MeshModel(kind=kind, stiffness=found.example())  # type: ignore[arg-type]
              for found in STIFFNESS_KINDS.loaded() for kind in ("full", "single")]
    for model in models:
        try:
            return model.set_by(name)
        except InputError:
            continue
    known = {n for model in models for n in model.known_names} | {*_WITH_UNITS}
    raise unknown_name("axis", name, known)


def at_axis_starts(model: Any, axes: Iterable[Axis]) -> Any:
    """A design without speed or torque at the first values of the axes ``speed`` and ``torque``.

    Values of the design itself are kept, and without an axis for a missing one it stays missing. Of several axes with
    one name the first counts. Anything but a design is returned as it is.
    """
    if not is_design(model):
        return model
    starts: dict[str, float] = {}
    for axis in axes:
        starts.setdefault(axis.name, axis.start)
    return model.at(**{n: starts[n] for n in ("speed", "torque") if n in starts and getattr(model, n) is None})


def check_speed_axes(model: Any, axes: Iterable[Axis]) -> None:
    """Raise `InputError` if an end of an axis ``speed`` is above the limit of the pitch line velocity of a design."""
    if not (isinstance(model, OperatingModel) and is_design(model.gears)):
        return
    from gearchaos.gears.design.checks import check_speed_range

    for axis in axes:
        if axis.name == "speed":
            check_speed_range(model.gears, axis.start, axis.stop)


def check_plane(model: MeshModel, x: Axis, y: Axis) -> None:
    """Raise `InputError` unless the axes are different, and valid for the model.

    Of a long axis of torques some values are checked, with both ends; each of the others when it is computed.
    """
    shared = set(model.set_by(x.name)) & set(model.set_by(y.name))
    if shared:
        both = x.name if x.name == y.name else f"{x.name} and {y.name}, which both set {', '.join(sorted(shared))}"
        raise InputError("axes", "must be two different parameters", both)
    for axis in (x, y):
        values = axis.values
        if axis.name == "torque" and axis.count > _MOST_TORQUES:
            values = values[np.linspace(0, axis.count - 1, _MOST_TORQUES).round().astype(int)]
        vary(model, {axis.name: values})


def shared_coordinates(model: MeshModel, *axes: Axis) -> tuple[str, ...]:
    """Names of the coordinates of the dynamic state, the same for all values of the axes and so for all tiles.

    A coordinate can be left out under conditions on products of parameters, which hold for all values if they hold at
    all corners.
    """
    return coordinates(corners(model, *axes))


def corners(model: MeshModel, *axes: Axis) -> Batch:
    """The model at all combinations of the ends of the axes."""
    ends = np.meshgrid(*([a.start, a.stop if a.count > 1 else a.start] for a in axes))
    return vary(model, {a.name: c.ravel() for a, c in zip(axes, ends, strict=True)})


def at_cells(x: Axis, y: Axis, cells: np.ndarray) -> dict[str, np.ndarray]:
    """The values (L,) of both axes, by name, in the cells (L,) of a map."""
    row, column = np.divmod(cells, x.count)
    return {x.name: x.values[column], y.name: y.values[row]}
