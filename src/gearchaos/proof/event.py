"""Proofs that an event of periodic orbits lies in an interval of a parameter: opposite proved facts at its two ends."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gearchaos.files import write_bytes
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import precision, to_text
from gearchaos.proof.certificate import Certificate, Unproved, checksum, used_versions
from gearchaos.proof.connection import connection
from gearchaos.proof.coordinates import lifted
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.exclusion import EmptyRegion, empty_region
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.prove import prove_orbit
from gearchaos.proof.search import as_floats, converged, distance, neighbours

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
    lower, upper = (End(end.model, end.value, _orbit_near(end, bits)) for end in ends)
    ends = lower, upper
    proved = [[_proved(end.model, end.points, bits)] for end in ends]
    (below,), (above,) = proved
    extra = ""
    if kind == "graze":
        if _sequence(below) == _sequence(above):
            raise NotProvedError(Unproved("no change", 0.0, bits))
    elif abs(below.outside - above.outside) != (1 if kind == "flip" else 2):
        raise NotProvedError(Unproved("no change", float(above.outside - below.outside), bits))
    if kind == "flip":
        side, doubled = _doubled(ends, bits)
        proved[side].append(doubled)
        extra = (f"At {('its lower', 'its upper')[side]} end there is an orbit that repeats after {doubled.period} "
                 f"mesh periods beside it, with {doubled.outside} multipliers outside.")
    link = None if kind == "graze" else _connection(below, above, bits)
    theorem = _change_in_words(kind, parameter, below, above, link is not None, extra)
    return _certificate(kind, theorem, parameter, ends, proved, None, link)


def _orbit_near(end: End, bits: int) -> np.ndarray:
    """The points (n, d) of the orbit at an end of the interval."""
    with _equations(end.model, bits) as equations:
        found = converged(equations, lifted(end.points, equations))
    if found is None:
        raise NotProvedError(Unproved("orbit not found", 0.0, bits))
    return as_floats(found.points)


def _proved(model: MeshModel, points: np.ndarray, bits: int) -> Certificate:
    """The certificate of an orbit; raises `NotProvedError` if it is not proved."""
    result = prove_orbit(model, points, bits)
    if isinstance(result, Unproved):
        raise NotProvedError(result)
    return result


def _connection(below: Certificate, above: Certificate, bits: int) -> dict[str, Any] | None:
    """The proof that the orbits at both ends are connected; raises `NotProvedError` if it fails."""
    try:
        return connection(below, above, bits)
    except UndecidedError as failure:
        raise NotProvedError(Unproved(failure.reason, failure.margin, bits)) from None


def _sequence(found: Certificate) -> list[list[tuple[int, str]]]:
    """The flanks and directions of the contact switches of each mesh period."""
    return [[(switch["flank"], switch["into"]) for switch in period] for period in found.document["switches"]]


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
        empty = _empty(ends[1 - side].model, pair, bits)
        theorem = _fold_in_words(parameter, side, first, second, empty)
        return _certificate("fold", theorem, parameter, ends, proved, empty)
    raise NotProvedError(Unproved("orbit not found", 0.0, bits))


def _nearest_two(end: End, bits: int) -> list[list[list[Fraction]]]:
    """The points of the two orbits nearest to the fold; fewer if they are not found."""
    with _equations(end.model, bits) as equations:
        start = lifted(end.points, equations)
        found = [candidate.points for candidate in neighbours(equations, start)]
    return sorted(found, key=lambda points: distance(points, start))[:2]


def _empty(model: MeshModel, pair: list[list[list[Fraction]]], bits: int) -> EmptyRegion:
    """The region about two orbits that is proved to be empty at the other end of the interval."""
    centre = [[(a + b) / 2 for a, b in zip(p, q, strict=True)] for p, q in zip(*pair, strict=True)]
    radius = Fraction(_REGION * distance(*pair))
    with _equations(model, bits) as equations:
        try:
            return empty_region(equations, centre, radius)
        except UndecidedError as failure:
            reason = "region not proved empty"
            raise NotProvedError(Unproved(reason, failure.margin, bits)) from None


def _certificate(
    kind: str, theorem: str, parameter: str, ends: tuple[End, End], proved: list[list[Certificate]],
    empty: EmptyRegion | None, link: dict[str, Any] | None = None,
) -> EventCertificate:
    """The certificate from its parts."""
    period = min(found.period for side in proved for found in side)
    document = {
        "format": FORMAT, "version": VERSION, "kind": kind, "theorem": theorem, "parameter": parameter,
        "interval": [end.value.hex() for end in ends], "period": period,
        "below": [found.document for found in proved[0]], "above": [found.document for found in proved[1]],
        "empty": None if empty is None else _empty_document(ends, proved, empty),
        "connection": link, "versions": used_versions(),
    }
    return EventCertificate({**document, "sha256": checksum(document)})


def _empty_document(ends: tuple[End, End], proved: list[list[Certificate]], empty: EmptyRegion) -> dict[str, Any]:
    """The empty region as it stands in a certificate."""
    side = 1 if proved[0] else 0
    return {"end": ("below", "above")[side], "model": exact_parameters(ends[side].model),
            "centre": [[to_text(v) for v in point] for point in empty.centre], "radius": to_text(empty.radius),
            "slices": empty.slices, "margin": f"{empty.margin:.3e}"}


def _change_in_words(
    kind: str, parameter: str, below: Certificate, above: Certificate, connected: bool, extra: str
) -> str:
    """The theorem of an event that changes the orbit."""
    n = below.period
    if kind == "graze":
        counts = [sum(map(len, c.document["switches"])) for c in (below, above)]
        what = (f"the teeth switch contact in different sequences, {counts[0]} times at the lower end and {counts[1]} "
                "times at the upper end")
    else:
        what = (f"{below.outside} multipliers lie outside the unit circle at the lower end and {above.outside} at the "
                "upper end")
    between = "" if not connected else (
        f"The two orbits are connected by exactly one orbit for each value of {parameter} between, and no multiplier "
        f"is 1: at some value {'a multiplier is -1' if kind == 'flip' else 'a multiplier lies on the unit circle'}.")
    return " ".join(filter(None, (
        f"At both ends of the interval of {parameter} there is exactly one orbit of period {n} mesh periods, and no "
        f"fewer, in the cubes listed, and {what}.", between, extra)))


def _fold_in_words(parameter: str, side: int, first: Certificate, second: Certificate, empty: EmptyRegion) -> str:
    """The theorem of a fold."""
    here, there = ("lower", "upper")[side], ("upper", "lower")[side]
    outside = sorted((first.outside, second.outside))
    return (f"At the {here} end of the interval of {parameter} there are two orbits of period {first.period} mesh "
            f"periods in the region listed, one with {outside[0]} and one with {outside[1]} multipliers outside the "
            f"unit circle. At the {there} end there is no orbit of period {first.period} in that region, within "
            f"{float(empty.radius):.3g} of its centre in each coordinate at each tau = k T.")
