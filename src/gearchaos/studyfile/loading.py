"""Reading of study files: the model or gears, the study and the classification settings that a file describes."""

from __future__ import annotations

import copy
import os
import tomllib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gearchaos.errors import InputError
from gearchaos.files import read_bytes
from gearchaos.gears.design.values import Choice
from gearchaos.gears.io.file_kinds import HEAD, no_table
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import OPERATING_NAMES, Gears, gears_of, is_design, model_of_gears
from gearchaos.model import (
    PARAMETER_PAIRS,
    STIFFNESS_KINDS,
    MeshModel,
    Stiffness,
    TransmissionError,
    check_state_name,
    default_stiffness,
)
from gearchaos.studies.core.axis import Axis, at_axis_starts
from gearchaos.studies.core.operating_ranges import torques_of
from gearchaos.studies.core.options import file_options
from gearchaos.studies.core.registry import study_class
from gearchaos.studies.core.study import ClassifyingStudy, Study
from gearchaos.studyfile.tables import (
    MODEL_NAMES,
    GearPairTable,
    InitialTable,
    ModelTable,
    StudyFile,
    study_file,
    validated,
)

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.train.model import TrainModel

AnyStudy = TypeVar("AnyStudy", bound=Study)

MAX_BYTES = 1_000_000
"""Largest size of a study file; one that is written by hand has some hundreds of bytes."""


@dataclass(frozen=True)
class LoadedStudy:
    """The content of a study file, with the values that were given to replace some of it."""

    model: MeshModel  # an `OperatingModel` if the file describes gears
    kind: str | None = None  # of study, if the file has a table ``[study]``
    options: Mapping[str, Any] = field(default_factory=dict)  # fields of the study that the file sets, axes included
    classification: Mapping[str, Any] = field(default_factory=dict)  # fields of `Classification` that it sets
    least_torque: float | None = None  # of the axes of torques, in N m
    design: Gears | None = None  # that the train of the model stands for, whose teeth differ

    @property
    def gears(self) -> Gears | None:
        """The gears at the operating point of the model; None if the file describes no gears."""
        return gears_of(self.model)

    @property
    def pair(self) -> GearPair | None:
        """The same gears as a gear pair in SI."""
        return None if self.gears is None else self.gears.to_pair()

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of the gears, also at the least torque; none if the file describes none."""
        described = self.gears if self.design is None else self.design
        if described is None or self.gears is None:
            return ()
        points = [described] + ([] if self.least_torque is None else [described.at(torque=self.least_torque)])
        points += [self.gears] * (self.design is not None)
        return tuple(dict.fromkeys(text for point in points for text in point.warnings))

    def options_for(self, kind: str) -> dict[str, Any]:
        """The options if the file describes a study of this kind, else none."""
        return dict(self.options) if self.kind == kind else {}

    def study(self, study_type: type[AnyStudy], **options: Any) -> AnyStudy:
        """A study of the model of this file; raises `InputError` if an option is missing or wrong.

        The options of the file are used if it describes a study of this class, and replaced by those given here; its
        classification settings are always used.
        """
        values = {**self.options_for(study_type.kind), **options}
        if self.classification and issubclass(study_type, ClassifyingStudy):
            values["settings"] = replace(study_type.default_settings, **self.classification)
        return study_type.of(self.model, values)


def load_study(
    path: str | os.PathLike[str] | None = None, values: Mapping[str, Any] | None = None, *, axes: Iterable[Axis] = (),
) -> LoadedStudy:
    """Read a study file, without one the default values of the model, and replace values by name.

    Names of ``values`` are as in `MeshModel.with_values`, ``kind`` and ``damping_law`` included, or
    ``gearpair.<field>``, ``design.<key>`` and ``operation.<key>``. A ``[design]`` without speed or torque gets the
    first value of the axis ``speed`` or ``torque`` among ``axes``, given beside the file, or else among those of the
    file. Raises `InputError`.
    """
    tables = _read(Path(path)) if path is not None else StudyFile()
    of_gears, model_values = _separated(values or {}) if tables.train is None else (_NONE, dict(values or {}))
    if tables.design is not None and "damping_law" in model_values:  # the load sharing of a design depends on it
        of_gears["design"]["damping_law"] = model_values.pop("damping_law")
    kind = model_values.pop("kind", None)
    given = {n: v for n, v in model_values.items() if n in OPERATING_NAMES}
    gears = _gears_of(tables, of_gears, Path(path or ".").parent, given)
    model: Any  # a `MeshModel`, or a `TrainModel`
    options: dict[str, Any] = {} if tables.study is None else tables.study.model_dump(exclude_none=True)
    study_kind = options.pop("kind", None)
    known = file_options(study_class(study_kind)) if study_kind else {}
    for key in options.keys() - known.keys():
        raise InputError(f"study.{key}", f"must be left out for kind {study_kind!r}", options[key],
                         f"It takes {', '.join(('kind', *known))}.")
    options = {key: option.checked(options[key], f"study.{key}") if option.type is Axis else options[key]
               for key, option in known.items() if key in options}
    options |= {key: str((Path(path or ".").parent / given).absolute()) for key, given in options.items()
                if known[key].is_path and isinstance(given, str)}
    axes = [*axes, *(each for each in options.values() if isinstance(each, Axis))]
    if "torque" in options and not known["torque"].is_path:
        axes += [Axis("torque", each, each, 1) for each in torques_of(options["torque"], "study.torque")]
    least = min((axis.start for axis in axes if axis.name == "torque"), default=None)
    if tables.train is not None:
        model = _train_model(tables, Path(path or ".").parent)
    elif gears is not None:
        gears = at_axis_starts(gears, axes)
        if is_design(gears) and gears.turning:  # a train has the stiffness that the design has at its torque
            gears = gears.at(**given)
            model_values = {n: v for n, v in model_values.items() if n not in given}
        model = model_of_gears(gears, kind or (tables.gearpair and tables.gearpair.kind))
        _refuse_without_table(gears, model_values, {*model.known_names, *OPERATING_NAMES, "damping_law"})
    else:
        model = _model(tables.model or ModelTable(), default_stiffness(model_values))
        model = model if kind is None else model.with_values({"kind": kind})
    described = None
    if model.kind == "train":
        model, described = _with_train_values(model, tables.initial, kind, model_values), gears
    else:
        initial = validated(InitialTable, {"initial": tables.initial}).initial
        for name in initial:
            check_state_name(model.kind, name)
        model = model.with_values(initial).with_values(model_values)
    settings = {} if tables.classification is None else tables.classification.model_dump(exclude_none=True)
    settings = {name: tuple(value) if isinstance(value, list) else value for name, value in settings.items()}
    return LoadedStudy(model, study_kind, options, settings, least, described)


def open(path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> Any:
    """The gears or the model that a study file describes.

    Parameters
    ----------
    path : path
        A TOML file with ``[design]``, ``[gearpair]``, ``[train]`` or ``[model]``.
    values : mapping, optional
        Values by name that replace those of the file, as of ``--set``: ``{"design.damping_ratio": 0.03}``.

    Returns
    -------
    GearDesign, GearPair, Train or MeshModel
        A design may be without speed and torque.

    Raises
    ------
    InputError
        If the file cannot be read, or an input is missing or wrong.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from tempfile import TemporaryDirectory
    >>> from pathlib import Path
    >>> with TemporaryDirectory() as folder:
    ...     Path(f"{folder}/model.toml").write_text("[model]\\nomega = 0.8")
    ...     gc.open(f"{folder}/model.toml").omega
    19
    0.8
    """
    if _read(Path(path)).design is not None:
        return load_design(path, values)
    model = load_study(path, values).model
    return gears_of(model) or model


def load_design(path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> GearDesign:
    """The design that a file describes, which may be without speed and torque; raises `InputError` if it has none.

    Values as in `load_study`; ``speed``, ``torque`` and ``damping_law`` may also be given without the name of their
    table.
    """
    tables = _read(Path(path))
    tables_of = {**dict.fromkeys(OPERATING_NAMES, "operation."), "damping_law": "design."}
    given = {tables_of.get(n, "") + n: v for n, v in (values or {}).items()}
    of_gears, others = _separated(given)
    gears = _gears_of(tables, of_gears, Path(path).parent, {})
    if not is_design(gears):
        advice = "" if tables.train is None else (
            "gearchaos assess says which speeds of a train to avoid, gearchaos modes its frequencies.")
        raise InputError("study file", "must have a table [design]", str(path), advice)
    _refuse_without_table(gears, others)
    for name, value in others.items():
        raise InputError(name, "must be a value of [design] or [operation]", value, "E.g. design.damping_ratio=0.05.")
    return gears


def _read(path: Path) -> StudyFile:
    """The tables of a study file; raises `InputError` if it cannot be read or has wrong keys or types."""
    try:
        what = no_table(read_bytes(path, HEAD, cut=True)).partition(". ")[0]
        text = "" if what else read_bytes(path, MAX_BYTES).decode("utf-8-sig")  # some editors write a byte order mark
        document = tomllib.loads(text)
    except OSError as error:
        raise InputError("study file", "must be a readable file", str(path), f"{error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise InputError("study file", "must be valid TOML", str(path), f"{error}.") from None
    if what:
        raise InputError("study file", "must be TOML", str(path), f"{what}. A study file is text, as in examples.")
    return validated(study_file(document), document)


_TABLES = ("gearpair", "design", "operation")
"""The tables that describe gears; ``--set TABLE.KEY=VALUE`` replaces a value in them."""


_NONE: dict[str, dict[str, Any]] = {table: {} for table in _TABLES}


def _separated(values: Mapping[str, Any]) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """Values for the tables of gears, by table and key, and the other values by name."""
    of_gears: dict[str, dict[str, Any]] = {table: {} for table in _TABLES}
    rest = {}
    for name, value in values.items():
        table, dot, key = name.partition(".")
        if dot and table in _TABLES:
            of_gears[table][key] = value
        else:
            rest[name] = value
    return of_gears, rest


def _refuse_without_table(gears: Gears, values: Mapping[str, Any], known: Collection[str] = ()) -> None:
    """Raise `InputError` for a value of the gears that is given without the name of its table.

    ``known`` are the names that need no table: those of the parameters and initial values of the model.
    """
    table = "design" if is_design(gears) else "gearpair"
    own = {f.name: f for f in fields(gears) if f.name not in known}  # type: ignore[arg-type]
    for name, value in values.items():
        head, _, key = name.partition(".")
        if head in own:
            choice = own[head].metadata.get("convert")
            if key and isinstance(choice, Choice) and key not in choice.files:  # such as stiffness.kind of a model
                name = head
                choice(name, value)
            raise InputError(name, "must be given with the name of its table", value, f"Write {table}.{name}=VALUE.")


def _gears_of(
    tables: StudyFile, values: Mapping[str, Mapping[str, Any]], folder: Path, default: Mapping[str, Any]
) -> Gears | None:
    """The gears of a study file in a folder; None if it describes none.

    ``values`` by table and key replace those of the file; ``default`` has speed and torque of a design without.
    """
    for table in _TABLES:
        for key, value in values[table].items():
            if getattr(tables, table) is None and not (table == "operation" and tables.design):
                raise InputError(f"{table}.{key}", f"needs a study file with a [{table}] table", value)
    if tables.design is None and tables.operation is not None:
        raise InputError("[operation]", "must be left out without [design]", list(tables.operation),
                         "[gearpair] has M10 and speed.")
    if tables.gearpair is not None:
        _refuse_beside(tables, "gearpair", "model", "design")
        given = _replaced(tables.gearpair.model_dump(exclude_unset=True), values["gearpair"], "gearpair")
        found = validated(GearPairTable, given, "gearpair")
        return GearPair(**found.model_dump(exclude={"kind"}))
    if tables.design is None:
        return None
    _refuse_beside(tables, "design", "model")
    from gearchaos.gears.design import gear_design  # many modules, for files with a design alone

    design = _replaced(tables.design, values["design"], "design")
    for name, path in gear_design.FILES:
        given = design.get(name)
        if isinstance(given, dict) and isinstance(given.get(path), str):
            given[path] = str((folder / given[path]).absolute())
    if isinstance(paths := design.get("pitch_errors"), list):
        design["pitch_errors"] = [str((folder / each).absolute()) if isinstance(each, str) and each else each
                                  for each in paths]
    operation = _replaced(tables.operation or {}, values["operation"], "operation")
    if any(name in operation for name in gear_design.FREQUENCIES):
        default = {name: value for name, value in default.items() if name != "speed"}
    return gear_design.GearDesign.from_tables(design, {**default, **operation})


def _train_model(tables: StudyFile, folder: Path) -> TrainModel:
    """The model of ``[train]`` of a study file in a folder."""
    from gearchaos.gears.train.model import TrainModel  # many modules, for trains alone
    from gearchaos.gears.train.train_file import read_train

    _refuse_beside(tables, "train", "model", "gearpair", "design", "operation")

    def pair(path: str) -> Gears:
        try:
            found = _gears_of(_read(folder / path), _NONE, (folder / path).parent, {})
        except InputError as error:
            raise InputError(f"{path}: {error.field}", error.rule, error.value, error.advice) from None
        if found is None:
            raise InputError("design", "must be the path of a file with [design] or [gearpair]", path)
        return found

    return TrainModel(read_train(tables.train or {}, pair))


def _with_train_values(
    model: TrainModel, initial: Mapping[str, Any], kind: Any, values: Mapping[str, Any]
) -> TrainModel:
    """A train with values replaced by name, and its initial values from a table."""
    from gearchaos.gears.train.train_file import initial_of

    if kind is not None:
        raise InputError("kind", "must be left out for a train", kind, "Its coordinates follow from its parts.")
    model = model.with_values(values)
    return replace(model, initial={**initial_of(model, initial), **model.initial})


def _refuse_beside(tables: StudyFile, table: str, *others: str) -> None:
    """Raise `InputError` for a table that determines the model, too."""
    for other in others:
        if (found := getattr(tables, other)) is not None:
            given = list(found) if isinstance(found, Mapping) else list(found.model_fields_set)
            raise InputError(f"[{other}]", f"must be left out beside [{table}]", given,
                             f"[{table}] determines the model.")


def _replaced(table: Mapping[str, Any], values: Mapping[str, Any], title: str) -> dict[str, Any]:
    """A table with values replaced by key; the key of a value in an inner table is ``quality.grade``."""
    out = copy.deepcopy(dict(table))
    for path, value in values.items():
        *outer, last = path.split(".")
        inner = out
        for name in outer:
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                raise InputError(f"{title}.{path}", f"must not lie in {name}, which is no table", value)
        inner[last] = value
    return out


def _model(table: Any, stiffness: Stiffness) -> MeshModel:
    """The model of ``[model]``, with this stiffness if the table has none."""
    values = table.model_dump(include=set(MODEL_NAMES), exclude_none=True)
    _check_pairs("model", values)
    series = TransmissionError(tuple(table.error.amplitudes) or (0.0,), tuple(table.error.phases))
    if "stiffness" in table.model_fields_set:
        given = table.stiffness.model_dump(exclude={"kind"})
        given = {name: value for name, value in given.items() if value not in (None, [])}
        chosen = STIFFNESS_KINDS[table.stiffness.kind]
        for name in (n for n in given if n not in chosen.record_keys()):
            takes = "; ".join(f"{kind} takes {found.keys}" for kind, found in STIFFNESS_KINDS.items())
            raise InputError(f"model.stiffness.{name}", f"must be left out for kind {table.stiffness.kind!r}",
                             given[name], f"{takes}.")
        _check_pairs("model.stiffness", given)
        stiffness = chosen.from_record(
            {single: v for name, v in given.items() for single in PARAMETER_PAIRS.get(name, (name,))})
    model = MeshModel(kind=table.kind, error=series, stiffness=stiffness, damping_law=table.damping_law)
    return model.with_values(values)


def _check_pairs(table: str, values: Mapping[str, Any]) -> None:
    """Raise `InputError` for a parameter pair beside one of its members: the result would depend on the order."""
    for pair, singles in PARAMETER_PAIRS.items():
        for single in singles:
            if pair in values and single in values:
                raise InputError(f"{table}.{pair}", f"must not be given beside {table}.{single}", values[pair],
                                 f"{pair} sets both {' and '.join(singles)}.")


def parse_set(texts: Iterable[str]) -> dict[str, Any]:
    """Values by name from texts ``name=value``, see `parse_value`; the last of several is used."""
    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InputError("--set", "must read name=value", text, "E.g. --set omega=1.")
        values.pop(name, None)  # so that it comes last: values are set in order, and q0 also sets q1
        values[name] = parse_value(value)
    return values


def parse_value(text: str) -> Any:
    """A text as an integer or a float if it is one, as true or false, as a list or table in TOML if it begins like one.
    """
    if text in ("true", "false"):
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    if not text.startswith(("[", "{")):
        return text
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError) as error:
        raise InputError("--set", "must give a list or table as in TOML", text,
                         f"{error}. Texts stand in quotes: --set \"design.bore=['30 mm', '60 mm']\".") from None
    if len(found) > 1:
        raise InputError("--set", "must give one value", text)
    return found["value"]
