"""Writes what follows from the classes of studies: public names, stub, catalogue of commands, lists of the manual.

``python -m gearchaos.studies.core.generate`` writes the files; a test compares them with what it would write.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable
from dataclasses import MISSING
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import gearchaos
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.declaration import WIDTH, accepted, arguments
from gearchaos.studies.core.options import Option, file_options
from gearchaos.studies.core.study import Study

_PACKAGE = Path(gearchaos.__file__).parent


def all_studies() -> list[type[Study]]:
    """The classes of all studies, in the order in which they are used."""
    found = set[type[Study]]()
    for module in walk_packages(import_module("gearchaos.studies").__path__, "gearchaos.studies."):
        names = vars(import_module(module.name)).values()
        found |= {v for v in names if isinstance(v, type) and issubclass(v, Study) and "kind" in vars(v)}
    return sorted(found, key=lambda study: (study.rank, study.kind))


def catalogue() -> str:
    """The module `gearchaos.catalogue`: what the public names and the commands need of studies, without their code."""
    entries = {study.kind: entry_of(study) for study in all_studies()}
    return f'''"""All studies by kind: where each stands, and what its command takes.

``python -m gearchaos.studies.core.generate`` writes this from the classes of the studies. It is all that public names
and commands need of them: nothing slow is loaded for them.
"""

from typing import Any

STUDIES: dict[str, dict[str, Any]] = {{
{"".join(f"    {kind!r}: {_literal(entry, 4)},{chr(10)}" for kind, entry in entries.items())}}}
'''


def entry_of(study: type[Study]) -> dict[str, Any]:
    """What the catalogue says of a study; of one of another package commands and study files ask for it here."""
    options = file_options(study).values()
    return {
        "module": study.__module__.removeprefix("gearchaos."), "class": study.__name__,
        "help": _first_sentence(_docstring(study)), "group": study.group, "needs_out": study.needs_out,
        "summary": study.summary,
        "axes": {o.name: o.count for o in options if o.is_axis},
        "options": {o.name: _command_option(o) for o in options if not o.is_axis},
        "run_options": {o.name: _command_option(o) for o in study.run_options if o.type is not None},
    }


def _literal(value: Any, indent: int) -> str:
    """A table as it is written in Python: the tables in it stand on lines of their own, other entries share lines."""
    text, room = repr(value), WIDTH - indent - 5
    if not isinstance(value, dict) or len(text) < room - 15:
        return text
    lines: list[str] = []
    tables: list[str] = []
    for name, each in value.items():
        entry = f"{name!r}: {_literal(each, indent + 4)},"
        if isinstance(each, dict):
            tables.append(entry)
        elif lines and len(lines[-1]) + len(entry) < room:
            lines[-1] += f" {entry}"
        else:
            lines.append(entry)
    return "\n".join(["{", *(f"{' ' * (indent + 4)}{line}" for line in [*lines, *tables]), f"{' ' * indent}}}"])


def _docstring(study: type[Study]) -> str:
    """The docstring of the function of a study, or of its class if it has none."""
    return str(vars(import_module(study.__module__)).get(study.kind, study).__doc__)


def _first_sentence(text: str) -> str:
    """The first sentence of a text, on one line and without markup."""
    return re.split(r"(?<=\.) ", " ".join(text.split()).replace("`", ""))[0]


def _command_option(option: Option) -> dict[str, Any]:
    """What a command needs to know of an option: its type, as `gearchaos.cli.studies` names it, its words, how its
    value is written, its choices."""
    words, default = _first_sentence(option.words), option.default
    if not (default is MISSING or isinstance(default, bool) or default in (None, ())):
        values = default if isinstance(default, tuple) else (default,)
        written = " and ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)
        words = f"{words[:-1]}; {written} by default."
    named = {"axis": option.type is Axis, "table": option.is_path, "values": "Mapping" in option.annotation,
             "str": bool(option.choices), "part": "PathLike" in option.annotation}
    found = {
        "type": next((name for name, holds in named.items() if holds), option.annotation.removesuffix(" | None")),
        "help": words, "metavar": option.metavar or "|".join(option.choices), "choices": option.choices,
        "least": option.least, "required": default is MISSING, "file_only": option.file_only,
    }
    return {name: value for name, value in found.items() if value not in ("", (), None) and value is not False}


_STUB_HEAD = '''"""The public names for type checkers and editors; at run time ``__init__`` imports them on first use.

``python -m gearchaos.studies.core.generate`` writes this from the names there and from the classes of the studies.
"""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Literal

import xarray as xr
'''


def stub(modules: dict[str, str], subpackages: Iterable[str]) -> str:
    """The text of ``gearchaos/__init__.pyi``, from the module of each public name that is no study."""
    studies = all_studies()
    imported = [("gearchaos", name, f" as {name}") for name in subpackages]
    imported += [(f"gearchaos.{module}", name, f" as {name}") for name, module in modules.items()]
    imported += [(study.__module__, study.__name__, f" as _{study.__name__}") for study in studies]
    imported += [("gearchaos.continuation.orbit", "Orbit", ""), ("gearchaos.continuation.saddles", "EdgeState", ""),
                 ("gearchaos.gears.operation.operating", "AnyModel", "")]
    parts = [f"from {module} import {name}{own}" for module, name, own in sorted(imported)]
    parts += ["", "__version__: str", ""]
    for study in studies:
        function = _signature(f"def {study.kind}(", arguments(study, study.run_options), f") -> {study.returns}:")
        made = _signature("    def __init__(", arguments(study), ") -> None: ...", "self")
        words = f'"""{_first_sentence(_docstring(study))}"""'
        parts += [f"{function}\n    {words}\n", f"class {study.__name__}(_{study.__name__}):\n    {words}\n\n{made}\n"]
    return "\n".join([_STUB_HEAD, *parts])


def _signature(start: str, options: Iterable[Option], end: str, *written: str) -> str:
    """A signature in lines of at most `WIDTH` characters; ``written`` are arguments before the options."""
    taken = [*written]
    for option in options:
        if option.keyword and "*" not in taken:
            taken.append("*")
        default = "" if option.default is MISSING else f" = {option.default!r}"
        taken.append(f"{option.name}: {accepted(option)}{default}")
    indent = " " * (len(start) - len(start.lstrip()) + 4)
    lines = textwrap.wrap(", ".join(taken) + ",", WIDTH, initial_indent=indent, subsequent_indent=indent)
    return "\n".join([start, *lines, indent[4:] + end])


def files() -> dict[Path, str]:
    """The text of each file that is written from the studies."""
    manual = _PACKAGE.parents[1] / "docs/reference/api.rst"
    studies = all_studies()
    listed = "".join(f"   gearchaos.{study.kind}\n" for study in studies)
    values = "".join(f"   gearchaos.{study.__name__}\n" for study in studies)
    text = _between(manual.read_text(encoding="utf-8"), "functions of studies", listed)
    return {
        _PACKAGE / "catalogue.py": catalogue(),
        _PACKAGE / "__init__.pyi": stub(*(vars(gearchaos)[name] for name in ("_OTHERS", "_SUBPACKAGES"))),
        manual: _between(text, "classes of studies", values),
    }


def _between(text: str, mark: str, lines: str) -> str:
    """A page of the manual with other lines in the list below a mark."""
    before, _, rest = text.partition(f".. {mark}\n")
    head, _, after = rest.partition("   :nosignatures:\n\n")
    return f"{before}.. {mark}\n{head}   :nosignatures:\n\n{lines}\n{after.partition(chr(10) * 2)[2]}"


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
