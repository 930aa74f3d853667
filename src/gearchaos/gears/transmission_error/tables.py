"""Static transmission error from measured orders, or from a table over the roll angle.

Both describe gears without load, or with a load so small that teeth do not deflect: the elastic part must not be in
them. The sign is that of `gearchaos.gears.transmission_error.harmonics`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.tables import Column, Table, read_table
from gearchaos.gears.stiffness.table import ROLL_ANGLE
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics, check_orders, evaluate
from gearchaos.validation import MAX_HARMONICS

_FIELD, _PEAK, _PEAK_TO_PEAK = "transmission_error", "peak", "peak to peak"
_AMPLITUDE_ADVICE = ("The amplitude e_j of a harmonic is its peak value: half of its peak-to-peak value, or its rms "
                     "value multiplied by 1.41421. ")
_RMS = r"\brms\b|effektiv|effective"
_OTHER_ERROR = (r"(?<!un)loaded|under load|(?<!un)belastet|unter last|pitch|teil|prof|lead|helix|flank|run ?out|"
                r"rundlauf|single|einzel|peak|rms")
# difference from a mesh period, in mesh periods, that the rounding of roll angles in a file explains
_PERIOD_TOLERANCE = 1e-3
_ROUNDING = 1e-9  # amplitudes over the largest error that may be due to rounding alone
# largest difference between the errors at both ends of a mesh period over the peak-to-peak value, for the noise of a
# measurement
_CLOSING_TOLERANCE = 0.01
# largest slope between the last row and the beginning of the next mesh period over the largest one in the table
_CLOSING_SLOPE = 3.0
_UNIT_ADVICE = "Check the unit in the header: errors of gears are some µm. At most half a module is accepted."
_SHAFT_ADVICE = ("Order 1 is the mesh frequency: divide the orders of a shaft by the number of teeth of its wheel, and "
                 "leave out those that are then no whole number.")


def _meant(radius: float | None) -> tuple[dict[units.Dimension, float], str]:
    """The unit of an error, a length or the angle of a wheel of a base radius, m, and what to do about another one."""
    if radius is None:
        advice = "For an angle write wheel = 1 or wheel = 2 beside the file: the wheel whose angle it is."
        return {units.LENGTH: 1.0}, advice
    return {units.ANGLE: radius}, "For a length along the line of action leave out wheel beside the file."


def _notes(table: Table, radius: float | None) -> tuple[str, ...]:
    if radius is None:
        return table.notes
    return (*table.notes, f"the errors are angles of a wheel, multiplied by its base radius, {radius * 1e3:.6g} mm")


def from_orders(
    path: str | Path, teeth: tuple[int, ...] = (), *, most: float = math.inf, radius: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> ErrorHarmonics:
    """Harmonics from a file of measured orders of the mesh frequency; orders that it leaves out have amplitude 0.

    The columns are ``order``, ``phase`` and either ``peak`` or ``peak to peak``: the amplitude e_j or twice it. The
    error of order j is e_j cos(j θ − phase), where θ = 0 is the instant at which a tooth pair enters contact. Multiples
    of one of ``teeth`` may be orders of its shaft: they have a warning. ``most`` is the largest plausible amplitude, m.
    With a base radius, m, the amplitudes are angles of that wheel. ``columns`` are headers in the file by names. Raises
    `InputError` with the number of the line.
    """
    scales, advice = _meant(radius)
    kinds = tuple(
        Column(name, scales, other=_RMS, advice=_AMPLITUDE_ADVICE + advice) for name in (_PEAK, _PEAK_TO_PEAK))
    phase = Column("phase", {units.ANGLE: 1.0}, ("phase angle", "phasenwinkel"), words="phase")
    table = read_table(path, ((Column("order", aliases=("ordnung",)),), kinds, (phase,)), field=_FIELD, chosen=columns)
    kind = next(name for name in (_PEAK, _PEAK_TO_PEAK) if name in table.columns)
    orders: list[int] = []
    for row, order in enumerate(table.columns["order"].tolist()):
        if order != round(order) or order < 1:
            raise table.error(
                row, "must have an order that is a positive whole number", order,
                "Orders count periods per mesh period. Once per turn of a wheel with z teeth is 1/z, which a model "
                "whose period is the mesh period cannot have. The mean, order 0, does not matter.")
        if order > MAX_HARMONICS:
            raise table.error(row, f"must have an order of at most {MAX_HARMONICS}", order, _SHAFT_ADVICE)
        if int(order) in orders:
            raise table.error(row, f"must not repeat the order of line {table.lines[orders.index(int(order))]}", order,
                              "Remove one of the two rows.")
        orders.append(int(order))
    values = table.columns[kind] * (1.0 if kind == _PEAK else 0.5)
    if (values < 0).any():
        row = int(np.argmax(values < 0))
        raise table.error(row, "must not have a negative amplitude", table.shown(kind, table.columns[kind][row]),
                          "Add 180 deg to the phase.")
    _check_amplitudes(table, values, most)
    amplitudes, phases = np.zeros(max(orders)), np.zeros(max(orders))
    for order, value, phase in zip(orders, values, table.columns["phase"], strict=True):
        amplitudes[order - 1], phases[order - 1] = value, phase
    # orders of the mesh are among those of a shaft the multiples of its number of teeth
    found, name = [[o for o in orders if o % count == 0] for count in teeth], Path(table.path).name
    warning: tuple[str, ...] = ()
    if multiples := max(found, key=len, default=[]):
        wheel = found.index(multiples)
        which = f"All orders of {name}" if len(multiples) == len(orders) else (
            f"Orders of {name}, {', '.join(map(str, multiples))},")
        warning = (f"{which} are multiples of z{wheel + 1} = {teeth[wheel]}: are they those of the shaft? "
                   f"{_SHAFT_ADVICE}",)
    return ErrorHarmonics(
        amplitudes=tuple(amplitudes.tolist()), phases=tuple(phases.tolist()), source=f"orders of {name}, {kind}",
        warnings=warning, assumptions=_notes(table, radius))


def _check_amplitudes(table: Table, amplitudes: np.ndarray, most: float) -> None:
    """Raise `InputError` for an amplitude, in m, that only a wrong unit explains."""
    if (amplitudes > most).any():
        row = int(np.argmax(amplitudes > most))
        raise table.error(row, f"must have an amplitude of at most {units.Length(most)}",
                          units.Length(amplitudes[row]), _UNIT_ADVICE)


def from_table(
    path: str | Path, teeth1: int, orders: int = 8, *, most: float = math.inf, radius: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> ErrorHarmonics:
    """Harmonics from a file with the error over the roll angle of wheel 1; the mesh period is 2π/``teeth1``.

    The columns are ``roll angle`` and ``error``. Roll angle 0 is the instant at which a tooth pair enters contact; the
    angles increase. A table of one mesh period must return to its first error: the error of the gears without load is
    continuous. One of several periods need not, since it may contain orders of the shafts. ``most`` is the largest
    plausible difference of an error from the mean, m; the rest as in `from_orders`.
    """
    scales, advice = _meant(radius)
    column = Column("error", scales, ("transmission error", "value", "te", "drehfehler", "drehwegfehler"),
                    r"\bte\b|error|fehler|abweich|devia", _OTHER_ERROR, advice)
    table = read_table(path, ((ROLL_ANGLE,), (column,)), field=_FIELD, chosen=columns, increasing=True)
    periods, error = table.columns["roll angle"] * teeth1 / (2 * math.pi), table.columns["error"]
    _check_amplitudes(table, np.abs(error - np.mean(error)), most)
    last, missing = len(error) - 1, 1 - float(periods[-1] - periods[0])
    if last > 7 and error[-1] == error[0] and abs(missing - round(missing)) > _PERIOD_TOLERANCE:
        raise table.error(last, "must not return exactly to the first error between two ends of mesh periods",
                          f"{1 - missing:.5g} mesh periods",
                          "Check the number of teeth, and that the angle is that of wheel 1.")
    if last and -_PERIOD_TOLERANCE <= missing < 0.5:  # one mesh period, which must return to its first error
        # where the last row lies before the end of the period, the slope from there on decides
        steepest = float(np.max(np.abs(np.diff(error)) / np.diff(periods)))
        closed = _CLOSING_TOLERANCE * float(np.ptp(error)) + _CLOSING_SLOPE * steepest * max(missing, 0.0)
        if abs(error[-1] - error[0]) > closed:
            raise table.error(
                last, f"must return to the error of line {table.lines[0]}, {error[0] * 1e6:.6g} µm, with which the "
                "next mesh period begins", f"{error[-1] * 1e6:.6g} µm",
                "The error of the gears without load is continuous. Remove the drift, or give several mesh periods.")
    try:
        found = fit_harmonics(periods, error, orders, source=f"curve of {Path(table.path).name}")
    except InputError as refused:
        raise table.error(last, f"must be the last of rows that give {orders} harmonics",
                          f"{periods[-1] - periods[0]:.4g} mesh periods", f"{refused}") from None
    _check_teeth(table, periods, found, teeth1)
    return replace(found, assumptions=_notes(table, radius))


def _check_teeth(table: Table, periods: np.ndarray, found: ErrorHarmonics, teeth: int) -> None:
    """Raise `InputError` if an error over several mesh periods contradicts the number of teeth.

    A record that does not end a mesh period, but for one row, must repeat itself. In one of whole turns the strongest
    order, runout apart, must be one of the mesh. The first harmonic of the mesh must not be missing.
    """
    span, longest, value = float(periods[-1] - periods[0]), float(np.diff(periods).max()), ""
    count, strongest = round(span), max(found.amplitudes)
    if math.ceil(span - _PERIOD_TOLERANCE) - span > (1 + _PERIOD_TOLERANCE) * longest and found.warnings:
        value = f"{span:.5g} mesh periods, in which the error does not repeat itself"
    elif count and count % teeth == 0:
        grid = np.arange(2 * MAX_HARMONICS * count) / (2 * MAX_HARMONICS)
        error = np.interp(grid, periods - periods[0], table.columns["error"], period=count)
        lines = 2 * np.abs(np.fft.rfft(error - found.at(grid + periods[0]), norm="forward"))
        lines[len(found.phases) * count:] = 0.0
        lines[: count // 2] = 0.0  # runout and what else is slow
        if lines.max() > strongest or found.amplitudes[0] < _PERIOD_TOLERANCE * strongest:
            order = int(np.argmax(lines)) if lines.max() > strongest else count * int(np.argmax(found.amplitudes) + 1)
            value = f"turns in which the error repeats itself {order * teeth / count:.6g} times, not {teeth} times"
    elif found.amplitudes[0] < _PERIOD_TOLERANCE * strongest > _ROUNDING * float(np.abs(table.columns["error"]).max()):
        value = f"mesh periods in each of which the error has {np.argmax(found.amplitudes) + 1} periods"
    if value:
        raise table.error(len(periods) - 1, "must end whole mesh periods, best a turn of wheel 1", value,
                          "Check the number of teeth, and that the angle is that of wheel 1. An error whose first "
                          "harmonic is missing has orders.")


def fit_harmonics(tau: np.ndarray, error: np.ndarray, orders: int, *, source: str = "curve") -> ErrorHarmonics:
    """Harmonics of an error sampled at times ``tau`` in mesh periods, by least squares with a mean, which is left out.

    Each sample has the weight of its share of the time, so that they need not be equidistant. The residual has all
    else: higher harmonics, and what repeats with the shafts where the samples cover several mesh periods. A warning
    says if its root mean square exceeds a tenth of that of the error. Raises `InputError` if the samples, folded into
    one period, leave a gap of half the shortest wavelength or more: the highest harmonic is then not determined.
    """
    count, times = check_orders(orders), np.asarray(tau, dtype=float)
    in_period = np.sort(np.mod(times, 1.0))
    gap = float(np.diff(np.append(in_period, in_period[0] + 1)).max())
    if gap * 2 * count >= 1 - 1e-9:
        most = max(math.ceil(0.5 / gap - 1e-9) - 1, 0)
        raise InputError("orders", f"must be at most {most} for samples with gaps of {gap:.4g} mesh periods", count,
                         "Give the error over at least one whole mesh period, in smaller steps.")
    angle = 2 * np.pi * times[:, None] * np.arange(1, count + 1)
    basis = np.hstack([np.ones((len(angle), 1)), np.cos(angle), np.sin(angle)])
    # each sample weighs its share of the time by the trapezoidal rule, those of the same time share it; the first and
    # the last one share what is left of the last mesh period, if it is no longer than the longest step
    instants, index, counts = np.unique(times, return_inverse=True, return_counts=True)
    steps, span = np.diff(instants), float(instants[-1] - instants[0])
    left = max(math.ceil(span - _PERIOD_TOLERANCE) - span, 0.0)
    left = left if left <= (1 + _PERIOD_TOLERANCE) * steps.max() else 0.0
    shares = ((np.append(left, steps) + np.append(steps, left)) / 2 / counts)[index]
    weights = np.round(shares / np.median(shares), 12)  # exactly 1 for equal steps
    root = np.sqrt(weights)
    solution = np.linalg.lstsq(basis * root[:, None], error * root, rcond=None)[0]
    cosine, sine = solution[1 : count + 1], solution[count + 1:]
    amplitudes, phases = tuple(np.hypot(cosine, sine).tolist()), tuple(np.arctan2(sine, cosine).tolist())
    varying = error - solution[0]
    rest = varying - evaluate(amplitudes, phases, tau)
    rms, whole = (float(np.sqrt(np.average(v**2, weights=weights))) for v in (rest, varying))
    missing = (f"{count} harmonics leave {rms / whole:.0%} of the error's rms value out: higher harmonics, and what "
               "does not repeat with the mesh, such as runout" if rms > max(
                   0.1 * whole, _ROUNDING * float(np.abs(error).max())) else "")
    return ErrorHarmonics(
        amplitudes=amplitudes, phases=phases, source=source, residual_rms=rms, residual_peak=float(np.abs(rest).max()),
        warnings=(missing,) if missing else ())
