"""What is kept of a run as its periods come: the worst values and the spectrum over the speed, and what shows jumps.

Its size does not depend on the number of periods, so that a run may last for hours. In a journal it is kept as it is.
"""

from __future__ import annotations

import json
import time
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gearchaos.errors import InputError
from gearchaos.execute.pool import OTHER_CALL
from gearchaos.files import check_target, write_bytes
from gearchaos.flow import Measure

_SERIES = 1 << 20  # most values along a run by which jumps are found
_BETWEEN = 5.0  # seconds between two writings of a journal
WORST = ("dynamic_factor", "mesh_force_peak", "z_peak_to_peak")  # variables that are the largest in a bin


class Run(NamedTuple):
    """Periods one after the other: k of them are over when the wheel has turned that far, at a speed that changes
    linearly with time."""

    first: float  # speed at the start, rpm
    rate: float  # its change, rpm/s
    cycles_per_rpm: float  # periods per second over the speed
    periods: int

    def time(self, k: np.ndarray) -> np.ndarray:
        """When k periods are over, s."""
        turned = k / self.cycles_per_rpm  # integral of the speed
        return 2 * turned / (self.first + np.sqrt(np.maximum(self.first**2 + 2 * self.rate * turned, 0.0)))

    def speed(self, k: np.ndarray) -> np.ndarray:
        """The mean speeds (M,), rpm, between M + 1 numbers of periods that are over."""
        return np.diff(k) / (self.cycles_per_rpm * np.diff(self.time(k)))


class RunResults:
    """What is found in a run over bins of speed, and over groups of periods one after the other.

    The spectrum is the mean power of windows of whole numbers of periods, which are added as they come, at O lines.

    Attributes
    ----------
    kept : dict of str to array
        All that changes as periods come.
    groups : (G + 1,)
        Numbers of periods at the ends of the groups, of one period each unless there are very many.
    """

    def __init__(self, run: Run, edges: np.ndarray, window: int, orders: int) -> None:
        self.run, self.edges, self.window, bins = run, edges, window, len(edges) - 1
        size = -(-run.periods // _SERIES)
        self.groups = np.minimum(np.arange(-(-run.periods // size) + 1) * size, run.periods)
        speed = run.speed(np.arange(run.periods // window + 1) * window)
        centres, at = (edges[1:] + edges[:-1]) / 2, np.digitize(speed, edges[1:-1])
        # a bin in which no window has its mean speed has the nearest one
        self._windows = [np.flatnonzero(at == b) if (at == b).any() else np.array([np.argmin(np.abs(speed - centre))])
                         for b, centre in enumerate(centres)]
        self.kept: dict[str, np.ndarray] = {
            "periods": np.array(0), "windows": np.array(0), "rest": np.zeros((0, 0)),
            "power": np.zeros((bins, orders)), "contact": np.zeros((4, bins), bool), "lost": np.array(np.nan),
            **{name: np.full(bins, np.nan) for name in WORST},
            **{name: np.full(len(self.groups) - 1, np.nan) for name in ("extent", "factor")},
            "marks": np.zeros(0, int), "motions": np.zeros((0, 3, 0))}

    def add(self, measures: np.ndarray, static: np.ndarray, force: np.ndarray) -> None:
        """Add the next n periods: their measures (len(Measure), n), static mesh forces (n,) and the mesh forces
        (n, samples), NaN from a lost motion on."""
        kept, first = self.kept, int(self.kept["periods"])
        k = np.arange(first, first + measures.shape[1] + 1)
        speed, group = self.run.speed(k), np.searchsorted(self.groups, k[:-1], side="right") - 1
        at, m = np.digitize(speed, self.edges[1:-1]), measures
        largest = np.maximum(np.abs(m[Measure.FORCE_MAX]), np.abs(m[Measure.FORCE_MIN]))
        factor = largest / np.where(static == 0, np.nan, np.abs(static))
        for name, each in zip(WORST, (factor, largest, m[Measure.Z_MAX] - m[Measure.Z_MIN]), strict=True):
            np.fmax.at(kept[name], at, each)
        front, back = m[Measure.FRONT_TIME] > 0, m[Measure.BACK_TIME] > 0
        apart, known = (m[Measure.SWITCHES] > 0) | ~(front | back), np.isfinite(largest)
        for row, each in zip(kept["contact"], (known, front, back, apart), strict=True):
            row[at[each & known]] = True
        np.fmax.at(kept["extent"], group, m[Measure.FORCE_MAX] - m[Measure.FORCE_MIN])
        np.fmax.at(kept["factor"], group, factor)
        if not known.all() and np.isnan(kept["lost"]):
            kept["lost"] = speed[np.argmin(known)]
        force = np.concatenate([kept["rest"], force]) if len(kept["rest"]) else force
        for begin in range(0, len(force) - self.window + 1, self.window):
            signal = force[begin : begin + self.window].ravel()
            power = np.abs(np.fft.rfft(signal)[: kept["power"].shape[1]] / (len(signal) / 2)) ** 2
            power[0] /= 4
            for bin_power, windows in zip(kept["power"], self._windows, strict=True):
                if windows[0] <= kept["windows"] <= windows[-1]:
                    bin_power += power / len(windows)
            kept["windows"] = kept["windows"] + 1
        kept["rest"] = force[len(force) // self.window * self.window :].copy()
        kept["periods"] = np.array(k[-1])

    def mark(self, motion: np.ndarray) -> None:
        """Keep the motion (3, d) with which the next period begins."""
        kept = self.kept
        kept["motions"] = np.concatenate([kept["motions"].reshape(-1, *motion.shape), motion[None]])
        kept["marks"] = np.append(kept["marks"], kept["periods"])

    def marked(self, period: int) -> tuple[int, np.ndarray]:
        """The last period not after this one before which the motion was kept, and the motion (3, d)."""
        at = int(np.searchsorted(self.kept["marks"], period, side="right")) - 1
        return int(self.kept["marks"][at]), self.kept["motions"][at]

    @property
    def lost(self) -> float | None:
        """The speed at which the motion diverged, rpm."""
        return None if np.isnan(self.kept["lost"]) else float(self.kept["lost"])

    @property
    def contact(self) -> np.ndarray:
        """The worst contact in each bin, of `gearchaos.dynamics.response.CONTACTS`."""
        known, front, back, apart = self.kept["contact"]
        return np.select([~known, front & back, apart & (front | back), front | back], [-1, 2, 1, 0], 3).astype(np.int8)

    @property
    def amplitudes(self) -> np.ndarray:
        """The root mean square over the windows of each bin, (B, O); NaN where the run did not come."""
        known = np.array([windows[-1] < self.kept["windows"] for windows in self._windows])
        return np.where(known[:, None], np.sqrt(self.kept["power"]), np.nan).astype(np.float32)


class Journal:
    """A file with arrays by name, from which a computation with the same settings goes on.

    It is written as a whole every few seconds. Raises `InputError` if it cannot be written, or exists and is that of
    another computation.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        check_target("journal", path)
        self._path, self._settings, self._written = path, json.dumps(dict(settings), sort_keys=True), time.monotonic()

    def read(self) -> dict[str, np.ndarray]:
        """The arrays that were written last; none if there is no file."""
        if not self._path.exists():
            return {}
        try:
            with np.load(BytesIO(self._path.read_bytes()), allow_pickle=False) as file:
                found = dict(file)
            settings = str(found.pop("settings"))
        except (AttributeError, EOFError, KeyError, OSError, TypeError, ValueError, zipfile.BadZipFile) as error:
            raise InputError("journal", "must be a journal of a run-up, whole and readable", str(self._path),
                             "Delete it, or choose another file.") from error
        if settings != self._settings:
            raise InputError("journal", "must be one of the same model, axes, settings and versions", str(self._path),
                             OTHER_CALL)
        return found

    def write(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Replace what is kept, unless that was done a few seconds ago."""
        if time.monotonic() - self._written < _BETWEEN:
            return
        content = BytesIO()
        np.savez(content, allow_pickle=False, **{"settings": np.array(self._settings), **arrays})
        write_bytes(self._path, content.getbuffer())
        self._written = time.monotonic()
