"""The options of a study: each stands once, as a field of its class, with its default, its rule and its words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from gearchaos.errors import LARGEST_INTEGER, InputError, unknown_name, whole_number
from gearchaos.quantities import Rule
from gearchaos.studies.axis import Axis, as_axis, as_range
from gearchaos.validation import check_rule, to_float

RANGE = 2
"""Number of values of an axis of which only the ends count."""


@dataclass(frozen=True)
class Option:
    """One option of a study.

    Attributes
    ----------
    name : str
    annotation : str
        Its type as it is written in the class, or for an option of the run in `Study.run_options`.
    default
        `dataclasses.MISSING` if it must be given.
    words : str
        What it means; the first sentence is the help of commands.
    type
        Its type without None.
    least, most : int, optional
        Bounds of a whole number.
    rule : Rule, optional
        What a number must satisfy.
    keyword : bool
        Whether it is given by name only.
    metavar : str
        How commands write its value, where the type does not say it.
    in_files : bool
        Whether study files and commands can set it; others are for Python alone.
    file_only : str
        Why it has an effect only on the file that a command writes; empty if it has another.
    is_axis : bool
        Whether it is one of the axes of the study.
    count : int, optional
        Number of values of an axis whose text has none; by default a text must have one.
    """

    name: str
    annotation: str
    default: Any
    words: str
    type: Any = None
    least: int | None = None
    most: int = LARGEST_INTEGER
    rule: Rule | None = None
    keyword: bool = True
    metavar: str = ""
    in_files: bool = True
    file_only: str = ""
    is_axis: bool = False
    count: int | None = None

    def checked(self, value: Any, field: str = "") -> Any:
        """A value in the type of the option; raises `InputError` if it breaks its rule. None is kept if it may be left
        out; ``field`` names the value in the message."""
        field = field or self.name
        if value is None and self.default is None:
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
) -> Any:
    """A field of a study; see `Option`."""
    return field(default=default, kw_only=keyword, metadata={
        "words": words, "least": least, "most": most, "rule": rule, "metavar": metavar, "in_files": in_files,
        "file_only": file_only})


def axis_option(words: str, count: int | None = None) -> Any:
    """A field of a study that is one of its axes; see `Option`."""
    return field(metadata={"words": words, "is_axis": True, "count": count})


@cache
def options_of(study: type) -> dict[str, Option]:
    """The options of a study by name, in the order of its arguments; its model is none of them."""
    types = get_type_hints(study)
    own: Sequence[Field[Any]] = [f for f in fields(study) if f.metadata]
    ordered = sorted(own, key=lambda f: (bool(f.kw_only), f.name == "settings"))
    return {f.name: Option(f.name, str(f.type), f.default, type=_without_none(types[f.name]), keyword=bool(f.kw_only),
                           **f.metadata) for f in ordered}


def file_options(study: type) -> dict[str, Option]:
    """Those of the options of a study that the table ``[study]`` of a study file can set."""
    return {name: each for name, each in options_of(study).items() if each.in_files and name != "settings"}


def _without_none(annotation: Any) -> Any:
    """An annotation without the alternative None."""
    types = [t for t in get_args(annotation) if t is not NoneType]
    return types[0] if NoneType in get_args(annotation) else annotation


def check_given(values: Mapping[str, Any], known: Mapping[str, Option], kind: str) -> None:
    """Raise `InputError` for an option that a study does not have, or one that is missing."""
    for name in values:
        if name not in known:
            raise unknown_name("study option", name, known)
    for name, each in known.items():
        if name not in values and each.default is MISSING:
            raise InputError(f"study.{name}", "must be given", None, f"A study of kind {kind!r} needs it.")
