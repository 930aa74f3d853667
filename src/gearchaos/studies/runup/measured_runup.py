"""A measured run-up beside a computed one: orders of a table, or of a signal over time with the speed beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics.time_series import KEPT, resampled
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.gears.io import units
from gearchaos.gears.io.measured_quantities import MEASURED, other_quantities
from gearchaos.gears.io.order_spectrum import ORDER, OrderSpectrum, read_order_spectrum
from gearchaos.gears.io.tables import SPEED, TIME, Column, Table, has_column, read_table
from gearchaos.quantities import POSITIVE

if TYPE_CHECKING:
    import xarray as xr

COMPARED = 3
"""Most mesh harmonics that are compared: those with the largest amplitudes."""

_MOST_BYTES = 200_000_000  # of a file with a signal
_GAP = 1.5  # largest distance of instants over the usual one
_FINER = 4  # times as many instants, between which the signal is interpolated over the angle
_PER_ORDER = 2.56  # instants per turn over the highest order
_REVERSAL = 0.05  # least share of the range of speeds after the largest one in a run-down
_NO_TIME = 'Without a time give the samples a second: --sampling-rate "25.6 kHz", in Python sampling_rate="25.6 kHz".'
_NO_SPEED = ("The speed is that of wheel 1 at each instant, in rpm. Of a record at one speed gearchaos orders has the "
             "computed lines.")
_OTHER = ("A run-up has orders of the mesh force, and no {0}. gearchaos fit --of {0!r} compares a table of speed, "
          "order and amplitude.")


@dataclass(frozen=True)
class MeasuredOrders:
    """A table of amplitudes, N, over speeds and mesh harmonics."""

    spectrum: OrderSpectrum
    mesh_order: float

    @property
    def notes(self) -> tuple[str, ...]:
        return self.spectrum.notes

    def beside(self, computed: xr.Dataset) -> xr.Dataset:
        """``order_force`` over the first direction, the measured speeds and orders; NaN where there is none."""
        found = self.spectrum
        harmonics = np.unique(found.harmonic)
        force = np.full((1, len(found.speeds), len(harmonics)), np.nan)
        force[0, found.at, np.searchsorted(harmonics, found.harmonic)] = found.amplitude
        ways = computed["direction"].values[:1].tolist()
        return _dataset(ways, found.speeds, harmonics * self.mesh_order, force)


@dataclass(frozen=True)
class MeasuredSignal:
    """The mesh force (N,), N, over the time, ``rate`` samples a second, with the speed (N,), rpm, beside it."""

    force: np.ndarray
    speed: np.ndarray
    rate: float
    notes: tuple[str, ...]

    def beside(self, computed: xr.Dataset) -> xr.Dataset:
        """``order_force`` over the directions of the run, speeds as close as its windows allow, and the orders of the
        computed one."""
        order = computed["order"].values
        spectra, mean = order_spectra(self.force, self.speed, self.rate, round(1 / order[1]), len(order))
        last, least = int(np.argmax(mean)), _REVERSAL * np.ptp(mean)
        ways = {"up": slice(last + 1), "down": slice(last + 1, None)}
        if mean[last] - mean[-1] <= least:  # a run-up alone
            ways = {"up": slice(None)}
        elif mean[last] - mean[0] <= least:
            ways = {"down": slice(None)}
        gaps = [np.diff(np.sort(mean[part])).max(initial=0.0) for part in ways.values()]
        step = max(*gaps, float(np.ptp(computed["speed"].values)) / computed.sizes["speed"]) or 1.0
        centres = mean.min() + step * np.arange(round(np.ptp(mean) / step) + 1)
        at = np.digitize(mean, centres[:-1] + step / 2)
        if not set(ways) & set(own := computed["direction"].values.tolist()):
            raise InputError("against", "must have a direction of the run-up", ", ".join(ways),
                             f"Computed is {', '.join(own)}: run down as well.")
        out = np.full((len(ways), len(centres), len(order)), np.nan)
        for i, part in enumerate(ways.values()):
            for b in np.unique(at[part]):
                out[i, b] = np.sqrt(np.mean(spectra[part][at[part] == b] ** 2, axis=0))
        out[:, centres[:, None] * order / 60 > KEPT * self.rate] = np.nan
        kept = [i for i, way in enumerate(ways) if way in own]
        return _dataset([*ways][kept[0] : kept[-1] + 1], centres, order, out[kept])


def _dataset(ways: list[str], speeds: np.ndarray, orders: np.ndarray, force: np.ndarray) -> xr.Dataset:
    data = {"order_force": variable("order_force", ("direction", "speed", "order"), force)}
    data["order_force"].attrs["units"] = "N"
    coords = {"direction": np.array(ways), "speed": speeds, "order": orders}
    return new_dataset(data, {n: variable(n, (n,), v) for n, v in coords.items()}, {})


def measured_runup(
    path: str | Path, computed: xr.Dataset, columns: Mapping[str, str] | None = None,
    sampling_rate: float | str | None = None,
) -> xr.Dataset:
    """The orders of a measured run-up beside a computed one.

    Parameters
    ----------
    path : str or Path
        As for `read_measured_runup`.
    computed : Dataset
        From `gearchaos.runup`, in physical units.
    columns : mapping of str to str, optional
        Headers in the file by the names of columns.
    sampling_rate : frequency, optional
        As for `read_measured_runup`.

    Returns
    -------
    xarray.Dataset
        ``order_force``, N, over ``direction``, ``speed`` and ``order``; NaN where nothing was measured.

    Raises
    ------
    InputError
        If the computed run-up is not in physical units, or the measured one cannot be read or compared with it.
    """
    if computed["order_force"].attrs["units"] != "N":
        raise InputError("computed", "must be in the units of the gears", computed["order_force"].attrs["units"],
                         "E.g. gearchaos.physical(dataset).")
    speeds = computed["speed"].values
    found = read_measured_runup(path, computed.attrs["mesh_order"], (speeds[0], speeds[-1]), columns,
                                sampling_rate)
    return found.beside(computed)


def read_measured_runup(
    path: str | Path, mesh_order: float, speeds: tuple[float, float], columns: Mapping[str, str] | None = None,
    sampling_rate: float | str | None = None,
) -> MeasuredOrders | MeasuredSignal:
    """A measured run-up, from a table or a file in the Universal File Format.

    It has the columns ``speed``, ``order`` and ``amplitude``, ``rms`` or ``peak to peak`` of the mesh force, as for
    `gearchaos.fit`; or ``time``, ``speed`` of the first wheel, and ``force`` at even instants. In the Universal File
    Format (``.uff``, ``.unv``) these are spectra over the order, with the speed on the z axis, or signals over time.

    Parameters
    ----------
    path : str or Path
    mesh_order : float
        Of the turn of the first wheel.
    speeds : (float, float)
        The lowest and the highest computed speed, rpm. Of a signal what lies before and after them is left out.
    columns : mapping of str to str, optional
        Headers in the file by the names of columns.
    sampling_rate : frequency, optional
        Samples a second, Hz, of a signal in a file without a time.

    Raises
    ------
    InputError
        For a file that cannot be read as one, with a gap in time or too few samples per second, or without speeds of
        the run-up.
    """
    chosen = {*(columns or {})}
    rate = None if sampling_rate is None else units.to_si("sampling_rate", sampling_rate, units.FREQUENCY, POSITIVE)
    if "order" in chosen or ("time" not in chosen and rate is None and has_column(path, ORDER, "against", _MOST_BYTES)):
        spectrum = read_order_spectrum(path, "mesh force", mesh_order, columns, field="against")
        _check_speeds(spectrum.speeds, speeds)
        return MeasuredOrders(spectrum, mesh_order)
    table = _read_signal(path, columns, rate)
    speed, force = (table.columns[name] for name in ("speed", "force"))
    within = _check_speeds(speed, speeds)
    part = slice(within[0], within[-1] + 1)
    if rate is None:
        rate = (len(speed) - 1) / float(np.ptp(table.columns["time"]))
    highest = mesh_order * speed[part].max() / 60
    if highest > rate / 2:
        raise InputError("against", "must have more than two samples in a mesh cycle", f"{rate:.5g} samples a second",
                         f"The mesh frequency reaches {highest:.5g} Hz: sample {_PER_ORDER * highest:.5g} times a "
                         "second or more often.")
    return MeasuredSignal(force[part], speed[part], rate, table.notes)


def _check_speeds(measured: np.ndarray, computed: tuple[float, float]) -> np.ndarray:
    """The indices of the measured speeds within those computed; raises `InputError` if there are none."""
    within = np.flatnonzero((measured >= computed[0]) & (measured <= computed[1]))
    if not len(within):
        raise InputError("against", "must have speeds of the run-up", f"{measured.min():g} to {measured.max():g} rpm",
                         f"Computed are {computed[0]:.5g} to {computed[1]:.5g} rpm.")
    return within


def compared_orders(computed: xr.Dataset, measured: xr.Dataset) -> list[dict[str, float]]:
    """The largest measured and computed amplitudes of the strongest mesh harmonics, N, and the speeds at which they
    are, over the speeds that both have."""
    first, rows = computed.attrs["mesh_order"], list[dict[str, float]]()
    both = computed.sel(direction=measured["direction"]), measured
    for order in first * np.arange(1, round(computed["order"].values[-1] / first) + 1):
        row, cuts = {"order": float(order)}, [order_cut(each, order).dropna("speed", how="all") for each in both]
        if not all(cut.sizes["speed"] for cut in cuts):
            continue
        speeds = [cut["speed"].values for cut in cuts]  # that have this order
        low, high = max(each.min() for each in speeds), min(each.max() for each in speeds)
        for name, whole in zip(("computed", "measured"), cuts, strict=True):
            cut = whole.sel(speed=(whole["speed"] >= low) & (whole["speed"] <= high))
            if cut.notnull().any():
                at = cut[cut.argmax(...)]
                row |= {name: float(at), f"{name}_speed": float(at["speed"])}
        if len(row) == 5:
            rows.append(row)
    strongest = sorted(rows, key=lambda row: -max(row["computed"], row["measured"]))[:COMPARED]
    return sorted(strongest, key=lambda row: row["order"])


def order_cut(dataset: xr.Dataset, order: float) -> xr.DataArray:
    """The amplitudes at the order nearest to one, over direction and speed; NaN without one."""
    cut = dataset["order_force"].sel(order=order, method="nearest")
    return cut.where(abs(cut["order"] - order) < 1e-6 * order)


def _read_signal(path: str | Path, columns: Mapping[str, str] | None, rate: float | None) -> Table:
    """The columns speed, force and, without a rate, time of a signal; raises `InputError` where the time has a gap or
    the wheel does not turn."""
    force = Column("force", {units.FORCE: 1.0}, ("mesh force", "kraft"), MEASURED["mesh force"].words,
                   advice="The run-up has the orders of the mesh force.",
                   instead=other_quantities("mesh force", _OTHER))
    over = () if rate else ((replace(TIME, advice=_NO_TIME),),)
    table = read_table(path, (*over, (replace(SPEED, advice=_NO_SPEED),), (force,)), field="against", chosen=columns,
                       increasing=not rate, most=_MOST_BYTES, by_option=True)
    step = np.diff(table.columns.get("time", ()))
    usual = float(np.median(step)) if len(step) else 0.0
    if len(step) and step.max() > _GAP * usual:
        row = int(np.argmax(step > _GAP * usual)) + 1
        raise table.error(row, f"must be {usual:.4g} s after the line before, as most are", f"{step[row - 1]:.4g} s",
                          "The record has a gap: give the part before or after it.")
    if (stopped := table.columns["speed"] <= 0).any():
        row = int(np.argmax(stopped))
        raise table.error(row, "must have a speed greater than 0", table.shown("speed", table.columns["speed"][row]),
                          "Leave out where the wheel stands still.")
    return table


def order_spectra(
    signal: np.ndarray, speed: np.ndarray, rate: float, turns: int, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes (W, ``count``) of the orders k/``turns`` in windows of that many turns, and their mean speeds (W,).

    The signal (N,), ``rate`` a second, is interpolated at equal angles, which are the integral of the speed (N,), rpm,
    so closely that no frequency of it is lost at the lowest speed, and filtered to the orders.
    """
    from scipy.interpolate import CubicSpline  # here, since it takes a third of a second to load

    finer = _FINER * len(signal) - (_FINER - 1)
    instants = np.arange(finer) / _FINER
    turned = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / (120 * rate))])
    angle = CubicSpline(np.arange(len(signal)), turned)(instants)
    dense = resampled(signal, _FINER, 1)[:finer]
    per_turn = int(np.ceil(_PER_ORDER * count / turns))
    closer = int(np.ceil(60 * rate / (speed.min() * per_turn)))
    windows = int(turned[-1] // turns)
    if not windows:
        raise InputError("against", f"must have {turns} turns within the speeds of the run-up", float(turned[-1]))
    points = windows * turns * per_turn
    check_memory("turns times samples", points * closer, 40)
    at_angles = CubicSpline(angle, dense)(np.arange(points * closer) / (per_turn * closer))
    series = resampled(at_angles, 1, closer).reshape(windows, turns * per_turn)
    amplitude = np.abs(np.fft.rfft(series, axis=1))[:, :count] / (turns * per_turn / 2)
    amplitude[:, 0] /= 2
    begin = np.interp(np.arange(windows + 1) * turns, angle, instants / rate)
    return amplitude, 60 * turns / np.diff(begin)


def comparison_words(row: Mapping[str, Any]) -> str:
    """How much larger the measured amplitude is, in dB."""
    return f"{20 * np.log10(row['measured'] / row['computed']):+.1f}" if row["measured"] > 0 < row["computed"] else ""
