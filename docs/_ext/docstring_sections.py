"""The sections of a docstring in numpydoc's form."""

from __future__ import annotations

import re
from typing import NamedTuple

_TITLE = re.compile(r"^([A-Z][\w ]+)\n-+$", re.MULTILINE)
_ENTRY = re.compile(r"^(\S.*?)(?: : (.*))?$")


class Entry(NamedTuple):
    """One entry of a list of parameters or attributes."""

    names: tuple[str, ...]
    type: str
    words: str


def sections(docstring: str) -> dict[str, str]:
    """The texts of the sections by title; "" is what stands before the first one."""
    parts = _TITLE.split(docstring)
    titled = zip(parts[1::2], parts[2::2], strict=True)
    return {"": parts[0].strip(), **{title: text.strip("\n") for title, text in titled}}


def entries(text: str) -> list[Entry]:
    """The entries of a section such as "Parameters", from its text."""
    out: list[Entry] = []
    for line in text.splitlines():
        found = _ENTRY.match(line)
        if found:
            names = tuple(name.strip().lstrip("*") for name in found[1].split(","))
            out.append(Entry(names, found[2] or "", ""))
        elif out and line.strip():
            out[-1] = out[-1]._replace(words=f"{out[-1].words} {line.strip()}".strip())
    return out
