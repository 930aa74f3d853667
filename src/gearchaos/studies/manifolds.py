"""Stable and unstable manifolds of saddles, which bound basins of attraction (d = 2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.manifolds import Manifold, saddle_manifolds, saddles
from gearchaos.continuation.shooting import Cycle
from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.dynamics.initial_conditions import checked_box
from gearchaos.errors import InputError, unknown_name
from gearchaos.quantities import Rule
from gearchaos.studies.declaration import function_of
from gearchaos.studies.options import option
from gearchaos.studies.study import WholeStudy

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
        branches = [
            (number, manifold) for number, saddle in enumerate(found)
            for manifold in saddle_manifolds(family, saddle, length=self.length, spacing=self.spacing, region=bounds)
        ]
        attributes = provenance(self.kind, family.model, period=self.period, length=self.length, spacing=self.spacing,
                                region=bounds.tolist())
        return new_dataset({**_branch_variables(branches), **_saddle_variables(found)}, {}, attributes)


manifolds = function_of(Manifolds)


def _branch_variables(branches: Sequence[tuple[int, Manifold]]) -> dict[str, xr.Variable]:
    """The points of all branches, one after another, and what holds for each branch."""
    points = np.concatenate([np.zeros((0, 2)), *(manifold.points for _, manifold in branches)])
    sizes = [len(manifold.points) for _, manifold in branches]
    number = np.repeat(np.arange(len(branches)), sizes).astype(int)
    per_branch = {
        "manifold_saddle": np.array([saddle for saddle, _ in branches], int),
        "manifold_stable": np.array([manifold.stable for _, manifold in branches], bool),
        "manifold_complete": np.array([manifold.complete for _, manifold in branches], bool),
    }
    return {
        "z": variable("z", ("point",), points[:, 0]), "z_dot": variable("z_dot", ("point",), points[:, 1]),
        "manifold": variable("manifold", ("point",), number),
        **{name: variable(name, ("number",), values) for name, values in per_branch.items()},
    }


def _saddle_variables(found: Sequence[Cycle]) -> dict[str, xr.Variable]:
    """Periods, multipliers, residuals and points of the saddles."""
    longest = max((saddle.period for saddle in found), default=1)
    sections = np.full((len(found), longest, 2), np.nan)
    for number, saddle in enumerate(found):
        sections[number, : saddle.period] = saddle.points
    multipliers = np.array([saddle.multipliers for saddle in found]).reshape(-1, 2)
    values = {
        "saddle_period": np.array([saddle.period for saddle in found], int),
        "saddle_residual": np.array([saddle.residual for saddle in found], float),
        "saddle_multipliers_real": multipliers.real, "saddle_multipliers_imag": multipliers.imag,
        "saddle_section_z": sections[..., 0], "saddle_section_z_dot": sections[..., 1],
    }
    dims = {"saddle_section_z": "cycle", "saddle_section_z_dot": "cycle"}
    return {
        name: variable(name, ("saddle_number", dims.get(name, "exponent"))[: v.ndim], v) for name, v in values.items()
    }
