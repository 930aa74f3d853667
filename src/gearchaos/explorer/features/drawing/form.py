"""The form of a drawing: its rows as a page shows them, and what stands beside them."""

from __future__ import annotations

from typing import Any, NamedTuple

from gearchaos.explorer.core.drawing import Drawing, Reading
from gearchaos.explorer.core.form_inputs import GROUPS, Input, inputs


class Box(NamedTuple):
    """A row of the form: an input, its numbers as texts, and the unit that is chosen."""

    input: Input
    texts: list[str]
    unit: str


def form(drawing: Drawing) -> list[tuple[str, list[Box]]]:
    """The rows of a form by heading, filled with a drawing."""
    return [(heading, [_box(each, drawing[key]) for key, each in inputs().items() if key.split(".")[1] in names])
            for heading, names in GROUPS.items()]


def _box(given: Input, text: str) -> Box:
    texts, unit = given.parts(text)
    count = 1 + given.reader.both
    return Box(given, [*texts, *[""] * count][:count], unit)


def marks(reading: Reading) -> dict[str, Any]:
    """What stands in and beside each row, by key: what is assumed in each box while it is empty, the message about the
    row, and what else is to be said of it; a message that is about no row has the key ""."""
    out = {"": {"assumed": [], "error": reading.errors.get("", ""), "note": ""}}
    for key in inputs():
        assumed = reading.assumed.get(key, "").split(" / ")
        out[key] = {"assumed": ["needed"] * len(assumed) if key in reading.needed else assumed,
                    "error": reading.errors.get(key, ""),
                    "note": reading.needed.get(key, "") or reading.because.get(key, "")}
    return out
