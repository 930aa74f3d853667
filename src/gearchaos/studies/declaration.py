"""The function of a study, and the docstrings of both, from its class."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import MISSING
from inspect import Parameter, Signature
from typing import Any

from gearchaos.studies.options import Option, options_of
from gearchaos.studies.study import Study

_VALUE = "As a value"
"""The section of the docstring of a study with the example of the class; its function has the others."""

_ONE_POINT = "The operating point, with its initial values."
_OVER_AXES = "All parameters but those of the axes, and the initial values."
WIDTH = 120


def function_of(study: type[Study]) -> Callable[..., Any]:
    """The function that creates a study and computes it at once; the docstring of the class is completed as well.

    Signature and docstring are made from the fields of the class and from its docstring.
    """

    def function(*arguments: Any, **options: Any) -> Any:
        of_run = {o.name: options.pop(o.name) for o in study.run_options if o.name in options}
        return study(*arguments, **options).result(**of_run)

    function.__name__ = function.__qualname__ = study.kind
    function.__module__ = study.__module__
    sections = _sections(study)
    own = {title: text for title, text in sections.items() if title and title != _VALUE}
    function.__doc__ = _text(sections[""], {"Parameters": _parameters(study, study.run_options), **own})
    study.__doc__ = _class_text(study, sections)
    parameters = []
    for option in arguments(study, study.run_options):
        kind = Parameter.KEYWORD_ONLY if option.keyword else Parameter.POSITIONAL_OR_KEYWORD
        default = Parameter.empty if option.default is MISSING else option.default
        parameters.append(Parameter(option.name, kind, default=default, annotation=accepted(option)))
    function.__signature__ = Signature(parameters, return_annotation=study.returns)  # type: ignore[attr-defined]
    return function


def arguments(study: type[Study], of_run: Iterable[Option] = ()) -> list[Option]:
    """The arguments of a study in order: its model, its options, those of the run."""
    words = study.model_words or (_OVER_AXES if study.axis_fields else _ONE_POINT)
    return [Option("model", "AnyModel", MISSING, words, keyword=False), *options_of(study).values(), *of_run]


def accepted(option: Option) -> str:
    """The annotation of an argument: texts are accepted for axes."""
    return re.sub(r"\bAxis\b", "Axis | str", option.annotation)


def _sections(study: type[Study]) -> dict[str, str]:
    """The sections of the docstring of a class by title; "" is what stands before the first."""
    first, *titled = re.split(r"\n\n([A-Z][\w ]+)\n-+\n", textwrap.dedent(f"    {study.__doc__}").strip())
    return {"": first, **dict(zip(titled[::2], titled[1::2], strict=True))}


def _class_text(study: type[Study], sections: dict[str, str]) -> str:
    summary = (f"The study that `{study.kind}` runs.\n\nAs a value it can be kept, and given to `gearchaos.run`: "
               f"this computes it in memory or into a store.\n`{study.kind}` says what it finds.")
    raised = "InputError\n    If a field breaks a rule; before any work."
    return _text(
        summary, {"Parameters": _parameters(study), "Raises": raised, "Examples": sections.get(_VALUE, "")})


def _text(summary: str, sections: dict[str, str]) -> str:
    """A docstring in numpydoc's form, indented as in a function."""
    titled = [f"{title}\n{'-' * len(title)}\n{text}" for title, text in sections.items() if text]
    return textwrap.indent("\n\n".join([summary, *titled]), "    ").strip() + "\n    "


def _parameters(study: type[Study], of_run: Iterable[Option] = ()) -> str:
    """The section of parameters, from the words of the options."""
    entries = []
    for option in arguments(study, of_run):
        entries.append(f"{option.name} : {_type_words(option)}")
        entries += textwrap.wrap(option.words, WIDTH - 8, initial_indent="    ", subsequent_indent="    ")
    return "\n".join(entries)


def _type_words(option: Option) -> str:
    """The type of an option in numpydoc's words."""
    if option.annotation == "AnyModel":
        return "MeshModel, GearPair or GearDesign"
    text, optional = re.subn(r" \| None$", "", option.annotation)
    text = re.sub(r"Literal\[(.*)\]", r"{\1}", text)
    text = re.sub(r"Callable\[.*\]\]", "callable]", text)
    text = re.sub(r"\btuple\[(.*?)\]", r"(\1)", text)
    text = re.sub(r"Mapping\[str, (.*)\]", r"mapping of str to \1", text)
    return re.sub(r"\bAxis\b", "Axis or str", text) + (", optional" if optional else "")
