"""The cells of a map while it is computed: which are known, and which cell each one is coloured by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.studies.fill_values import fill_value
from gearchaos.studies.zones import Zones


@dataclass(frozen=True)
class Map:
    """A map as far as it is computed.

    Attributes
    ----------
    dataset : xarray.Dataset
        As from `gearchaos.zones`; ``label`` is 0 in cells that are not computed yet.
    source : (rows, columns) of int
        Number of the cell whose kind of motion each cell shows: its own once it is computed; -1 if there is none.
    level_source : (rows, columns) of int
        The same for response levels such as ``v_rms``, which a chaotic motion has only after its verdict.
    chaotic_so_far : (cells,) of bool
        Cells with chaotic motion up to now whose verdict is still open, since it may be a transient.
    stride : int
        Distance between the rows and columns that are being computed.
    share : float
        Share of the cells that are computed or chaotic so far.
    """

    dataset: xr.Dataset
    source: np.ndarray
    level_source: np.ndarray
    chaotic_so_far: np.ndarray
    stride: int
    share: float

    def labels(self) -> xr.DataArray:
        """Labels (rows, columns), with `Label.CHAOTIC` in cells that are chaotic so far."""
        label = self.dataset["label"]
        chaotic = self.chaotic_so_far.reshape(label.shape)
        return label.copy(data=np.where(chaotic, label.dtype.type(Label.CHAOTIC), label))

    def shown(self, values: np.ndarray, nothing: float) -> np.ndarray:
        """Values (rows, columns) as the cells show them, ``nothing`` where there is nothing to show yet."""
        return np.where(self.source >= 0, values.ravel()[self.source], np.asarray(nothing, values.dtype))

    def level(self, name: str) -> xr.Variable:
        """A response level (rows, columns) as the cells show it, NaN where there is nothing to show yet."""
        level = self.dataset[name].variable
        return level.copy(data=np.where(self.level_source >= 0, level.values.ravel()[self.level_source], np.nan))


class MapGrid:
    """The cells of a map, computed in any order. A cell has the number row * columns + column.

    Attributes
    ----------
    number : (rows, columns) of int
    requested, known, chaotic_so_far : (rows, columns) of bool
        Cells whose computation was asked for; that have a verdict; that are chaotic so far, without a verdict.
    source, level_source : (rows, columns) of int
        As of `Map`.
    found : dict of str to (cells,) array
        Variables of the map by name.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.shape = (rows, columns)
        self.number = np.arange(rows * columns, dtype=np.int32).reshape(self.shape)
        self.requested, self.known, self.chaotic_so_far = (np.zeros(self.shape, dtype=bool) for _ in range(3))
        self.source, self.level_source = (np.full(self.shape, -1, dtype=np.int32) for _ in range(2))
        self.found: dict[str, np.ndarray] = {}

    def request(self, stride: int) -> np.ndarray:
        """Numbers (N,) of the cells in every stride-th row and column that were not requested before."""
        cells = self.number[::stride, ::stride][~self.requested[::stride, ::stride]]
        self.requested.flat[cells] = True
        return cells

    def put(self, found: dict[str, np.ndarray], cells: np.ndarray) -> None:
        """Keep the variables found, each (N,), of some cells (N,)."""
        for name, values in found.items():
            if name not in self.found:
                self.found[name] = np.full(self.number.size, fill_value(name, values.dtype), values.dtype)
            self.found[name][cells] = values
        self.known.flat[cells] = True
        self.chaotic_so_far.flat[cells] = False

    def put_chaotic_so_far(self, cells: np.ndarray, stride: int) -> None:
        """Show some cells as chaotic until their verdict is known."""
        self.chaotic_so_far.flat[cells] = True
        self._spread(cells, stride, self.source)

    def unresolved(self) -> np.ndarray:
        """Numbers of the known cells whose verdict is chaotic or undecided."""
        return np.flatnonzero(self.known.ravel() & np.isin(self.found["label"], (Label.CHAOTIC, Label.UNDECIDED)))

    def reopen(self, cells: np.ndarray) -> None:
        """Have some cells computed again; until then they show what they showed before."""
        self.requested.flat[cells] = self.known.flat[cells] = False

    def show(self, cells: np.ndarray, stride: int) -> None:
        """Show some cells of the lattice with this stride in all cells nearest to them."""
        for target in (self.source, self.level_source):
            self._spread(cells, stride, target)

    def _spread(self, cells: np.ndarray, stride: int, target: np.ndarray) -> None:
        """Enter each cell as the source of all cells within half a stride; beyond the last row and column of all."""
        row, column = np.divmod(cells, self.shape[1])
        for down in range(-(stride // 2), max(1, stride)):
            for right in range(-(stride // 2), max(1, stride)):
                r, c = row + down, column + right
                inside = self._nearest(row, down, stride, 0) & self._nearest(column, right, stride, 1)
                target[r[inside], c[inside]] = cells[inside]

    def _nearest(self, index: np.ndarray, offset: int, stride: int, dimension: int) -> np.ndarray:
        """Whether the row (or column) at an offset exists and is nearest to the row ``index`` of the lattice, (N,)."""
        half, size, moved = max(1, (stride + 1) // 2), self.shape[dimension], index + offset
        return (moved >= 0) & (moved < size) & ((offset < half) | (index + stride >= size))

    def map(self, study: Zones, stride: int) -> Map:
        """The map of what is known now; its arrays are copies."""
        found = {n: v.copy() for n, v in self.found.items()}
        share = float((self.known | self.chaotic_so_far).mean())
        sources = self.source.copy(), self.level_source.copy()
        return Map(study.finish(found), *sources, self.chaotic_so_far.ravel().copy(), stride, share)
