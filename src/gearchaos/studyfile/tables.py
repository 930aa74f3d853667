"""The layout of a study file: its tables and keys as pydantic models, whose errors are turned into `InputError`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from gearchaos.catalogue import STUDIES
from gearchaos.errors import InputError, all_of, unknown_name
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.model import DEFAULT_LAW, SCALARS, STIFFNESS_KINDS, Stiffness
from gearchaos.quantities import PARAMETERS, find
from gearchaos.studies.core.generate import entry_of
from gearchaos.studies.core.registry import study_class


class _Table(BaseModel):
    """A table of a study file: unknown keys are refused, and types must match exactly."""

    model_config = ConfigDict(extra="forbid", strict=True)


class Series(_Table):
    """A Fourier series, one amplitude and one phase in radians per harmonic: ``[model.error]``."""

    amplitudes: list[float] = []
    phases: list[float] = []


_KEY_TYPES: dict[str, Any] = {
    "int": int, "float": float, "bool": bool, "str": str, "axis": str, "values": dict[str, float],
    "tuple[int, int]": list[int], "tuple[str, ...]": list[str | dict[str, Any]],
    "tuple[float, ...]": list[float | str], "tuple[tuple[str, str, float], ...]": list[list[str | float]],
    "table": str | dict[str, list[float]],
}
"""The types of keys of ``[study]``, by the type of an option in the catalogue of studies."""


def _study_table(entries: Mapping[str, dict[str, Any]]) -> Any:
    """``[study]``, with axes and options of these kinds of studies, each with its type and no default."""
    keys: dict[str, Any] = {}
    leasts: dict[str, list[int | None]] = {}
    types: dict[str, Any] = {}  # all that a key has in the studies that take it
    for entry in entries.values():
        keys |= dict.fromkeys(entry["axes"], (str | None, None))
        for name, option in entry["options"].items():
            leasts.setdefault(name, []).append(option.get("least"))
            type_ = Literal[option["choices"]] if "choices" in option else _KEY_TYPES[option["type"]]
            type_ = types[name] = type_ if types.get(name, type_) == type_ else types[name] | type_
            bounds = [least for least in leasts[name] if least is not None]
            bounded = len(bounds) == len(leasts[name])  # by all studies that take it
            keys[name] = (Annotated[type_, Field(ge=min(bounds))] | None if bounded else type_ | None, None)
    return create_model(
        "_StudyTable",
        __base__=_Table,
        kind=(Literal[tuple(entries)], ...),  # type: ignore[arg-type,valid-type]
        **keys,
    )


class _ClassificationTable(_Table):
    """``[classification]``; see `Classification`."""

    transient_lengths: list[int] | None = None
    longest_period: int | None = None
    exponent_run: int | None = None
    doublings: int | None = None
    longest_transient: int | None = None
    averaging_periods: int | None = None


def _stiffness_table(kinds: Mapping[str, type[Stiffness]]) -> Any:
    """``[model.stiffness]``, with the keys of these kinds of stiffness."""
    return create_model(
        "StiffnessTable",
        __base__=Series,
        kind=(Literal[tuple(kinds)], next(iter(kinds))),
        **{  # type: ignore[call-overload]
            name: (list[float], []) if name in kind.lists() else (float | None, None)
            for kind in kinds.values() for name in kind.record_keys() if name not in Series.model_fields
        },
    )


StiffnessTable = _stiffness_table(STIFFNESS_KINDS.own)

MODEL_NAMES = (*SCALARS, *(q.name for q in PARAMETERS if q.members))
"""The keys of ``[model]`` that are numbers."""


def _model_table(stiffness: Any) -> Any:
    """``[model]``, with this table of its stiffness."""
    return create_model(
        "ModelTable",
        __base__=_Table,
        kind=(str, "torsional"),
        damping_law=(str, DEFAULT_LAW),
        error=(Series, Series()),
        stiffness=(stiffness, stiffness()),
        **{name: (float | None, None) for name in MODEL_NAMES},  # type: ignore[call-overload]
    )


ModelTable = _model_table(StiffnessTable)
GearPairTable = create_model(
    "GearPairTable",
    __base__=_Table,
    kind=(str | None, None),
    **{f.name: (Any, ... if f.default is MISSING else f.default) for f in fields(GearPair)},  # type: ignore[call-overload]
)


class InitialTable(_Table):
    """``[initial]`` of a model or a pair: values by coordinate."""

    initial: dict[str, float]


class StudyFile(_Table):
    """The layout of a study file."""

    model: ModelTable | None = None  # type: ignore[valid-type]
    gearpair: GearPairTable | None = None  # type: ignore[valid-type]
    design: dict[str, Any] | None = None  # checked by `GearDesign`
    operation: dict[str, Any] | None = None
    train: dict[str, Any] | None = None  # checked by `Train`
    initial: dict[str, Any] = {}
    study: _study_table(STUDIES) | None = None  # type: ignore[valid-type]
    classification: _ClassificationTable | None = None


def study_file(document: Mapping[str, Any]) -> type[StudyFile]:
    """The layout of a file, with the keys of the kinds of study and of stiffness of other packages that it names.

    Raises `NotInstalledError` for a kind that no package offers.
    """
    guests: dict[str, Any] = {}
    study, stiffness = _kind(document, "study"), _kind(document, "model", "stiffness")
    if study not in STUDIES and study not in _ADVICE_ON_KINDS:
        guests["study"] = _study_table({**STUDIES, study: entry_of(study_class(study))})
    if stiffness not in STIFFNESS_KINDS.own:
        STIFFNESS_KINDS.check("model.stiffness.kind", stiffness)
        kinds = {**STIFFNESS_KINDS.own, stiffness: STIFFNESS_KINDS[stiffness]}
        guests["model"] = _model_table(_stiffness_table(kinds))
    return create_model(  # type: ignore[call-overload,no-any-return]
        "StudyFile", __base__=StudyFile, **{name: (table | None, None) for name, table in guests.items()})


def _kind(document: Any, *tables: str) -> str:
    """The kind that a table of a file names, by default the first of gearchaos, also for what is no text."""
    for name in (*tables, "kind"):
        document = document.get(name) if isinstance(document, Mapping) else None
    known: Mapping[str, Any] = STUDIES if tables == ("study",) else STIFFNESS_KINDS.own
    return document if isinstance(document, str) else next(iter(known))


def validated(schema: type[BaseModel], document: Mapping[str, Any], *where: str) -> Any:
    """A document as a table of the schema; raises one `InputError` for all its values, an unknown key or
    missing ones first. ``where`` names the table."""
    try:
        return schema.model_validate(document)
    except ValidationError as error:
        # an unknown key is reported first: it may be a missing key misspelt
        first, *others = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        if first["type"] == "missing":
            first["loc"] = (*first["loc"][:-1], ", ".join(str(e["loc"][-1]) for e in (first, *others) if e[
                "type"] == "missing" and e["loc"][:-1] == first["loc"][:-1]))
        wrong = {e["loc"][:2]: e for e in reversed([first, *others]) if e is first or e["type"] not in (
            "missing", "extra_forbidden")}  # one for each value: pydantic has one for each type that it may have
        raise all_of([_input_error(schema, e, where) for e in reversed(wrong.values())]) from None


def _input_error(schema: type[BaseModel], error: Any, where: tuple[str, ...]) -> InputError:
    """An error of pydantic as an `InputError`."""
    *table, name = error["loc"]
    if error["type"] == "extra_forbidden":
        at: Any = schema
        for part in table:
            annotation = at.model_fields[part].annotation
            options = getattr(annotation, "__args__", (annotation,))
            at = next(a for a in options if isinstance(a, type) and issubclass(a, BaseModel))
        title = ".".join((*where, *table))
        field, known = f"key of [{title}]" if title else "table", find(str(name)) if title == "model" else None
        if known is not None and known.name == name and known.toml_table:
            return InputError(field, "must be a parameter of the model itself", name,
                              f"Write it in {known.toml_table}.")
        return unknown_name(field, str(name), list(at.model_fields))
    field = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in (*where, *table, name))
    if error["type"] == "missing":
        return InputError(field[1:], "must be given", None, _UNITS if "gearpair" in (*where, *table) else "")
    if error["type"] in ("model_type", "dict_type"):
        return InputError(field[1:], "must be a table", error["input"])
    advice = _ADVICE_ON_KINDS.get(str(error["input"]), "") if error["loc"] == ("study", "kind") else ""
    if error["type"] == "float_type" and isinstance(error["input"], str) and error["loc"][0] == "model":
        advice = _DIMENSIONLESS
    return InputError(field[1:], error["msg"].replace("Input should", "must"), error["input"], advice)


_UNITS = "Values have a unit, e.g. R1 = '35 mm', I1 = '4.9e-4 kg*m^2', c0 = '4e8 N/m', speed = '3000 rpm'."
_DIMENSIONLESS = ("The values of [model] are numbers without units, phases in radians, e.g. 3.14159 for 180 deg: "
                  "docs/model.md, Parameters. Gears with units are a [gearpair] or a [design].")
_ADVICE_ON_KINDS = {
    "map": 'For speed and torque write kind = "zones", x = "speed=500:8000:200" and y = "torque=20:400:150".',
    "gear": "gearchaos gear says which speeds to avoid of a design; it needs no [study].",
}
"""What to write in a study file instead of the name of a command that is not a kind of study."""
