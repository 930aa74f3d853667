"""One line of the benchmark."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """What was measured, the value, the goal and whether it was reached (None where there is none)."""

    name: str
    value: str
    goal: str = ""
    reached: bool | None = None

    def __str__(self) -> str:
        verdict = "" if self.reached is None else "  reached" if self.reached else "  MISSED"
        return f"{self.name:44} {self.value}" + (f"  [goal {self.goal}]{verdict}" if self.goal else "")
