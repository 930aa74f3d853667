"""The exception for wrong input. Failures of a computation, such as a diverging motion, are data and not exceptions."""

from __future__ import annotations

import difflib
import numbers
from collections.abc import Iterable

MOST = 2**53
"""Largest whole number that is accepted by default; up to it all whole numbers are floats."""


class InputError(ValueError):
    """A value from outside that breaks a rule.

    Parameters
    ----------
    field : str
        Name of the value: a parameter, an option, a key of a study file.
    rule : str
        The rule as the predicate of a sentence whose subject is the field, e.g. "must be greater than 0".
    value : object
        The value.
    advice : str
        What to do, or why the rule exists, in sentences; may be empty.
    """

    def __init__(self, field: str, rule: str, value: object, advice: str = "") -> None:
        self.field, self.rule, self.value, self.advice = field, rule, value, advice
        text = f"{field} {rule}; got {_shown(value)}."
        super().__init__(f"{text} {advice}".rstrip())

    def __reduce__(self):
        return type(self), (self.field, self.rule, self.value, self.advice)


_SHOWN = 200
"""Largest number of characters of a value in a message; of a longer one the beginning and the end are shown."""


def _shown(value: object) -> str:
    """A value as it stands in a message."""
    try:
        text = repr(value.item()) if hasattr(value, "item") and getattr(value, "size", 1) == 1 else repr(value)
    except ValueError:  # Python refuses to convert an integer of more than 4300 digits
        return "a number too long to show"
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN // 2]} … {text[-_SHOWN // 4 :]} ({len(text):,} characters)"


def whole_number(field: str, value: object, least: int, most: int = MOST) -> int:
    """The value as an int; raises `InputError` unless it is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < least:
        raise InputError(field, f"must be a whole number of at least {least}", value)
    if int(value) > most:
        raise InputError(field, f"must be at most {most:,}", value)
    return int(value)


def unknown_name(field: str, name: str, known: Iterable[str]) -> InputError:
    """The error for an unknown name, which lists the known ones and suggests the most similar one."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    advice = f"Did you mean {near[0]!r}?" if near else ""
    return InputError(field, f"must be one of {', '.join(known)}", name, advice)
