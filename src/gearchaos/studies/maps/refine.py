"""Refinement of a map: a coarse lattice of cells is computed first, then finer ones only where neighbours differ.

A cell that is not computed has the motion inferred from the corners of its block of the lattice, and is marked as
inferred. Finally the boundaries are traced: an inferred cell with a computed cell nearby of another motion is computed
too, until there is none. So a thin tongue is found entirely wherever a lattice point lies in it. A region that contains
no lattice point and is far from every boundary is missed.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import suppress

import numpy as np

from gearchaos.dynamics import Reason

SIDE = 256
"""Rows and columns of a part of the map. Each part is refined by itself, so that its result does not depend on which
other parts are computed with it."""

_NEARBY = np.hypot(*np.mgrid[-4:5, -4:5]) < 4.3
"""Footprint of the cells near a cell, which is in the middle. A cell is computed if one of these is computed and has
another motion."""

Compute = Callable[[np.ndarray], dict[str, np.ndarray]]
"""Function from the numbers (L,) of cells to their results, arrays (L,) by name."""

Requests = Generator[np.ndarray, np.ndarray]
"""Generator that yields the positions (L,) of cells to be computed, and receives their motion codes (L,)."""


def refined(compute: Compute, cells: np.ndarray, columns: int, coarse: int) -> dict[str, np.ndarray]:
    """Compute or infer the results (N,) by name of cells of a map with this number of columns.

    ``cells`` (N,) are their numbers; they fill whole parts of `SIDE` rows and columns of the map. ``coarse`` is the
    spacing of the first lattice, a power of two. ``inferred`` is 1 where a cell was not computed: it then has the label
    and period of the corners of its block, `Reason.INFERRED`, and fill values elsewhere. The cells that all parts
    request next are computed together, since a few cells cost nearly as much as many.
    """
    row, column = np.divmod(cells, columns)
    number = (row // SIDE) * (columns // SIDE + 1) + column // SIDE
    order = np.argsort(number, kind="stable")
    own = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    parts = [_Refinement(positions.reshape(len(np.unique(row[positions])), -1)) for positions in own]
    running, found = [part.requests(coarse) for part in parts], dict[str, np.ndarray]()
    requested = [next(part) for part in running]
    while running:
        positions, ends = np.concatenate(requested), np.cumsum([len(r) for r in requested])
        new = compute(cells[positions])
        put(found, new, positions, len(cells))
        codes = np.split(new["label"].astype(np.int64) * 2**32 + new["period"], ends[:-1])
        answered = list(zip(running, codes, strict=True))
        running, requested = [], []
        for requests, received in answered:
            with suppress(StopIteration):  # raised by a part that has ended
                requested.append(requests.send(received))
                running.append(requests)
    found["inferred"] = np.zeros(len(cells), dtype=np.int8)
    for part in parts:
        rest, motions = part.inferred()
        found["label"][rest], found["period"][rest] = np.divmod(motions, 2**32)
        found["reason"][rest], found["inferred"][rest] = Reason.INFERRED, 1
    return found


def put(found: dict[str, np.ndarray], new: dict[str, np.ndarray], positions: np.ndarray, count: int) -> None:
    """Put new results (L, ...) at their positions (L,) in arrays (count, ...), which are made if they do not exist."""
    for name, values in new.items():
        if name not in found:
            found[name] = np.full((count, *values.shape[1:]), fill_value(name, values.dtype), values.dtype)
        found[name][positions] = values


class _Refinement:
    """The refinement of one part of a map, with arrays (rows, columns).

    ``positions`` are those of the cells among all cells of the computation, ``code`` their motion codes, computed or
    inferred; 0 where neither is done yet.
    """

    def __init__(self, positions: np.ndarray) -> None:
        self.positions = positions
        self.computed = np.zeros(positions.shape, dtype=bool)
        self.code = np.zeros(positions.shape, dtype=np.int64)

    def requests(self, coarse: int) -> Requests:
        """Yield the positions of cells to be computed, lattice by lattice, and receive their motion codes."""
        spacing = coarse if min(self.positions.shape) > 1 else 1
        yield from self.request(self.lattice(spacing))
        while spacing > 1:
            yield from self.request(self.next_lattice(spacing, with_neighbours=spacing == coarse))
            spacing //= 2
        while (contradicted := self.contradicted()).any():
            yield from self.request(contradicted)

    def lines(self, spacing: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows (R,) and columns (C,) of a lattice, which always include the last ones."""
        rows, columns = (np.unique(np.append(np.arange(0, n, spacing), n - 1)) for n in self.positions.shape)
        return rows, columns

    def lattice(self, spacing: int) -> np.ndarray:
        """Whether each cell is on the lattice, (rows, columns) of bool."""
        out = np.zeros(self.positions.shape, dtype=bool)
        out[np.ix_(*self.lines(spacing))] = True
        return out

    def request(self, wanted: np.ndarray) -> Requests:
        """Request those of the wanted cells (rows, columns) that are not computed yet."""
        new = wanted & ~self.computed
        if new.any():
            self.code[new] = yield self.positions[new]
            self.computed |= new

    def next_lattice(self, spacing: int, with_neighbours: bool) -> np.ndarray:
        """Cells of the lattice of half the spacing in blocks whose corners differ, (rows, columns) of bool.

        With ``with_neighbours`` the blocks next to these are included. The cells of all other blocks are inferred.
        """
        from scipy.ndimage import binary_dilation  # here, since it takes a tenth of a second to load

        rows, columns = self.lines(spacing)
        computed, code = _corners(self.computed[np.ix_(rows, columns)]), _corners(self.code[np.ix_(rows, columns)])
        complete = computed.all(axis=0)
        mixed = complete & (code != code[0]).any(axis=0)
        finer = binary_dilation(mixed, np.ones((3, 3))) & complete if with_neighbours else mixed
        inside = _cells_of_blocks(complete & ~finer, rows, columns, self.positions.shape) & ~self.computed
        i, j = np.nonzero(inside)  # inferred from a corner of their block
        at = rows[np.searchsorted(rows, i, side="right") - 1], columns[np.searchsorted(columns, j, side="right") - 1]
        self.code[i, j] = self.code[at]
        return self.lattice(spacing // 2) & _cells_of_blocks(finer, rows, columns, self.positions.shape)

    def contradicted(self) -> np.ndarray:
        """Inferred cells with a computed cell nearby that has another motion code, (rows, columns) of bool."""
        from scipy.ndimage import maximum_filter, minimum_filter  # here, as in `next_lattice`

        above, below = self.code.max() + 1, self.code.min() - 1
        high = maximum_filter(np.where(self.computed, self.code, below), footprint=_NEARBY)
        low = minimum_filter(np.where(self.computed, self.code, above), footprint=_NEARBY)
        return ~self.computed & (((high > below) & (high != self.code)) | ((low < above) & (low != self.code)))

    def inferred(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions and motion codes of the inferred cells, each (L,)."""
        return self.positions[~self.computed], self.code[~self.computed]


def _corners(values: np.ndarray) -> np.ndarray:
    """The values (R, C) on a lattice at the four corners of its blocks, (4, R - 1, C - 1)."""
    return np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])


def _cells_of_blocks(blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Whether each cell lies in or on the edge of one of the chosen blocks, bool of this shape.

    ``blocks`` (R - 1, C - 1) are those of the lattice with ``rows`` (R,) and ``columns`` (C,).
    """
    inner = np.repeat(np.repeat(blocks, np.diff(rows), axis=0), np.diff(columns), axis=1)
    out = np.zeros(shape, dtype=bool)
    for corner in (out[:-1, :-1], out[1:, :-1], out[:-1, 1:], out[1:, 1:]):
        corner |= inner
    return out


def fill_value(name: str, dtype: np.dtype) -> float | int:
    """The value of a variable where it is not computed: NaN for floats, −1 for contact states and ``proved``, else 0.

    0 is not a label, a period or a reason, but is a contact state, and means "not proved".
    """
    if dtype.kind == "f":
        return np.nan
    return -1 if name.startswith("contact") or name == "proved" else 0
