"""Messages of the library, which speak of study files, in the words of a form: its labels, no TOML."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from gearchaos.errors import InputError

_QUOTED = r"""(?:'[^']*'|"[^"]*")"""
_FILES = rf"(?:, or |,? or |, )(?:\w+ = )?\{{ \w+ = {_QUOTED} \}}"  # tables that a form does not take, as another way
_WRITTEN = (
    (r",? or a plain number in [^ ,.]+", ""), (_FILES, ""), (r"\[(?:design|operation)\] ", ""),
    (r"\w+ = \{ ", ""), (r"\{ ?| ?\}", ""), (r"\ba list of ", ""), (r"\bbe a table with ", "have "))
"""What is said of the writing of a file, and what a form says instead."""

_NUMBER = re.compile(r"-?\d+(\.\d*)?(e[-+]\d+)?")
_MARKS = "'\""  # of quotation
_GOT = "\0"  # where the value that was given stands in a message
Label = Callable[[str], str]
"""A function that gives the label of a name on the form; empty for a name that it does not have."""


def in_form_words(text: str, label: Label) -> str:
    """A message with the labels of a form, in quotes, in the place of names."""
    def named(found: re.Match[str]) -> str:
        name, wheel, value = found["name"], found["wheel"], found["value"]
        words = f"“{known}”" if (known := label(name)) else name.replace("_", " ")
        of = f" of wheel {int(wheel) + 1}" if wheel else ""
        given = value if "," in value else value.strip(_MARKS)
        return f"{words}{of}" + (f": {given}" if value else "")

    for pattern, words in _WRITTEN:
        text = re.sub(pattern, words, text)
    text = re.sub(rf"\b(?P<name>[a-z]\w*)(?P<wheel>)(?: = |': )(?P<value>{_QUOTED}|[\d.]+\b)", named, text)
    text = re.sub(r"\b(?P<name>[a-z]{2,}(?:_[a-z]{2,})*)\[(?P<wheel>[01])\](?P<value>)", named, text)
    text = re.sub(r"\b(?P<name>[a-z]{2,}(?:_[a-z]{2,})+)\b(?P<wheel>)(?P<value>)", named, text)
    return re.sub(r"(?<!\w)'([^']*)'(?!\w)", r"“\1”", text).replace("*", " ").replace(" um", " µm")


def error_in_form_words(error: InputError, label: Label, unit: str = "", named: bool = False) -> str:
    """An error beside an input, whose plain numbers are in a ``unit``; its subject is ``named`` if it is not the input.
    """
    def shown(value: Any) -> str:
        if isinstance(value, Mapping):
            return ", ".join(f"{name} = {each!r}" for name, each in value.items())
        if isinstance(value, (tuple, list)):
            return " / ".join(map(shown, value))
        plain = not isinstance(value, str) and _NUMBER.fullmatch(str(value))  # a length says its unit by itself
        return f"{value:g} {unit}".rstrip() if plain else str(value)

    subject, wheel = (error.field, "") if named else ("", re.search(r"\[([01])\]", error.field))
    got = "" if error.value is None else shown(error.value)
    if not isinstance(error.value, str):
        got = in_form_words(got, label)
    of = f"of wheel {int(wheel[1]) + 1} " if wheel else ""
    said = in_form_words(f"{subject} {of}{error.rule}{_GOT * bool(got)}. {error.advice}".strip(), label)
    return said.replace(_GOT, f"; got {got.replace('*', ' ').replace(' um', ' µm')}")  # as it was written

