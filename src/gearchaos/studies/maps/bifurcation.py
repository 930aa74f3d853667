"""Bifurcation diagrams: stroboscopic sections, verdicts and exponents along one parameter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from gearchaos.dynamics import Classification, Verdicts
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory, max_items
from gearchaos.execute.tiles import interleaved
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.axis import Axis, corners, shared_coordinates
from gearchaos.studies.core.cost import Cost, estimate
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import (
    PERIODS_PER_VALUE,
    InitialValueProblems,
    initial_value_problems,
    swept_initial_values,
)
from gearchaos.studies.core.options import axis_option, option
from gearchaos.studies.core.study import ClassifyingStudy, Results
from gearchaos.studies.motion.batch_classification import classify_batch
from gearchaos.studies.motion.simulate import steady_sections

_MAX_TILE_VALUES = 4_000_000
"""Largest number of values that the sections of a tile may have, unless the tile has only `_MIN_TILE` columns."""

_MIN_TILE = 64
_BYTES_PER_COORDINATE = 24
"""Memory that each coordinate of a stroboscopic point takes until it is saved."""

BIFURCATION_SETTINGS = Classification(exponent_run=1000, doublings=2)
"""A diagram has few columns, so each is given longer exponent runs than a cell of a map, for smooth exponent curves."""


@dataclass(frozen=True)
class Bifurcation(ClassifyingStudy):
    """Scan one parameter: stroboscopic points, verdicts and exponents.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(axis, point)``, and for each column the variables that `zones` has for a cell.

    Raises
    ------
    InputError
        If the axis or an option is wrong, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.1:0.2:3", points=8)
    >>> diagram.section_x1.shape
    (3, 8)
    >>> gc.studies.motions(diagram.label, diagram.period)
    ['2T', 'chaotic', 'chaotic']

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Bifurcation(gc.MeshModel.of(q0=0.1, eps1=0.1), "eps1=0.1:0.2:5")
    >>> study.kind, study.count
    ('bifurcation', 5)
    """

    kind: ClassVar[str] = "bifurcation"
    rank: ClassVar[int] = 4
    group: ClassVar[str] = "Bifurcations"
    gridded: ClassVar[bool] = True
    item_dims: ClassVar[tuple[str, ...]] = ("point",)
    needs_out: ClassVar[bool] = True
    variables: ClassVar[tuple[str, ...]] = ("label", "period", "contact")
    summary: ClassVar[str] = "map"
    default_settings: ClassVar[Classification] = BIFURCATION_SETTINGS

    axis: Axis = axis_option('The parameter and its range, as a text "eps1=0:0.3:400".')
    points: int = option(128, "Stroboscopic points per column, 0 for the verdicts alone.", least=0)
    mode: Literal["fixed", "up", "down"] = option(
        "fixed", "Columns from the model's initial values, or a sweep up or down. In a sweep each column starts from "
        "the state that the previous one ended in, as in a slow sweep of the parameter; both directions together show "
        "hysteresis.")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mode != "fixed" and self.axis.name in self.model.state_names:
            raise InputError("mode", "must be fixed where the axis is an initial value", self.mode)
        vary(self.model, {self.axis.name: self.axis.values})  # raises for a value that the model refuses
        if self.block[self.axis.name] * self.points > max_items(self._point_bytes):
            self.check_in_memory()
        _ = self.cost

    def check_in_memory(self) -> None:
        check_memory("columns", self.axis.count)
        check_memory("columns times points", self.axis.count * self.points, self._point_bytes)
        super().check_in_memory()

    @property
    def _point_bytes(self) -> int:
        """Memory that a stroboscopic point takes until it is saved."""
        return _BYTES_PER_COORDINATE * (2 + len(self.model.coordinate_names))

    @property
    def block(self) -> dict[str, int]:
        return {self.axis.name: 1 if self.mode == "fixed" else self.axis.count}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates of the dynamic state, the same for all columns."""
        return shared_coordinates(self.model, self.axis)

    @cached_property
    def cost(self) -> Cost:
        sequential = self.axis.count * PERIODS_PER_VALUE if self.mode != "fixed" else 0
        system = switched_system(corners(self.model, self.axis), self.names)
        return estimate(system, self.axis.count, self.classification.max_periods, sequential, model=self.model)

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        values, model = {self.axis.name: self.axis.values}, self.model
        if self.mode != "fixed":
            values |= {n: v[0] for n, v in swept_initial_values(model, self.axis, self.mode == "up").items()}
            model = replace(model, initial={})

        def initial_states(columns: np.ndarray) -> InitialValueProblems:
            return initial_value_problems(model, {n: v[items[columns]] for n, v in values.items()}, self.names)

        def collect(_: np.ndarray, motions: Any, found: Verdicts) -> dict[str, np.ndarray]:
            sections = steady_sections(motions, found, self.points) if self.points else {}
            return found.variables() | {f"section_{name}": value for name, value in sections.items()}

        most = _MAX_TILE_VALUES // max(1, self.points * len(self.names))
        return classify_batch(
            initial_states, collect, interleaved(len(items), threads), settings=self.classification,
            largest=min(self.cost.max_parameter_points(threads), max(_MIN_TILE, most)),
            progress="bifurcation" if progress else None, threads=threads,
        )

    @property
    def recorded(self) -> dict[str, Any]:
        return {"points": self.points, "mode": self.mode}


bifurcation = function_of(Bifurcation)
