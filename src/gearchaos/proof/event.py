"""Proofs that an event of periodic orbits lies in an interval of a parameter: opposite proved facts at its two ends."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gearchaos.files import write_bytes
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import from_text, precision, to_text
from gearchaos.proof.candidate import Candidate
from gearchaos.proof.certificate import Certificate, Unproved, checksum, used_versions
from gearchaos.proof.connection import along, check_coordinates, connection, line
from gearchaos.proof.coordinates import lifted
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.exclusion import Region
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.prove import prove_orbit
from gearchaos.proof.search import as_floats, converged, distance, neighbours
from gearchaos.proof.section import at_phase

FORMAT, VERSION = "gearchaos event certificate", 1
KINDS = ("flip", "fold", "graze", "neimark-sacker")

_REGION = 3
"""Half the edge of the region of a fold, in distances of the two orbits."""


@dataclass(frozen=True, eq=False)
class EventCertificate:
    """An event that is proved to lie in an interval of a parameter.

    Attributes
    ----------
    document : dict
        The certificate as it is written; ``below`` and ``above`` have the certificates of the orbits proved at the ends
        of the interval, each of which ``gearchaos verify`` checks by itself.
    """

    proved: ClassVar[bool] = True
    document: dict[str, Any]

    @property
    def theorem(self) -> str:
        """What is proved, in words."""
        return self.document["theorem"]

    @property
    def kind(self) -> str:
        """One of `KINDS`."""
        return self.document["kind"]

    @property
    def interval(self) -> tuple[float, float]:
        """The ends of the interval of the parameter."""
        low, high = map(float.fromhex, self.document["interval"])
        return low, high

    def certificates(self) -> list[Certificate]:
        """The certificates of the orbits at the lower end of the interval, then at the upper end."""
        return [Certificate(d) for end in ("below", "above") for d in self.document[end]]

    def in_words(self) -> str:
        """The theorem."""
        return f"proved. {self.theorem}"

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        names = ("kind", "theorem", "parameter", "interval", "period", "empty", "sha256")
        return {"proved": True, **{name: self.document[name] for name in names}}

    def write(self, path: str | Path) -> None:
        """Write the certificate to a JSON file."""
        write_bytes(Path(path), (json.dumps(self.document, indent=1) + "\n").encode())

    def __repr__(self) -> str:
        return f"EventCertificate({self.kind}, {self.document['parameter']} in {list(self.interval)})"


class NotProvedError(Exception):
    """A fact that could not be proved, with the `Unproved` that says why."""

    def __init__(self, result: Unproved) -> None:
        super().__init__(result.in_words())
        self.result = result


@dataclass(frozen=True)
class End:
    """An end of the interval of the parameter.

    Attributes
    ----------
    model : MeshModel
    value : float
        The parameter.
    points : (n, d)
        Approximate states at τ = k T of the orbit that the event happens to.
    """

    model: MeshModel
    value: float
    points: np.ndarray


def prove_event_facts(
    kind: str, parameter: str, models: list[tuple[MeshModel, float]], points: np.ndarray, bits: int
) -> EventCertificate | Unproved:
    """Prove what is different at the two ends of an interval of a parameter.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    parameter : str
        Its name.
    models : list of (MeshModel, float)
        The models at the lower and the upper end, with the values of the parameter.
    points : (n, d)
        Approximate states at τ = k T of the orbit at the event.
    bits : int
        First precision of the proofs.
    """
    lower, upper = (End(model, value, points) for model, value in models)
    try:
        if kind == "fold":
            return _fold(parameter, (lower, upper), bits)
        return _change(kind, parameter, (lower, upper), bits)
    except NotProvedError as failure:
        return failure.result


def _change(kind: str, parameter: str, ends: tuple[End, End], bits: int) -> EventCertificate:
    """The certificate of an event that changes the orbit: a flip, a graze or a Neimark-Sacker bifurcation."""
    orbits = [_orbit_near(end, bits) for end in ends]
    lower, upper = (replace(end, points=as_floats(o.points)) for end, o in zip(ends, orbits, strict=True))
    ends, phase = (lower, upper), _free_phase(orbits) if kind == "graze" else 0.0
    proved = [[_proved(end.model, end.points, bits, phase)] for end in ends]
    (below,), (above,) = proved
    counts = [len(_sequence(found)) for found in (below, above)]
    if kind == "graze":
        same = _is_rotation(_sequence(below), _sequence(above))
    else:
        same = abs(below.outside - above.outside) != (1 if kind == "flip" else 2)
    if same:
        raise NotProvedError(Unproved("no change", float(above.outside - below.outside), bits))
    extra = ""
    if kind == "flip":
        side, doubled = _doubled(ends, bits)
        proved[side].append(doubled)
        extra = (f"At {('its lower', 'its upper')[side]} end there is an orbit that repeats after {doubled.period} "
                 f"mesh periods beside it, with {doubled.outside} multipliers outside.")
    try:
        start = (below if counts[0] > counts[1] else above) if kind == "graze" else None
        link = connection(below, above, bits, start)
    except UndecidedError as failure:
        raise NotProvedError(Unproved(failure.reason, failure.margin, bits)) from None
    theorem = _change_in_words(kind, parameter, below, above, extra)
    return _certificate(kind, theorem, parameter, ends, proved, None, link)


def _orbit_near(end: End, bits: int) -> Candidate:
    """The orbit at an end of the interval."""
    with _equations(end.model, bits) as equations:
        found = converged(equations, lifted(end.points, equations))
    if found is None:
        raise NotProvedError(Unproved("orbit not found", 0.0, bits))
    return found


def _free_phase(orbits: list[Candidate]) -> float:
    """The phase of the section, in mesh periods, that is farthest from all contact switches of orbits."""
    times = sorted(float(s.time.mid()) for orbit in orbits for motion in orbit.trajectories for s in motion.switches)
    gaps = [(after - before, before) for before, after in pairwise([*times, *(time + 1 for time in times[:1])])]
    gap, before = max(gaps, default=(0.0, 0.0))
    return (before + gap / 2) % 1


def _proved(model: MeshModel, points: np.ndarray, bits: int, phase: float = 0.0) -> Certificate:
    """The certificate of an orbit at a phase of the section; raises `NotProvedError` if it is not proved."""
    shifted = at_phase(model, points, phase) if phase else points
    if shifted is None:
        raise NotProvedError(Unproved("orbit not found", 0.0, bits))
    result = prove_orbit(model, shifted, bits, phase)
    if isinstance(result, Unproved):
        raise NotProvedError(result)
    return result


def _sequence(found: Certificate) -> list[tuple[int, str]]:
    """The flanks and directions of the contact switches over the period of an orbit."""
    return [(switch["flank"], switch["into"]) for period in found.document["switches"] for switch in period]


def _is_rotation(first: list[Any], second: list[Any]) -> bool:
    """Whether two sequences are the same up to where they begin."""
    return len(first) == len(second) and any(first[k:] + first[:k] == second for k in range(max(1, len(first))))


def _doubled(ends: tuple[End, End], bits: int) -> tuple[int, Certificate]:
    """The number of the end, and the certificate, of an orbit of twice the period next to a flip."""
    failure = Unproved("orbit not found", 0.0, bits)
    for side, end in enumerate(ends):
        for candidate in _neighbours(end.model, np.concatenate([end.points] * 2), bits):
            half = len(end.points)
            if distance(candidate[:half], candidate[half:]) < 1e-12:
                continue
            result = prove_orbit(end.model, as_floats(candidate), bits)
            if isinstance(result, Certificate):
                return side, result
            failure = result
    raise NotProvedError(failure)


def _neighbours(model: MeshModel, points: np.ndarray, bits: int) -> Iterator[list[list[Fraction]]]:
    """The points of different orbits of a model near points (n, d)."""
    with _equations(model, bits) as equations:
        for candidate in list(neighbours(equations, lifted(points, equations))):
            yield candidate.points


@contextmanager
def _equations(model: MeshModel, bits: int) -> Iterator[MeshEquations]:
    """The equations of a model, with the precision set."""
    with precision(bits):
        yield MeshEquations(exact_parameters(model), bits=bits)


def _fold(parameter: str, ends: tuple[End, End], bits: int) -> EventCertificate:
    """The certificate of a fold: two orbits at one end, and none at the other in a region about both."""
    for side, end in enumerate(ends):
        pair = _nearest_two(end, bits)
        if len(pair) < 2:
            continue
        proved: list[list[Certificate]] = [[], []]
        proved[side] = [_proved(end.model, as_floats(points), bits) for points in pair]
        first, second = proved[side]
        if abs(first.outside - second.outside) != 1:
            raise NotProvedError(Unproved("no change", 0.0, bits))
        empty = _empty(ends, side, proved[side], bits)
        theorem = _fold_in_words(parameter, side, first, second, empty)
        return _certificate("fold", theorem, parameter, ends, proved, empty)
    raise NotProvedError(Unproved("orbit not found", 0.0, bits))


def _nearest_two(end: End, bits: int) -> list[list[list[Fraction]]]:
    """The points of the two orbits nearest to the fold; fewer if they are not found."""
    with _equations(end.model, bits) as equations:
        start = lifted(end.points, equations)
        found = [candidate.points for candidate in neighbours(equations, start)]
    return sorted(found, key=lambda points: distance(points, start))[:2]


def _empty(ends: tuple[End, End], side: int, pair: list[Certificate], bits: int) -> dict[str, Any]:
    """The region about the two orbits of an end that is proved to be empty at the other end, and closed between."""
    first, second = ([[from_text(text) for text in point] for point in found.document["points"]] for found in pair)
    centre = [[(a + b) / 2 for a, b in zip(p, q, strict=True)] for p, q in zip(first, second, strict=True)]
    radius = Fraction(_REGION * distance(first, second))
    low, high = (exact_parameters(end.model) for end in ends)
    changes = line(low, high)
    halves = {name: change / 2 for name, change in changes.items()}
    there, middle = along(low, changes, Fraction(1 - side)), along(low, halves, Fraction(1))
    try:
        for points, found in zip((first, second), pair, strict=True):
            room = radius - Fraction(distance(points, centre)) - Fraction(found.document["radius"])
            if not room > 0:
                raise UndecidedError("region not proved empty", float(room))
        with precision(bits):
            between, empty = MeshEquations(middle, bits=bits), MeshEquations(there, bits=bits)
            for equations in (between, empty):
                check_coordinates(equations, *pair)
            region = Region(between, centre, radius, halves)
            inside, border = region.not_empty(region.whole, border=True)
            _, slices = region.at(empty).not_empty(inside, border=False)
    except UndecidedError as failure:
        raise NotProvedError(Unproved(failure.reason, failure.margin, bits)) from None
    return {"end": ("below", "above")[1 - side], "model": there, "radius": to_text(radius),
            "centre": [[to_text(v) for v in point] for point in centre], "border": border, "slices": slices}


def _certificate(
    kind: str, theorem: str, parameter: str, ends: tuple[End, End], proved: list[list[Certificate]],
    empty: dict[str, Any] | None, link: dict[str, Any] | None = None,
) -> EventCertificate:
    """The certificate from its parts."""
    period = min(found.period for side in proved for found in side)
    document = {
        "format": FORMAT, "version": VERSION, "kind": kind, "theorem": theorem, "parameter": parameter,
        "interval": [end.value.hex() for end in ends], "period": period,
        "below": [found.document for found in proved[0]], "above": [found.document for found in proved[1]],
        "empty": empty, "connection": link, "versions": used_versions(),
    }
    return EventCertificate({**document, "sha256": checksum(document)})


def _change_in_words(kind: str, parameter: str, below: Certificate, above: Certificate, extra: str) -> str:
    """The theorem of an event that changes the orbit."""
    n = below.period
    if kind == "graze":
        counts = [len(_sequence(found)) for found in (below, above)]
        what = (f"the teeth switch contact in different sequences, {counts[0]} times at the lower end and {counts[1]} "
                "times at the upper end")
        event = "teeth touch or part without speed"
    else:
        what = (f"{below.outside} multipliers lie outside the unit circle at the lower end and {above.outside} at the "
                "upper end")
        event = "a multiplier is -1" if kind == "flip" else "a multiplier lies on the unit circle"
    between = (f"The two orbits are connected by exactly one orbit for each value of {parameter} between, and no "
               f"multiplier is 1: at some value {event}.")
    return " ".join(filter(None, (
        f"At both ends of the interval of {parameter} there is exactly one orbit of period {n} mesh periods, and no "
        f"fewer, in the cubes listed, and {what}.", between, extra)))


def _fold_in_words(parameter: str, side: int, first: Certificate, second: Certificate, empty: dict[str, Any]) -> str:
    """The theorem of a fold."""
    here, there = ("lower", "upper")[side], ("upper", "lower")[side]
    outside, n = sorted((first.outside, second.outside)), first.period
    return (f"At the {here} end of the interval of {parameter} there are two orbits of period {n} mesh periods in the "
            f"region listed (its radius, about {float(from_text(empty['radius'])):.3g}, from its centre in each "
            f"coordinate at each tau = k T), one with {outside[0]} and one with {outside[1]} multipliers outside the "
            f"unit circle. At the {there} end there is no orbit of period {n} in that region, and for no value of "
            f"{parameter} between is there one on its border: at some value an orbit in it has the multiplier 1.")
