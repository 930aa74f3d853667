"""What the proof of a periodic orbit gives: a certificate that anybody can check, or why there is none."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from gearchaos.files import write_bytes

FORMAT, VERSION = "gearchaos certificate", 1

REASONS = {
    "Newton diverged": "Newton's method did not converge to an orbit from the points given",
    "section on the contact boundary": "at a section, teeth may just touch: choose another phase of the section",
    "tangency undecided": "teeth may touch without a switch, or switch twice: the motion grazes a contact boundary",
    "windows overlap": "the time windows of two contact switches overlap",
    "too many switches": "there are more than 500 contact switches in a mesh period",
    "Krawczyk not contracting": "Krawczyk's operator does not map the cubes about the points into themselves",
    "period not minimal": "two points of the orbit cannot be told apart: its minimal period may be smaller",
    "neutral": "a multiplier may lie on the unit circle",
    "too many steps": "the mesh period is too long for the fastest rates of the model: more than 2000 steps",
    "bits exhausted": "rounding errors are too large, even at the largest precision allowed",
}
"""The reasons for which an orbit is not proved."""

CHAOS_REASONS = {
    "no saddle": "no saddle of a small period was found",
    "no homoclinic orbit": "no homoclinic orbit of a saddle was found with sets along it that cover each other",
    "covering not proved": "too few of the sets found are proved to cover each other",
}
"""Further reasons for which a chaotic set is not proved."""

EVENT_REASONS = {
    "orbit not found": "an orbit that the event joins was not found at an end of the interval",
    "no change": "what is proved at both ends of the interval is the same: the event lies elsewhere",
    "region not proved empty": "the region about the fold may contain an orbit beyond it",
    "coordinates not the same": "in the box a coordinate acts on z that does not at its centre: vary both wheels alike",
}
"""Further reasons for which an event or a box of parameters is not proved."""


@dataclass(frozen=True)
class Unproved:
    """A periodic orbit or a chaotic set that is not proved; nothing is known to be false."""

    proved: ClassVar[bool] = False
    reason: str  # one of `REASONS`, `EVENT_REASONS` or `CHAOS_REASONS`
    margin: float  # what should have been positive; at most 0, or not a number where it could not be computed
    bits: int = 0  # the largest precision tried

    def __bool__(self) -> bool:
        """False, so that ``if prove(model):`` asks whether there is a proof."""
        return False

    def in_words(self) -> str:
        """The result in a sentence."""
        return f"not proved, {self.reason}: {self.meaning} (margin {self.margin:.2g}, {self.bits} bits)"

    @property
    def meaning(self) -> str:
        """The reason in words."""
        return (REASONS | EVENT_REASONS | CHAOS_REASONS)[self.reason]

    def to_dict(self) -> dict[str, Any]:
        return {"proved": False, "reason": self.reason, "meaning": self.meaning, "margin": self.margin,
                "bits": self.bits}


class UndecidedError(Exception):
    """A property that could not be proved, with the reason and the margin of `Unproved`.

    ``bits`` is the largest precision tried, if it is not the present one.
    """

    def __init__(self, reason: str, margin: float, bits: int | None = None) -> None:
        super().__init__(reason, margin)
        self.reason, self.margin, self.bits = reason, margin, bits

    def unproved(self, bits: int) -> Unproved:
        """The result of a proof that failed at this precision."""
        return Unproved(self.reason, self.margin, self.bits or bits)


Trial = TypeVar("Trial")
Result = TypeVar("Result")


def first_proved(prove: Callable[[Trial], Result], trials: Iterable[Trial], reason: str) -> Result:
    """The result for the first trial that is proved; raises the last `UndecidedError`, or this one if none is tried."""
    failure = UndecidedError(reason, 0.0)
    for trial in trials:
        try:
            return prove(trial)
        except UndecidedError as error:
            failure = error
    raise failure


@dataclass(frozen=True, eq=False)
class Theorem:
    """What is proved: the base of all certificates."""

    proved: ClassVar[bool] = True
    document: dict[str, Any]  # the certificate in the form in which it is written, see ``docs/proofs.md``

    theorem = property(lambda self: self.document["theorem"], doc="What is proved, in words.")
    bits = property(lambda self: self.document["bits"], doc="The precision of the proof in bits.")

    def in_words(self) -> str:
        """The theorem, with the precision of its proof."""
        return f"proved with {self.bits} bits. {self.theorem}"

    def selected(self, *names: str, **others: Any) -> dict[str, Any]:
        """A summary as JSON-ready values: entries of the document, other values, and its checksum."""
        chosen = {name: self.document[name] for name in names}
        return {"proved": True, **chosen, **others, "sha256": self.document["sha256"]}

    def write(self, path: str | Path) -> None:
        """Write the certificate to a JSON file: ``gearchaos verify`` checks those of orbits and chaotic sets."""
        write_bytes(Path(path), (json.dumps(self.document, indent=1) + "\n").encode())


@dataclass(frozen=True, eq=False)
class Certificate(Theorem):
    """A proved periodic orbit."""

    period = property(lambda self: self.document["period"], doc="The minimal period in mesh periods.")
    radius = property(lambda self: float(self.document["radius"]),
                      doc="Half the edge of the cubes in which the orbit is unique.")
    inside = property(lambda self: self.document["stability"]["inside"], doc="Multipliers inside the unit circle.")
    outside = property(lambda self: self.document["stability"]["outside"], doc="Multipliers outside the unit circle.")

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        return self.selected("theorem", "period", radius=self.radius, bits=self.bits, inside=self.inside,
                             outside=self.outside)

    def __repr__(self) -> str:
        return f"Certificate({self.period}T, radius={self.document['radius']}, bits={self.bits})"


class Proved(IntEnum):
    """Whether the motion of a cell of a map is proved to be periodic."""

    NOT_PERIODIC = -1
    NOT_PROVED = 0
    PROVED = 1


NO_REASON = 0  # code of the reason where there is none: the motion is proved, or its verdict is not periodic
INFERRED = 1  # code of the reason of a periodic motion that was inferred from neighbouring cells, not computed
REASON_CODES = {
    NO_REASON: "none", INFERRED: "inferred", 2: "Newton diverged", 3: "section on the contact boundary",
    4: "tangency undecided", 5: "windows overlap", 6: "too many switches", 7: "Krawczyk not contracting",
    8: "period not minimal", 9: "neutral", 10: "bits exhausted", 11: "too many steps",
}
"""The reasons for which a periodic motion is not proved, by their codes in files of results. New ones are appended."""


def checksum(document: dict[str, Any]) -> str:
    """SHA-256 of the canonical JSON of a certificate without its checksum."""
    rest = {name: value for name, value in document.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode("ascii")).hexdigest()


@cache
def used_versions() -> dict[str, str]:
    """The versions of the programs that made a certificate."""
    names = ("gearchaos", "python-flint", "numpy")
    return {"python": platform.python_version(), **{name: version(name) for name in names}}


def with_checksum(document: dict[str, Any]) -> dict[str, Any]:
    """A certificate with the versions of the programs that made it, and its checksum."""
    document = {**document, "versions": used_versions()}
    return {**document, "sha256": checksum(document)}
