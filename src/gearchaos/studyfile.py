"""Study files: TOML in, a model and a study out, with values set by name over them.

A file has ``[model]`` (with ``[model.error]`` and ``[model.stiffness]``) or ``[gearpair]``, ``[initial]`` and
``[study]`` with ``[classification]``; every table is optional. ``StudyFile.model_json_schema()`` describes the layout.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from gearchaos.dynamics.settings import FORMER_NAMES, Classification
from gearchaos.errors import InputError, unknown_name
from gearchaos.files import read_bytes
from gearchaos.gears.pair import GearPair
from gearchaos.model import (
    PAIRS,
    SCALARS,
    HarmonicStiffness,
    MeshModel,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
    check_state_name,
    default_stiffness,
)
from gearchaos.quantities import find
from gearchaos.studies.axis import Axis, parse_axis
from gearchaos.studies.registry import STUDIES
from gearchaos.studies.study import ClassifyingStudy, Study

_ON_PAIR = "gearpair."

Kind = TypeVar("Kind", bound=Study)

LARGEST = 1_000_000
"""Most bytes of a study file; one that is written by hand has some hundreds."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Series(_Table):
    amplitudes: list[float] = []
    phases: list[float] = []


class _StiffnessTable(_Series):
    kind: Literal["two-level", "harmonics"] = "two-level"
    chi0: float | None = None
    chi1: float | None = None
    chi2: float | None = None
    contact_ratio: float | None = None


def _key_type(type_: Any, least: int | None) -> Any:
    """The type of a key of ``[study]`` for a field of a study; axes are texts."""
    if type_ is Axis:
        return str | None
    return Annotated[type_, Field(ge=least)] | None if least is not None else type_ | None


def _study_keys() -> dict[str, Any]:
    """The keys of ``[study]``: axes and options of all kinds of studies, each with its type and no default."""
    keys: dict[str, Any] = {}
    for kind in STUDIES.values():
        declared = {f.name: f for f in fields(kind)}
        for name, type_ in kind.option_types().items():
            if declared[name].metadata:  # others can be given in Python alone
                keys[name] = (_key_type(type_, declared[name].metadata["least"]), None)
        keys |= dict.fromkeys(kind.axis_fields, (str | None, None))
    return keys


_StudyTable = create_model(
    "_StudyTable",
    __base__=_Table,
    kind=(Literal[tuple(STUDIES)], ...),  # type: ignore[arg-type,valid-type]
    **_study_keys(),
)


class _ClassificationTable(_Table):
    transient_lengths: list[int] | None = None
    longest_period: int | None = None
    exponent_run: int | None = None
    doublings: int | None = None
    longest_transient: int | None = None
    averaging_periods: int | None = None


class _FormerClassificationTable(_Table):
    """``[budget]`` of version 0.1; see `FORMER_NAMES`."""

    looks: list[int] | None = None
    longest: int | None = None
    exponent: int | None = None
    extensions: int | None = None
    patience: int | None = None
    measured: int | None = None


_NAMES = (*SCALARS, *(pair for pair in PAIRS if pair != "chi0"))
_ModelTable = create_model(
    "_ModelTable",
    __base__=_Table,
    kind=(str, "torsional"),
    error=(_Series, _Series()),
    stiffness=(_StiffnessTable, _StiffnessTable()),
    **{name: (float | None, None) for name in _NAMES},  # type: ignore[call-overload]
)
_GearPairTable = create_model(
    "_GearPairTable",
    __base__=_Table,
    kind=(str | None, None),
    **{f.name: (Any, ... if f.default is MISSING else f.default) for f in fields(GearPair)},  # type: ignore[call-overload]
)


class StudyFile(_Table):
    """The layout of a study file."""

    model: _ModelTable | None = None  # type: ignore[valid-type]
    gearpair: _GearPairTable | None = None  # type: ignore[valid-type]
    initial: dict[str, float] = {}
    study: _StudyTable | None = None  # type: ignore[valid-type]
    classification: _ClassificationTable | None = None
    budget: _FormerClassificationTable | None = None


@dataclass(frozen=True)
class LoadedStudy:
    """The content of a study file, with the values set over it.

    Attributes
    ----------
    model : MeshModel
        The dimensionless model.
    pair : GearPair or None
        The physical pair from which the model was made.
    kind : str or None
        The kind of study that the file describes.
    options : dict
        The fields of that study which the file sets, axes included.
    classification : dict
        The fields of `Classification` that the file sets.
    """

    model: MeshModel
    pair: GearPair | None = None
    kind: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    classification: Mapping[str, Any] = field(default_factory=dict)

    def options_for(self, kind: str) -> dict[str, Any]:
        """The options if the file describes a study of this kind, else none."""
        return dict(self.options) if self.kind == kind else {}

    def study(self, kind: type[Kind], **options: Any) -> Kind:
        """A study of this kind with the given options, those of the file, and its classification settings.

        Raises
        ------
        InputError
            If an option is missing or wrong.
        """
        values = {**self.options_for(kind.kind), **options}
        if self.classification and issubclass(kind, ClassifyingStudy):
            values["settings"] = replace(kind.default_settings, **self.classification)
        return kind.of(self.model, values)


def load_study(path: str | os.PathLike[str] | None = None, values: Mapping[str, Any] | None = None) -> LoadedStudy:
    """Read a study file and set values by name over it.

    Parameters
    ----------
    path : path, optional
        A TOML file; left out, the paper's defaults.
    values : mapping, optional
        Names as in `MeshModel.with_values`, ``kind`` included, or ``gearpair.<field>`` for a physical pair.

    Raises
    ------
    InputError
        For a file that cannot be read, an unknown name (with the nearest known one), or a value that breaks
        its rule.
    """
    values = dict(values or {})
    tables = _read(Path(path)) if path is not None else StudyFile()
    on_pair = {k.removeprefix(_ON_PAIR): v for k, v in values.items() if k.startswith(_ON_PAIR)}
    on_model = {k: v for k, v in values.items() if not k.startswith(_ON_PAIR)}
    pair, model = _pair_and_model(tables, on_pair, on_model.pop("kind", None), default_stiffness(on_model))
    for name in tables.initial:
        check_state_name(model.kind, name)
    model = model.with_values(tables.initial).with_values(on_model)
    return LoadedStudy(model, pair, *_study(tables.study), _classification(tables))


def _classification(tables: StudyFile) -> dict[str, Any]:
    """What ``[classification]`` sets, or ``[budget]`` of an older file, by field of `Classification`."""
    if tables.budget is None:
        given = {} if tables.classification is None else tables.classification.model_dump(exclude_none=True)
        return _settings(given)
    if tables.classification is not None:
        raise InputError("[budget]", "must be left out beside [classification]", sorted(tables.budget.model_fields_set),
                         "It is the older name of the same table.")
    former = tables.budget.model_dump(exclude_none=True)
    given = _settings({FORMER_NAMES[name]: value for name, value in former.items()})
    try:
        Classification(**given)
    except InputError as error:
        names = {f"classification.{name}": f"budget.{old}" for old, name in FORMER_NAMES.items()}
        raise InputError(names.get(error.field, error.field), error.rule, error.value, error.advice) from None
    return given


def _settings(given: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of `Classification`, as they are given in a file."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


def _pair_and_model(
    tables: StudyFile, on_pair: Mapping[str, Any], kind: str | None, stiffness: Stiffness
) -> tuple[GearPair | None, MeshModel]:
    """The pair of a file, if it has one, and its model seen as one of this kind, if any is asked for, with this
    stiffness if it says nothing of it."""
    if tables.gearpair is None:
        for name, value in on_pair.items():
            raise InputError(f"{_ON_PAIR}{name}", "needs a study file with a [gearpair] table", value)
        model = _model(tables.model or _ModelTable(), stiffness)
        return None, model if kind is None else model.with_values({"kind": kind})
    if tables.model is not None:
        given = list(tables.model.model_fields_set)
        raise InputError("[model]", "must be left out beside [gearpair]", given, "The pair is the model.")
    values = _checked(_GearPairTable, {**tables.gearpair.model_dump(), **on_pair}, "gearpair").model_dump()
    pair = GearPair(**{f.name: values[f.name] for f in fields(GearPair)})
    return pair, pair.to_model(kind if kind is not None else values["kind"])


def _read(path: Path) -> StudyFile:
    try:
        document = tomllib.loads(read_bytes(path, LARGEST).decode("utf-8-sig"))  # some editors write a byte order mark
    except OSError as error:
        raise InputError("study file", "must be a readable file", str(path), f"{error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise InputError("study file", "must be valid TOML", str(path), f"{error}.") from None
    return _checked(StudyFile, document)


def _checked(schema: type[BaseModel], document: Mapping[str, Any], *where: str) -> Any:
    try:
        return schema.model_validate(document)
    except ValidationError as error:
        # a misspelt key explains a missing one, so it comes first
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        raise _input_error(schema, first, where) from None


def _input_error(schema: type[BaseModel], error: Any, where: tuple[str, ...]) -> InputError:
    """The same complaint in the words of the project."""
    *table, name = error["loc"]
    if error["type"] == "extra_forbidden":
        title = ".".join((*where, *table))
        return _unknown(title, str(name), list(_table_at(schema, table).model_fields))
    field = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in (*where, *table, name))
    if error["type"] == "missing":
        return InputError(field[1:], "must be given", None)
    if error["type"] in ("model_type", "dict_type"):
        return InputError(field[1:], "must be a table", error["input"])
    return InputError(field[1:], error["msg"].replace("Input should", "must"), error["input"])


def _table_at(schema: Any, location: Sequence[Any]) -> Any:
    """The table of the schema that a location names."""
    for name in location:
        annotation = schema.model_fields[name].annotation
        options = getattr(annotation, "__args__", (annotation,))
        schema = next(a for a in options if isinstance(a, type) and issubclass(a, BaseModel))
    return schema


def _unknown(title: str, name: str, known: Iterable[str]) -> InputError:
    field = f"key of [{title}]" if title else "table"
    found = find(name) if title == "model" else None
    if found is not None and found.name == name and found.home:
        return InputError(field, "must be a parameter of the model itself", name, f"Write it in {found.home}.")
    return unknown_name(field, name, known)


def _model(table: Any, stiffness: Stiffness) -> MeshModel:
    values = table.model_dump(include=set(_NAMES), exclude_none=True)
    _check_pairs("model", values)
    series = TransmissionError(tuple(table.error.amplitudes) or (0.0,), tuple(table.error.phases))
    if "stiffness" in table.model_fields_set:
        stiffness = _stiffness(table.stiffness)
    model = MeshModel(kind=table.kind, error=series, stiffness=stiffness)
    return model.with_values(values)


def _check_pairs(table: str, values: Mapping[str, Any]) -> None:
    """Refuse a pair beside one of its two: which of them holds would depend on their order."""
    for pair, singles in PAIRS.items():
        for single in singles:
            if pair in values and single in values:
                raise InputError(
                    f"{table}.{pair}", f"must not be given beside {table}.{single}", values[pair],
                    f"{pair} sets both {' and '.join(singles)}.",
                )


def _stiffness(table: _StiffnessTable) -> Stiffness:
    levels = table.model_dump(include={"chi0", "chi1", "chi2", "contact_ratio"}, exclude_none=True)
    series = [name for name in _Series.model_fields if getattr(table, name)]
    for name in levels if table.kind == "harmonics" else series:
        raise InputError(
            f"model.stiffness.{name}", f"must be left out for kind {table.kind!r}", getattr(table, name),
            "two-level takes chi1, chi2 (or chi0) and contact_ratio; harmonics takes amplitudes and phases.",
        )
    if table.kind == "harmonics":
        return HarmonicStiffness(tuple(table.amplitudes) or (0.0,), tuple(table.phases))
    _check_pairs("model.stiffness", levels)
    singles = {single: v for name, v in levels.items() for single in PAIRS.get(name, (name,))}
    return TwoLevelStiffness(**singles)


def _study(table: Any) -> tuple[str | None, dict[str, Any]]:
    """The kind of study that ``[study]`` names, and the options that it sets."""
    if table is None:
        return None, {}
    given = table.model_dump(exclude_none=True)
    kind = STUDIES[given.pop("kind")]
    types = kind.option_types() | dict.fromkeys(kind.axis_fields, Axis)
    for key in given.keys() - types.keys():
        rule, known = f"must be left out for kind {kind.kind!r}", ("kind", *kind.axis_fields, *kind.option_types())
        raise InputError(f"study.{key}", rule, given[key], f"It takes {', '.join(known)}.")
    return kind.kind, {
        key: parse_axis(given[key], f"study.{key}") if types[key] is Axis else given[key]
        for key in types if key in given
    }


def parse_set(texts: Iterable[str]) -> dict[str, Any]:
    """Values by name from ``name=value`` texts, numbers where numeric; the last one of a name holds."""
    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InputError("--set", "must read name=value", text, "E.g. --set omega=1.")
        values.pop(name, None)  # so that it also comes last in order: q0 sets q1 after q1 has been set
        values[name] = _value(value)
    return values


def _value(text: str) -> int | float | str:
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
