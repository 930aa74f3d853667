"""Mesh stiffness from a table in a file, for example computed by finite elements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.tables import Column, Table, read_table
from gearchaos.gears.stiffness import MeshStiffness, from_curve
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, folded, periodic_curve

TIME = units.Dimension("a time", "s", "2 ms")
STIFFNESS_PER_WIDTH = units.Dimension("a stiffness over face width", "N/m^2", "14 N/(mm*um)")
_OTHER_WHEEL = r"(wheel|gear|rad) ?2|\b(wheel|gear|rad)\b(?! ?1)|driven|output|abtrieb|getrieben"
# the roll angle of wheel 1
ROLL_ANGLE = Column(
    "roll angle", {units.ANGLE: 1.0}, ("angle", "rotation", "pinion rotation", "drehwinkel"),
    words=r"angle|winkel|rotation|roll|dreh|\bphi|φ", advice="The roll angle is that of wheel 1.",
    other=rf"press|eingriff|contact|helix|schräg|phase|error|fehler|abweich|devia|pitch|teilung|{_OTHER_WHEEL}")
_ABSCISSAE = (
    Column("fraction", aliases=("fraction of mesh period", "mesh period", "tau/T", "t/T")), ROLL_ANGLE,
    Column("time", {TIME: 1.0}, ("t", "zeit"), words="time|zeit"))
_OTHER_STIFFNESS = ("single|einzel|pair|paar|bear|lager|shaft|well|tors|dreh|axial|body|bend|bieg|hertz|mean|mittel|"
                    "average")
# least and greatest stiffness that a mesh of gears may have, N/m: steel gears of a face width of 1 mm and of 5 m have
# about 1e7 and 1e11, plastic ones a hundredth
_PLAUSIBLE = (1e3, 1e14)
# largest difference between the last abscissa of a table and a whole number of mesh periods, in mesh periods, for
# rounding in the file
_PERIOD_TOLERANCE = 1e-3
# largest relative difference between the values at the beginning and the end of the period, likewise
_CLOSING_TOLERANCE = 1e-4
# largest relative difference of equal steps, largest such step in mesh periods of a table without the row that closes
# the period, and how many equal steps are no chance
_STEP_TOLERANCE, _LARGEST_STEP, _MANY_STEPS = 0.1, 0.2, 8
# largest root mean square of what does not repeat with the mesh, over that of the variation of the stiffness
_REST_TOLERANCE = 0.1


def from_table(
    path: str | Path, *, teeth: int, speed: float | None = None, face_width: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> MeshStiffness:
    """Mesh stiffness from a table over whole mesh periods, for example computed by finite elements.

    The abscissa is the ``fraction`` of the mesh period, from 0 to 1, the ``roll angle`` of wheel 1, from 0 to 2π/z1, or
    the ``time``, from 0 to the mesh period at ``speed``, rpm, given only for a table over time. At 0 a tooth pair
    enters contact. The other column is

    - either ``stiffness``: points of a curve that is linear between them. Two rows with the same abscissa are a jump.
      The last row is the end of the period; its value must equal the first one. If the curve jumps there, as that of
      spur gears does, the last two rows have the same abscissa. Rows in equal steps may lack the closing one.
    - or ``level``: steps, each of which begins at its abscissa. The first begins at 0, the last one ends with the
      period. Up to 64 steps are taken over exactly.

    A stiffness in N/(mm µm) is multiplied by ``face_width``, m. A table over several mesh periods becomes the mean of
    them. The notes say so, and which columns were taken, unless they have the names above. Raises `InputError` with the
    number of the line. The last abscissa may differ from whole periods by 0.1 % of one, the last value from the first
    one by 0.01 %, for rounding in the file. What does not repeat with the mesh may be a tenth of the variation of the
    stiffness.
    """
    curve, notes = read_curve(path, teeth=teeth, speed=speed, face_width=face_width, columns=columns)
    return from_curve(curve, f"table {Path(path).name}", notes)


def read_curve(
    path: str | Path, *, teeth: int, speed: float | None = None, face_width: float | None = None,
    columns: Mapping[str, str] | None = None, field: str = "stiffness.table",
) -> tuple[PeriodicCurve, tuple[str, ...]]:
    """The curve of a table in N/m, and notes on how it was read; see `from_table`."""
    scales = {units.STIFFNESS: 1.0, **({} if face_width is None else {STIFFNESS_PER_WIDTH: face_width})}
    values = (Column("stiffness", scales, ("mesh stiffness", "k", "c", "value", "eingriffssteifigkeit"), "stiff|steif",
                     _OTHER_STIFFNESS), Column("level", scales, ("stiffness level",)))
    table = read_table(path, (_ABSCISSAE, values), field=field, chosen=columns, increasing=True, jumps=True)
    (abscissa, x), (kind, k) = table.columns.items()
    least, most = _PLAUSIBLE
    if not ((k >= least) & (k <= most)).all():
        row = int(np.argmin((k >= least) & (k <= most)))
        raise table.error(row, f"must have a {kind} between {least:g} and {most:g} N/m", table.shown(kind, k[row]),
                          "No mesh of gears has another one: check the unit in the header.")
    if x[0] != 0:
        raise table.error(0, f"must have the {abscissa} 0, at which a tooth pair enters contact",
                          table.shown(abscissa, x[0]), "Subtract it from all rows if a tooth pair enters there.")
    if abscissa == "time":
        if speed is None or not speed > 0:
            raise InputError("stiffness.speed", "must be given, greater than 0, for a stiffness over time", speed,
                             "Or give the stiffness over the fraction of the mesh period.")
        period = 2 * math.pi / (teeth * (speed * units.RPM))
    elif speed is not None:
        raise InputError("stiffness.speed", f"must be left out for a stiffness over the {abscissa}", speed)
    else:
        period = 1.0 if abscissa == "fraction" else 2 * math.pi / teeth
    curve, cycles, notes = (_steps if kind == "level" else _points)(table, x, k, period)
    curve, of_cycles = _one_period(table, curve, cycles)
    return curve, (*table.notes, *notes, *of_cycles)


# the curve over the whole table, how many mesh periods that are, and notes
_Whole = tuple[PeriodicCurve, int, tuple[str, ...]]


def _steps(table: Table, x: np.ndarray, values: np.ndarray, period: float) -> _Whole:
    """The curve of a table of levels."""
    abscissa, positions = next(iter(table.columns)), x / period
    equal = np.flatnonzero(np.diff(x) == 0)
    if len(equal):
        raise table.error(int(equal[0]) + 1, f"must not repeat the {abscissa} of line {table.lines[equal[0]]}",
                          table.shown(abscissa, x[equal[0]]), "Each level begins at its own one.")
    cycles = max(math.ceil(positions[-1] - _PERIOD_TOLERANCE), 1)
    if positions[-1] >= cycles - _PERIOD_TOLERANCE:
        raise table.error(len(x) - 1, f"must have a {abscissa} less than {_periods(table, cycles, period)}",
                          table.shown(abscissa, x[-1]), "Each level begins at its row, the last one ends with the "
                          "period. Remove this line if it is the end of the period.")
    steps, rest = np.diff(positions), cycles - float(positions[-1])
    if len(steps) >= _MANY_STEPS and np.ptp(steps) < 0.01 * rest and not 0.5 < rest / steps[0] < 1.5:
        raise table.error(len(x) - 1, "must begin the last of equal steps", f"one of {rest:.4g} mesh periods after "
                          f"those of {steps[0]:.4g}", "Check the numbers of teeth.")
    return PeriodicCurve(np.append(positions / cycles, 1.0), values, values), cycles, ()


def _points(table: Table, x: np.ndarray, values: np.ndarray, period: float) -> _Whole:
    """The curve of a table of points, closed by its first value if the row that closes it is missing."""
    notes: tuple[str, ...] = ()
    (abscissa, kind), last, end = table.columns, len(x) - 1, float(x[-1] / period)
    cycles, closing = max(round(end), 1), abs(values[-1] / values[0] - 1)
    if abs(end - cycles) > _PERIOD_TOLERANCE:
        cycles, steps = max(math.ceil(end), 1), np.diff(x) / period
        step = float(np.median(steps)) if last else 0.0
        equal = step < _LARGEST_STEP and bool(
            np.abs(steps - step).max(initial=0.0) < _STEP_TOLERANCE * step > abs(cycles - end - step))
        if closing <= _CLOSING_TOLERANCE or not equal:  # the row that would close the period is not the one missing
            raise table.error(last, f"must have the {abscissa} of the end of {_periods(table, cycles, period)}",
                              table.shown(abscissa, x[-1]), f"It is {end:.5g} mesh periods. A table covers whole ones, "
                              "including the end of the last one: check the numbers of teeth.")
        x, values = np.append(x, cycles * period), np.append(values, values[0])
        notes = ("the table has no row that closes the mesh period: its first value is taken",)
    elif closing > _CLOSING_TOLERANCE:
        raise table.error(last, f"must have the stiffness of line {table.lines[0]}, {table.shown(kind, values[0])}, "
                          "with which the next period begins", table.shown(kind, values[-1]), "If the curve jumps "
                          f"there, add a line with the same {abscissa} and the value after the jump.")
    return periodic_curve(x / x[-1], np.append(values[:-1], values[0])), cycles, notes


def _periods(table: Table, cycles: int, period: float) -> str:
    """A number of mesh periods in words, with their length in the unit of the file."""
    what = "the mesh period" if cycles == 1 else f"{cycles} mesh periods"
    return f"{what}, {table.shown(next(iter(table.columns)), cycles * period)}"


def _one_period(table: Table, curve: PeriodicCurve, cycles: int) -> tuple[PeriodicCurve, tuple[str, ...]]:
    """The mean of the mesh periods of a curve, and a note on it."""
    found, last = folded(curve, cycles, _PERIOD_TOLERANCE), len(table.lines) - 1
    advice = "Check the numbers of teeth, and that the angle is that of wheel 1; or give one mesh period."
    if found is None:
        raise table.error(last, f"must have the same jumps in each of its {cycles} mesh periods",
                          f"{len(curve.jumps)} jumps", advice)
    curve, rest = found
    mean, amplitudes = curve.mean, curve.fourier(8)[0]
    variation = PeriodicCurve(curve.knots, curve.first - mean, curve.last - mean).mean_square()
    if rest > max(_REST_TOLERANCE * math.hypot(math.sqrt(variation), rest), _PERIOD_TOLERANCE * mean):
        raise table.error(last, f"must repeat itself in each of its {cycles} mesh periods",
                          f"{rest / mean:.1%} of the mean that does not", advice)
    if amplitudes[0] < _PERIOD_TOLERANCE * amplitudes.max() > _CLOSING_TOLERANCE * _PERIOD_TOLERANCE * mean:
        raise table.error(last, "must have one period in a mesh period", f"{int(np.argmax(amplitudes)) + 1} periods",
                          advice)
    return curve, () if cycles == 1 else (
        f"the table covers {cycles} mesh periods: their mean is taken, from which they differ by "
        f"{rest / mean:.1%} of the mean stiffness (root mean square)",)
