"""A map that sharpens: a coarse lattice first, then finer ones.

In the end all cells are computed; only what seems chaotic, or stays open, is looked at more than once.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearchaos.app.bounds import MANY
from gearchaos.app.state import View
from gearchaos.axis import Axis
from gearchaos.motion import Budget, Label
from gearchaos.studies.evidence import blank
from gearchaos.studies.plan import Plan
from gearchaos.studies.zones import plan

COARSE = (16, 8)
"""Every so many-th column and row, in a quick look."""

FINE = (4, 2, 1)
QUICK = Budget(looks=(24, 40, 80), longest=16, exponent=150, extensions=0, patience=0)
STEADY = Budget(looks=(24, 40, 80, 160, 320), longest=16, exponent=150, extensions=1, patience=0)
PATIENT = Budget(looks=(24, 40, 80, 160, 320), longest=16, exponent=250, extensions=2, patience=1500)
"""Budgets of three looks: at the coarse lattice, at all cells, and at last at those that seem chaotic or stay open."""

_STEP = 0.3
_FEWEST, _MOST = 1024, 16384


@dataclass(frozen=True)
class Map:
    """A map as far as it is known.

    Attributes
    ----------
    dataset : xarray.Dataset
        As from `zones`; ``label`` is 0 where nothing is computed yet.
    source : (rows, columns) of int
        The cell whose colour each cell shows, its own once it is computed.
    stride : int
        Distance of the cells of the lattice that is being computed.
    share : float
        Of the cells that are computed.
    """

    dataset: xr.Dataset
    source: np.ndarray
    stride: int
    share: float

    def values(self, name: str) -> np.ndarray:
        """A variable (rows, columns), every cell with the value it shows."""
        return self.dataset[name].values.ravel()[self.source]


def sharpened(view: View) -> Iterator[Map]:
    """The map of a view, ever sharper."""
    return _many(view) if view.colour == "attractors" else _one(view)


def _one(view: View) -> Iterator[Map]:
    quick, steady, patient = (plan(view.model, view.x, view.y, budget=b) for b in (QUICK, STEADY, PATIENT))
    grid = _Grid(view.x.count, view.y.count)
    for stride in COARSE:
        grid.put(quick.compute(new := grid.unknown(stride)), new)
        grid.show(new, stride)
        yield grid.map(steady, stride)
    grid.forget(grid.open())
    for finer in FINE:
        for part in _parts(grid.unknown(finer), view.x.count):
            grid.put(part.run(steady), part.cells)
            grid.show(part.cells, finer)
            yield grid.map(steady, finer)
    for part in _parts(grid.open(), view.x.count):
        grid.put(part.run(patient), part.cells)
        yield grid.map(patient, 1)


class _Grid:
    """Cells of a map, found one after the other."""

    def __init__(self, columns: int, rows: int) -> None:
        self.shape = (rows, columns)
        self.number = np.arange(rows * columns, dtype=np.int32).reshape(self.shape)
        self.known = np.zeros(self.shape, dtype=bool)
        self.source = np.zeros(self.shape, dtype=np.int32)
        self.found: dict[str, np.ndarray] = {}

    def unknown(self, stride: int) -> np.ndarray:
        """Numbers of the cells of a lattice that are not known."""
        on = self.number[::stride, ::stride]
        return on[~self.known[::stride, ::stride]]

    def put(self, found: dict[str, np.ndarray], cells: np.ndarray) -> None:
        """Keep what was found of some cells."""
        for name, values in found.items():
            if name not in self.found:
                self.found[name] = np.full(self.number.size, blank(name, values.dtype), values.dtype)
            self.found[name][cells] = values
        self.known.flat[cells] = True

    def open(self) -> np.ndarray:
        """Numbers of the cells that a quick look left open."""
        return np.flatnonzero(self.known.ravel() & np.isin(self.found["label"], (Label.CHAOTIC, Label.UNDECIDED)))

    def forget(self, cells: np.ndarray) -> None:
        """Have some cells computed again; they show what they showed until then."""
        self.known.flat[cells] = False

    def show(self, cells: np.ndarray, stride: int) -> None:
        """Have some cells of a lattice show in all cells nearest to them."""
        row, column = np.divmod(cells, self.shape[1])
        for down in range(-(stride // 2), max(1, stride)):
            for right in range(-(stride // 2), max(1, stride)):
                self._paint(cells, row, column, down, right, stride)

    def _paint(
        self, cells: np.ndarray, row: np.ndarray, column: np.ndarray, down: int, right: int, stride: int
    ) -> None:
        """The cells so many rows and columns on; past half a stride only beyond the last row and column."""
        half = max(1, (stride + 1) // 2)
        r, c = row + down, column + right
        inside = (r >= 0) & (c >= 0) & (r < self.shape[0]) & (c < self.shape[1])
        inside &= (down < half) | (row + stride >= self.shape[0])
        inside &= (right < half) | (column + stride >= self.shape[1])
        self.source[r[inside], c[inside]] = cells[inside]

    def map(self, whole: Plan, stride: int) -> Map:
        """What is known so far; arrays are copied, since they go to another thread."""
        found = {n: v.copy() for n, v in self.found.items()}
        return Map(whole.finish(found), self.source.copy(), stride, float(self.known.mean()))


@dataclass
class _Part:
    """Some cells to be computed at one go, and how long that took."""

    cells: np.ndarray
    seconds: float = 0.0

    def run(self, whole: Plan) -> dict[str, np.ndarray]:
        began = time.perf_counter()
        found = whole.compute(self.cells)
        self.seconds = time.perf_counter() - began
        return found


def _parts(cells: np.ndarray, columns: int) -> Iterator[_Part]:
    """The cells, column by column since frequencies close together share their steps, in parts of a third of a second
    or so: a newer map need not wait longer.
    """
    cells = cells[np.argsort(cells % columns, kind="stable")]
    size, done = 2048, 0
    while done < len(cells):
        part = _Part(cells[done : done + size])
        yield part
        done += size
        size = int(np.clip(size * _STEP / max(part.seconds, 1e-3), max(_FEWEST, size // 2), min(_MOST, 2 * size)))


def _many(view: View) -> Iterator[Map]:
    """The map of the number of attractors: some starts in every cell of a coarser plane, row by row."""
    columns, rows, starts = MANY
    x, y = (Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, columns), (view.y, rows)))
    whole = plan(view.model, x, y, starts=starts, budget=QUICK)
    grid = _Grid(columns, rows)
    for stride in (4, 2, 1):
        for row in range(0, rows, stride):
            if grid.known[row].all():
                continue
            grid.put(whole.compute(grid.number[row]), grid.number[row])
            grid.source[row : row + stride] = grid.number[row]
            yield grid.map(whole, stride)
