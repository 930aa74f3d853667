"""The map of motions, computed on a coarse lattice of cells first and then on finer ones.

Two coarse lattices of cells are classified with short transients. Then all cells are classified, lattice by lattice.
Motions that a stage leaves unresolved are collected, and the next stage continues them from their present states.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gearchaos.dynamics import Classification, Verdicts
from gearchaos.execute import tiles
from gearchaos.execute.machine import cores
from gearchaos.explorer.jobs.map_grid import Map, MapGrid
from gearchaos.explorer.view.bounds import ATTRACTOR_MAP
from gearchaos.explorer.view.state import View
from gearchaos.studies.axis import Axis
from gearchaos.studies.batch_classification import BatchClassifier, Unresolved, concatenated
from gearchaos.studies.initial_value_problems import Motions
from gearchaos.studies.zones import Zones

COARSE = (16, 8)
"""Strides of the coarse lattices: every 16th, then every 8th row and column."""

FINE = (4, 2, 1)
"""Strides of the lattices after them."""

QUICK = Classification(transient_lengths=(48, 96), longest_period=16, exponent_run=150, doublings=0,
                       longest_transient=0, averaging_periods=32)
"""Settings for the coarse lattices."""

FULL = Classification(transient_lengths=(64, 320), longest_period=16, exponent_run=150, doublings=1,
                      longest_transient=1250, averaging_periods=32)
"""Settings for all cells."""

_TILE_SECONDS = 0.4
"""Computing time of one tile. A thread can turn to another page or to a newer map only after a tile."""

_SMALLEST_TILE, _LARGEST_TILE = 256, 4096
"""Limits of the size of a tile, in cells."""

_INTERVAL = 1.0
"""Least number of seconds between two maps shown."""


def successive_maps(view: View) -> Generator[Map]:
    """The map of a view, first with the cells of the coarsest lattice, in the end with all cells."""
    return _attractor_map(view) if view.colour == "attractors" else _motion_map(view)


def warm_up(view: View) -> Generator[None]:
    """Compute the coarsest map and discard it, so that the kernels it needs are compiled and loaded."""
    next(_motion_map(view))
    yield


def _motion_map(view: View) -> Generator[Map]:
    """The map of the motions from the initial values of the model."""
    quick = Zones(view.model, view.x, view.y, settings=QUICK)
    grid = MapGrid(view.x.count, view.y.count)
    for stride in COARSE:
        grid.put(quick.compute(cells := grid.request(stride)), cells)
        grid.show(cells, stride)
        yield grid.map(quick, stride)
    grid.reopen(grid.unresolved())
    classifier = BatchClassifier(quick.initial_states, _collect, FULL)
    stages, chaotic = _Stages(classifier, grid, quick), []
    for stride in FINE:
        unresolved = Unresolved(_by_column(grid.request(stride), view.x.count))
        for stage in ("transients", "exponents"):
            unresolved = yield from stages.run(stage, unresolved, stride)
        grid.put_chaotic_so_far(unresolved.number, stride)
        chaotic.append(unresolved)
    unresolved = concatenated(chaotic)
    by_column = np.argsort(unresolved.number % view.x.count, kind="stable")
    yield from stages.run("chaos", unresolved.take(by_column), 1)
    yield grid.map(quick, 1)


def _collect(_: np.ndarray, __: Motions, found: Verdicts) -> dict[str, np.ndarray]:
    """The variables of the map, from the verdicts found."""
    return found.variables()


def _by_column(cells: np.ndarray, columns: int) -> np.ndarray:
    """Cells (N,) sorted by column: if x is the frequency, neighbours then share their step grids."""
    return cells[np.argsort(cells % columns, kind="stable")]


@dataclass(frozen=True)
class _Stages:
    """The classification of the cells of a map, stage by stage.

    ``rate`` is the number of cells that one thread classifies per second, by stage.
    """

    classifier: BatchClassifier
    grid: MapGrid
    study: Zones
    rate: dict[str, float] = field(default_factory=dict)

    def run(self, stage: str, unresolved: Unresolved, stride: int) -> Generator[Map, None, Unresolved]:
        """Run one stage for all unresolved cells, and yield maps meanwhile; returns the cells that stay unresolved."""
        rest, shown = {0: unresolved.take(slice(0))}, time.monotonic()
        for tile, (cells, variables, left) in tiles.run(
            partial(self._classify, stage, unresolved), self._tiles(stage, len(unresolved.number)),
        ):
            self.grid.put(variables, cells)
            self.grid.show(cells, stride)
            rest[tile.start] = left
            if time.monotonic() - shown > _INTERVAL:
                shown = time.monotonic()
                yield self.grid.map(self.study, stride)
        return concatenated([rest[first] for first in sorted(rest)])

    def _tiles(self, stage: str, count: int) -> Iterator[slice]:
        """Tiles of about `_TILE_SECONDS`, smaller ones at the end, so that all threads end at about the same time."""
        first = 0
        while first < count:
            largest = min(_LARGEST_TILE, max(_SMALLEST_TILE, (count - first) // (2 * cores())))
            size = int(np.clip(_TILE_SECONDS * self.rate.get(stage, 0.0), _SMALLEST_TILE, largest))
            yield slice(first, min(first + size, count))
            first += size

    def _classify(
        self, stage: str, unresolved: Unresolved, tile: slice
    ) -> tuple[np.ndarray, dict[str, np.ndarray], Unresolved]:
        """Run one stage for one tile, with the result of `BatchClassifier.run_stage`, and measure its rate."""
        began = time.perf_counter()
        found = self.classifier.run_stage(stage, unresolved, tile)
        self.rate[stage] = (tile.stop - tile.start) / (time.perf_counter() - began)
        return found


def _attractor_map(view: View) -> Generator[Map]:
    """The map of the number of attractors: several initial states in every cell of a coarser plane, row by row."""
    columns, rows, starts = ATTRACTOR_MAP
    x, y = (Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, columns), (view.y, rows)))
    study = Zones(view.model, x, y, starts=starts, settings=QUICK)
    grid = MapGrid(columns, rows)
    for stride in (4, 2, 1):
        for row in range(0, rows, stride):
            if grid.known[row].all():
                continue
            grid.put(study.compute(grid.number[row]), grid.number[row])
            grid.source[row : row + stride] = grid.measure_source[row : row + stride] = grid.number[row]
            yield grid.map(study, stride)
