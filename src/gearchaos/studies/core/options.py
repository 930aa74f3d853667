"""The options of a study: each stands once, as a field of its class, with its default, its rule and its words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cache
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from gearchaos.errors import LARGEST_INTEGER, InputError, unknown_name, whole_number
from gearchaos.quantities import Rule
from gearchaos.studies.core.axis import Axis, as_axis, as_range
from gearchaos.validation import check_rule, to_float

RANGE = 2
"""Number of values of an axis of which only the ends count."""


@dataclass(frozen=True)
class Option:
    """One option of a study, or of its run (`Study.run_options`)."""

    name: str
    annotation: str  # its type as it is written in the class
    default: Any  # `dataclasses.MISSING` if it must be given
    words: str  # what it means; the first sentence is the help of commands
    type: Any = None  # without None
    least: int | None = None  # bounds of a whole number
    most: int = LARGEST_INTEGER
    rule: Rule | None = None  # what a number must satisfy
    keyword: bool = True  # given by name only
    metavar: str = ""  # how commands write its value, where the type does not say it
    in_files: bool = True  # study files and commands can set it; others are for Python alone
    file_only: str = ""  # why it has an effect only on the file that a command writes; empty if it has another
    is_path: bool = False  # a text is the path of a file, which a study file gives relative to its folder
    is_axis: bool = False
    count: int | None = None  # of the values of an axis whose text has none; by default a text must have one

    def checked(self, value: Any, field: str = "") -> Any:
        """A value in the type of the option; raises `InputError` if it breaks its rule. None is kept if it may be left
        out; ``field`` names the value in the message."""
        field = field or self.name
        if value is None and (self.default is None or self.annotation.endswith("| None")):
            return None
        if self.type is Axis:
            return as_axis(value, field) if self.count is None else as_range(value, field, self.count)
        if self.least is not None:
            return whole_number(field, value, self.least, self.most)
        if self.rule is not None:
            check_rule(field, number := to_float(field, value), self.rule)
            return number
        if self.type is bool and not isinstance(value, bool):
            raise InputError(field, "must be true or false", value)
        if self.choices and value not in self.choices:
            raise unknown_name(field, str(value), self.choices)
        return value

    @property
    def choices(self) -> tuple[str, ...]:
        """The values of which it has one; none for other types."""
        return get_args(self.type) if get_origin(self.type) is Literal else ()


def option(
    default: Any, words: str, *, least: int | None = None, most: int = LARGEST_INTEGER, rule: Rule | None = None,
    keyword: bool = True, metavar: str = "", in_files: bool = True, file_only: str = "",
    is_path: bool = False,
) -> Any:
    """A field of a study; see `Option`."""
    return field(default=default, kw_only=keyword, metadata={
        "words": words, "least": least, "most": most, "rule": rule, "metavar": metavar, "in_files": in_files,
        "file_only": file_only, "is_path": is_path})


def axis_option(words: str, count: int | None = None) -> Any:
    """A field of a study that is one of its axes; see `Option`."""
    return field(metadata={"words": words, "is_axis": True, "count": count})


@cache
def options_of(study: type) -> dict[str, Option]:
    """The options of a study by name, in the order of its arguments; its model is none of them."""
    types = get_type_hints(study)
    own: Sequence[Field[Any]] = [f for f in fields(study) if f.metadata]
    out = {}
    for f in sorted(own, key=lambda f: (bool(f.kw_only), f.name == "settings")):
        given = [t for t in get_args(types[f.name]) if t is not NoneType]
        without_none = given[0] if NoneType in get_args(types[f.name]) else types[f.name]
        literal = ", ".join(f'"{choice}"' for choice in get_args(without_none))  # also of a type with a name
        text = str(f.type) if get_origin(without_none) is not Literal else (
            f"Literal[{literal}]{' | None' * (NoneType in get_args(types[f.name]))}")
        out[f.name] = Option(f.name, text, f.default, type=without_none, keyword=bool(f.kw_only), **f.metadata)
    return out


def file_options(study: type) -> dict[str, Option]:
    """Those of the options of a study that the table ``[study]`` of a study file can set."""
    return {name: each for name, each in options_of(study).items() if each.in_files and name != "settings"}
