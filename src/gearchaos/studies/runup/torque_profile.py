"""A torque that changes along a run: a table over the time or over the speed, linear between its rows."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.tables import SPEED, TIME, Column, read_table
from gearchaos.validation import to_float

Profile = dict[str, list[float]]
"""The rows of a table: ``time``, s, or ``speed``, rpm, and ``torque``, N m."""

_STEPS = 4000  # steps from the least to the largest torque: gears are made anew for each that differs
_OVER = {"time": TIME, "speed": SPEED}
_TORQUE = Column("torque", {units.TORQUE: 1.0}, ("m", "m1", "t1", "moment", "drehmoment"), r"torque|moment")


def read_profile(path: str | PathLike[str]) -> tuple[Profile, tuple[str, ...]]:
    """The rows of a file, and what is to be said of its columns; raises `InputError` with the line of a wrong row."""
    table = read_table(fspath(path), (tuple(_OVER.values()), (_TORQUE,)), field="torque", increasing=True)
    rows = {name: values.tolist() for name, values in table.columns.items()}
    return _checked(rows), table.notes


def as_profile(value: Any) -> Profile:
    """The rows from the path of a file, or from columns by name; raises `InputError` for anything else."""
    if isinstance(value, (str, PathLike)):
        return read_profile(value)[0]
    if not isinstance(value, Mapping) or len(value.keys() & _OVER.keys()) != 1 or value.keys() - {*_OVER, "torque"}:
        raise InputError("torque", "must be a table of time or speed, and torque", value,
                         "A file with these columns, or {'time': [0, 60], 'torque': [20, 100]}, in s and N m.")
    over = next(iter(value.keys() & _OVER.keys()))
    return _checked({name: [to_float(f"torque.{name}", each) for each in np.atleast_1d(value.get(name, ())).tolist()]
                     for name in (over, "torque")})


def _checked(rows: Profile) -> Profile:
    over = next(name for name in rows if name in _OVER)
    if len(rows[over]) < 2 or len(rows[over]) != len(rows["torque"]):
        raise InputError("torque", f"must have two or more rows, each with {over} and torque",
                         [len(values) for values in rows.values()])
    if not np.all(np.diff(rows[over]) > 0):
        raise InputError("torque", f"must have rows with rising {over}", rows[over])
    return rows


def check_covers(profile: Profile, duration: float, speeds: tuple[float, float]) -> None:
    """Raise `InputError` unless a table has the torque at each instant of a duration, s, or at each speed, rpm."""
    over = next(name for name in profile if name in _OVER)
    first, last, unit = (0.0, duration, "s") if over == "time" else (*speeds, "rpm")
    own = profile[over]
    if own[0] > first or own[-1] < last:
        raise InputError("torque", f"must have the torque from {first:.6g} to {last:.6g} {unit}",
                         f"{own[0]:.6g} to {own[-1]:.6g} {unit}",
                         "A run-down goes on after the run-up: its time, too." if over == "time" else "")
    if over == "time" and own[0] < 0:
        raise InputError("torque", "must begin at the time 0", own[0], "The run-up begins there.")


def largest_torque(profile: Profile) -> float:
    """The torque of the largest size."""
    return max(profile["torque"], key=abs)


def extremes(profile: Profile) -> np.ndarray:
    """The least and the largest torque."""
    return np.array([min(profile["torque"]), max(profile["torque"])])


def torque_at(profile: Profile, time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """The torque (N,) at instants, s, and the speeds there, rpm, to the nearest of `_STEPS` steps of its range."""
    over = "time" if "time" in profile else "speed"
    exact = np.interp(time if over == "time" else speed, profile[over], profile["torque"])
    least, most = extremes(profile)
    step = (most - least) / _STEPS or 1.0
    return least + step * np.round((exact - least) / step)
