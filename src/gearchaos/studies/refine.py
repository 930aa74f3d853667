"""A map for a fraction of its cells: a coarse lattice first, then finer ones only where neighbours differ.

What is not computed is inferred from the corners of the block it lies in, and says so. At last every boundary is
followed: as long as a computed cell differs from one inferred nearby, that one is computed too. So a thin tongue is
found whole wherever the lattice meets it; what lies wholly between lattice lines, and far from any boundary, is missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter, minimum_filter

from gearchaos.motion import Reason
from gearchaos.studies.evidence import blank

SIDE = 256
"""Rows and columns of a part that is refined by itself, so that its result does not depend on what is beside it."""

_NEARBY = 7
"""Rows and columns about a cell in which a computed cell of another kind casts doubt on it."""

Cells = Callable[[np.ndarray], dict[str, np.ndarray]]
"""From the numbers (L,) of some cells what is found of them, arrays (L,) by name."""


def refined(compute: Cells, cells: np.ndarray, coarse: int) -> dict[str, np.ndarray]:
    """What is found, or inferred, of a rectangle of cells (rows, columns) of a map, arrays (rows * columns,) by name.

    ``coarse`` is the first step of the lattice, a power of two. ``inferred`` is 1 where a cell was not computed: it has
    the label and period of its block's corners, and nothing else.
    """
    work = _Refinement(compute, cells)
    step = coarse if min(cells.shape) > 1 else 1
    work.add(work.lattice(step))
    while step > 1:
        work.add(work.refine(step, beside=step == coarse))
        step //= 2
    while (doubtful := work.doubtful()).any():
        work.add(doubtful)
    return work.finish()


def in_parts(compute: Cells, cells: np.ndarray, columns: int, coarse: int) -> dict[str, np.ndarray]:
    """`refined` for some cells (N,) of a map with so many columns, whole parts of `SIDE` rows and columns of it."""
    row, column = np.divmod(cells, columns)
    part = (row // SIDE) * (columns // SIDE + 1) + column // SIDE
    out: dict[str, np.ndarray] = {}
    for number in np.unique(part):
        mine = np.flatnonzero(part == number)
        rectangle = cells[mine].reshape(len(np.unique(row[mine])), -1)
        for name, values in refined(compute, rectangle, coarse).items():
            out.setdefault(name, np.empty(len(cells), values.dtype))[mine] = values
    return out


class _Refinement:
    """Cells of a rectangle, computed step by step; blocks that are alike are settled and left alone."""

    def __init__(self, compute: Cells, cells: np.ndarray) -> None:
        self.compute, self.cells = compute, cells
        self.known = np.zeros(cells.shape, dtype=bool)
        self.kind = np.zeros(cells.shape, dtype=np.int64)
        self.found: dict[str, np.ndarray] = {}

    def lines(self, step: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of a lattice, the last ones included."""
        rows, columns = (np.unique(np.append(np.arange(0, n, step), n - 1)) for n in self.cells.shape)
        return rows, columns

    def lattice(self, step: int) -> np.ndarray:
        """Which cells (rows, columns) are on it."""
        out = np.zeros(self.cells.shape, dtype=bool)
        out[np.ix_(*self.lines(step))] = True
        return out

    def add(self, wanted: np.ndarray) -> None:
        """Compute those of the wanted cells that are not known."""
        new = wanted & ~self.known
        if not new.any():
            return
        for name, values in self.compute(self.cells[new]).items():
            if name not in self.found:
                self.found[name] = np.full(self.cells.shape, blank(name, values.dtype), values.dtype)
            self.found[name][new] = values
        self.known |= new
        self.kind[new] = self._kinds()[new]

    def _kinds(self) -> np.ndarray:
        """A number for every kind and period of motion."""
        return self.found["label"].astype(np.int64) * 2**32 + self.found["period"]

    def refine(self, step: int, beside: bool) -> np.ndarray:
        """Which cells the next lattice has in blocks whose corners differ, or lie ``beside`` such; fill the others."""
        rows, columns = self.lines(step)
        known, kind = _corners(self.known[np.ix_(rows, columns)]), _corners(self.kind[np.ix_(rows, columns)])
        complete = known.all(axis=0)
        mixed = complete & (kind != kind[0]).any(axis=0)
        finer = binary_dilation(mixed, np.ones((3, 3))) & complete if beside else mixed
        self._fill(complete & ~finer, rows, columns)
        return self.lattice(step // 2) & _cover(finer, rows, columns, self.cells.shape)

    def _fill(self, blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        """Give the kind of their corners to the cells of some blocks that are not known."""
        inside = _cover(blocks, rows, columns, self.cells.shape) & ~self.known
        i, j = np.nonzero(inside)
        at = rows[np.searchsorted(rows, i, side="right") - 1], columns[np.searchsorted(columns, j, side="right") - 1]
        self.kind[i, j] = self.kind[at]

    def doubtful(self) -> np.ndarray:
        """Which cells were inferred to be other than some cell computed nearby is."""
        most, least = self.kind.max() + 1, self.kind.min() - 1
        high = maximum_filter(np.where(self.known, self.kind, least), size=_NEARBY)
        low = minimum_filter(np.where(self.known, self.kind, most), size=_NEARBY)
        return ~self.known & (((high > least) & (high != self.kind)) | ((low < most) & (low != self.kind)))

    def finish(self) -> dict[str, np.ndarray]:
        """All arrays, with what was inferred."""
        guessed = ~self.known
        self.found["label"][guessed], self.found["period"][guessed] = np.divmod(self.kind[guessed], 2**32)
        self.found["reason"][guessed] = Reason.INFERRED
        self.found["inferred"] = guessed.astype(np.int8)
        return {n: v.ravel() for n, v in self.found.items()}


def _corners(values: np.ndarray) -> np.ndarray:
    """The values (R, C) on a lattice at the four corners of its blocks, (4, R - 1, C - 1)."""
    return np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])


def _cover(blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The cells of some blocks of a lattice, edges included."""
    inner = np.repeat(np.repeat(blocks, np.diff(rows), axis=0), np.diff(columns), axis=1)
    out = np.zeros(shape, dtype=bool)
    for corner in (out[:-1, :-1], out[1:, :-1], out[:-1, 1:], out[1:, 1:]):
        corner |= inner
    return out
