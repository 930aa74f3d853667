"""Misuse is an exception that says what to do; a failure of the domain is data, never an exception."""

from __future__ import annotations

import difflib
import numbers
from collections.abc import Iterable

MOST = 2**53
"""The largest whole number taken where nothing lower is said: floats still tell it from the next."""


class InputError(ValueError):
    """A value from outside breaks a rule; names the field, the rule, the value and what to do."""

    def __init__(self, field: str, rule: str, value: object, advice: str = "") -> None:
        self.field, self.rule, self.value, self.advice = field, rule, value, advice
        text = f"{field} {rule}; got {_shown(value)}."
        super().__init__(f"{text} {advice}".rstrip())

    def __reduce__(self):
        return type(self), (self.field, self.rule, self.value, self.advice)


_SHOWN = 200
"""So many characters of a value are shown, of a longer one its beginning and its end."""


def _shown(value: object) -> str:
    try:
        text = repr(value.item()) if hasattr(value, "item") and getattr(value, "size", 1) == 1 else repr(value)
    except ValueError:  # Python writes no whole number of more than some thousand digits
        return "a number too long to show"
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN // 2]} … {text[-_SHOWN // 4 :]} ({len(text):,} characters)"


def whole_number(field: str, value: object, least: int, most: int = MOST) -> int:
    """The value as an int, if it is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < least:
        raise InputError(field, f"must be a whole number of at least {least}", value)
    if int(value) > most:
        raise InputError(field, f"must be at most {most:,}", value)
    return int(value)


def unknown_name(field: str, name: str, known: Iterable[str]) -> InputError:
    """The error for a name that does not exist, with the nearest known one as advice."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    advice = f"Did you mean {near[0]!r}?" if near else ""
    return InputError(field, f"must be one of {', '.join(known)}", name, advice)
