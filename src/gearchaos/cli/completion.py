"""Completion of the values of options in shells: names of parameters, of variables of results, and choices.

A name that is the only possible one is completed together with a value, NAME=VALUE: Bash would otherwise put a space
after the equals sign.
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

from gearchaos.quantities import COORDINATES, HARMONICS, OPERATION, PARAMETERS, RESPONSES, VERDICTS, Quantity

Completer = Callable[[typer.Context, str], list[str]]

_COMPLETE = "_GEARCHAOS_COMPLETE"
"""The environment variable by which a shell asks for completions."""

_GEARS, _KINDS = ("design", "operation", "gearpair"), ("single", "torsional", "full")
"""Tables of study files with gears, and kinds of models."""

_OF_PAIRS = tuple(q for q in COORDINATES if not q.name.startswith("rotation"))
"""The coordinates of pairs: turning as a whole is one of trains."""

_EXAMPLES = {"speed": "1500", "torque": "100"}
"""Values of the parameters that have no default."""

_name_before = ""
"""The name before the equals sign, if the shell completes only what follows it."""


def join_words() -> None:
    """Join the words into which Bash splits NAME=VALUE, before its question is answered: it splits at = and at colons.

    Of the word to be completed only what follows the equals sign is left; the name before it is kept here.
    """
    global _name_before
    if os.environ.get(_COMPLETE) != "complete_bash":
        return
    words, current = os.environ.get("COMP_WORDS", "").split("\n"), int(os.environ.get("COMP_CWORD", "0"))
    joined: list[str] = []
    for word in words[: current + 1]:
        if joined and (word[:1] in ("=", ":") or joined[-1][-1:] in ("=", ":")):
            joined[-1] += word
        else:
            joined.append(word)
    name, equals, rest = joined[-1].partition("=")
    if equals and words[current] != joined[-1]:
        _name_before, joined[-1] = name, rest
    os.environ["COMP_WORDS"], os.environ["COMP_CWORD"] = "\n".join(joined), str(len(joined) - 1)


def choices(*values: str) -> Completer:
    """The completion of an option that has one of these values."""
    def complete(context: typer.Context, incomplete: str) -> list[str]:
        return [v for v in values if v.startswith(incomplete)]

    return complete


def colours(context: typer.Context, incomplete: str) -> list[str]:
    """Names of the variables that `gearchaos plot` can show, of the result on the command line where it can be read."""
    names: Collection[str] = (*(q.name for q in (*RESPONSES, *VERDICTS)), "attractors", "hysteresis",
                              "contact_worst", "to_avoid", "share_of_load_changes")
    path = Path(_argument(context))
    try:
        if path.is_dir():
            own = set(json.loads((path / "run/study.json").read_bytes())["arrays"])
        else:
            import h5py  # a tenth of a second, where xarray takes one

            with h5py.File(path) as file:
                own = set(file)
        names = [name for name in names if name in own]
    except (OSError, ValueError, LookupError, TypeError):
        pass
    return [n for n in ("motion", *names) if n.startswith(incomplete)]


def _argument(context: typer.Context) -> str:
    """The file on the command line; an option without its value, which is to be completed, leaves it unassigned."""
    given = [text for text in (*context.params.values(), *context.args) if isinstance(text, (str, Path))]
    return str(next((text for text in given if os.path.exists(text)), ""))


def values(context: typer.Context, incomplete: str) -> list[str]:
    """NAME=VALUE for ``--set``: kinds of models, damping laws, parameters, initial values, the operating point of
    gears, and the values of the gears of the study file on the command line."""
    from gearchaos.model import DAMPING_LAWS

    try:
        tables = tomllib.loads(Path(_argument(context)).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        tables = {}
    given = {"kind": _KINDS, "damping_law": tuple(DAMPING_LAWS),
             **dict(_assigned({name: tables[name] for name in _GEARS if name in tables}))}
    return _assignments(incomplete, [*given, *map(_first, (*_values(), *_OF_PAIRS, *OPERATION))], _default, given)


def _assigned(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, tuple[str, ...]]]:
    """Names and values of a table and those in it, e.g. design.quality.grade; of values only numbers, which no shell
    splits."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _assigned(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", (f"{value}" if isinstance(value, (int, float)) else "",)


def starts(context: typer.Context, incomplete: str) -> list[str]:
    """NAME=VALUE for ``--start``: initial values."""
    return _assignments(incomplete, [q.name for q in _OF_PAIRS], _default, {})


def axes(context: typer.Context, incomplete: str) -> list[str]:
    """NAME=START:STOP:COUNT for ``--axis``, over the range that the explorer offers."""
    rows = {_first(q): q for q in (*_values(), *_OF_PAIRS, *OPERATION)}
    return _assignments(incomplete, rows, lambda name: _range(rows[name]) + ":200", {})


def ranges(context: typer.Context, incomplete: str) -> list[str]:
    """NAME=START:STOP for ``--axis`` of commands that follow something along a parameter."""
    rows = {_first(q): q for q in (*_values(), *OPERATION)}
    return _assignments(incomplete, rows, lambda name: _range(rows[name]), {})


def _assignments(
    incomplete: str, names: Iterable[str], value: Callable[[str], str], given: dict[str, tuple[str, ...]]
) -> list[str]:
    """Completions of NAME=VALUE; ``given`` has the values of names that have a choice of them."""
    name, equals, rest = (_name_before, "=", incomplete) if _name_before else incomplete.partition("=")
    found = [n for n in names if (n == name if equals else n.startswith(name))]
    if len(found) != 1:
        return [f"{n}=" for n in found]
    texts = [v for v in given.get(found[0]) or (value(found[0]),) if v.startswith(rest)]
    return texts if _name_before else [f"{found[0]}={v}" for v in texts]


def _values() -> tuple[Quantity, ...]:
    """The parameters of all models; those of the mesh stiffness are known once its kinds are imported."""
    from gearchaos.model import STIFFNESS_KINDS

    rows = {row.name: row for kind in STIFFNESS_KINDS.values() for row in kind.rows}.values()
    return (*PARAMETERS, *rows, *HARMONICS.values())


def _first(row: Quantity) -> str:
    """The name of a parameter; of a family of harmonics that of order 1."""
    return f"{row.name}1" if row.name in HARMONICS else row.name


def _range(row: Quantity) -> str:
    """START:STOP of the range that the explorer offers."""
    assert row.range is not None
    return f"{row.range.low:g}:{row.range.high:g}"


def _default(name: str) -> str:
    """The default value of a parameter or initial value."""
    if name in _EXAMPLES:
        return _EXAMPLES[name]
    if name in {q.name for q in _OF_PAIRS}:
        return "1" if name == "x1" else "0"
    from gearchaos.model import MeshModel, default_stiffness

    return f"{MeshModel(stiffness=default_stiffness([name])).value(name):g}"
