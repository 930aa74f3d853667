"""A map that sharpens: a coarse lattice in a quick look first, then all cells, lattice by lattice.

What a look leaves open is put aside and gone on with, from where it is, together with its like.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import xarray as xr

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.execute import tiles
from gearchaos.execute.machine import cores
from gearchaos.explorer.bounds import MANY
from gearchaos.explorer.state import View
from gearchaos.flow import ExactFlow
from gearchaos.studies.axis import Axis
from gearchaos.studies.classification import BatchClassifier, Unresolved, concatenated
from gearchaos.studies.verdict_variables import blank, verdict_variables
from gearchaos.studies.zones import Zones

COARSE = (16, 8)
"""Every so many-th column and row, in a quick look."""

FINE = (4, 2, 1)
QUICK = Classification(transient_lengths=(48, 96), longest_period=16, exponent_run=150, doublings=0,
                       longest_transient=0, averaging_periods=32)
STEADY = Classification(transient_lengths=(64, 320), longest_period=16, exponent_run=150, doublings=1,
                        longest_transient=1250, averaging_periods=32)
"""Budgets of the coarse lattices, and of all cells."""

_STEP = 0.4
"""Seconds that a thread works at one go: a newer map, or another page, need not wait longer."""

_FEWEST, _MOST = 256, 4096

_PACE = 1.0
"""Seconds between two pictures."""


@dataclass(frozen=True)
class Map:
    """A map as far as it is known.

    Attributes
    ----------
    dataset : xarray.Dataset
        As from `zones`; ``label`` is 0 where nothing is computed yet.
    source : (rows, columns) of int
        The cell whose motion each cell shows, its own once it is computed; -1 where there is none to show yet.
    measured : (rows, columns) of int
        The same of the cell whose levels it shows: chaos has none before it is judged.
    wild : (cells,) of bool
        Cells that were chaotic so far, and are not judged yet.
    stride : int
        Distance of the cells of the lattice that is being computed.
    share : float
        Of the cells that are judged, if only so far.
    """

    dataset: xr.Dataset
    source: np.ndarray
    measured: np.ndarray
    wild: np.ndarray
    stride: int
    share: float

    def labels(self) -> xr.DataArray:
        """The labels, those of motions that were chaotic so far included."""
        label = self.dataset["label"]
        return label.copy(data=np.where(self.wild.reshape(label.shape), label.dtype.type(Label.CHAOTIC), label))

    def shown(self, values: np.ndarray, nothing: float) -> np.ndarray:
        """Motions of all cells as the cells show them, ``nothing`` where there is nothing to show yet."""
        return np.where(self.source >= 0, values.ravel()[self.source], np.asarray(nothing, values.dtype))

    def level(self, name: str) -> xr.Variable:
        """A level (rows, columns) as the cells show it; NaN where there is nothing to show yet."""
        level = self.dataset[name].variable
        values = np.where(self.measured >= 0, level.values.ravel()[self.measured], np.nan)
        return level.copy(data=values)


def sharpened(view: View) -> Generator[Map]:
    """The map of a view, ever sharper."""
    return _many(view) if view.colour == "attractors" else _one(view)


def first(view: View) -> Generator[None]:
    """No map, but all that the coarse ones need, so that the next one is quick."""
    next(_one(view))
    yield


def _one(view: View) -> Generator[Map]:
    quick = Zones(view.model, view.x, view.y, settings=QUICK)
    grid = _Grid(view.x.count, view.y.count)
    for stride in COARSE:
        grid.put(quick.compute(new := grid.fresh(stride)), new)
        grid.show(new, stride)
        yield grid.map(quick, stride)
    grid.forget(grid.open())
    work, wild = _Work(BatchClassifier(quick.initial_states, _keep, STEADY), grid, quick), []
    for stride in FINE:
        still = Unresolved(_by_column(grid.fresh(stride), view.x.count))
        for stage in ("transients", "exponents"):
            still = yield from work.run(stage, still, stride)
        grid.suppose(still.number, stride)
        wild.append(still)
    still = concatenated(wild)
    yield from work.run("chaos", still.take(np.argsort(still.number % view.x.count, kind="stable")), 1)
    yield grid.map(quick, 1)


def _keep(_: np.ndarray, __: ExactFlow, ___: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
    return verdict_variables(found)


def _by_column(cells: np.ndarray, columns: int) -> np.ndarray:
    """Column by column, since frequencies close together share their steps."""
    return cells[np.argsort(cells % columns, kind="stable")]


@dataclass(frozen=True)
class _Work:
    """How the cells of a map are judged, stage by stage, and how many of them a thread judges in a second."""

    classifier: BatchClassifier
    grid: _Grid
    whole: Zones
    pace: dict[str, float] = field(default_factory=dict)

    def run(self, stage: str, still: Unresolved, stride: int) -> Generator[Map, None, Unresolved]:
        """Maps under way while a stage judges some cells of a lattice; returns what it leaves open."""
        rest, shown = {0: still.take(slice(0))}, time.monotonic()
        for tile, (settled, facts, left) in tiles.run(partial(self._judge, stage, still), self._cut(stage, still)):
            self.grid.put(facts, settled)
            self.grid.show(settled, stride)
            rest[tile.start] = left
            if time.monotonic() - shown > _PACE:
                shown = time.monotonic()
                yield self.grid.map(self.whole, stride)
        return concatenated([rest[first] for first in sorted(rest)])

    def _cut(self, stage: str, still: Unresolved) -> Iterator[slice]:
        """Tiles of about the same time; smaller ones at the end, so that no thread waits long for another."""
        first, count = 0, len(still.number)
        while first < count:
            most = min(_MOST, max(_FEWEST, (count - first) // (2 * cores())))
            size = int(np.clip(_STEP * self.pace.get(stage, 0.0), _FEWEST, most))
            yield slice(first, min(first + size, count))
            first += size

    def _judge(self, stage: str, still: Unresolved, tile: slice) -> tuple[np.ndarray, dict[str, np.ndarray],
        Unresolved]:
        began = time.perf_counter()
        found = self.classifier.judge(stage, still, tile)
        self.pace[stage] = (tile.stop - tile.start) / (time.perf_counter() - began)
        return found


class _Grid:
    """Cells of a map, found one after the other."""

    def __init__(self, columns: int, rows: int) -> None:
        self.shape = (rows, columns)
        self.number = np.arange(rows * columns, dtype=np.int32).reshape(self.shape)
        self.taken, self.known, self.wild = (np.zeros(self.shape, dtype=bool) for _ in range(3))
        self.source, self.measured = (np.full(self.shape, -1, dtype=np.int32) for _ in range(2))
        self.found: dict[str, np.ndarray] = {}

    def fresh(self, stride: int) -> np.ndarray:
        """Numbers of the cells of a lattice that were not asked for yet."""
        cells = self.number[::stride, ::stride][~self.taken[::stride, ::stride]]
        self.taken.flat[cells] = True
        return cells

    def put(self, found: dict[str, np.ndarray], cells: np.ndarray) -> None:
        """Keep what was found of some cells."""
        for name, values in found.items():
            if name not in self.found:
                self.found[name] = np.full(self.number.size, blank(name, values.dtype), values.dtype)
            self.found[name][cells] = values
        self.known.flat[cells] = True
        self.wild.flat[cells] = False

    def suppose(self, cells: np.ndarray, stride: int) -> None:
        """Have some cells of a lattice show as chaotic, which they were so far."""
        self.wild.flat[cells] = True
        self._show(cells, stride, self.source)

    def open(self) -> np.ndarray:
        """Numbers of the cells that a quick look left open."""
        return np.flatnonzero(self.known.ravel() & np.isin(self.found["label"], (Label.CHAOTIC, Label.UNDECIDED)))

    def forget(self, cells: np.ndarray) -> None:
        """Have some cells computed again; they show what they showed until then."""
        self.taken.flat[cells] = self.known.flat[cells] = False

    def show(self, cells: np.ndarray, stride: int) -> None:
        """Have some cells of a lattice show in all cells nearest to them."""
        for target in (self.source, self.measured):
            self._show(cells, stride, target)

    def _show(self, cells: np.ndarray, stride: int, target: np.ndarray) -> None:
        row, column = np.divmod(cells, self.shape[1])
        for down in range(-(stride // 2), max(1, stride)):
            for right in range(-(stride // 2), max(1, stride)):
                self._paint(target, cells, row, column, down, right, stride)

    def _paint(
        self, target: np.ndarray, cells: np.ndarray, row: np.ndarray, column: np.ndarray, down: int, right: int,
        stride: int,
    ) -> None:
        """The cells so many rows and columns on; past half a stride only beyond the last row and column."""
        half = max(1, (stride + 1) // 2)
        r, c = row + down, column + right
        inside = (r >= 0) & (c >= 0) & (r < self.shape[0]) & (c < self.shape[1])
        inside &= (down < half) | (row + stride >= self.shape[0])
        inside &= (right < half) | (column + stride >= self.shape[1])
        target[r[inside], c[inside]] = cells[inside]

    def map(self, whole: Zones, stride: int) -> Map:
        """What is known so far; arrays are copied, so that it stays what it is."""
        found, share = {n: v.copy() for n, v in self.found.items()}, float((self.known | self.wild).mean())
        sources = self.source.copy(), self.measured.copy()
        return Map(whole.finish(found), *sources, self.wild.ravel().copy(), stride, share)


def _many(view: View) -> Generator[Map]:
    """The map of the number of attractors: some starts in every cell of a coarser plane, row by row."""
    columns, rows, starts = MANY
    x, y = (Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, columns), (view.y, rows)))
    whole = Zones(view.model, x, y, starts=starts, settings=QUICK)
    grid = _Grid(columns, rows)
    for stride in (4, 2, 1):
        for row in range(0, rows, stride):
            if grid.known[row].all():
                continue
            grid.put(whole.compute(grid.number[row]), grid.number[row])
            grid.source[row : row + stride] = grid.measured[row : row + stride] = grid.number[row]
            yield grid.map(whole, stride)
