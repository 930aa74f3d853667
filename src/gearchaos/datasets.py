"""Labelled results: names, units and provenance of what the studies return, saved and loaded."""

from __future__ import annotations

import dataclasses
import io
import json
import os
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics import REASONS, Label, Reason, motion_name
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES, NO_FILE, check_target, write_bytes
from gearchaos.model import HarmonicStiffness, MeshModel, Stiffness, TransmissionError, TwoLevelStiffness

if TYPE_CHECKING:
    import xarray as xr

_LENGTH, _TIME = "delta", "1/omega0"
_NAMES: dict[str, tuple[str, str]] = {
    "omega": ("mesh frequency", "omega0"),
    "tau": ("time", _TIME),
    "z": ("dynamic transmission error", _LENGTH),
    "z_dot": ("velocity of the dynamic transmission error", f"{_LENGTH}*omega0"),
    "v_rms": ("rms velocity", f"{_LENGTH}*omega0"),
    "contact_fraction": ("share of the time in contact", "1"),
    "dynamic_factor": ("dynamic factor", "1"),
    "mesh_force": ("mesh force", f"c0*{_LENGTH}"),
    "mesh_force_peak": ("peak of the mesh force", f"c0*{_LENGTH}"),
    "contact": ("contact state", "1"),
    "label": ("kind of motion", "1"),
    "period": ("period", "T"),
    "reason": ("reason of the verdict", "1"),
    "lyapunov": ("largest Lyapunov exponent", "omega0"),
    "lyapunov_lo": ("lower end of its 99 % interval", "omega0"),
    "lyapunov_hi": ("upper end of its 99 % interval", "omega0"),
    "lyapunov_spectrum": ("Lyapunov exponents, largest first", "omega0"),
    "lyapunov_spectrum_lo": ("lower ends of their intervals", "omega0"),
    "lyapunov_spectrum_hi": ("upper ends of their intervals", "omega0"),
    "trace_error": ("distance of the exponents' sum from the trace", "omega0"),
    "residual": ("change of the polished orbit over one round", "1"),
    "multiplier": ("largest modulus of the Floquet multipliers", "1"),
    "multipliers_real": ("real parts of the Floquet multipliers", "1"),
    "multipliers_imag": ("imaginary parts of the Floquet multipliers", "1"),
    "rotation": ("rotation number, or a multiple of it", "1/T"),
    "inferred": ("whether a cell was inferred, not computed", "1"),
    "transient_chaos": ("whether chaos came before the motion settled", "1"),
    "periods_spent": ("transient and exponent run", "T"),
    "attractors": ("number of attractors found", "1"),
    "v_rms_least": ("least rms velocity of the attractors", f"{_LENGTH}*omega0"),
    "v_rms_most": ("largest rms velocity of the attractors", f"{_LENGTH}*omega0"),
    "v_rms_up": ("rms velocity after a sweep up", f"{_LENGTH}*omega0"),
    "v_rms_down": ("rms velocity after a sweep down", f"{_LENGTH}*omega0"),
    "hysteresis": ("whether the sweeps end in different motions", "1"),
    "contact_worst": ("worst contact state of the attractors", "1"),
    "fraction": ("share of the starts", "1"),
    "fraction_lo": ("lower end of its 95 % interval", "1"),
    "fraction_hi": ("upper end of its 95 % interval", "1"),
    "kick": ("smallest change of the state that leaves the basin", "1"),
    "basin_entropy": ("basin entropy", "nat"),
    "boundary_basin_entropy": ("boundary basin entropy", "nat"),
    "uncertainty_exponent": ("uncertainty exponent of the boundary", "1"),
    "switches": ("contact switches per mesh period", "1/T"),
    "z_rms": ("rms of z about its mean", _LENGTH),
    "z_peak_to_peak": ("peak to peak of z", _LENGTH),
    "z_dot_rms": ("rms of z'", f"{_LENGTH}*omega0"),
    "z_dot_peak_to_peak": ("peak to peak of z'", f"{_LENGTH}*omega0"),
}


def describe(name: str) -> dict[str, str]:
    """long_name and units of a variable or axis, by its name; parameters are dimensionless."""
    base = name.removeprefix("section_").removeprefix("attractor_section_").removeprefix("attractor_")
    if base in _NAMES:
        long_name, units = _NAMES[base]
    elif base[:2] in ("x1", "x2", "y1", "y2"):
        long_name, units = base, f"{_LENGTH}*omega0" if base.endswith("_dot") else _LENGTH
    else:
        long_name, units = base, "1"
    prefix = "stroboscopic " if "section_" in name else ""
    return {"long_name": prefix + long_name, "units": units}


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
    """A variable with its name, units and codes."""
    import xarray as xr

    base = name.removeprefix("attractor_")
    codes = _CODES.get(base, {}) if coded else {}
    return xr.Variable(dims, values, {**describe(name), **codes})


def new_dataset(
    data: Mapping[str, Any], coords: Mapping[str, Any] | None = None, attrs: Mapping[str, Any] | None = None
) -> xr.Dataset:
    """A Dataset of some variables.

    Here and in `variable` xarray is imported when it is first used: with pandas it takes half a second, which what
    needs no Dataset, as a verdict on the command line, does not wait for.
    """
    import xarray as xr

    return xr.Dataset(data, coords, attrs)


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
    import xarray as xr

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
    import xarray as xr

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
