"""The map of motions, computed on a coarse lattice of cells first and then on finer ones.

Two coarse lattices of cells are classified with short transients. Then all cells are classified, lattice by lattice.
Motions that a stage leaves unresolved are collected, and the next stage continues them from their present states.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import of_mesh
from gearchaos.dynamics import Classification, Label
from gearchaos.execute import tiles
from gearchaos.execute.machine import cores
from gearchaos.explorer.core.bounds import ATTRACTOR_MAP
from gearchaos.explorer.core.models import coarseness
from gearchaos.explorer.core.state import COLOURS, OF_STARTS, View
from gearchaos.flow import WIDTH
from gearchaos.gears.operation.operating import Gears, gears_of
from gearchaos.gears.operation.results import physical
from gearchaos.quantities import quantity
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.maps.refine import put
from gearchaos.studies.maps.zones import Zones
from gearchaos.studies.motion.batch_classification import BatchClassifier, Unresolved, concatenated


@dataclass(frozen=True)
class Map:
    """A map, possibly before all of its cells are computed."""

    dataset: xr.Dataset  # as from `gearchaos.zones`; ``label`` is 0 in cells that are not computed yet
    # (rows, columns) the number of the cell whose kind of motion is shown in each cell: its own once it is computed,
    # before that the number of a computed cell nearby, or -1 if there is none
    source: np.ndarray
    # the same for response measures such as ``v_rms``, which cells that are chaotic so far get after the verdict
    measure_source: np.ndarray
    chaotic_so_far: np.ndarray  # (cells,) of bool: no verdict, but chaotic up to now, which may be a transient
    stride: int  # distance between the rows, and between the columns, of the lattice that is being computed
    share: float  # of the cells, those that are computed or chaotic so far
    physical: xr.Dataset | None = None  # the measures of ``dataset`` that have a unit, in the units of the gears

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: of the datasets, only the cells that are known."""
        known = self.dataset["label"].values != 0
        return self.__dict__ | {n: _Sparse(whole, known) for n in ("dataset", "physical")
                                if (whole := getattr(self, n)) is not None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({n: found.whole() if isinstance(found, _Sparse) else found for n, found in state.items()})

    def of_mesh(self, mesh: str) -> Map:
        """The same map with the contact and the dynamic factor of one mesh of a train; itself for the worst one."""
        return replace(self, dataset=self.dataset.assign(of_mesh(self.dataset, mesh).data_vars)) if mesh else self

    def labels(self) -> xr.DataArray:
        """Labels (rows, columns), with `Label.CHAOTIC` in cells that are chaotic so far."""
        label = self.dataset["label"]
        chaotic = self.chaotic_so_far.reshape(label.shape)
        return label.copy(data=np.where(chaotic, label.dtype.type(Label.CHAOTIC), label))

    def shown(self, values: np.ndarray, nothing: float) -> np.ndarray:
        """Of the values (rows, columns) of all cells, the one that each cell shows; ``nothing`` if none yet."""
        return np.where(self.source >= 0, values.ravel()[self.source], np.asarray(nothing, values.dtype))

    def measure(self, name: str, physical: bool = False) -> xr.Variable:
        """The response measure that each cell shows, (rows, columns), NaN if none yet; in the unit of the gears, if
        ``physical`` and it has one."""
        scaled = physical and self.physical is not None and name in self.physical
        found = (self.physical if scaled and self.physical is not None else self.dataset)[name].variable
        return found.copy(data=np.where(self.measure_source >= 0, found.values.ravel()[self.measure_source], np.nan))


class _Sparse:
    """A Dataset of a map, of which only the known cells are kept, a mask (rows, columns); the others are all alike."""

    def __init__(self, dataset: xr.Dataset, known: np.ndarray) -> None:
        variables = {n: v.variable for n, v in dataset.data_vars.items() if v.shape == known.shape}
        self._rest, self._order, self._known = dataset.drop_vars(variables), list(dataset.data_vars), known
        other = np.unravel_index(int(np.argmin(known)), known.shape)
        self._cells = {n: (v.dims, v.attrs, v.values[known], v.values[other]) for n, v in variables.items()}

    def whole(self) -> xr.Dataset:
        """The Dataset with all cells."""
        found = {}
        for name, (dims, attrs, values, other) in self._cells.items():
            found[name] = dims, np.full(self._known.shape, other, values.dtype), attrs
            found[name][1][self._known] = values
        return self._rest.assign(found)[self._order]


class MapGrid:
    """The cells of a map, computed in any order. A cell has the number row * columns + column.

    ``requested``, ``known`` and ``chaotic_so_far``, (rows, columns) of bool, are the cells whose computation has been
    requested; that have a verdict; that have none, but are chaotic so far. The sources are as of `Map`, ``found`` has
    the variables (cells,) of the map by name.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.shape = (rows, columns)
        self.number = np.arange(rows * columns, dtype=np.int32).reshape(self.shape)
        self.requested, self.known, self.chaotic_so_far = (np.zeros(self.shape, dtype=bool) for _ in range(3))
        self.source, self.measure_source = (np.full(self.shape, -1, dtype=np.int32) for _ in range(2))
        self.found: dict[str, np.ndarray] = {}

    def request(self, stride: int) -> np.ndarray:
        """Numbers (N,) of the cells in every stride-th row and column that were not requested before."""
        cells = self.number[::stride, ::stride][~self.requested[::stride, ::stride]]
        self.requested.flat[cells] = True
        return cells

    def put(self, found: dict[str, np.ndarray], cells: np.ndarray) -> None:
        """Keep the variables found, each (N,), of some cells (N,)."""
        put(self.found, found, cells, self.number.size)
        self.known.flat[cells] = True
        self.chaotic_so_far.flat[cells] = False

    def put_chaotic_so_far(self, cells: np.ndarray, stride: int) -> None:
        """Show some cells (N,) of the lattice with this stride as chaotic until their verdict is known."""
        self.chaotic_so_far.flat[cells] = True
        self._spread(cells, stride, self.source)

    def show(self, cells: np.ndarray, stride: int) -> None:
        """Show the values of some cells (N,) of the lattice with this stride also in the cells around them."""
        self._spread(cells, stride, self.source, self.measure_source)

    def reopen(self) -> None:
        """Mark the cells known as chaotic or undecided as to be computed again; until then they keep what they show."""
        unresolved = np.isin(self.found["label"], (Label.CHAOTIC, Label.UNDECIDED))
        cells = np.flatnonzero(self.known.ravel() & unresolved)
        self.requested.flat[cells] = self.known.flat[cells] = False

    def _spread(self, cells: np.ndarray, stride: int, *targets: np.ndarray) -> None:
        """Make each cell of a lattice the source of the cells around it, up to half a stride away.

        Cells of the last row and column of the lattice are the source of all cells beyond them.
        """
        chosen = np.zeros(self.shape, dtype=bool)
        chosen.flat[cells] = True
        column = cells % self.shape[1]
        first, last = column.min(initial=self.shape[1]), column.max(initial=0)
        near = slice(max(0, first - stride), last + stride)  # the columns in which anything changes
        nearest = [np.minimum((np.arange(n) + stride // 2) // stride, (n - 1) // stride) * stride for n in self.shape]
        place = np.ix_(nearest[0], nearest[1][near])
        around = chosen[place]
        for target in targets:
            target[:, near][around] = self.number[place][around]

    def map(self, study: Zones, stride: int) -> Map:
        """The map of what is known now; its arrays are copies."""
        dataset = study.finish({n: v.copy() for n, v in self.found.items()})
        return Map(dataset, self.source.copy(), self.measure_source.copy(), self.chaotic_so_far.ravel().copy(), stride,
                   share=float((self.known | self.chaotic_so_far).mean()),
                   physical=physical_measures(dataset, gears_of(study.model), self.known))


def physical_measures(dataset: xr.Dataset, gears: Gears | None, known: np.ndarray) -> xr.Dataset | None:
    """The response measures of a map by which it can be coloured, in the units of the gears; None without gears.

    Only those of the torques at which a cell is known, (rows, columns) of bool, are scaled: each torque may have
    scales of its own, and those of the cells computed have been found already.
    """
    names = [n for n in COLOURS if n in dataset and quantity(n).physical is not None]
    if gears is None or not names:
        return None
    if "torque" not in dataset.dims:
        return physical(dataset[names], gears)
    other = 1 - dataset["label"].dims.index("torque")
    measures = dataset[names]  # an axis of ω is not scaled
    measures = measures.drop_vars([n for n in measures.coords if n != "torque"])
    found = physical(measures.isel(torque=np.flatnonzero(known.any(axis=other))), gears)
    return found.reindex(torque=dataset["torque"])


COARSE = (32, 16, 8)  # strides of the coarse lattices: every 32nd row and column first
FINE = (4, 2, 1)  # strides of the lattices after them

QUICK = Classification(transient_lengths=(48, 96), longest_period=16, exponent_run=150, doublings=0,
                       longest_transient=0, averaging_periods=32)
"""Settings for the coarse lattices."""

FULL = Classification(transient_lengths=(64, 320), longest_period=16, exponent_run=150, doublings=1,
                      longest_transient=1250, averaging_periods=32)
"""Settings for all cells."""

_TILE_SECONDS = 0.4
"""Longest computing time of one tile. A thread can turn to another page or to a newer map only after a tile."""

_SMALLEST_TILE, _LARGEST_TILE = 256, 4096  # limits of the size of a tile, in cells of a pair
_ROWS = 9  # of a map with several starts that are computed at once: a quarter of those of a pair
_FIRST_INTERVAL, _LAST_INTERVAL, _GROWTH = 0.1, 1.0, 2.0
"""Least number of seconds between two maps shown, at first and in the end, and by what it grows with each."""


def warm_up(view: View) -> Generator[None]:
    """Compute the coarsest map and discard it, so that the kernels it needs are compiled and loaded.

    Of a train it would only delay that of the first page.
    """
    if not view.model.mesh_names:
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
    grid.reopen()
    classifier = BatchClassifier(quick.initial_states, lambda _cells, _motions, found: found.variables(), FULL)
    stages, chaotic = _Stages(classifier, grid, quick, _FIRST_INTERVAL), []
    for stride in FINE:
        cells = grid.request(stride)  # by column: if x is the frequency, neighbours then share their step grids
        unresolved = Unresolved(cells[np.argsort(cells % view.x.count, kind="stable")])
        for stage in ("transients", "exponents"):
            unresolved = yield from stages.run(stage, unresolved, stride)
        grid.put_chaotic_so_far(unresolved.number, stride)
        chaotic.append(unresolved)
    unresolved = concatenated(chaotic)
    by_column = np.argsort(unresolved.number % view.x.count, kind="stable")
    yield from stages.run("chaos", unresolved.take(by_column), 1)
    yield grid.map(quick, 1)


@dataclass
class _Stages:
    """The classification of the cells of a map, stage by stage.

    ``rate`` is the number of cells that one thread classifies per second, by stage. ``shown`` is when the last map was
    shown, and ``interval`` the least number of seconds until the next.
    """

    classifier: BatchClassifier
    grid: MapGrid
    study: Zones
    interval: float
    rate: dict[str, float] = field(default_factory=dict)
    shown: float = field(default_factory=time.monotonic)

    def run(self, stage: str, unresolved: Unresolved, stride: int) -> Generator[Map, None, Unresolved]:
        """Run one stage for all unresolved cells, and yield maps meanwhile; returns the cells that stay unresolved."""
        def classify(tile: slice) -> tuple[np.ndarray, dict[str, np.ndarray], Unresolved]:
            began = time.perf_counter()
            found = self.classifier.run_stage(stage, unresolved, tile)
            self.rate[stage] = (tile.stop - tile.start) / (time.perf_counter() - began)
            return found

        rest = {0: unresolved.take(slice(0))}
        for tile, (cells, variables, left) in tiles.run(classify, self._tiles(stage, len(unresolved.number))):
            self.grid.put(variables, cells)
            self.grid.show(cells, stride)
            rest[tile.start] = left
            if time.monotonic() - self.shown > self.interval:
                self.shown, self.interval = time.monotonic(), min(_GROWTH * self.interval, _LAST_INTERVAL)
                yield self.grid.map(self.study, stride)
        return concatenated([rest[first] for first in sorted(rest)])

    def _tiles(self, stage: str, count: int) -> Iterator[slice]:
        """Tiles of `_TILE_SECONDS`, or of the interval between two maps; smaller ones at the end, so that all threads
        end at about the same time."""
        first, smallest = 0, max(WIDTH, _SMALLEST_TILE // coarseness(self.study.model) ** 2)
        while first < count:
            largest = min(_LARGEST_TILE, max(smallest, (count - first) // (2 * cores())))
            seconds = min(_TILE_SECONDS, self.interval)
            size = int(np.clip(seconds * self.rate.get(stage, 0.0), smallest, largest))
            yield slice(first, min(first + size, count))
            first += size


def successive_maps(view: View) -> Generator[Map]:
    """The map of a view, first with the cells of the coarsest lattice, in the end with all cells.

    That of the number of attractors, and of gears of what load changes lead to, has several initial states in every
    cell of a coarser plane. Some rows are computed at once, along which the sweeps run side by side.
    """
    if view.colour not in OF_STARTS:
        yield from _motion_map(view)
        return
    columns, rows = (count // coarseness(view.model) for count in ATTRACTOR_MAP[:2])
    starts = ATTRACTOR_MAP[2]
    x, y = (Axis(a.name, a.start, a.stop, n) for a, n in ((view.x, columns), (view.y, rows)))
    study = Zones(view.model, x, y, starts=starts, load_change=view.load_change, settings=QUICK)
    grid = MapGrid(columns, rows)
    for stride in (4, 2, 1):
        missing = [row for row in range(0, rows, stride) if not grid.known[row].any()]
        for some in (missing[i : i + _ROWS] for i in range(0, len(missing), _ROWS)):
            cells = grid.number[some].ravel()
            grid.put(study.compute(cells), cells)
            for row in some:
                grid.source[row : row + stride] = grid.measure_source[row : row + stride] = grid.number[row]
            yield grid.map(study, stride)
