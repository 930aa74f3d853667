"""The attractors of one operating point, found from many initial states, and the share of these that each attracts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics.initial_conditions import checked_box, default_box, spread
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, state_names, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.attractor_set import AttractorSet, attractor_variables, final_states
from gearchaos.studies.axis import Axis
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.declaration import function_of
from gearchaos.studies.initial_value_problems import Motions, initial_value_problems
from gearchaos.studies.options import option
from gearchaos.studies.perturbation import BYTES_PER_DIRECTION, MOTIONS_PER_DIRECTION, smallest_perturbation
from gearchaos.studies.study import ClassifyingStudy, Results
from gearchaos.studies.sweep import PERIODS_PER_VALUE, swept_initial_values

if TYPE_CHECKING:
    import xarray as xr

_CONFIDENCE = 0.95
"""Confidence level of the intervals of the shares."""


@dataclass(frozen=True)
class Attractors(ClassifyingStudy):
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
        check_memory("kicks", self.kicks, BYTES_PER_DIRECTION)
        sequential = 2 * self.sweep.count * PERIODS_PER_VALUE if self.sweep else 0
        system = switched_system(vary(self.model, {}))
        motions = self.starts + self.kicks * MOTIONS_PER_DIRECTION
        return estimate(system, motions, self.classification.max_periods, sequential)

    @property
    def _box(self) -> Mapping[str, tuple[float, float]]:
        return self.box or default_box(self.model)

    @cached_property
    def _starts(self) -> dict[str, np.ndarray]:
        """Initial values (starts,) by name."""
        return spread(self._box, self.starts, self.seed)

    @cached_property
    def _initial_states(self) -> np.ndarray:
        """Initial states (d, starts)."""
        return initial_state(vary(self.model, self._starts), self._flow.system).T

    @cached_property
    def _flow(self) -> ExactFlow:
        return initial_value_problems(self.model).flow

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        name, w = "attractors" if progress else None, self._initial_states[:, items]
        return final_states(Motions.at(self._flow, w), settings=self.classification, progress=name, threads=threads)

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        attractors, settings = AttractorSet(self._flow), self.classification
        index = attractors.match(found)
        attractors.count_starts(index)
        ends: np.ndarray = np.empty(0, dtype=int)
        if self.sweep:
            value, (name, least, most, count) = _check_sweep(self.model, self.sweep), astuple(self.sweep)
            up = swept_initial_values(self.model, Axis(name, least, value, count), True)
            down = swept_initial_values(self.model, Axis(name, value, most, count), False)
            reached = vary(replace(self.model, initial={}), {n: np.array([up[n][0, -1], down[n][0, 0]]) for n in up})
            w = initial_state(reached, switched_system(vary(self.model, {}))).T
            ends = attractors.find(w, settings=settings, threads=threads)
        rank = attractors.ranks()
        swept = zip(("up", "down"), ends, strict=False)
        data = {
            "attractor": variable("attractor", ("start",), attractors.numbers(index, found["label"])),
            **{f"attractor_{n}": variable("attractor", (), rank[i]) for n, i in swept},
            **attractor_variables(attractors, settings), **_shares(attractors, int(np.sum(found["label"] > 0))),
            **(_kicks(attractors, self.kicks, progress, settings=settings, threads=threads) if self.kicks else {}),
            **{f"start_{n}": variable(n, ("start",), v) for n, v in self._starts.items()},
        }
        options = {
            "starts": self.starts, "seed": self.seed, "box": dict(self._box),
            "sweep": self.sweep and asdict(self.sweep), "kicks": self.kicks,
        }
        return new_dataset(data, attrs=self.provenance(**options))


attractors = function_of(Attractors)


def _check_sweep(model: MeshModel, sweep: Axis) -> float:
    """The model's value of the swept parameter; raises `InputError` if sweeps from both sides cannot reach it."""
    if sweep.name in state_names(model.kind):
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
    found = [
        smallest_perturbation(
            attractors.flow, attractors.members[i], directions, progress=f"kicks {n}" if progress else None, **options
        ) for n, i in enumerate(attractors.order(), start=1)
    ]
    none = np.full(len(names), np.nan)
    rows = {
        "attractor_kick": np.array([p.norm if p else np.nan for p in found]),
        "attractor_kick_change": np.array([p.change if p else none for p in found]).reshape(-1, len(names)),
        "attractor_kick_point": np.array([p.point if p else none for p in found]).reshape(-1, len(names)),
    }
    out = {n: variable(n, ("number", "coordinate")[: v.ndim], v) for n, v in rows.items()}
    return {**out, "coordinate": ("coordinate", list(names))}


def _shares(attractors: AttractorSet, starts: int) -> dict[str, xr.Variable]:
    """The share of the initial states that each attractor attracts, with its confidence interval."""
    from scipy.stats import binomtest  # here, since scipy.stats takes a second to load

    counts = [attractors.members[i].count for i in attractors.order()]
    intervals = [binomtest(c, starts).proportion_ci(_CONFIDENCE) for c in counts]
    values = {
        "fraction": [c / starts for c in counts], "fraction_lo": [i.low for i in intervals],
        "fraction_hi": [i.high for i in intervals],
    }
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), np.array(v, float)) for n, v in values.items()}
