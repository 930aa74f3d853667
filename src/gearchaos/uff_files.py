"""Signals and order spectra in the Universal File Format, datasets 58, as programs of test benches read them."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics.time_series import evenly
from gearchaos.errors import InputError, missing_package
from gearchaos.files import check_target, temporary_folder

if TYPE_CHECKING:
    import xarray as xr

RATE_OVER_HIGHEST = 2.56
"""Samples per second of a signal over its highest frequency, as analysers take them."""

_STEPS = (1.0, 2.0, 2.5, 4.0, 5.0, 10.0)  # of rates per second whose inverse a header writes exactly, in six digits
# by unit: the unit of SI and how many of them it is, the type of the data, and the exponents of length and force
_UNITS = {"N": ("N", 1.0, 9, 0, 1), "N*m": ("N*m", 1.0, 1, 1, 1), "µm": ("m", 1e6, 8, 1, 0),
          "m/s^2": ("m/s^2", 1.0, 12, 1, 0), "rpm": ("rpm", 1.0, 19, 0, 0)}
_PER_SECOND = {"ms": 1e3}  # instants of a result that are not in seconds
_WAYS = {"up": "speed rising", "down": "speed falling"}


def save_uff(dataset: xr.Dataset, path: Path) -> None:
    """Write the order spectra of a Dataset in the units of gears, and its signals, as datasets 58 of one file.

    A spectrum is a function of the order, of a run-up one for each direction and speed, which is its value on the
    z axis, rpm. A signal is a function of time at even instants, of each direction, with the speed beside it. Units are
    those of SI, and rpm. The file appears, or replaces an older one, only when it is complete.

    Raises
    ------
    InputError
        If the package pyuff is missing, the Dataset has neither spectrum nor signal or is in other units, or the path
        cannot be written.
    """
    check_target("path", path)
    check_installed("path")
    sets = [*_spectra(dataset), *_signals(dataset)]
    if not sets:
        raise InputError("path", "must end in .nc or .csv for a result without order spectrum or signal",
                         str(path), "UFF is for results of orders, of runup, and of simulate with samples.")
    import pyuff

    units = {"type": 164, "units_code": 1, "units_description": "SI: Meter (newton)", "temp_mode": 1, "length": 1.0,
             "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    with temporary_folder(path.parent) as folder:
        partial = folder / "partial.uff"
        try:
            with warnings.catch_warnings(action="ignore", category=ResourceWarning):  # it leaves files to Python
                pyuff.UFF(str(partial)).write_sets([units, *sets], mode="overwrite")
        except Exception as error:  # pyuff raises its own for each, that of a full disk among them
            cause = error.__context__
            raise OSError(getattr(cause, "errno", None), str(cause or error), str(path)) from error
        os.replace(partial, path)


def check_installed(field: str) -> None:
    """Raise `InputError` unless the package that writes the files is there."""
    if find_spec("pyuff") is None:
        raise missing_package(field, "pyuff", "uff")


def _spectra(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """The amplitudes over order, those of a run-up for each direction and speed."""
    for name, values in dataset.data_vars.items():
        if values.dims[-1:] != ("order",) or not str(name).removeprefix("against_").startswith("order_"):
            continue
        others = values.dims[:-1]
        for at in np.ndindex(*(values.sizes[dim] for dim in others)):
            one = values.isel(dict(zip(others, at, strict=True)))
            if not one.notnull().all():
                continue
            speed = {"z_axis_value": one["speed"].item(), "z_axis_spec_data_type": 19, "z_axis_axis_lab": "speed",
                     "z_axis_axis_units_lab": "rpm"} if others else {}
            words = [_WAYS[one["direction"].item()]] if others else [dataset.attrs[n] for n in ("amplitude", "motion")]
            yield _function(one["order"].values, one, ", ".join(words), ("order", "", 20), **speed)


def _signals(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """The mesh force over time: of a run-up for each direction, with the speed beside it, of a simulation for each
    mesh, from its first instant on."""
    import xarray as xr

    if "mesh_force" in dataset and "tau" in dataset["mesh_force"].dims:
        tau, force = dataset["tau"], dataset["mesh_force"]
        time = (tau.values - tau.values[0]) / _PER_SECOND.get(tau.attrs["units"], 1.0)
        for name, values in zip(dataset["mesh"].values.tolist() if "mesh" in dataset.dims else ["mesh"],
                                force.values.reshape(len(time), -1).T, strict=True):
            of_mesh = xr.DataArray(values, name=force.name, attrs=force.attrs)
            yield _function(time, of_mesh, name, ("time", "s", 17), binary=1, func_type=1)
    if "signal_force" not in dataset:
        return

    rate = even_rate(dataset["order"].values[-1] * dataset["speed"].values[-1] / 60)
    for way in dataset["direction"].values.tolist():
        one = dataset.sel(direction=way)
        known = np.isfinite(one["signal_force"].values)
        if np.count_nonzero(known) < 2:  # the run did not come here
            continue
        for name in ("signal_force", "signal_speed"):
            instants, values = evenly(one["signal_time"].values[known], one[name].values[known], rate)
            even = xr.DataArray(values, name=name, attrs=one[name].attrs)
            yield _function(instants, even, _WAYS[way], ("time", "s", 17), binary=1, func_type=1)


def even_rate(highest: float) -> float:
    """The least number of samples per second for signals up to the frequency ``highest``, Hz, whose inverse has at most
    six digits: the header of a file has no more."""
    least = RATE_OVER_HIGHEST * highest
    decade = 10.0 ** np.floor(np.log10(least))
    return float(next(step * decade for step in _STEPS if step * decade >= least))


def _function(
    x: np.ndarray, values: xr.DataArray, of: str, axis: tuple[str, str, int], **fields: Any
) -> dict[str, Any]:
    """The dataset 58 of values (N,) at x (N,), which are ``of`` something; an axis has a label, a unit and the type of
    its data."""
    if values.attrs["units"] not in _UNITS:
        raise InputError("dataset", "must be in the units of the gears", values.attrs["units"],
                         "E.g. gearchaos.physical(dataset).")
    unit, number, kind, length, force = _UNITS[values.attrs["units"]]
    step = float(f"{x[1] - x[0]:.5e}")
    even = len(x) > 2 and bool(np.allclose(x, x[0] + step * np.arange(len(x)), rtol=1e-12, atol=1e-9 * step))
    label, abscissa_unit, abscissa_kind = axis
    own = str(values.name).replace("order_", "").replace("signal_", "").replace("_", " ")[:20]  # a field has no more
    return {
        "type": 58, "id1": f"{values.attrs['long_name']}, {of}"[:80], "id2": "gearchaos", "func_type": 0, "rsp_node": 1,
        "rsp_dir": 0, "ref_node": 0, "ref_dir": 0, "x": x, "data": values.values.astype(float) / number,
        "abscissa_spacing": int(even), "abscissa_spec_data_type": abscissa_kind, "abscissa_axis_lab": label,
        "abscissa_axis_units_lab": abscissa_unit, "ordinate_spec_data_type": kind, "ordinate_len_unit_exp": length,
        "ordinate_force_unit_exp": force, "ordinate_axis_lab": own, "ordinate_axis_units_lab": unit,
        "orddenom_spec_data_type": 0, **fields}
