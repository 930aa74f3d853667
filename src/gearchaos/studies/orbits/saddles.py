"""Saddles and what they bound: their manifolds (d = 2), and the edge state between two attractors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import check_period, checked_state
from gearchaos.continuation.saddles import EdgeState, saddle_manifolds, saddles, track_edge
from gearchaos.datasets import new_dataset, provenance, variables
from gearchaos.dynamics import Classification
from gearchaos.dynamics.initial_conditions import checked_box
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import InputError, unknown_name
from gearchaos.model import check_is_pair
from gearchaos.quantities import Rule
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import option
from gearchaos.studies.core.study import ClassifyingStudy, WholeStudy

if TYPE_CHECKING:
    import xarray as xr

_REGION = {"z": (-4.0, 4.0), "z_dot": (-3.0, 3.0)}


@dataclass(frozen=True)
class Manifolds(WholeStudy):
    """Find the saddles of a model with two coordinates, and their stable and unstable manifolds.

    The stable manifolds of saddles are the boundaries between basins of attraction; the unstable ones lead to the
    attractors.

    Returns
    -------
    xarray.Dataset
        Over ``point``, the points of all branches one after another, each in order from its saddle: ``z`` and ``z_dot``
        at phase 0, and ``manifold``, the number of the branch. Over ``number``, the branches: ``manifold_saddle``, the
        number of the saddle, ``manifold_stable``, and ``manifold_complete``: whether the branch was followed to this
        length, or ended before outside the region or on an attractor. Over ``saddle_number``, the saddles:
        ``saddle_period``, ``saddle_multipliers_real`` and ``saddle_multipliers_imag`` (saddle_number, exponent),
        ``saddle_residual``, and their points ``saddle_section_z`` and ``saddle_section_z_dot`` (saddle_number, cycle).

    Raises
    ------
    InputError
        If the relative motion has more than two coordinates, or an argument is out of range.

    Notes
    -----
    D. Hobson, An efficient method for computing invariant manifolds of planar maps, J. Comput. Phys. 104, 1993. Saddles
    are found by Newton's method from many initial states: one that no start leads to is missing. A stable manifold is
    the unstable one in reversed time.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.manifolds(model, period=1, length=5.0)
    >>> found.sizes["number"], found.saddle_period.values.tolist()
    (4, [1])

    As a value
    ----------
    >>> import gearchaos as gc
    >>> gc.Manifolds(gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05), period=1).spacing
    0.03
    """

    kind: ClassVar[str] = "manifolds"
    rank: ClassVar[int] = 10
    group: ClassVar[str] = "Bifurcations"
    needs_out: ClassVar[bool] = True
    model_words: ClassVar[str] = "The operating point; its relative motion must have two coordinates, z and z_dot."

    period: int = option(4, "Largest period of the saddles, in mesh periods.", least=1, most=64)
    length: float = option(
        30.0, "Arclength inside the region of each branch, in half backlashes.",
        rule=Rule(lambda v: (v > 0) & (v <= 1e5), "must be greater than 0, at most 100000"))
    spacing: float = option(
        0.03, "Largest distance of neighbouring points inside the region.",
        rule=Rule(lambda v: (v >= 1e-4) & (v <= 1), "must lie in [1e-4, 1]"))
    region: Mapping[str, tuple[float, float]] | None = option(
        None, "Ranges of ``z`` and ``z_dot``; by default ±4 and ±3.", in_files=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_is_pair(self.model, "manifolds")
        if self.region is not None:
            self._set(region=checked_box(self.region))
        for name in self.region or {}:
            if name not in _REGION:
                raise unknown_name("region", name, _REGION)
        if self._family.dimension != 2:
            raise InputError("model", "must have two coordinates, so that manifolds are curves", self._family.dimension,
                             "Use a single model, or a torsional one with the same β/J of both wheels.")

    @cached_property
    def _family(self) -> ParameterFamily:
        return ParameterFamily(self.model, ())

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        family, box = self._family, {**_REGION, **(self.region or {})}
        bounds = np.array([box["z"], box["z_dot"]])
        found = saddles(family, family.start, self.period)
        sections = np.full((len(found), max((saddle.period for saddle in found), default=1), 2), np.nan)
        for number, saddle in enumerate(found):
            sections[number, : saddle.period] = saddle.points
        multipliers = np.array([saddle.multipliers for saddle in found]).reshape(-1, 2)
        own = [saddle_manifolds(family, saddle, length=self.length, spacing=self.spacing, region=bounds)
               for saddle in found]
        branches = [manifold for each in own for manifold in each]
        points = np.concatenate([np.zeros((0, 2)), *(manifold.points for manifold in branches)])
        sizes = [len(manifold.points) for manifold in branches]
        data = {
            **variables(("point",), {
                "z": points[:, 0], "z_dot": points[:, 1],
                "manifold": np.repeat(np.arange(len(branches)), sizes).astype(int)}),
            **variables(("number",), {
                "manifold_saddle": np.array([number for number, each in enumerate(own) for _ in each], int),
                "manifold_stable": np.array([manifold.stable for manifold in branches], bool),
                "manifold_complete": np.array([manifold.complete for manifold in branches], bool)}),
            **variables(("saddle_number", "exponent"), {
                "saddle_period": np.array([saddle.period for saddle in found], int),
                "saddle_residual": np.array([saddle.residual for saddle in found], float),
                "saddle_multipliers_real": multipliers.real, "saddle_multipliers_imag": multipliers.imag}),
            **variables(("saddle_number", "cycle"), {
                "saddle_section_z": sections[..., 0], "saddle_section_z_dot": sections[..., 1]}),
        }
        return new_dataset(data, {}, provenance(
            self.kind, family.model, period=self.period, length=self.length, spacing=self.spacing,
            region=bounds.tolist()))


manifolds = function_of(Manifolds)


@dataclass(frozen=True)
class EdgeTracking(ClassifyingStudy, WholeStudy):
    """Find the saddle that divides the basins of two attractors, for any number of coordinates.

    Its stable manifold is the boundary between them.

    Returns
    -------
    EdgeState

    Raises
    ------
    InputError
        If both lead to the same attractor, or an argument is out of range.

    Notes
    -----
    Edge tracking: J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006. Attractors without a
    period are told apart by their kind of motion alone. A fractal boundary may contain several saddles: one of them is
    found, which depends on ``first`` and ``second``, and on their order.

    `gearchaos.run` of the study gives a Dataset: ``section_<coordinate>`` over "round", the states on the boundary in
    order of time, and the attribute ``orbit``, the saddle as JSON, null for none.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.edge_state(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0})
    >>> found.orbit.period, found.orbit.unstable
    (1, 1)

    As a value
    ----------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> gc.EdgeTracking(model, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0}).rounds
    60
    """

    kind: ClassVar[str] = "edge_state"
    rank: ClassVar[int] = 11
    group: ClassVar[str] = "Bifurcations"
    needs_out: ClassVar[bool] = True
    summary: ClassVar[str] = "edge"
    returns: ClassVar[str] = "EdgeState"
    model_words: ClassVar[str] = "The operating point."
    default_settings: ClassVar[Classification] = SINGLE_MOTION

    first: Mapping[str, float] = option(MISSING, "Initial values that lead to one attractor.", keyword=False)
    second: Mapping[str, float] = option(MISSING, "Initial values that lead to another one.", keyword=False)
    period: int = option(4, "Largest period of the saddle, in mesh periods.")
    rounds: int = option(
        60, "Most times two neighbouring states are brought together again. They are on both sides of the boundary.",
        least=1, most=10_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_period(self.period)
        for name in ("first", "second"):
            self._set(**{name: checked_state(self.model, getattr(self, name), name)})

    def result(self, **run_options: Any) -> EdgeState:
        family = ParameterFamily(self.model, ())
        starts = [ParameterFamily(self.model.with_values(state), ()) for state in (self.first, self.second)]
        first, second = (start.initial_states(start.start[None])[0] for start in starts)
        return track_edge(
            family, first, second, period=self.period, rounds=self.rounds, settings=self.classification)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        found = self.result()
        data = variables(("round",), {f"section_{name}": x for name, x in found.states.items()})
        attributes = self.provenance(
            first=dict(self.first), second=dict(self.second), period=self.period, rounds=self.rounds)
        orbit = json.dumps(None if found.orbit is None else found.orbit.to_dict())
        return new_dataset(data, attrs={**attributes, "orbit": orbit})


edge_state = function_of(EdgeTracking)
