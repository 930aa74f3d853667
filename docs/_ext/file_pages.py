"""The pages of names, their units and rules, and of the tables and keys of study files, generated from the code."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from dataclasses import MISSING, fields
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from numpydoc.docscrape import NumpyDocString
from pages import code, generated, table

from gearchaos import quantities
from gearchaos.dynamics import Classification
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.pair import GearPair
from gearchaos.model import MeshModel
from gearchaos.quantities import Quantity
from gearchaos.studies.registry import STUDIES
from gearchaos.studyfile import tables as schema


def type_words(annotation: Any) -> str:
    """The type of a key in the words of TOML."""
    origin, args = get_origin(annotation), [a for a in get_args(annotation) if a is not NoneType]
    if origin is Annotated:
        least = next((m.ge for field in get_args(annotation)[1:] for m in getattr(field, "metadata", [])
                      if hasattr(m, "ge")), None)
        return type_words(args[0]) + ("" if least is None else f", at least {least}")
    if origin is Literal:
        return "one of " + ", ".join(f'"{value}"' for value in args)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(type_words(a) for a in args))
    if origin in (list, tuple):
        return f"list: {type_words(args[0])}"
    simple = {float: "number", int: "whole number", str: "text", bool: "true or false", Any: "number, or text with a unit"}
    return simple.get(annotation, "table")


def _keys(model: Any, names: Iterable[str] | None = None) -> str:
    """The keys of a table of a study file, with type and default."""
    rows = []
    for name, field in model.model_fields.items():
        if names is None or name in names:
            default = "must be given" if field.is_required() else default_words(field.default)
            rows.append([code(name), type_words(field.annotation), default])
    return table(["key", "type", "if left out"], rows)


def default_words(value: Any) -> str:
    """A default as it is written in TOML; nothing for None, tables and empty lists."""
    if isinstance(value, bool):
        return code(str(value).lower())
    if isinstance(value, str):
        return code(f'"{value}"') if value else ""
    return code(value) if isinstance(value, int | float) else ""


def _study(kind: str) -> str:
    """The keys of ``[study]`` for one kind of study."""
    study, rows = STUDIES[kind], []
    declared, types = {f.name: f for f in fields(study)}, study.option_types()
    for name in study.axis_fields:
        rows.append([code(name), 'axis: text "NAME=START:STOP:COUNT"', "must be given"])
    for name, type_ in types.items():
        if declared[name].metadata:
            least = declared[name].metadata["least"]
            words = type_words(type_) if type_.__name__ != "Axis" else 'axis: text "NAME=START:STOP:COUNT"'
            default = declared[name].default
            rows.append([code(name), words + ("" if least is None else f", at least {least}"),
                         "must be given" if default is MISSING else default_words(default)])
    body = table(["key", "type", "if left out"], rows) if rows else "No other keys.\n"
    return f'### `kind = "{kind}"`\n\n{body}'


def study_file_page() -> str:
    """Every table and key that a study file may have."""
    defaults = Classification()
    rows = [[code(f.name), type_words(f.type if not isinstance(f.type, str) else
             {"int": int, "tuple[int, ...]": list[int]}[f.type]), code(getattr(defaults, f.name))]
            for f in fields(Classification)]
    return "\n".join([
        "# Keys of study files", "",
        "Every table and key that a study file may have, generated from the program. [The command line](/cli.md#study-file)",
        "has a commented example. All tables are optional.", "",
        "## `[model]`", "", "Numbers are the [parameters](quantities.md#parameters).", "",
        _keys(schema.ModelTable, {"kind"}), "",
        "### `[model.error]`", "", _keys(schema.Series), "", "### `[model.stiffness]`", "", _keys(schema.StiffnessTable), "",
        "## `[initial]`", "", "Initial values by the names of the [coordinates](quantities.md#coordinates).", "",
        "## `[gearpair]`", "", "A pair with its own units instead of `[model]`; see {class}`gearchaos.GearPair`.", "",
        _described(GearPair, {f.name for f in fields(GearPair)}), "",
        "## `[design]`", "", "A pair as its drawing describes it; see {class}`gearchaos.GearDesign` and",
        "[the file](/gears.md#the-file).", "", _described(GearDesign, {f.name for f in fields(GearDesign)} - {"speed", "torque"}), "",
        "## `[operation]`", "",
        table(["key", "value", "meaning"],
              [[code(q.name), f"number with a unit, e.g. in {q.unit}", q.long_name] for q in quantities.OPERATION]),
        "", "## `[study]`", "", *(_study(kind) + "\n" for kind in STUDIES),
        "## `[classification]`", "", "Lengths of runs in mesh periods; see {class}`gearchaos.Classification`. The values of",
        "a study that differ are in [verdicts](/verdicts.md#settings).", "",
        table(["key", "type", "default"], rows)])


def _described(value: type, names: set[str]) -> str:
    """The keys of a table that a class checks, by the parameters in its docstring: dimension, words, default."""
    defaults = {f.name: f.default if f.default_factory is MISSING else None for f in fields(value)}  # type: ignore[arg-type]
    rows = []
    for parameter in NumpyDocString(inspect.getdoc(value) or "")["Parameters"]:
        shared = [name.strip() for name in parameter.name.split(",")]
        if not names.intersection(shared):
            continue
        default = defaults[shared[0]]
        left_out = "must be given" if default is MISSING else default_words(default)
        words = plain(" ".join(parameter.desc))
        rows.append([", ".join(code(name) for name in shared), plain(parameter.type), words, left_out])
    return table(["key", "value", "meaning", "if left out"], rows)


def plain(text: str) -> str:
    """The markup of a docstring as Markdown: code in single backticks, no stars or brackets with a meaning."""
    return text.replace("``", "`").replace("*", r"\*").replace("[", r"\[")


def _quantity(q: Quantity, defaults: dict[str, float] | None) -> list[str]:
    """The cells of one quantity."""
    words = q.long_name or q.title or q.axis_name
    cells = [code(q.name), q.symbol, words, q.unit, q.physical.unit if q.physical else ""]
    if defaults is not None:
        rule = "" if q.rule is None else q.rule.text.removeprefix("must ").removeprefix("be ")
        rule = rule.removeprefix("lie ").replace("not be", "not")
        cells += ["" if q.name not in defaults else f"{defaults[q.name]:g}", rule]
    return cells


_HEADER = ["name", "symbol", "meaning", "unit", "unit of a pair"]
_SECTIONS = (
    ("Coordinates", "COORDINATES", "Positions and velocities; they are also the names of initial values."),
    ("Response measures", "RESPONSES", "Measures of the steady motion."),
    ("Verdicts", "VERDICTS", "The kind of motion and its evidence."),
    ("Other results", "RESULTS", "Variables of single kinds of results."),
)


def quantities_page() -> str:
    """Every name a user meets: parameters, coordinates and variables of results."""
    defaults = MeshModel.of("full").parameters()
    parameters = [*quantities.PARAMETERS, *quantities.STIFFNESS_LEVELS]
    parts = ["# Names, symbols and units", "",
             "Every name that is set, varied or returned, generated from the program. Lengths are in units of half the",
             "backlash Δ (`delta`), forces in c0 Δ, times in 1/ω0 or mesh periods T; the last unit is that of results of a",
             "gear pair in SI, see {func}`gearchaos.physical`.", "",
             "## Parameters", "", table([*_HEADER, "default (`full`)", "rule"], [_quantity(q, defaults) for q in parameters]),
             "### Harmonics", "", "A number follows the name: `eps1` … `eps64`.", "",
             table(_HEADER, [_quantity(q, None) for q in quantities.HARMONICS.values()]),
             "### Operating point of given gears", "",
             table(_HEADER, [_quantity(q, None) for q in (*quantities.OPERATION, *quantities.GEARS)])]
    for title, name, words in _SECTIONS:
        rows = [_quantity(q, None) for q in getattr(quantities, name)]
        parts += [f"## {title}", "", words, "", table(_HEADER, rows)]
    return "\n".join(parts)


def setup(app: Any) -> dict[str, Any]:
    """Write both pages before Sphinx reads the sources."""
    generated(app, "study-file", study_file_page)
    generated(app, "quantities", quantities_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
