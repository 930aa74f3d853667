"""The pages of names, their units and rules, and of the tables and keys of study files, generated from the code."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from docstring_sections import entries, sections
from pages import code, generated, table

from gearchaos import quantities
from gearchaos.dynamics import Classification
from gearchaos.gears.design.gear_design import OPERATION, GearDesign
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import Body, Shaft
from gearchaos.gears.train.planets import PlanetarySet
from gearchaos.gears.train.train import Train
from gearchaos.model import MeshModel
from gearchaos.quantities import Quantity
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.options import file_options
from gearchaos.studies.core.registry import STUDIES
from gearchaos.studyfile import tables as schema

_SIMPLE = {float: "number", int: "whole number", str: "text", bool: "true or false",
           Axis: 'axis: text "NAME=START:STOP:COUNT"'}
_MUST = "required"

STUDY_FILE = """# Keys of study files

Every table and key that a study file may have, generated from the program. All tables are optional.
[The command line](/cli.md#study-file) has a commented example.

## `[model]`

{model}
The other keys are the [parameters](quantities.md#parameters), each a number.

### `[model.error]`

{error}
### `[model.stiffness]`

{stiffness}
## `[initial]`

Initial values by the names of the [coordinates](quantities.md#coordinates). Of a train `deflections` and
`deflection_rates`, tables of values by the names of meshes, 0 where the front flanks touch, and of shafts, the twist.
What is left out begins at the static deflection, at rest.

## `[gearpair]`

A pair in SI instead of `[model]`; see {{class}}`gearchaos.GearPair`. A value is a number in SI, of
the speed in rpm, or a text with a unit.

{gearpair}
## `[design]`

A pair as its drawing describes it; see {{class}}`gearchaos.GearDesign` and [the file](/gears.md#the-file).

{design}
## `[operation]`

`shaft_frequency` or `mesh_frequency`, in Hz or with a unit, may take the place of `speed`.

{operation}
## `[train]`

A [gear train](/trains.md) instead of `[model]`; see {{class}}`gearchaos.Train`. A value is a number in SI, a speed in
rpm, or a text with a unit. Keys of bodies, shafts and meshes are below.

{train}
### `[[train.bodies]]`

{bodies}
### `[[train.shafts]]`

{shafts}
### `[[train.meshes]]`

{meshes}
### `[train.planets]`

A planetary set, whose bodies and meshes are added to those of the tables; see {{class}}`gearchaos.PlanetarySet`.

{planets}
## `[study]`

{studies}
## `[classification]`

Lengths of runs in mesh periods; see {{class}}`gearchaos.Classification`. Values of single studies that differ are in
[verdicts](/verdicts.md#settings).

{classification}"""

QUANTITIES = """# Names, symbols and units

Every name that is set, varied or returned, generated from the program. Lengths are in units of half the backlash Δ
(`delta`), forces in c0 Δ, times in 1/ω0 or mesh periods T; the last unit is that of results of a gear pair in SI, see
{{func}}`gearchaos.physical`.

## Parameters

Defaults are those of the model `full`.

{parameters}
### Harmonics

A number follows the name: `eps1` … `eps64`.

{harmonics}
### Operating point of given gears

{operation}
## Coordinates

Positions and velocities; they are also the names of initial values.

{coordinates}
## Response measures

Measures of the steady motion.

{responses}
## Verdicts

The kind of motion and its evidence.

{verdicts}
## Other results

Variables of single kinds of results.

{results}"""


def type_words(annotation: Any) -> str:
    """The type of a key in the words of TOML."""
    origin, args = get_origin(annotation), [a for a in get_args(annotation) if a is not NoneType]
    if origin is Annotated:
        return type_words(args[0])
    if origin is Literal:
        return "one of " + ", ".join(f'"{value}"' for value in args)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(type_words(a) for a in args))
    if origin is Mapping:
        return "table: numbers by name"
    if origin in (list, tuple):
        return f"list: {type_words(args[0])}"
    return _SIMPLE.get(annotation, "table")


def default_words(value: Any) -> str:
    """A default as it is written in TOML; nothing for None, tables and empty lists."""
    if value is MISSING:
        return _MUST
    if isinstance(value, bool):
        return code(str(value).lower())
    if isinstance(value, tuple):
        return code(list(value)) if value else ""
    if isinstance(value, str):
        return code(f'"{value}"') if value else ""
    return code(f"{value:g}" if isinstance(value, float) else value) if isinstance(value, int | float) else ""


def plain(text: str) -> str:
    """The markup of a docstring as Markdown: code in single backticks, no stars or brackets with a meaning."""
    return text.replace("``", "`").replace("*", r"\*").replace("[", r"\[")


def keys(model: Any, names: Iterable[str] | None = None) -> str:
    """The keys of a table that pydantic checks: type and default."""
    rows = [[code(name), type_words(field.annotation), _MUST if field.is_required() else default_words(field.default)]
            for name, field in model.model_fields.items() if names is None or name in names]
    return table(["key", "type", "if left out"], rows)


def described(value: type, without: Iterable[str] = ()) -> str:
    """The keys of a table that a class checks, by the parameters in its docstring: dimension, words, default."""
    every = value.__dataclass_fields__.values()  # those given on creation alone included
    defaults = {f.name: f.default for f in every if f.name not in without}
    rows = []
    for entry in entries(sections(inspect.getdoc(value) or "")["Parameters"]):
        shared = [name for name in entry.names if name in defaults]
        if shared:
            left_out = default_words(defaults[shared[0]])
            rows.append([", ".join(map(code, shared)), plain(entry.type), plain(entry.words), left_out])
    return table(["key", "value", "meaning", "if left out"], rows)


def study(kind: str) -> str:
    """The keys of ``[study]`` for one kind of study."""
    rows = []
    for name, option in file_options(STUDIES[kind]).items():
        words = type_words(option.type) + ("" if option.least is None else f", at least {option.least}")
        rows.append([code(name), words, plain(option.words), default_words(option.default)])
    body = table(["key", "type", "meaning", "if left out"], rows) if rows else "No other keys.\n"
    return f'### `kind = "{kind}"`\n\n{body}'


def study_file_page() -> str:
    """Every table and key that a study file may have."""
    types = get_type_hints(Classification)
    rows = [[code(f.name), type_words(types[f.name]), default_words(f.default)] for f in fields(Classification)]
    return STUDY_FILE.format(
        model=keys(schema.ModelTable, {"kind", "damping_law"}), error=keys(schema.Series),
        stiffness=keys(schema.StiffnessTable),
        train=described(Train, ("bodies", "shafts", "meshes")), bodies=described(Body), shafts=described(Shaft),
        meshes=described(Mesh), planets=described(PlanetarySet), gearpair=described(GearPair),
        design=described(GearDesign, OPERATION),
        operation=described(GearDesign, set(GearDesign.__dataclass_fields__) - set(OPERATION)),
        studies="\n".join(study(kind) for kind in STUDIES), classification=table(["key", "type", "default"], rows))


def quantity_table(rows: Iterable[Quantity]) -> str:
    """A table of quantities: name, symbol, meaning and units."""
    return table(["name", "symbol", "meaning", "unit", "unit of a pair"], map(_cells, rows))


def _cells(q: Quantity) -> list[str]:
    """The cells of one quantity."""
    words = q.long_name or q.title or q.axis_name
    return [code(q.name), q.symbol, words, q.unit, q.physical.unit if q.physical else ""]


def parameter_table() -> str:
    """The parameters, with defaults and rules."""
    defaults = MeshModel.of("full").parameters()
    rows = []
    for q in (*quantities.PARAMETERS, *quantities.STIFFNESS_PARAMETERS):
        rule = "" if q.rule is None else q.rule.text.removeprefix("must ").removeprefix("be ").removeprefix("lie ")
        default = f"{defaults[q.name]:g}" if q.name in defaults else ""
        rows.append([*_cells(q), default, rule.replace("not be", "not")])
    return table(["name", "symbol", "meaning", "unit", "unit of a pair", "default", "rule"], rows)


def quantities_page() -> str:
    """Every name a user meets: parameters, coordinates and variables of results."""
    return QUANTITIES.format(
        parameters=parameter_table(), harmonics=quantity_table(quantities.HARMONICS.values()),
        operation=quantity_table((*quantities.OPERATION, *quantities.GEARS)),
        coordinates=quantity_table(quantities.COORDINATES), responses=quantity_table(quantities.RESPONSES),
        verdicts=quantity_table(quantities.VERDICTS), results=quantity_table(quantities.RESULTS))


def setup(app: Any) -> dict[str, Any]:
    """Write both pages before Sphinx reads the sources."""
    generated(app, "study-file", study_file_page)
    generated(app, "quantities", quantities_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
