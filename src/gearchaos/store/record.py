"""A study as the JSON record that its store keeps: everything that decides its result."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from gearchaos.datasets import model_from_json, model_json
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import FORMER_NAMES
from gearchaos.errors import InputError, unknown_name
from gearchaos.studies.axis import Axis
from gearchaos.studies.registry import study_class
from gearchaos.studies.study import Study


def to_record(study: Study) -> dict[str, Any]:
    """All fields of a study as JSON-ready values.

    Defaults are written out, so that the record stays whole when a later version has other defaults. The classification
    settings have the names of format 1, see `FORMER_NAMES`.
    """
    options = {name: getattr(study, name) for name in study.option_types()}
    settings = getattr(study, "settings", None)
    record = {
        "kind": study.kind, "model": json.loads(model_json(study.model)),
        "axes": [asdict(getattr(study, name)) for name in study.axis_fields],
        "options": {n: asdict(v) if isinstance(v, Axis) else v for n, v in options.items()},
        "budget": None if settings is None else _settings_record(settings),
    }
    return json.loads(json.dumps(record, default=lambda value: value.item()))


def from_record(record: Mapping[str, Any]) -> Study:
    """The inverse of `to_record`; raises `InputError` for a record of no study."""
    kind = study_class(record["kind"])
    types, axes = kind.option_types(), record["axes"]
    if len(axes) != len(kind.axis_fields):
        raise InputError("axes", f"must be {len(kind.axis_fields)} for kind {kind.kind!r}", [a["name"] for a in axes])
    for name in record["options"]:
        if name not in types:
            raise unknown_name("study option", name, types)
    values = {n: Axis(**v) if types[n] is Axis and v else v for n, v in record["options"].items()}
    values |= {name: Axis(**axis) for name, axis in zip(kind.axis_fields, axes, strict=True)}
    if record["budget"] is not None:
        values["settings"] = _settings(record["budget"])
    return kind.of(model_from_json(json.dumps(record["model"])), values)


def _settings_record(settings: Classification) -> dict[str, Any]:
    return {former: getattr(settings, name) for former, name in FORMER_NAMES.items()}


def _settings(record: Mapping[str, Any]) -> Classification:
    values: dict[str, Any] = {FORMER_NAMES[former]: value for former, value in record.items()}
    return Classification(**{**values, "transient_lengths": tuple(values["transient_lengths"])})


def differences(stored: Mapping[str, Any], asked: Mapping[str, Any], field: str = "") -> list[str]:
    """Where two records differ: "field: stored value in the store, other value asked for"."""
    out = []
    for name in sorted(stored.keys() | asked.keys()):
        one, other, where = stored.get(name), asked.get(name), f"{field}{name}"
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            out += differences(one, other, f"{where}.")
        elif one != other:
            out.append(f"{where}: {one!r} in the store, {other!r} asked for")
    return out
