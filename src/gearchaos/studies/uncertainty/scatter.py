"""A scatter: what uncertain inputs, as tolerances and damping, do to contact loss along the speed, and which matter."""

from __future__ import annotations

import textwrap
from dataclasses import MISSING, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np

from gearchaos.datasets import new_dataset, variables
from gearchaos.dynamics import Classification, Label
from gearchaos.dynamics.initial_conditions import default_box
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.execute.tiles import useful_threads
from gearchaos.gears.operation.operating import gears_of, is_design
from gearchaos.model import MeshModel, check_is_pair, vary
from gearchaos.model.switched import switched_system
from gearchaos.quantities import POSITIVE
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.cost import Cost, estimate
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.operating_ranges import operating_axis, torques_of
from gearchaos.studies.core.options import axis_option, option
from gearchaos.studies.core.study import ClassifyingStudy, Results
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.load_change import CHANGE, LOAD_CHANGES, REVERSAL, LoadChange
from gearchaos.studies.uncertainty.distributions import (
    SCRAMBLES,
    Scattered,
    as_text,
    correlated,
    correlation_factor,
    probabilities,
)
from gearchaos.studies.uncertainty.scatter_results import AFTER, OUTCOMES, ScatterResults
from gearchaos.studies.uncertainty.scattered_models import (
    ScatteredModels,
    check_centre_distance,
    check_parameters,
    check_values,
    drawn_within_grade,
    resolved,
    uncertain_inputs,
    with_varied_deviations,
)
from gearchaos.studies.uncertainty.scattered_motions import PERMANENT, TWO_SIDED, ScatteredMotions, lost
from gearchaos.validation import check_rule

if TYPE_CHECKING:
    import xarray as xr

_LEAST = 2 * SCRAMBLES  # designs: two in each scrambling


@dataclass(frozen=True)
class Scatter(ClassifyingStudy):
    """Say what the scatter of uncertain inputs does to contact loss and dynamic factor along the speed.

    Every sample is a design of its own, made anew with all that follows from its inputs. At each speed the motion from
    the initial state that ``start`` names is followed, and from the next speeds, rising and falling, motions that have
    lost contact there: these are those of operation. With ``load_change`` one more is followed at each speed, from a
    random state after a change of the load, as in `speeds_to_avoid`, or with ``wide`` from any of wide ranges.

    Returns
    -------
    xarray.Dataset
        Over ``outcome``, ``torque`` and ``speed`` (``omega`` of a dimensionless model) ``probability`` with its 95 %
        interval, ``probability_lo`` to ``probability_hi``; outcomes are "contact loss", "both flanks hit", "no
        repetition" (chaotic or quasi-periodic), "force over limit": a dynamic factor, over the quasi-static ratio of
        the design, above ``factor``, and "beyond the teeth", of which no factor counts. ``anywhere``, ``anywhere_lo``,
        ``anywhere_hi`` are those of an outcome at any of the speeds. These are of operation; the same names with
        ``_after_load_change`` before ``_lo`` and ``_hi`` are those after one change of the load at each speed. Over
        ``torque`` and ``percentile`` (5, 50, 95) ``lowest_speed_lost``, ``highest_speed_lost`` of the designs that lose
        contact, and ``share_lost`` of the speeds. Over ``output``, ``torque`` and ``varied`` Sobol's indices
        ``first_index`` and ``total_index``; over ``aim``, ``torque`` and ``varied`` ``if_best``, what is expected where
        an input is held at its best value, from ``best_from`` to ``best_to``, and ``if_halved``, where its spread is
        halved; all with ``_lo`` and ``_hi``. Over ``varied`` ``distribution``, ``varied_unit`` and ``cut_share``.
        ``impossible`` is the share of designs that are not possible; the others are those that count. Over ``sample``
        the inputs and results of each design: ``sample_value``, ``sample_possible``, ``sample_share_lost``,
        ``sample_contact`` (the worst at any speed), ``sample_factor``.

    Raises
    ------
    InputError
        If an input cannot be varied, has impossible values, correlations do not go together, or more motions would be
        followed than ``budget``.

    Notes
    -----
    "quality.deviations=within the grade" stands for ``quality.deviations.1`` and ``quality.deviations.2``: the
    tooth-to-tooth deviations of both wheels, over those that the grade permits, of the error "from quality". They are
    normal, with the permissible ones at three standard deviations: a convention.

    Samples are 16 independent scramblings of a Sobol sequence; intervals follow from their scatter by Student's t with
    15 degrees of freedom. Indices are not defined for correlated inputs, nor where designs are not possible, since the
    inputs of the others then depend on each other. With indices half of the samples each are A and B of Saltelli's
    design, and half as many again are computed for each input. Motions that are called chaotic are not followed to
    see whether the chaos is transient.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.scatter(design, ["damping_ratio=0.03:0.1"], "speed=1000:4000:4", [100], samples=64)
    >>> found.probability.dims
    ('outcome', 'torque', 'speed')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.8, q0=0.1, chi0=0, zeta=0.05, eps1=0.045)
    >>> study = gc.Scatter(model, ["eps1=0.045±0.005", "zeta=0.04:0.06"], "omega=0.7:0.9:3", samples=64)
    >>> study.kind, study.count
    ('scatter', 384)
    """

    kind: ClassVar[str] = "scatter"
    rank: ClassVar[int] = 5
    group: ClassVar[str] = "Gears"
    summary: ClassVar[str] = "scatter"
    model_words: ClassVar[str] = "A single pair of given gears, or a dimensionless one."
    default_settings: ClassVar[Classification] = Classification(
        transient_lengths=(80, 160, 320), longest_period=16, doublings=1, longest_transient=0)

    vary: tuple[str, ...] = option(
        MISSING, "Inputs with distributions: backlash=0.10:0.25 mm, damping_ratio=0.05±0.01, quality.grade=6:8.",
        keyword=False)
    speed: Axis = axis_option('Speeds of wheel 1, rpm, as a text "speed=500:6000:60"; of a dimensionless model omega.')
    torque: tuple[float, ...] | None = option(
        None, "Torques at wheel 1, numbers in N m or texts; by default that of the gears.", keyword=False)
    samples: int = option(1024, "Designs from which probabilities follow, 16 times a power of two.", least=_LEAST)
    factor: float = option(
        1.5, "Limit of the dynamic factor over the quasi-static ratio.", rule=POSITIVE)
    indices: bool = option(
        True, "Also compute the indices of Sobol, from half as many designs again for each input.")
    start: Literal["rest", "static deflection", "steady contact"] = option(
        "rest", "Initial states of the motions. From rest they are those of the model, of gears flanks that touch; in "
        "steady contact those of the motion of flanks that never part, at the mean stiffness.")
    correlations: tuple[tuple[str, str, float], ...] = option(
        (), "Of pairs of inputs, as [first, second, correlation]: a Gaussian copula.")
    load_change: float | None = option(
        REVERSAL.ratio, f"{CHANGE} None, of commands and files \"none\", where the load never changes.",
        rule=LOAD_CHANGES)
    wide: bool = option(False, "Look at wide ranges of states instead, which no load stores.")
    seed: int = option(0, "Of the samples.", least=0)
    budget: int = option(2_000_000, "Most motions that are followed.", least=1)

    def __post_init__(self) -> None:
        given = (self.vary,) if isinstance(self.vary, str) or hasattr(self.vary, "keys") else tuple(self.vary)
        if not given and (gears := gears_of(self.model) if isinstance(self.model, MeshModel) else self.model):
            given = uncertain_inputs(gears)
        self._set(vary=drawn_within_grade([as_text(each) for each in given]))
        self._set(correlations=_correlations(self.correlations))
        along = "omega" if isinstance(self.model, MeshModel) and gears_of(self.model) is None else "speed"
        self._set(speed=operating_axis(along, self.speed, "speed"))
        if self.torque is not None:
            self._set(torque=torques_of(self.torque))
            check_rule("torque", np.array(self.torque), POSITIVE)
        if is_design(self.model) and self.torque:
            self._set(model=self.model.at(torque=self.torque[0]))
        if self.load_change == "none":  # as study files and commands have it
            self._set(load_change=None)
        if self.wide and self.load_change != REVERSAL.ratio:
            raise InputError("load_change", "must be left out with wide", self.load_change)
        super().__post_init__()
        check_is_pair(self.model, "a scatter")
        gears = gears_of(self.model)
        if gears is None and self.torque is not None:
            raise InputError("torque", "must be left out for a dimensionless model", list(self.torque),
                             "Its torques are q1 and q2.")
        if gears is not None:
            self._set(torque=self.torque or (float(self.model.value("torque") or 0.0),))
            self._refuse_other_values(gears)
            self._set(model=with_varied_deviations(self.model, [Scattered.parse(each).name for each in self.vary]))
            gears = gears_of(self.model)
        self._check_inputs(gears)
        self._check_budget()
        _ = self.cost

    def _refuse_other_values(self, gears: Any) -> None:
        """Raise `InputError` for a parameter or stiffness of the model that is not that of its gears."""
        made, advice = gears.to_model(self.model.kind), "Set it in the table of the gears: samples are gears made anew."
        given, of_gears = self.model.stiffness, made.stiffness
        if (given.kind, given.unnamed()) != (of_gears.kind, of_gears.unnamed()):
            raise InputError("stiffness", "must be that of the gears", given.kind, advice)
        own = made.parameters()
        for name, value in self.model.parameters().items():
            if name not in ("omega", "q1", "q2") and own[name] != value:
                raise InputError(name, "must be that of the gears", value, advice)

    def _check_inputs(self, gears: Any) -> None:
        names = [each.name for each in self.inputs]
        if len(set(names)) < max(1, len(names)):
            raise InputError("vary", "must name one input or more, each once", list(self.vary))
        if self.samples & (self.samples - 1):
            near = 1 << self.samples.bit_length()
            raise InputError("samples", f"must be {SCRAMBLES} times a power of two", self.samples,
                             f"E.g. {near // 2} or {near}.")
        correlation_factor(self.inputs, self.correlations)
        check_memory("designs times speeds and torques", self.count, 40)
        values = list(self.values.reshape(-1, len(names)).T)
        if is_design(gears) and "centre_distance" in names:
            check_centre_distance(gears, names)
        if gears is None:
            check_parameters(self.model, self.inputs, values)
        for each, tried in zip(self.inputs, values, strict=True):
            if gears is not None:
                check_values(gears, each, tried)
        try:
            self.models.models(self.models.middle())
        except InputError as error:
            raise InputError(f"vary: {error.field}", error.rule, error.value,
                             f"So it is in the middle of the distributions. {error.advice}") from None

    def _check_budget(self) -> None:
        if self.count <= self.budget:
            return
        per_sample = self.count / self.samples
        most = SCRAMBLES << max(1, int(self.budget / per_sample / SCRAMBLES).bit_length() - 1)
        fewer = [f"--samples {most} ({int(per_sample * most):,} motions)"] if per_sample * most <= self.budget else []
        points = len(self.torques) * self.speed.count
        if self.has_indices:
            fewer.append(f"--no-indices ({self.samples * points:,})")
        raise InputError(
            "budget", f"must be at least {self.count:,}, the motions of {self.count // points:,} designs at "
            f"{points} points", self.budget,
            f"Or choose {' or '.join([*fewer, 'fewer speeds'])}.")

    @property
    def has_indices(self) -> bool:
        """Whether the indices of Sobol are computed: they are wanted, and inputs are independent."""
        return self.indices and not self.correlations

    @cached_property
    def inputs(self) -> tuple[Scattered, ...]:
        """The uncertain inputs."""
        found, gears = [Scattered.parse(each) for each in self.vary], gears_of(self.model)
        return tuple(each if gears is None else resolved(gears, each) for each in found)

    @property
    def torques(self) -> tuple[float | None, ...]:
        """The torques in N m; None for that of a dimensionless model."""
        return (None,) if self.torque is None else self.torque

    @cached_property
    def models(self) -> ScatteredModels:
        return ScatteredModels(self.model, self.inputs, self.torques, self.speed.name, self.speed.start,
                               self.start)

    @cached_property
    def points(self) -> np.ndarray:
        """The probabilities of all inputs, (blocks, scrambles, n, inputs); see `distributions.probabilities`."""
        u = probabilities(self.samples, len(self.inputs), self.seed, self.has_indices)
        return correlated(u, correlation_factor(self.inputs, self.correlations))

    @cached_property
    def values(self) -> np.ndarray:
        """The values of all inputs, of the shape of `points`, as `Scattered.at` gives them."""
        return np.stack([each.at(self.points[..., i]) for i, each in enumerate(self.inputs)], axis=-1)

    @cached_property
    def changes(self) -> np.ndarray:
        """Even numbers between 0 and 1, (n, samples, torques, speeds), from which states after load changes follow."""
        count = len(default_box(self.model)) if self.wide else 2
        return np.random.default_rng([self.seed, 1]).random(
            (count, self.samples, len(self.torques), self.speed.count))

    @property
    def grid(self) -> dict[str, int]:
        designs = self.samples * (len(self.inputs) + 2) // 2 if self.has_indices else self.samples
        return {"design": designs, "torque": len(self.torques), self.speed.name: self.speed.count}

    @property
    def block(self) -> dict[str, int]:
        return {**self.grid, "design": 1}

    @cached_property
    def cost(self) -> Cost:
        ends = [self.speed.start, self.speed.stop]
        return estimate(switched_system(vary(self.model, {self.speed.name: ends})), self.count,
                        self.classification.max_periods, model=self.model)

    def thinned(self, share: float) -> Self:
        """Of fewer samples."""
        least = max(_LEAST, round(share * self.samples))
        return replace(self, samples=min(self.samples, SCRAMBLES << (least // SCRAMBLES).bit_length() - 1))

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        per_design, speeds = len(self.torques) * self.speed.count, self.speed.values
        designs = items[::per_design] // per_design  # a block has whole designs
        rows = self.values.reshape(-1, len(self.inputs))
        samples = {int(design): tuple(rows[design].tolist()) for design in designs}
        machines, _ = self.models.machines(samples, "designs" if progress else None)
        place = {int(design): position for position, design in enumerate(designs)}
        shape = len(designs), len(self.torques), len(speeds)
        out: Results = {"possible": np.zeros(shape, np.int8)}
        for after in self._classes:
            out |= {f"label{after}": np.zeros(shape, np.int8), f"contact{after}": np.full(shape, PERMANENT, np.int8),
                    f"excess{after}": np.full(shape, np.nan, np.float32), f"beyond{after}": np.zeros(shape, np.int8)}
        most = max(1, useful_threads(self.count, threads) * self.cost.max_parameter_points(threads) // len(speeds))
        groups = [keys[i : i + most] for keys in self.models.alike(machines) for i in range(0, len(keys), most)]
        for number, keys in enumerate(groups, 1):
            motions = ScatteredMotions(
                self.models, [machines[key] for key in keys], speeds, self.classification,
                self.cost.max_parameter_points(threads), f"scatter {number} of {len(groups)}" if progress else None,
                threads)
            design, torque = np.transpose(keys)
            at = np.array([place[each] for each in design.tolist()]), torque
            out["possible"][at] = 1
            # the load changes only for designs that are samples of the inputs
            cells = np.flatnonzero(np.repeat((design < self.samples) & (AFTER in self._classes), len(speeds)))
            machine, speed = np.divmod(cells, len(speeds))
            found, changed = motions.found(cells, self.changes[:, design[machine], torque[machine], speed],
                                           None if self.wide else LoadChange(self.load_change or 0.0))
            of_changes = {n: np.zeros_like(v) for n, v in found.items()}
            for name, values in changed.items():
                of_changes[name][cells] = values
            for after, results in zip(self._classes, (found, of_changes), strict=False):
                for each in ("label", "contact", "excess", "beyond"):
                    out[f"{each}{after}"][at] = results[each].reshape(len(keys), -1)
        return {n: v.reshape(-1) for n, v in out.items()}

    @property
    def _classes(self) -> tuple[str, ...]:
        """What the names of results end in: of motions in operation, and after a change of the load."""
        return ("", AFTER) if self.wide or self.load_change is not None else ("",)

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        found = {name: values.reshape(tuple(self.grid.values())) for name, values in found.items()}
        possible, excess, beyond = found["possible"] == 1, found["excess"], found["beyond"] == 1
        outcomes = [self._outcomes({n: found[f"{n}{after}"] for n in ("label", "contact", "excess", "beyond")})
                    for after in self._classes]
        loaded = possible & (np.isfinite(excess) | beyond)
        results = ScatterResults(
            inputs=self.inputs, points=self.points, values=self.values, speeds=self.speed, indices=self.has_indices,
            independent=not self.correlations, outcomes=outcomes[0], after=outcomes[1] if outcomes[1:] else None,
            contact=found["contact"], excess=np.where(beyond, np.nan, excess), possible=possible[:, 0, 0],
            loaded=loaded[:, 0, 0])
        undecided = (found["label"] == Label.UNDECIDED) & possible
        data = {**results.variables(), **variables((), {
            "undecided_share": np.array(undecided.sum() / max(1, np.sum(possible)))})}
        coords = variables((self.speed.name,), {self.speed.name: self.speed.values})
        if self.torque is not None:
            coords |= variables(("torque",), {"torque": np.array(self.torque)})
        if not results.possible.any():
            raise InputError("vary", "must leave some designs possible", ", ".join(each.name for each in self.inputs),
                             self._why(results))
        refused = "" if self.indices else "they were not asked for"
        if self.correlations:
            refused = "they are not defined for correlated inputs"
        elif self.indices and not results.possible.all():
            refused = "they are not defined where some designs are not possible: narrow the distributions"
        attributes = {"indices_refused": refused, "impossible_because": self._why(results)}
        coords |= results.coordinates()
        return new_dataset(data, coords, {**self.provenance(**self.recorded), **attributes})

    def _outcomes(self, found: Results) -> np.ndarray:
        """Which of `OUTCOMES` motions have, (outcomes, ...)."""
        beyond = found["beyond"] == 1
        outcomes = {
            "contact loss": lost(found), "both flanks hit": (found["contact"] == TWO_SIDED) | beyond,
            "no repetition": np.isin(found["label"], (Label.CHAOTIC, Label.QUASI_PERIODIC)),
            "force over limit": (found["excess"] > self.factor) | beyond, BEYOND: beyond}
        return np.stack([outcomes[n] for n in OUTCOMES])

    def _why(self, results: ScatterResults) -> str:
        """Why designs are not possible, the most frequent reason first."""
        rows = self.values.reshape(-1, len(self.inputs))
        _, refused = self.models.machines({int(n): tuple(rows[n]) for n in np.flatnonzero(~results.possible)[:100]})
        return textwrap.shorten("; ".join(reason for reason, _ in refused.most_common(3)), 300)

    @property
    def recorded(self) -> dict[str, Any]:
        return {n: getattr(self, n) for n in self.option_types()}


scatter = function_of(Scatter)


def _correlations(given: Any) -> tuple[tuple[str, str, float], ...]:
    """Correlations as pairs of names with a number; raises `InputError` for anything else."""
    found = []
    for each in given:
        if isinstance(each, str) or not hasattr(each, "__len__") or len(each) != 3:
            raise InputError("correlations", "must be a list of [first, second, correlation]", each,
                             "E.g. [['backlash', 'damping_ratio', 0.5]].")
        first, second, value = each
        if isinstance(value, (str, bool)) or not hasattr(value, "__float__"):
            raise InputError("correlations", "must have numbers", each)
        found.append((str(first), str(second), float(value)))
    return tuple(found)
