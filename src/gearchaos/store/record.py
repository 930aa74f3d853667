"""Conversion of a study to the JSON record in its store, which has everything that determines the result."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from gearchaos.datasets import model_from_json, model_json
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.operation.operating import OperatingModel, gears_from_json, gears_json, with_gears
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.registry import study_class
from gearchaos.studies.core.study import Study

CARRIED = "carried_gears"
"""The key of the gears of a model, where the study depends on them by the units of its results alone."""


def to_record(study: Study) -> dict[str, Any]:
    """All fields of a study as values for JSON.

    Default values are included, so that the record does not depend on the defaults of a later version.
    """
    options = {name: getattr(study, name) for name in study.option_types()}
    settings = getattr(study, "settings", None)
    record = {
        "kind": study.kind, "model": json.loads(model_json(study.model)),
        "axes": [asdict(getattr(study, name)) for name in study.axis_fields],
        "options": {n: asdict(v) if isinstance(v, Axis) else v for n, v in options.items()},
        "settings": None if settings is None else asdict(settings),
    }
    if isinstance(study.model, OperatingModel):
        record[CARRIED if study.gears is None else "gears"] = json.loads(gears_json(study.model.gears))
    return json.loads(json.dumps(record, default=_plain))


def _plain(value: Any) -> Any:
    """A number of NumPy as one of Python; raises `InputError` for what is no number, as a function or other gears."""
    if not hasattr(value, "item"):
        raise InputError("study", "must have no functions and no other gears among its options to be kept in a store",
                         value, "Compute it in memory.")
    return value.item()


def from_record(record: Mapping[str, Any]) -> Study:
    """The inverse of `to_record`; raises `InputError` if the record describes no study."""
    study_type = study_class(record["kind"])
    names, types, axes = study_type.axis_fields, study_type.option_types(), record["axes"]
    if len(axes) != len(names):
        raise InputError("axes", f"must be {len(names)} for kind {study_type.kind!r}", [a["name"] for a in axes])
    for name in record["options"]:
        if name not in types:
            raise unknown_name("study option", name, types)
    values = {n: Axis(**v) if types[n] is Axis and v else v for n, v in record["options"].items()}
    values |= {name: Axis(**axis) for name, axis in zip(names, axes, strict=True)}
    if (settings := record["settings"]) is not None:
        values["settings"] = Classification(**{**settings, "transient_lengths": tuple(settings["transient_lengths"])})
    model = model_from_json(json.dumps(record["model"]))
    if gears := record.get("gears") or record.get(CARRIED):
        model = with_gears(model, gears_from_json(json.dumps(gears)))
    return study_type.of(model, values)


def differences(stored: Mapping[str, Any], requested: Mapping[str, Any], field: str = "") -> list[str]:
    """The differences of two records, each as a text "field: stored value in the store, other value asked for"."""
    out = []
    for name in sorted(stored.keys() | requested.keys()):
        old, new, where = stored.get(name), requested.get(name), f"{field}{name}"
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            out += differences(old, new, f"{where}.")
        elif old != new:
            out.append(f"{where}: {old!r} in the store, {new!r} asked for")
    return out
