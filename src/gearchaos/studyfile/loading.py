"""Study files: TOML in, a model and a study out, with values set by name over them."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from gearchaos.dynamics.settings import FORMER_NAMES, Classification
from gearchaos.errors import InputError
from gearchaos.files import read_bytes
from gearchaos.gears.pair import GearPair
from gearchaos.model import (
    PAIRS,
    HarmonicStiffness,
    MeshModel,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
    check_state_name,
    default_stiffness,
)
from gearchaos.studies.axis import Axis, parse_axis
from gearchaos.studies.registry import STUDIES
from gearchaos.studies.study import ClassifyingStudy, Study
from gearchaos.studyfile.tables import (
    MODEL_NAMES,
    GearPairTable,
    ModelTable,
    Series,
    StiffnessTable,
    StudyFile,
    checked,
)

_ON_PAIR = "gearpair."

Kind = TypeVar("Kind", bound=Study)

LARGEST = 1_000_000
"""Most bytes of a study file; one that is written by hand has some hundreds."""


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
        model = _model(tables.model or ModelTable(), stiffness)
        return None, model if kind is None else model.with_values({"kind": kind})
    if tables.model is not None:
        given = list(tables.model.model_fields_set)
        raise InputError("[model]", "must be left out beside [gearpair]", given, "The pair is the model.")
    values = checked(GearPairTable, {**tables.gearpair.model_dump(), **on_pair}, "gearpair").model_dump()
    pair = GearPair(**{f.name: values[f.name] for f in fields(GearPair)})
    return pair, pair.to_model(kind if kind is not None else values["kind"])


def _read(path: Path) -> StudyFile:
    try:
        document = tomllib.loads(read_bytes(path, LARGEST).decode("utf-8-sig"))  # some editors write a byte order mark
    except OSError as error:
        raise InputError("study file", "must be a readable file", str(path), f"{error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise InputError("study file", "must be valid TOML", str(path), f"{error}.") from None
    return checked(StudyFile, document)


def _model(table: Any, stiffness: Stiffness) -> MeshModel:
    values = table.model_dump(include=set(MODEL_NAMES), exclude_none=True)
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


def _stiffness(table: StiffnessTable) -> Stiffness:
    levels = table.model_dump(include={"chi0", "chi1", "chi2", "contact_ratio"}, exclude_none=True)
    series = [name for name in Series.model_fields if getattr(table, name)]
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
