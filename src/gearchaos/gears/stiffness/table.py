"""Mesh stiffness from a table in a text file, for example computed by finite elements."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.inputs.csvtable import Column, Table, read_table
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, periodic_curve

TIME = units.Dimension("a time", "s", "2 ms")

ABSCISSAE = ("fraction", "roll angle", "time")

_COLUMNS = (
    Column("fraction", aliases=("fraction of mesh period", "mesh period", "tau/T", "t/T"), required=False),
    Column("roll angle", units.ANGLE, ("angle", "rotation", "pinion rotation"), required=False),
    Column("time", TIME, ("t",), required=False),
    Column("stiffness", units.STIFFNESS, ("mesh stiffness", "k", "c"), required=False),
    Column("level", units.STIFFNESS, ("stiffness level",), required=False, by_unit=False),
)

_PLAUSIBLE = (1e3, 1e14)
"""Least and greatest stiffness that a mesh of gears may have, N/m: steel gears of a face width of 1 mm and of 5 m have
about 1e7 and 1e11, plastic ones a hundredth."""

_PERIOD_TOLERANCE = 1e-3
"""Largest relative difference between the last abscissa of a table and the mesh period, for rounding in the file."""

_CLOSING_TOLERANCE = 1e-4
"""Largest relative difference between the values at the beginning and the end of the period, likewise."""


def read_curve(path: str | Path, *, field: str, teeth: int, speed: float | None = None) -> PeriodicCurve:
    """The curve of a table in N/m; see `gearchaos.gears.stiffness.mesh_stiffness.from_table`.

    Parameters
    ----------
    path : str or Path
        The file.
    field : str
        Name of the path in error messages.
    teeth : int
        z1.
    speed : float, optional
        Of wheel 1, rpm; needed for a table over time only.

    Raises
    ------
    InputError
        With the number of the line, for a table that is not as `from_table` says.
    """
    table = read_table(path, _COLUMNS, field=field, abscissa=ABSCISSAE, jumps=True)
    abscissa = next(name for name in ABSCISSAE if name in table.columns)
    kind = _kind(table, field)
    period = _period(abscissa, teeth, speed)
    values = table.columns[kind]
    least, most = _PLAUSIBLE
    plausible = (values >= least) & (values <= most)
    if not plausible.all():
        row = int(np.argmin(plausible))
        raise table.error(row, f"must have a {kind} between {least:g} and {most:g} N/m", float(values[row]),
                          "No mesh of gears has another one: check the unit in the header.")
    if table.columns[abscissa][0] != 0:
        raise table.error(0, f"must have the {abscissa} 0, at which a tooth pair enters contact",
                          float(table.columns[abscissa][0]), "Subtract it from all rows if a tooth pair enters there.")
    return (_steps if kind == "level" else _points)(table, abscissa, period, values)


def _kind(table: Table, field: str) -> str:
    """The column with the stiffness."""
    kinds = [name for name in ("stiffness", "level") if name in table.columns]
    if len(kinds) != 1:
        raise InputError(field, "must have either the column stiffness or the column level", kinds)
    return kinds[0]


def _period(abscissa: str, teeth: int, speed: float | None) -> float:
    """The mesh period as a fraction, in radians of wheel 1 or in seconds."""
    if abscissa == "fraction":
        return 1.0
    if abscissa == "roll angle":
        return 2 * math.pi / teeth
    if speed is None or not speed > 0:
        raise InputError("stiffness.speed", "must be given, greater than 0, for a stiffness over time", speed,
                         "Or give the stiffness over the fraction of the mesh period.")
    return 2 * math.pi / (teeth * (speed * units.RPM))


def _steps(table: Table, abscissa: str, period: float, values: np.ndarray) -> PeriodicCurve:
    """The curve of a table of levels."""
    positions = table.columns[abscissa] / period
    equal = np.flatnonzero(np.diff(positions) == 0)
    if len(equal):
        raise table.error(int(equal[0]) + 1, f"must not repeat the {abscissa} of line {table.lines[equal[0]]}",
                          float(table.columns[abscissa][equal[0]]), "Each level begins at its own one.")
    if positions[-1] >= 1 - _PERIOD_TOLERANCE:
        raise table.error(len(values) - 1, f"must have a {abscissa} less than the mesh period, {period:.9g} in SI",
                          float(table.columns[abscissa][-1]), "Each level begins at its row, the last one ends with "
                          "the period. Remove this line if it is the end of the period.")
    return PeriodicCurve(np.append(positions, 1.0), values, values)


def _points(table: Table, abscissa: str, period: float, values: np.ndarray) -> PeriodicCurve:
    """The curve of a table of points."""
    end, last = float(table.columns[abscissa][-1]), len(values) - 1
    if abs(end / period - 1) > _PERIOD_TOLERANCE:
        raise table.error(last, f"must have the {abscissa} of the end of the mesh period, {period:.9g} in SI", end,
                          "A table covers exactly one period, including its end.")
    if abs(values[-1] / values[0] - 1) > _CLOSING_TOLERANCE:
        raise table.error(last, f"must have the stiffness of line {table.lines[0]}, {values[0]:.9g} N/m, with which "
                          "the next period begins", float(values[-1]), "If the curve jumps there, add a line with "
                          f"the same {abscissa} and the value after the jump.")
    return periodic_curve(table.columns[abscissa] / end, np.append(values[:-1], values[0]))
