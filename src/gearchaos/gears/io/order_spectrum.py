"""A measured order spectrum over the speed: amplitudes of mesh harmonics, from a table as programs export them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gearchaos.gears.io.measured_quantities import MEASURED, MeasuredQuantity, other_quantities
from gearchaos.gears.io.tables import SPEED, TIME, Column, read_table
from gearchaos.quantities import quantity
from gearchaos.validation import MAX_HARMONICS

_RMS, _RANGE = r"\brms\b|\beff", "peak to peak"
# the peak value over what a column has, words in its header beside those of the kind, and words of other columns
_COLUMNS = {"amplitude": (1.0, "", f"{_RMS}|{_RANGE}|phase"), "rms": (math.sqrt(2), _RMS, ""),
            _RANGE: (0.5, _RANGE, "")}
_OF_SIGNAL = ("This is a signal over the time. gearchaos runup --against compares it with a computed run-up, and "
              "gearchaos orders has computed lines. A fit needs the amplitudes of orders over the speed.")
ORDER = Column("order", aliases=("ordnung", "orders"), instead=((TIME, _OF_SIGNAL),))
"""Of the turn of wheel 1."""


@dataclass(frozen=True)
class OrderSpectrum:
    """M measured amplitudes, peak values in SI, at P speeds.

    ``unit`` is that of the file, and ``size`` one of it in SI. ``ignored`` are the rows whose order is none of the
    mesh; ``notes`` say what was taken by its meaning.
    """

    speeds: np.ndarray  # (P,) rpm, rising
    at: np.ndarray  # (M,) index of the speed
    harmonic: np.ndarray  # (M,) of the mesh, from 1 on
    amplitude: np.ndarray  # (M,)
    unit: str
    size: float
    ignored: int
    notes: tuple[str, ...]


def read_order_spectrum(path: str | Path, of: MeasuredQuantity, teeth: float, columns: Mapping[str, str] | None = None,
                        field: str = "measured") -> OrderSpectrum:
    """Read a table with the columns ``speed``, ``order`` and ``amplitude``, ``rms`` or ``peak to peak``.

    ``of`` is what was measured. The turn of wheel 1 has order 1, so that the mesh has the order ``teeth``; orders that
    are no multiples of it are ignored. ``columns`` are headers in the file by the names of columns, with the unit of a
    column that has none: "Force [N]". ``field`` is the name of the file in messages. Raises `InputError` for a file
    that cannot be read as one, and for rows that are wrong, with the number of the line.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm];order;rms [N]\\n1000;25;1,5\\n1000;1;4,5\\n1100;50;2,5\\n")
    ...     found = read_order_spectrum(file, "mesh force", 25)
    >>> found.harmonic.tolist(), found.amplitude.round(3).tolist(), found.ignored
    ([1, 2], [2.121, 3.536], 1)
    """
    dimension, words = MEASURED[of].dimension, MEASURED[of].words
    advice = "A column 'amplitude' has peak values, 'rms' root mean squares. Units stand in the header or in columns."
    others = other_quantities(of, "Say what was measured: --of {0!r}, in Python quantity={0!r}.")
    kinds = [Column(name, {dimension: 1.0}, words=own or words, other=other, advice=advice, instead=others)
             for name, (_, own, other) in _COLUMNS.items()]
    table = read_table(path, ((SPEED,), (ORDER,), kinds), field=field, chosen=columns, by_option=True)
    kind = next(name for name in _COLUMNS if name in table.columns)
    values, orders = table.columns[kind] * _COLUMNS[kind][0], table.columns["order"]
    *_, least, most = quantity("speed").range or (0.0, math.inf)
    harmonic = np.rint(orders / teeth).astype(int)
    own = np.abs(orders - teeth * harmonic) < 1e-6
    for broken, rule, column, why in (
            ((table.columns["speed"] < least) | (table.columns["speed"] > most),
             f"must have a speed from {least:g} to {most:g} rpm", "speed", "Check the unit in the header."),
            (values < 0, "must not have a negative amplitude", kind, "Phases are not read."),
            (own & (harmonic < 1), "must have an order greater than 0", "order", "Leave the mean out."),
            (own & (harmonic > MAX_HARMONICS), f"must have a harmonic of the mesh of at most {MAX_HARMONICS}", "order",
             "")):
        if broken.any():
            row = int(np.argmax(broken))
            raise table.error(row, rule, table.shown(column, table.columns[column][row]), why)
    if not own.any():
        raise table.error(0, f"must have orders that are multiples of z1 = {teeth:g}", orders[0],
                          f"Orders are those of the turn of wheel 1. Multiply orders of the mesh by {teeth:g}.")
    seen: dict[tuple[float, int], int] = {}
    for row in np.flatnonzero(own).tolist():
        first = seen.setdefault((table.columns["speed"][row], harmonic[row]), row)
        if first != row:
            raise table.error(row, f"must not repeat the speed and the order of line {table.lines[first]}",
                              table.shown("order", orders[row]), "Give one amplitude of each, e.g. the mean.")
    speeds, at = np.unique(table.columns["speed"][own], return_inverse=True)
    unit, size = table.units[kind]
    return OrderSpectrum(speeds, at, harmonic[own], values[own], unit, size, int((~own).sum()), table.notes)
