"""What the studies that follow periodic orbits share: options, planes of parameters, variables of orbits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import outside
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.orbit import check_period, checked_state
from gearchaos.datasets import variables
from gearchaos.errors import InputError
from gearchaos.model import MeshModel
from gearchaos.quantities import Rule
from gearchaos.studies.core.axis import Axis, check_plane
from gearchaos.studies.core.options import option
from gearchaos.studies.core.study import WholeStudy

if TYPE_CHECKING:
    import xarray as xr


def step_option(default: float) -> Any:
    """The option of the longest step, with its default."""
    return option(
        default, "Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean "
        "square distance of all stroboscopic points is half a backlash.",
        rule=Rule(lambda v: (v >= 1e-5) & (v <= 1), "must lie in [1e-5, 1]"))


@dataclass(frozen=True)
class FollowingStudy(WholeStudy):
    """A study that follows orbits along a curve in parameters, from an orbit near initial values.

    ``steps`` are the lengths of steps where nothing is said of them.
    """

    steps: ClassVar[Settings] = Settings()

    start: Mapping[str, float] | None = option(
        None, "Initial values near the first orbit; by default those of the model. If its own lead to a motion of "
        "another period, the orbit is found as by `orbit`.")
    period: int | None = option(
        None, "Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most "
        "1024.")
    longest_step: float = step_option(Settings.longest)
    max_points: int = option(10_000, "Largest number of points in each direction.", least=2, most=1_000_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.period is not None:
            check_period(self.period)
        if self.start:
            self._set(start=checked_state(self.model, self.start))

    @property
    def step_lengths(self) -> Settings:
        """The lengths of steps along the curve."""
        steps = self.steps
        return replace(steps, first=min(steps.first, self.longest_step), longest=self.longest_step,
                       shortest=min(steps.shortest, self.longest_step), points=self.max_points)


def parameter_plane(model: MeshModel, x: Axis, y: Axis) -> ParameterFamily:
    """The model along two axes; raises `InputError` unless these are two parameters that it has."""
    check_is_parameter(model, x, "x")
    check_is_parameter(model, y, "y")
    check_plane(model, x, y)
    return ParameterFamily(model, (x.name, y.name))


def check_is_parameter(model: MeshModel, axis: Axis, field: str = "axis") -> None:
    """Raise `InputError` for an axis that is an initial value."""
    if axis.name in model.state_names:
        raise InputError(field, "must be a parameter", axis.name,
                         "An initial value only selects an orbit of the model: give it as start.")


def check_inside(model: MeshModel, *axes: Axis) -> None:
    """Raise `InputError` unless the model's own values of all parameters lie on their axes, whose ends it accepts."""
    for axis in axes:
        family = ParameterFamily(model, (axis.name,))
        error = outside(family, float(family.start[0]), (axis.start, axis.stop))
        if error is not None:
            raise error
        family.check(np.array([[axis.start], [axis.stop]]))


def section_variables(
    family: ParameterFamily, orbits: Iterable[tuple[np.ndarray, np.ndarray]]
) -> dict[str, xr.Variable]:
    """The stroboscopic points of all orbits by name, over point and cycle; NaN after the last one of an orbit.

    Each part of ``orbits`` has the parameters (P, Q) and the points (P, n, d) of orbits of one period n.
    """
    parts = [as_initial_values(family, values, points) for values, points in orbits]
    longest = max((x.shape[1] for part in parts for x in part.values()), default=1)
    return variables(("point", "cycle"), {f"section_{name}": np.concatenate([
        np.pad(part[name], ((0, 0), (0, longest - part[name].shape[1])), constant_values=np.nan) for part in parts])
        for name in (parts[0] if parts else ())})
