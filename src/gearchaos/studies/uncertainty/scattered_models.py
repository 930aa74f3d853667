"""The models of gears, or dimensionless ones, with the values of uncertain inputs; batches of those that are alike.

Gears are made anew for each sample, so that all that depends on an input follows from it. What gears refuse, such as a
geometry that cannot run, is a sample without a model.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.execute.progress import bar
from gearchaos.flow import ExactFlow
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.geometry.backlash import Backlash
from gearchaos.gears.io.units import LENGTH
from gearchaos.gears.operation.operating import OPERATING_NAMES, gears_of, operating_model
from gearchaos.gears.transmission_error import PERMISSIBLE_OVER_SD
from gearchaos.gears.transmission_error.harmonics import BOUND, FROM_QUALITY
from gearchaos.model import Batch, MeshModel, has_effect, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import SwitchedAffine, coordinates, switched_system
from gearchaos.studies.core.initial_value_problems import Motions
from gearchaos.studies.operation.beyond_the_teeth import TeethLimits
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studies.uncertainty.distributions import WITHIN, Scattered

SPREAD = 0.3
"""Half the range of an input whose scatter is assumed, over its value."""
_PROBED = (0.125, 0.875)  # probabilities of an input at which it is seen what depends on it
STARTS = {"rest": "from rest", "static deflection": "from the static deflection",
          "steady contact": "from steady contact"}
"""From which initial states motions are computed, and how a reader wants that named."""

DEVIATIONS = "quality.deviations"
_DRAWN = f"normal(0, {1 / PERMISSIBLE_OVER_SD!r}, -1, 1)"  # of each wheel, over the permissible deviation

Values = tuple[float, ...]  # of the inputs of a sample, in their units, as `Scattered.at` gives them


def drawn_within_grade(vary: Sequence[Any]) -> tuple[Any, ...]:
    """Inputs as texts, those of the deviations ``within the grade`` as one of each wheel."""
    found: list[Any] = []
    for each in vary:
        words = isinstance(each, str) and " ".join(each.replace("=", " ").split())
        found += [f"{DEVIATIONS}.{n}={_DRAWN}" for n in (1, 2)] if words == f"{DEVIATIONS} {WITHIN}" else [each]
    return tuple(found)


def uncertain_inputs(gears: Any) -> tuple[str, ...]:
    """What every drawing leaves uncertain: deviations within the grade, uniform damping and backlash."""
    backlash, unit = gears.backlash, "mm"
    if isinstance(backlash, Backlash):
        backlash, unit = backlash.value, unit if backlash.dimension is LENGTH else ""
    elif not isinstance(backlash, float):  # allowances of the teeth
        backlash = None
    given = {"damping_ratio": (getattr(gears, "damping_ratio", None), ""), "k": (getattr(gears, "k", None), "N*s/m"),
             "backlash": (backlash and backlash * (1e3 if unit else 1), unit)}
    of_grade = getattr(gears, "transmission_error", None) in (*FROM_QUALITY,) and gears.quality.deviations is None
    return (*[f"{DEVIATIONS}={WITHIN}"] * of_grade, *(
        f"{name}={(1 - SPREAD) * value:.4g}:{(1 + SPREAD) * value:.4g} {unit}".rstrip()
        for name, (value, unit) in given.items() if value))


def with_varied_deviations(model: MeshModel, names: Sequence[str]) -> MeshModel:
    """The model of gears with deviations within their grade, instead of typical ones, if those of both wheels are
    varied. Raises `InputError` if only one is, and the other is not known."""
    gears: Any = gears_of(model)
    quality, varied = getattr(gears, "quality", None), [n for n in (1, 2) if f"{DEVIATIONS}.{n}" in names]
    if quality is None or quality.deviations is not None or not varied:
        return model
    if len(varied) == 1:
        raise InputError(f"vary: {DEVIATIONS}.{3 - varied[0]}", "must be varied too, or be given in the gears", None,
                         f"Both wheels make the error: --vary '{DEVIATIONS}={WITHIN}'.")
    error = BOUND if gears.transmission_error in FROM_QUALITY else gears.transmission_error
    made = operating_model(replace(gears, quality=replace(quality, deviations=(0.0, 0.0)), transmission_error=error),
                           model.kind)
    return replace(made, initial=model.initial)


def resolved(gears: Any, scattered: Scattered) -> Scattered:
    """An input of gears with the path of the value that it sets, in whole numbers where that has them.

    Raises `InputError` for a name that is none of a field, and for values that the field does not take, of which a
    normal distribution may have some.
    """
    top, *inner = scattered.name.split(".")
    known = [f.name for f in fields(gears)]
    if top in OPERATING_NAMES or scattered.name == "M10":
        raise InputError("vary", "must not name the speed or the torque", scattered.name,
                         "Motions are computed at those given by speed and torque.")
    if top not in known:
        raise unknown_name("vary", top, known)
    present = getattr(gears, top)
    for key in inner:
        names = _keys(present)
        if key not in names:
            raise unknown_name(f"vary: {top}", key, names) if names else InputError(
                "vary", f"must name a value: {top} has no {key}", scattered.name)
        present = names[key]
    if is_dataclass(present):
        names = _keys(present)
        if "value" not in names:
            raise InputError("vary", f"must name one value of {scattered.name}", scattered.name,
                             f"E.g. {', '.join(f'{scattered.name}.{key}' for key in names)}.")
        scattered = replace(scattered, path=f"{scattered.name}.value")
    counted = present if isinstance(present, tuple) and present else (present,)
    if all(isinstance(each, int) and not isinstance(each, bool) for each in counted):
        scattered = scattered.whole
    return scattered


def check_centre_distance(design: GearDesign, names: Sequence[str]) -> None:
    """Raise `InputError` for a varied centre distance of a design that leaves open what moves with it.

    The teeth of a drawing stay as they are: their shifts must be given, and the backlash by the thickness of the teeth,
    unless it is varied as well.
    """
    geometry, sets, still = design.geometry, list[str](), any(name.partition(".")[0] == "backlash" for name in names)
    if design.profile_shift is None:
        sets.append(f"--set \"design.profile_shift=[{', '.join(f'{x:g}' for x in geometry.profile_shift)}]\"")
    if isinstance(design.backlash, Backlash) and not still:
        thinner = (design.backlash_line_of_action - geometry.theoretical_backlash) * math.cos(
            geometry.helix_angle) / math.cos(geometry.transverse_pressure_angle) / 2
        one = f"'{-1e6 * thinner:.5g} um'"
        sets.append(f"--set \"design.backlash={{ tooth_thickness_allowances = [{one}, {one}] }}\"")
    if sets:
        raise InputError(
            "vary: centre_distance", "must have profile_shift, and the backlash by tooth_thickness_allowances, in the "
            "design", None, "Then the teeth stay as they are, and the backlash moves by 2 sin(α) times what the "
            f"distance does. As the design is now: {' '.join(sets)}.")


def check_values(gears: Any, scattered: Scattered, values: np.ndarray) -> None:
    """Raise `InputError` if the field of gears does not take some of the values of an input, whatever the others are.

    Values (N,) are those of all samples: their extremes are tried, and those of all but 0.2 % of the distribution. If
    one is refused, the share is counted.
    """

    def refused(value: float) -> InputError | None:
        table = with_values(gears, {scattered.path or scattered.name: scattered.given(value)})
        (top, new), = table.items()
        convert = next(f for f in fields(gears) if f.name == top).metadata.get("convert", lambda _, v: v)
        try:
            convert(top, new)
        except InputError as error:
            return error
        return None

    tried = np.arange(len(scattered.items)) if scattered.items else np.concatenate(
        [scattered.at(np.array([0.001, 0.999])), [values.min(), values.max()]])
    errors = [error for error in map(refused, tried.tolist()) if error is not None]
    if not errors:
        return
    error = errors[0]
    if scattered.mean is None:
        raise InputError(f"vary: {error.field}", error.rule, error.value, error.advice)
    share = np.mean([refused(value) is not None for value in scattered.at((np.arange(500) + 0.5) / 500).tolist()])
    raise InputError(f"vary: {error.field}", error.rule, error.value,
                     f"About {100 * share:.2g} % of {scattered.words} are impossible. Give limits: "
                     f"{scattered.name}=normal(mean, sd, low, high).")


def present_value(gears: Any, scattered: Scattered) -> float | None:
    """The value that gears have of a resolved input, in its unit; None where they have none, and for a list."""
    path = scattered.path or scattered.name
    own = _at(gears, path)
    if scattered.items or own is None:
        return None
    middle = float(scattered.at(np.array(0.5)))
    made = _at(replace(gears, **with_values(gears, {path: scattered.given(middle)})), path)
    return middle * own / made if made else None


def _at(value: Any, path: str) -> Any:
    """The value at the path of an input; None where there is none."""
    for key in path.split("."):
        value = _keys(value).get(key)
    return value


def _keys(value: Any) -> dict[str, Any]:
    """The parts of a value by the name by which an input addresses them: fields, keys, or 1 and 2 for the wheels."""
    if is_dataclass(value):
        return {f.name: getattr(value, f.name) for f in fields(value)}
    if isinstance(value, Mapping):
        return dict(value)
    return {str(n): each for n, each in enumerate(value, 1)} if isinstance(value, (tuple, list)) else {}


def with_values(gears: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of gears by name in which values are replaced by the paths of these, ``quality.grade``."""
    out: dict[str, Any] = {}
    for path, value in values.items():
        top, *inner = path.split(".")
        out[top] = _replaced(out.get(top, getattr(gears, top)), inner, value)
    return out


def _replaced(value: Any, path: Sequence[str], new: Any) -> Any:
    if not path:
        return new
    parts = _keys(value)
    parts[path[0]] = _replaced(parts[path[0]], path[1:], new)
    return list(parts.values()) if isinstance(value, (tuple, list)) else parts


class Machine(NamedTuple):
    """A sample at one torque: its model, `quasi_static_ratio`, NaN without a static load, and what its teeth bear."""

    model: MeshModel
    quasi_static: float
    limits: TeethLimits


@dataclass(frozen=True)
class ScatteredModels:
    """The models of samples at torques, N m, or of a dimensionless model at its own, under the one torque None."""

    model: MeshModel
    inputs: tuple[Scattered, ...]
    torques: tuple[float | None, ...]
    along: str  # "speed" or "omega"
    first: float  # a speed at which models are made
    start: str  # one of `STARTS`

    def models(self, values: Values) -> list[MeshModel]:
        """The models of a sample at all torques; raises `InputError` for one that is not possible."""
        return [model for model, _ in self._made(values)]

    def _made(self, values: Values) -> list[tuple[MeshModel, TeethLimits]]:
        """The same with what the teeth bear."""
        given = {each.path or each.name: each.given(value) for each, value in zip(self.inputs, values, strict=True)}
        gears: Any = gears_of(self.model)
        if gears is None:
            return [(self.model.with_values(given), TeethLimits())]
        table, out = with_values(gears, given), []
        for torque in self.torques:
            found = replace(gears, **table).at(torque=torque, speed=self.first)
            model = found.to_model(self.model.kind)
            out.append((replace(model, initial=self.model.initial) if self.model.initial else model,
                        TeethLimits.of(found, torque or 0.0)))
        return out

    def middle(self, **changed: float) -> Values:
        """The values of a sample in the middle of all distributions, but for some probabilities by input."""
        return tuple(float(each.at(np.array(changed.get(f"u{i}", 0.5)))) for i, each in enumerate(self.inputs))

    @cached_property
    def varying(self) -> frozenset[str]:
        """The names of the parameters that differ where one input differs: batches have arrays of these alone."""
        found = list[MeshModel]()
        for i, each in enumerate(self.inputs):
            tried = (np.arange(len(each.items)) + 0.5) / len(each.items) if each.items else _PROBED
            for u in (0.5, *tried):
                try:
                    found += self.models(self.middle(**{f"u{i}": float(u)}))
                except InputError:
                    continue
        values = [model.parameters() for model in found]
        names = {name for each in values for name in each}
        return frozenset(name for name in names if has_effect(name, self.model.kind)
                         and len({each.get(name) for each in values} - {None}) > 1)

    def machines(
        self, samples: Mapping[int, Values], progress: str | None = None
    ) -> tuple[dict[tuple[int, int], Machine], Counter[str]]:
        """The machines of samples by number of the sample and of the torque, and why others are not possible."""
        out, refused = dict[tuple[int, int], Machine](), Counter[str]()
        with bar(progress, len(samples)) as advance:
            for number, values in samples.items():
                try:
                    out |= {(number, t): Machine(
                        model, quasi_static_ratio(model) if model.q1 or model.q2 else np.nan, limits)
                        for t, (model, limits) in enumerate(self._made(values))}
                except InputError as error:
                    refused[f"{error.field} {error.rule}"] += 1
                advance(1)
        return out, refused

    def alike(self, machines: Mapping[tuple[int, int], Machine]) -> list[list[tuple[int, int]]]:
        """The keys of machines, grouped by what no array of a batch can have.

        In which group a machine is, and which values are arrays, does not depend on the other machines: results do
        not either, to the last bit.
        """
        groups = dict[Any, list[tuple[int, int]]]()
        for key, (model, *_) in machines.items():
            parameters, stiffness = model.parameters(), model.stiffness
            same = tuple((n, None if n in self.varying or n == "omega" else v) for n, v in parameters.items())
            unnamed = () if stiffness.families else tuple(
                (n, tuple(v) if isinstance(v, list) else v) for n, v in stiffness.record().items()
                if n not in parameters)
            likeness = type(stiffness), unnamed, same, coordinates(vary(model, {})), model.damping_law
            groups.setdefault(likeness, []).append(key)
        return list(groups.values())

    def batch(
        self, machines: Sequence[Machine], machine: np.ndarray, at: np.ndarray,
        initial: Mapping[str, np.ndarray] | None = None,
    ) -> Batch:
        """The parameters of machines that are alike: of machine (L,) at the speed or ω (L,).

        ``initial`` values by name, (L,), stand for those of the model where they are given, even if there are none."""
        values = [m.model.parameters() for m in machines]
        arrays = {n: np.array([each[n] for each in values])[machine] for n in values[0] if n in self.varying}
        omega = np.array([each["omega"] for each in values])[machine]
        arrays["omega"] = at if self.along == "omega" else omega * (at / self.first)
        model = machines[0].model if initial is None else replace(machines[0].model, initial={})
        return vary(model, {**arrays, **(initial or {})})

    def motions(self, machines: Sequence[Machine], machine: np.ndarray, at: np.ndarray) -> Motions:
        """The motions of a `batch` from the initial states of the scatter."""
        batch = self.batch(machines, machine, at)
        system = switched_system(batch, coordinates(vary(machines[0].model, {})))
        w = initial_state(batch, system) if self.start == "rest" else in_contact(system, self.start == "steady contact")
        return Motions(ExactFlow(system), w.T.copy(), np.arange(batch.size))


def in_contact(system: SwitchedAffine, vibrating: bool) -> np.ndarray:
    """The states (P, d) at phase 0 of the steady motions that front flanks which never part have at their mean
    stiffness; without vibration those of the static deflection, at rest.

    At constant stiffness the first is the motion in permanent contact, where there is one.
    """
    P, d, _ = system.A.shape
    durations = np.diff(system.starts, axis=1, append=1 + system.starts[:, :1])
    mean = (durations * system.levels).sum(axis=1)
    spring = np.zeros((P, d))
    spring[:, 0] = mean
    if system.law.in_contact:
        spring[:, 1] = system.damping
    A = system.A - system.b[:, :, None] * spring[:, None, :]
    out = -np.linalg.solve(A, (system.f0 + system.b * mean[:, None])[:, :, None])[..., 0]
    for j in range(1, system.f_cos.shape[1] + 1) if vibrating else ():
        forcing = np.zeros((P, d, 1), complex)
        forcing[:, 1, 0] = system.f_cos[:, j - 1] - 1j * system.f_sin[:, j - 1]
        out += np.linalg.solve(1j * j * system.omega[:, None, None] * np.eye(d) - A, forcing)[..., 0].real
    return out


def check_parameters(model: MeshModel, inputs: Sequence[Scattered], points: Sequence[np.ndarray]) -> None:
    """Raise `InputError` unless inputs are parameters of a dimensionless model, with values (N,) that it takes."""
    for each, values in zip(inputs, points, strict=True):
        if each.name == "omega" or each.name in model.state_names:
            raise InputError("vary", "must name parameters other than omega, and no initial values", each.name)
        if each.unit or any(isinstance(item, str) for item in each.items):
            raise InputError(each.name, "must have numbers without a unit", each.words, "The model is dimensionless.")
        if each.name not in model.known_names:
            model.expand({each.name: 0.0})
        vary(model, {each.name: [each.given(v) for v in values[[values.argmin(), values.argmax()]]]})
