"""The function of a study, and the docstrings of both, from its class."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import MISSING
from inspect import Parameter, Signature
from typing import Any

from gearchaos.studies.core.options import Option, options_of
from gearchaos.studies.core.study import Study

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
    first, *titled = re.split(r"\n\n([A-Z][\w ]+)\n-+\n", textwrap.dedent(f"    {study.__doc__}").strip())
    sections = dict(zip(titled[::2], titled[1::2], strict=True))
    example = sections.pop(_VALUE, "")
    taken = arguments(study, study.run_options)
    function.__doc__ = _text(first, {"Parameters": _parameters(taken), **sections})
    study.__doc__ = _text(
        f"The study that `{study.kind}` runs.\n\nAs a value it can be kept, and given to `gearchaos.run`: "
        f"this computes it in memory or into a store.\n`{study.kind}` says what it finds.",
        {"Parameters": _parameters(arguments(study)),
         "Raises": "InputError\n    If a field breaks a rule; before any work.", "Examples": example})
    kinds = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)
    function.__signature__ = Signature([  # type: ignore[attr-defined]
        Parameter(o.name, kinds[o.keyword], default=Parameter.empty if o.default is MISSING else o.default,
                  annotation=accepted(o)) for o in taken], return_annotation=study.returns)
    return function


def arguments(study: type[Study], of_run: Iterable[Option] = ()) -> list[Option]:
    """The arguments of a study in order: its model, its options, those of the run."""
    words = study.model_words or (_OVER_AXES if study.axis_fields else _ONE_POINT)
    return [Option("model", "AnyModel", MISSING, words, keyword=False), *options_of(study).values(), *of_run]


def accepted(option: Option) -> str:
    """The annotation of an argument: texts are accepted for axes."""
    return re.sub(r"\bAxis\b", "Axis | str", option.annotation)


def _text(summary: str, sections: dict[str, str]) -> str:
    """A docstring in numpydoc's form, indented as in a function."""
    titled = [f"{title}\n{'-' * len(title)}\n{text}" for title, text in sections.items() if text]
    return textwrap.indent("\n\n".join([summary, *titled]), "    ").strip() + "\n    "


_TYPE_WORDS = (
    ("^AnyModel$", "MeshModel, GearPair, GearDesign or Train"), (r" \| None$", ", optional"),
    (r"Literal\[(.*)\]", r"{\1}"), (r"Callable\[.*\]\]", "callable]"), (r"\btuple\[(.*?)\]", r"(\1)"),
    (r"Mapping\[str, (.*)\]", r"mapping of str to \1"), (r"\bAxis\b", "Axis or str"),
)
"""What replaces the parts of an annotation, one after another, in numpydoc's words."""


def _parameters(options: Iterable[Option]) -> str:
    """The section of parameters, from the words of the options."""
    entries = []
    for option in options:
        words = option.annotation
        for pattern, replacement in _TYPE_WORDS:
            words = re.sub(pattern, replacement, words)
        entries.append(f"{option.name} : {words}")
        entries += textwrap.wrap(option.words, WIDTH - 8, initial_indent="    ", subsequent_indent="    ")
    return "\n".join(entries)
