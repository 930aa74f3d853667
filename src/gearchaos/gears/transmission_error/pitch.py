"""Pitch deviations of the teeth of a wheel: measured ones from a table, or drawn at random within an accuracy grade."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearchaos.gears.io import units
from gearchaos.gears.io.tables import Column, read_table
from gearchaos.gears.transmission_error import PERMISSIBLE_OVER_SD, Tolerances

_SINGLE = "single pitch deviation"
_CUMULATIVE = "cumulative pitch deviation"


def pitch_from_table(path: str | Path, field: str) -> tuple[float, ...]:
    """The cumulative pitch deviation of each tooth at the measuring circle, m, teeth in the order of their numbers.

    The columns are ``tooth``, all numbers from 1 on, and ``cumulative pitch deviation`` or ``single pitch deviation``,
    that of the pitch before the tooth. Raises `InputError` with the number of the line.
    """
    kinds = (Column(_CUMULATIVE, {units.LENGTH: 1.0}, ("cumulative", "f_pi", "fpi", "deviation"), r"cumul|summen"),
             Column(_SINGLE, {units.LENGTH: 1.0}, ("single", "f_pt", "fpt"), r"single|einzel"))
    table = read_table(path, ((Column("tooth", aliases=("zahn", "tooth number")),), kinds), field=field)
    tooth = table.columns["tooth"]
    order = np.argsort(tooth, kind="stable")
    for k, row in enumerate(order.tolist(), 1):
        if tooth[row] != k:
            raise table.error(row, f"must have the tooth number {k}", f"{tooth[row]:g}",
                              "Each tooth from 1 on has one row.")
    if _CUMULATIVE in table.columns:
        return tuple(table.columns[_CUMULATIVE][order].tolist())
    return tuple(_closed(table.columns[_SINGLE][order]).tolist())


def _closed(single: np.ndarray) -> np.ndarray:
    """The cumulative deviations of single ones (z,), whose mean, which a turn cannot have, is left out."""
    return np.cumsum(single - single.mean())


def drawn_pitch(tolerances: Tolerances, teeth: int, rng: np.random.Generator) -> np.ndarray:
    """Cumulative pitch deviations (teeth,) at the measuring circle, m, within the tolerances of a wheel.

    The single deviations are normal with a standard deviation of a third of the permissible one; where they or their
    sums would exceed what the grade permits, all are reduced.
    """
    cumulative = _closed(rng.normal(scale=tolerances.single_pitch / PERMISSIBLE_OVER_SD, size=teeth))
    single = np.abs(np.diff(cumulative, prepend=cumulative[-1])).max()
    return cumulative * min(1.0, tolerances.single_pitch / single, tolerances.cumulative_pitch / np.ptp(cumulative))
