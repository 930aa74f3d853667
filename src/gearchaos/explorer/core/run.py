"""The run-up that a page plays: between which speeds, how long, up only or down again, with sound or without."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.explorer.core.bounds import LONGEST_RUN, bounded, finite_number

WAYS = {"up": "up", "down": "up and down"}
"""Whether a run-down follows, each with its words in the menu."""

_SECONDS = 10.0  # of the run-up that a page offers first


@dataclass(frozen=True)
class Run:
    """A run-up between two speeds in rpm; `InputError` if a value is not accepted.

    `RunUp` refuses what the gears do not allow.
    """

    start: float
    stop: float
    duration: float = _SECONDS  # of the run-up, and of the run-down too, s
    way: str = "up"  # one of `WAYS`
    sound: bool = False

    def __post_init__(self) -> None:
        if self.way not in WAYS:
            raise unknown_name("run-up", str(self.way)[:40], WAYS)
        for end in (self.start, self.stop):
            bounded("speed", end)
        if not self.start < self.stop:
            raise InputError("run-up", "must lead to a higher speed", f"{self.start:g}:{self.stop:g}")
        if not 0 < self.duration <= LONGEST_RUN / self.ways:
            raise InputError("run-up duration", f"must lie in (0, {LONGEST_RUN / self.ways:g}] s in the explorer",
                             self.duration, "With the run-down it counts twice.")

    @property
    def ways(self) -> int:
        """1 for a run-up, 2 with its run-down."""
        return 1 + (self.way == "down")

    @classmethod
    def parse(cls, text: str) -> Run:
        """The run-up that `str` writes for an address."""
        ends, _, rest = text.partition(",")
        (start, colon, stop), parts = ends.partition(":"), rest.split(",")
        if not colon or len(parts) not in (2, 3) or parts[2:] not in ([], ["sound"]):
            raise InputError("run", "must read start:stop,duration,way", text[:60], "E.g. 500:6000,10,up,sound.")
        numbers = [finite_number("run", part) for part in (start, stop, parts[0])]
        return cls(numbers[0], numbers[1], numbers[2], parts[1], parts[2:] == ["sound"])

    def __str__(self) -> str:
        return f"{self.start!r}:{self.stop!r},{self.duration!r},{self.way}{',sound' * self.sound}"

    def values(self) -> dict[str, Any]:
        """What the page shows of it, by the name of the field."""
        return {"start": self.start, "stop": self.stop, "duration": self.duration, "way": self.way, "sound": self.sound}
