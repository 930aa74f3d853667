"""The attractors of one operating point, found from many initial states, and the share of these that each attracts.

The smallest perturbation of the state after which a motion leaves its attractor is searched too. In the literature on
multistability its norm is the magnitude of the minimal critical (or fatal) shock: L. Halekotte, U. Feudel, *Minimal
fatal shocks in multistable complex networks*, Sci. Rep. 10 (2020) 11783.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics import ON_ATTRACTOR, Label, Reason, Verdicts
from gearchaos.dynamics.initial_conditions import checked_box, default_box, spread
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import PERIODS_PER_VALUE, Motions, swept_initial_values
from gearchaos.studies.core.options import option
from gearchaos.studies.core.proportions import proportion
from gearchaos.studies.core.study import Results
from gearchaos.studies.motion.attractor_set import Attractor, AttractorSet, AttractorStudy
from gearchaos.studies.motion.batch_classification import classify_batch

if TYPE_CHECKING:
    import xarray as xr

_MAX_POINTS = 16
"""Largest number of stroboscopic points of the attractor that are perturbed."""

_NORMS = np.geomspace(1e-3, 4.0, 25)
"""Norms of the perturbations tried in each random direction."""

_IMPROVEMENTS = 12
"""Number of rounds that improve the best perturbation."""

_NEIGHBOURS = 32
"""Number of directions near the best one that a round tries."""

_REDUCTIONS = np.array([0.5, 0.7, 0.85, 0.93, 0.97, 0.99])
"""Norms that a round tries in each direction, relative to the best one."""

_LEAST_STARTS = 64
"""Least number of initial states of a thinned study."""

_DECIDED = (*ON_ATTRACTOR, Label.DIVERGED)
"""Labels of motions that can have left the attractor; an undecided motion does not count."""

_MOTIONS_PER_DIRECTION = _MAX_POINTS * len(_NORMS)
"""Largest number of motions followed for each direction."""

_BYTES_PER_DIRECTION = 1200 * _MOTIONS_PER_DIRECTION
"""Upper bound of the memory that they take, in bytes."""


@dataclass(frozen=True)
class Attractors(AttractorStudy):
    """Find all attractors of one operating point, with the share of the initial states that lead to each.

    Its work items are the initial states, here called starts; sweeps and perturbations are computed by `finish`.

    Returns
    -------
    xarray.Dataset
        For each attractor, along the dim "number": label, period, share of the initial states with its 95 % interval
        (Clopper-Pearson), response measures, largest exponent or multiplier, and section. ``attractor(start)`` is the
        number of the attractor that each initial state leads to, -1 for a motion that diverged or is undecided, -2 for
        one that an unfinished store does not have yet;
        ``attractor_up`` and ``attractor_down`` are those that the two sweeps end on. ``attractor_kick_change`` is the
        smallest sudden change of the state that was found after which a motion leaves the attractor,
        ``attractor_kick_point`` the state at the start of a mesh period to which it is added, and ``attractor_kick``
        its Euclidean norm in half backlashes and their velocities; NaN if no change up to 4 was found.

    Raises
    ------
    InputError
        If a number or a range is out of bounds; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.attractors(model, starts=16)
    >>> gc.studies.motions(found.attractor_label, found.attractor_period)
    ['1T', '1T']

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Attractors(gc.MeshModel.of(q0=0.1, eps1=0.1), starts=16)
    >>> study.kind, study.count
    ('attractors', 16)
    """

    kind: ClassVar[str] = "attractors"
    rank: ClassVar[int] = 3
    summary: ClassVar[str] = "attractors"
    model_words: ClassVar[str] = (
        "The operating point. Initial values without a range in ``box`` are those of the model.")

    starts: int = option(
        256, "Number of initial states, points of a scrambled Sobol sequence in the box.", least=1, keyword=False)
    box: Mapping[str, tuple[float, float]] | None = option(
        None, "Ranges of initial values; by default ±3 half backlashes, and ±2 for velocities, in every coordinate on "
        "which the relative motion depends.", in_files=False)
    seed: int = option(0, "Seed of the Sobol sequence of initial states.", least=0)
    sweep: Axis | None = option(
        None, "A parameter that is also swept slowly to its value in the model, from both ends. It is swept upwards "
        "from the first value of the axis and downwards from the last, with ``count`` values in each sweep.")
    kicks: int = option(
        0, "Directions in which to search the smallest perturbation that leaves a basin. They are random; the "
        "perturbation, here called kick, is searched for each attractor; by default it is not searched.", least=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.box:
            self._set(box=checked_box(self.box))
        vary(self.model, {n: [low, high] for n, (low, high) in self._box.items()})  # raises for an unknown name
        _ = self.cost
        if self.sweep:
            _check_sweep(self.model, self.sweep)

    @property
    def grid(self) -> dict[str, int]:
        return {"start": self.starts}

    @cached_property
    def cost(self) -> Cost:
        """Bound for all initial states, sweeps and perturbations; raises `InputError` if memory does not suffice."""
        check_memory("starts", self.starts)
        check_memory("kicks", self.kicks, _BYTES_PER_DIRECTION)
        sequential = 2 * self.sweep.count * PERIODS_PER_VALUE if self.sweep else 0
        motions = self.starts + self.kicks * _MOTIONS_PER_DIRECTION
        return self.estimate(motions, self.classification.max_periods, sequential)

    def thinned(self, share: float) -> Self:
        """Of fewer initial states and directions of kicks."""
        return replace(self, starts=min(self.starts, max(_LEAST_STARTS, round(share * self.starts))),
                       kicks=math.ceil(share * self.kicks))

    @property
    def _box(self) -> Mapping[str, tuple[float, float]]:
        return self.box or default_box(self.model)

    @cached_property
    def _starts(self) -> dict[str, np.ndarray]:
        """Initial values (starts,) by name."""
        return spread(self._box, self.starts, self.seed)

    def initial_values(self, items: np.ndarray) -> dict[str, np.ndarray]:
        return {n: v[items] for n, v in self._starts.items()}

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        (attractors, index), settings = self.attractors(found), self.classification
        ends: np.ndarray = np.empty(0, dtype=int)
        if self.sweep:
            value, (name, least, most, count) = _check_sweep(self.model, self.sweep), astuple(self.sweep)
            up = swept_initial_values(self.model, Axis(name, least, value, count), True)
            down = swept_initial_values(self.model, Axis(name, value, most, count), False)
            reached = vary(replace(self.model, initial={}), {n: np.array([up[n][0, -1], down[n][0, 0]]) for n in up})
            w = initial_state(reached, self.flow.system).T
            ends = attractors.find(w, settings=settings, threads=threads)
        rank = attractors.ranks()
        shares = proportion([a.count for a in attractors.ordered], int(np.sum(found["label"] > 0)))
        names = ("attractor_fraction", "attractor_fraction_lo", "attractor_fraction_hi")
        swept = zip(("up", "down"), ends, strict=False)
        data = {
            "attractor": variable("attractor", ("start",), attractors.numbers(index, found["label"])),
            **{f"attractor_{n}": variable("attractor", (), rank[i]) for n, i in swept},
            **attractors.variables(settings),
            **{n: variable(n, ("number",), v) for n, v in zip(names, shares, strict=True)},
            **(_kicks(attractors, self.kicks, progress, settings=settings, threads=threads) if self.kicks else {}),
            **{f"start_{n}": variable(n, ("start",), v) for n, v in self._starts.items()},
        }
        return new_dataset(data, attrs=self.provenance(
            starts=self.starts, seed=self.seed, box=dict(self._box), sweep=self.sweep and asdict(self.sweep),
            kicks=self.kicks))


attractors = function_of(Attractors)


def _check_sweep(model: MeshModel, sweep: Axis) -> float:
    """The model's value of the swept parameter; raises `InputError` if sweeps from both sides cannot reach it."""
    if sweep.name in model.state_names:
        raise InputError(f"sweep {sweep.name}", "must be a parameter, not an initial value", sweep.name)
    whole_number(f"sweep {sweep.name} count", sweep.count, 2)
    vary(model, {sweep.name: sweep.values})  # checked before any work
    value = model.value(sweep.name)
    if value is None:
        raise InputError(f"sweep {sweep.name}", "must have one value for both wheels", model.set_by(sweep.name))
    if not sweep.start < value < sweep.stop:
        raise InputError(f"sweep {sweep.name}", f"must run from below to above the model's value {value:g}",
                         f"{sweep.start:g}:{sweep.stop:g}")
    return value


def _kicks(attractors: AttractorSet, directions: int, progress: bool, **options: Any) -> dict[str, Any]:
    """The smallest destabilising perturbation found of each attractor, as variables, in the `AttractorSet.order`."""
    names = attractors.flow.system.names
    found = [smallest_perturbation(attractors, a, directions, f"kicks {n}" if progress else None, **options)
             for n, a in enumerate(attractors.ordered, start=1)]
    norms, changes, points = zip(*found, strict=True) if found else ((), (), ())
    rows = {"attractor_kick": np.array(norms, float),
            "attractor_kick_change": np.array(changes, float).reshape(-1, len(names)),
            "attractor_kick_point": np.array(points, float).reshape(-1, len(names))}
    out = {n: variable(n, ("number", "coordinate")[: v.ndim], v) for n, v in rows.items()}
    return {**out, "coordinate": ("coordinate", list(names))}


def smallest_perturbation(
    attractors: AttractorSet, attractor: Attractor, directions: int, progress: str | None, **options: Any
) -> tuple[float, np.ndarray, np.ndarray]:
    """The smallest perturbation found after which a motion leaves an attractor.

    It is the norm, the change of the state (d,), and the state at phase 0 to which the change is added; all NaN if none
    up to the norm 4 was found. The norm is Euclidean over the d coordinates, in half backlashes and their velocities.
    It is an upper bound of the smallest one: narrow tongues of other basins between the directions are missed. These
    are random; the best perturbation is improved by random changes of its direction and smaller norms. ``options`` are
    settings and threads of `classify_batch`.
    """

    def leaving(w: np.ndarray, progress: str | None = None) -> np.ndarray:
        """Those of the motions from w (L, d) that settle on another attractor or diverge."""

        def collect(_: np.ndarray, __: Motions, found: Verdicts) -> dict[str, np.ndarray]:
            alike = np.flatnonzero((found.label == attractor.label) & (found.period == attractor.period)
                                   & ((found.reason == Reason.NEUTRAL) == attractor.neutral))
            leaves = np.isin(found.label, _DECIDED)
            leaves[alike[attractors.contains(attractor, found.w[:, alike])]] = False
            return {"leaves": leaves}

        start = Motions.at(attractors.flow, w.T).take
        return np.flatnonzero(classify_batch(
            start, collect, np.arange(len(w)), response=False, progress=progress, **options)["leaves"])

    rng, d, section = np.random.default_rng(0), attractors.flow.dimension, attractor.section
    units, deviation = _units(rng.normal(size=(directions, d))), 0.5
    points = section[np.unique(np.linspace(0, len(section) - 1, _MAX_POINTS).astype(int))]
    sizes = (len(points), directions, len(_NORMS))
    point, direction, step = (i.ravel() for i in np.meshgrid(*(np.arange(n) for n in sizes)))
    changes = _NORMS[step, None] * units[direction]
    found = leaving(points[point] + changes, progress)
    if len(found) == 0:
        return np.nan, np.full(d, np.nan), np.full(d, np.nan)
    best = found[np.argmin(step[found])]
    norm, change, start = float(_NORMS[step[best]]), changes[best], points[point[best]]
    for _ in range(_IMPROVEMENTS):
        around = _units(change / norm + deviation * rng.normal(size=(_NEIGHBOURS, d)) / np.sqrt(d))
        around[0] = change / norm
        changes = (norm * _REDUCTIONS[:, None, None] * around).reshape(-1, d)
        found = leaving(start + changes)
        if len(found):
            change = changes[found[0]]
            norm = float(np.linalg.norm(change))
        else:
            deviation /= 2
    return norm, change, start


def _units(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors in the directions of vectors (N, d)."""
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
