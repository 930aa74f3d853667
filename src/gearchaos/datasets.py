"""Labelled results: names, units and provenance of what the studies return, saved and loaded."""

from __future__ import annotations

import dataclasses
import io
import json
import os
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import REASONS, Label, Reason, motion_name
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES, NO_FILE, check_target, write_bytes
from gearchaos.model import HarmonicStiffness, MeshModel, Stiffness, TransmissionError, TwoLevelStiffness
from gearchaos.quantities import parse, quantity


def describe(name: str) -> dict[str, str]:
    """``long_name`` and ``units`` of a variable or axis by its name; raises `InputError` for an unknown name."""
    found = quantity(name)
    prefix = "stroboscopic " if "section_" in parse(name).prefix else ""
    return {"long_name": prefix + (found.long_name or found.name), "units": found.unit}


def flags(enum_names: dict[int, str]) -> dict[str, Any]:
    """CF attributes that name the codes of a variable."""
    return {
        "flag_values": np.array(list(enum_names), dtype=np.int8),
        "flag_meanings": " ".join(n.replace(" ", "_") for n in enum_names.values()),
    }


_CODES = {
    "label": flags({int(v): v.name.lower().replace("_", "-") for v in Label}),
    "contact": flags(dict(enumerate(CONTACTS))),
    "contact_worst": flags(dict(enumerate(CONTACTS))),
    "reason": {**flags({int(r): r.name.lower() for r in Reason}),
               "comment": "; ".join(f"{int(r)}: {REASONS[r]}" for r in Reason)},
}


def variable(name: str, dims: tuple[str, ...], values: np.ndarray, coded: bool = True) -> xr.Variable:
    """A variable described by its name: ``long_name``, ``units`` and, if ``coded``, the meanings of its codes."""
    codes = _CODES.get(parse(name).base, {}) if coded else {}
    return xr.Variable(dims, values, {**describe(name), **codes})


def motions(labels: xr.DataArray, periods: xr.DataArray) -> list[str]:
    """Every motion by name: "3T" where it has a period, else its kind, or "not computed"."""
    pairs = zip(labels.values.ravel().tolist(), periods.values.ravel().tolist(), strict=True)
    return [motion_name(Label(label), period) if label else "not computed" for label, period in pairs]


def model_json(model: MeshModel) -> str:
    """The whole model as JSON, enough to build it again."""
    return json.dumps({**_fields(model), "stiffness_kind": _stiffness_kind(model)}, sort_keys=True)


def model_from_json(text: str) -> MeshModel:
    """The model that `model_json` wrote; raises `InputError` for anything else."""
    try:
        return _model(json.loads(text))
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise InputError("dataset", "must carry the model of its study as JSON in attrs['model']", text,
                         f"Compute it again, or load the file that was saved. ({error})") from error


def _model(values: dict[str, Any]) -> MeshModel:
    stiffness: type[Stiffness] = TwoLevelStiffness
    if values.pop("stiffness_kind") == "harmonics":
        stiffness = HarmonicStiffness
    parts = {"error": TransmissionError, "stiffness": stiffness}
    made = {n: kind(**{k: _hashable(v) for k, v in values[n].items()}) for n, kind in parts.items()}
    return MeshModel(**{**values, **made})


def _hashable(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _fields(model: MeshModel) -> dict[str, Any]:
    out = {f.name: getattr(model, f.name) for f in dataclasses.fields(model)}
    for name in ("error", "stiffness"):
        out[name] = dataclasses.asdict(out[name])
    return {**out, "initial": dict(model.initial)}


def _stiffness_kind(model: MeshModel) -> str:
    return "two-level" if isinstance(model.stiffness, TwoLevelStiffness) else "harmonics"


def provenance(study: str, model: MeshModel, **settings: Any) -> dict[str, Any]:
    """Attributes that say what was computed and with what."""
    return {
        "study": study, "model": model_json(model), "settings": json.dumps(settings, sort_keys=True),
        **_versions(),
    }


@cache
def _versions() -> dict[str, str]:
    return {f"{p}_version": metadata.version(p) for p in ("gearchaos", "numba", "numpy", "xarray")}


def save(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a Dataset as NetCDF (HDF5) with checksums, whole or not at all."""
    target = Path(path)
    _check_savable(dataset, target)
    check_target("path", target)
    write_bytes(target, netcdf(dataset))


def _check_savable(dataset: Any, target: Path) -> None:
    if not isinstance(dataset, xr.Dataset):
        raise InputError("dataset", "must be an xarray.Dataset", f"a {type(dataset).__name__}", "save(dataset, path).")
    if target.suffix and target.suffix.lower() not in DATA_SUFFIXES:
        raise InputError("path", f"must end in {', '.join(DATA_SUFFIXES)}, or have no ending", str(target),
                         "It is NetCDF that is written; dataset.to_dataframe().to_csv(path) writes a table.")


def netcdf(dataset: xr.Dataset) -> memoryview:
    """A Dataset as the bytes of a NetCDF (HDF5) file with checksums.

    It is made in memory, which takes as much again as the Dataset: HDF5 itself does not survive a full disk.
    """
    content = io.BytesIO()
    _checked(dataset).to_netcdf(content, engine="h5netcdf")  # type: ignore[call-overload]
    return content.getbuffer()


def _checked(dataset: xr.Dataset) -> xr.Dataset:
    """The same Dataset, to be written with checksums, so that a reader finds damaged numbers.

    HDF5 has none for single values and words.
    """
    out = dataset.copy(deep=False)
    for variable in out.variables.values():
        if variable.dims and variable.dtype.kind not in "OUT":
            variable.encoding["fletcher32"] = True
    return out


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a Dataset that `save` wrote; raises `InputError` if the file is another, or damaged."""
    if not Path(path).is_file():
        raise InputError("path", "must be a NetCDF file", str(path), _instead(Path(path)))
    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            return dataset.load()
    except (OSError, KeyError) as error:  # the latter where a name's record is damaged
        raise InputError("path", "must be a NetCDF file, whole and readable", str(path),
                         f"If gearchaos saved it, it is damaged: save it again. ({error})") from error


def _instead(path: Path) -> str:
    """What is where a file should be."""
    if path.is_dir():
        return "xarray.open_zarr reads the folder of a run."
    return f"It is {NO_FILE}." if path.exists() else "There is no such file."
