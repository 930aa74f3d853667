"""Proofs that an event of periodic orbits lies in an interval of a parameter: opposite proved facts at its two ends.

For a flip, a graze or a Neimark-Sacker bifurcation the orbits of both ends are connected by orbits for all values
between. For a fold the region about both orbits of one end is empty at the other end, see `exclusion`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from gearchaos.model import SCALARS
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import fractions, from_text, precision, texts, to_text
from gearchaos.proof.candidate import Candidate, Points, converged
from gearchaos.proof.certificate import Certificate, Theorem, UndecidedError, Unproved, first_proved, with_checksum
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.boxes import BoxSystem
from gearchaos.proof.families.coefficients import LEVELS, shifted
from gearchaos.proof.families.exclusion import Region, as_floats, distance, neighbours
from gearchaos.proof.parameters import exact_parameters, lifted
from gearchaos.proof.prove import at_phase, prove_orbit

_EXPONENTS = (3, 4, 5, 6, 7, 8, 9, 10, 11, 12)  # radii 10^-k that are tried


def connection(below: Certificate, above: Certificate, bits: int, start: Certificate | None = None) -> dict[str, Any]:
    """The proof for the straight line of parameters between two models, whose orbits have one period and one phase.

    The line begins at ``start``, one of the two, if orbits along it may graze a contact boundary: the one whose teeth
    switch contact more often. By default it begins in the middle. Raises `UndecidedError` if it is not proved.

    ``ends`` of the result are the values of u at ``below`` and ``above``. For each u between them there is exactly one
    orbit within ``radius`` of the points plus u times the derivative, no multiplier is 1, and no contact switch is at a
    section. The orbits at the ends are those of the certificates.
    """
    share = Fraction(1, 2) if start is None else Fraction(int(start is above))
    reach = max(share, 1 - share)
    ends = [-share / reach, (1 - share) / reach]
    changes = line(below.document["model"], above.document["model"])
    parameters = shifted(below.document["model"], {name: share * change for name, change in changes.items()})
    with precision(bits):
        equations = MeshEquations(parameters, from_text(below.document["phase"]), bits)
        check_coordinates(equations, below, above)
        candidate = converged(equations, fractions((start or below).document["points"]))
        if candidate is None:
            raise UndecidedError("orbit not found", 0.0)
        system = BoxSystem(candidate, [{name: reach * v for name, v in changes.items()}], start is not None)

        def within(exponent: int) -> dict[str, Any]:
            margin = system.continued(10.0**-exponent)
            for u, end in zip(ends, (below, above), strict=True):
                _check_same(system, u, end, Fraction(10.0**-exponent))
            derivative = [[float(v).hex() for v in point] for point in system.drift[:, :, 0].tolist()]
            return {"ends": list(map(int, ends)), "points": texts(candidate.points), "derivative": derivative,
                    "radius": f"1e-{exponent}", "margin": f"{margin:.3e}"}

        return first_proved(within, _EXPONENTS, "orbit not found")


def check_coordinates(equations: MeshEquations, *found: Certificate) -> None:
    """Raise `UndecidedError` if the equations have other coordinates than the orbits of certificates."""
    if any(list(equations.names) != orbit.document["coordinates"] for orbit in found):
        raise UndecidedError("coordinates not the same", 0.0)


def line(first: Mapping[str, Any], last: Mapping[str, Any]) -> dict[str, Fraction]:
    """The differences of the parameters of two models, of those that a box can vary."""
    def numbers(parameters: Mapping[str, Any]) -> dict[str, Fraction]:
        texts = {name: text for table, names in ((parameters, SCALARS), (parameters["stiffness"], LEVELS))
                 for name, text in table.items() if name in names}
        texts |= {f"eps{j}": text for j, text in enumerate(parameters["eps"], start=1)}
        return {name: from_text(text) for name, text in texts.items()}

    ours, theirs = numbers(first), numbers(last)
    return {name: theirs[name] - ours[name] for name in ours if ours[name] != theirs[name]}


def _check_same(system: BoxSystem, u: Fraction, end: Certificate, radius: Fraction) -> None:
    """Raise `UndecidedError` unless the orbit of an end is the one on the line.

    Of the two boxes in each of which there is exactly one orbit, one has to lie in the other.
    """
    room, points = abs(radius - Fraction(end.document["radius"])), fractions(end.document["points"])
    for point, centre, drift in zip(points, system.candidate.points, system.drift[:, :, 0].tolist(), strict=True):
        for x, c, derivative in zip(point, centre, drift, strict=True):
            if (gap := room - abs(x - c - u * Fraction(derivative))) <= 0:
                raise UndecidedError("orbit not found", float(gap))


FORMAT, VERSION = "gearchaos event certificate", 1
KINDS = ("flip", "fold", "graze", "neimark-sacker")

_REGION = 3  # half the edge of the region of a fold, in distances of the two orbits


@dataclass(frozen=True, eq=False)
class EventCertificate(Theorem):
    """An event that is proved to lie in an interval of a parameter.

    In ``document``, ``below`` and ``above`` have the certificates of the orbits proved at the ends of the interval,
    each of which ``gearchaos verify`` checks by itself.
    """

    kind = property(lambda self: self.document["kind"], doc="One of `KINDS`.")
    interval = property(lambda self: tuple(map(float.fromhex, self.document["interval"])),
                        doc="The ends of the interval of the parameter.")

    def certificates(self) -> list[Certificate]:
        """The certificates of the orbits at the lower end of the interval, then at the upper end."""
        return [Certificate(d) for end in ("below", "above") for d in self.document[end]]

    def in_words(self) -> str:
        """The theorem."""
        return f"proved. {self.theorem}"

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        return self.selected("kind", "theorem", "parameter", "interval", "period", "empty")

    def __repr__(self) -> str:
        return f"EventCertificate({self.kind}, {self.document['parameter']} in {list(self.interval)})"


def prove_event_facts(kind: str, parameter: str, ends: list[tuple[MeshModel, float]], points: np.ndarray,
                      bits: int) -> EventCertificate | Unproved:
    """Prove what is different at the two ends of an interval of a parameter.

    ``kind`` is one of `KINDS`. ``ends`` has the model and the value of the parameter at the lower and the upper end.
    ``points`` (n, d) are approximate states at τ = k T of the orbit at the event, ``bits`` the first precision.
    """
    models = [model for model, _ in ends]
    try:
        found = (_fold(parameter, models, points, bits) if kind == "fold"
                 else _change(kind, parameter, models, points, bits))
    except UndecidedError as failure:
        return failure.unproved(bits)
    below, above = found["below"], found["above"]
    return EventCertificate(with_checksum({
        "format": FORMAT, "version": VERSION, "kind": kind, "theorem": found["theorem"], "parameter": parameter,
        "interval": [value.hex() for _, value in ends], "period": min(f.period for f in (*below, *above)),
        "below": [f.document for f in below], "above": [f.document for f in above],
        "empty": found.get("empty"), "connection": found.get("connection"),
    }))


def _change(kind: str, parameter: str, models: list[MeshModel], points: np.ndarray, bits: int) -> dict[str, Any]:
    """What is proved of an event that changes the orbit: a flip, a graze or a Neimark-Sacker bifurcation."""
    orbits = []
    for model in models:
        with _equations(model, bits) as equations:
            found = converged(equations, lifted(points, equations.names))
        if found is None:
            raise UndecidedError("orbit not found", 0.0)
        orbits.append(found)
    ends = [(model, as_floats(orbit.points)) for model, orbit in zip(models, orbits, strict=True)]
    phase = _free_phase(orbits) if kind == "graze" else 0.0
    below, above = (_proved(model, near, bits, phase) for model, near in ends)
    proved, start, extra = ([below], [above]), None, []
    if kind == "graze":
        first, second = ([(s["flank"], s["into"]) for switches in found.document["switches"] for s in switches]
                         for found in (below, above))
        start = below if len(first) > len(second) else above
        same = len(first) == len(second) and any(
            first[k:] + first[:k] == second for k in range(max(1, len(first))))  # up to where they begin
        what = (f"the teeth switch contact in different sequences, {len(first)} times at the lower end and "
                f"{len(second)} times at the upper end")
        event = "teeth touch or part without speed"
    else:
        same = abs(below.outside - above.outside) != (1 if kind == "flip" else 2)
        what = (f"{below.outside} multipliers lie outside the unit circle at the lower end and {above.outside} at the "
                "upper end")
        event = "a multiplier is -1" if kind == "flip" else "a multiplier lies on the unit circle"
    if same:
        raise UndecidedError("no change", float(above.outside - below.outside))
    if kind == "flip":
        side, doubled = _doubled(ends, bits)
        proved[side].append(doubled)
        extra = [f"At {('its lower', 'its upper')[side]} end there is an orbit that repeats after {doubled.period} "
                 f"mesh periods beside it, with {doubled.outside} multipliers outside."]
    theorem = " ".join((
        f"At both ends of the interval of {parameter} there is exactly one orbit of period {below.period} mesh "
        f"periods, and no fewer, in the cubes listed, and {what}.",
        f"The two orbits are connected by exactly one orbit for each value of {parameter} between, and no multiplier "
        f"is 1: at some value {event}.", *extra))
    return {"below": proved[0], "above": proved[1], "theorem": theorem,
            "connection": connection(below, above, bits, start)}


def _free_phase(orbits: list[Candidate]) -> float:
    """The phase of the section, in mesh periods, that is farthest from all contact switches of orbits."""
    times = sorted(float(s.time.mid()) for orbit in orbits for motion in orbit.trajectories for s in motion.switches)
    gaps = [(after - before, before) for before, after in pairwise([*times, *(time + 1 for time in times[:1])])]
    gap, before = max(gaps, default=(0.0, 0.0))
    return (before + gap / 2) % 1


def _proved(model: MeshModel, points: np.ndarray, bits: int, phase: float = 0.0) -> Certificate:
    """The certificate of an orbit at a phase of the section; raises `UndecidedError` if it is not proved."""
    there = at_phase(model, points, phase) if phase else points
    if there is None:
        raise UndecidedError("orbit not found", 0.0)
    result = prove_orbit(model, there, bits, phase)
    if isinstance(result, Unproved):
        raise UndecidedError(result.reason, result.margin, result.bits)
    return result


def _doubled(ends: list[tuple[MeshModel, np.ndarray]], bits: int) -> tuple[int, Certificate]:
    """The number of the end, and the certificate, of an orbit of twice the period next to a flip."""
    beside = ((side, found) for side, (model, points) in enumerate(ends)
              for found in _neighbours(model, np.concatenate([points] * 2), bits)
              if distance(found[:len(points)], found[len(points):]) >= 1e-12)
    return first_proved(lambda trial: (trial[0], _proved(ends[trial[0]][0], as_floats(trial[1]), bits)), beside,
                        "orbit not found")


def _neighbours(model: MeshModel, points: np.ndarray, bits: int) -> list[Points]:
    """The points of different orbits of a model near points (n, d)."""
    with _equations(model, bits) as equations:
        return [candidate.points for candidate in neighbours(equations, lifted(points, equations.names))]


@contextmanager
def _equations(model: MeshModel, bits: int) -> Iterator[MeshEquations]:
    """The equations of a model, with the precision set."""
    with precision(bits):
        yield MeshEquations(exact_parameters(model), bits=bits)


def _fold(parameter: str, models: list[MeshModel], points: np.ndarray, bits: int) -> dict[str, Any]:
    """What is proved of a fold: two orbits at one end, and none at the other in a region about both."""
    for side, model in enumerate(models):
        with _equations(model, bits) as equations:
            start = lifted(points, equations.names)
        pair = sorted(_neighbours(model, points, bits), key=lambda found: distance(found, start))[:2]
        if len(pair) < 2:
            continue
        first, second = (_proved(model, as_floats(found), bits) for found in pair)
        if abs(first.outside - second.outside) != 1:
            raise UndecidedError("no change", 0.0)
        empty, n = _empty(models, side, [first, second], bits), first.period
        here, there = (("lower", "upper"), ("upper", "lower"))[side]
        outside = sorted((first.outside, second.outside))
        theorem = (
            f"At the {here} end of the interval of {parameter} there are two orbits of period {n} mesh periods in the "
            f"region listed (its radius, about {float(from_text(empty['radius'])):.3g}, from its centre in each "
            f"coordinate at each tau = k T), one with {outside[0]} and one with {outside[1]} multipliers outside the "
            f"unit circle. At the {there} end there is no orbit of period {n} in that region, and for no value of "
            f"{parameter} between is there one on its border: at some value an orbit in it has the multiplier 1.")
        ends = [[first, second], []]
        return {"below": ends[side], "above": ends[1 - side], "empty": empty, "theorem": theorem}
    raise UndecidedError("orbit not found", 0.0)


def _empty(models: list[MeshModel], side: int, pair: list[Certificate], bits: int) -> dict[str, Any]:
    """The region about the two orbits of an end that is proved to be empty at the other end, and closed between."""
    first, second = (fractions(found.document["points"]) for found in pair)
    centre = [[(a + b) / 2 for a, b in zip(p, q, strict=True)] for p, q in zip(first, second, strict=True)]
    radius = Fraction(_REGION * distance(first, second))
    low, high = map(exact_parameters, models)
    changes = line(low, high)
    halves = {name: change / 2 for name, change in changes.items()}
    there = shifted(low, {name: (1 - side) * change for name, change in changes.items()})
    for points, found in zip((first, second), pair, strict=True):
        room = radius - Fraction(distance(points, centre)) - Fraction(found.document["radius"])
        if not room > 0:
            raise UndecidedError("region not proved empty", float(room))
    with precision(bits):
        between, empty = MeshEquations(shifted(low, halves), bits=bits), MeshEquations(there, bits=bits)
        for equations in (between, empty):
            check_coordinates(equations, *pair)
        region = Region(between, centre, radius, halves)
        inside, border = region.not_empty(region.whole, border=True)
        _, slices = region.at(empty).not_empty(inside, border=False)
    return {"end": ("below", "above")[1 - side], "model": there, "radius": to_text(radius), "centre": texts(centre),
            "border": border, "slices": slices}
