"""A map for a fraction of its cells: a coarse lattice first, then finer ones only where neighbours differ.

What is not computed is inferred from the corners of the block it lies in, and says so. At last every boundary is
followed: as long as a computed cell differs from one inferred nearby, that one is computed too. So a thin tongue is
found whole wherever the lattice meets it; what lies wholly between lattice lines, and far from any boundary, is missed.
"""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np

from gearchaos.dynamics import Reason
from gearchaos.studies.verdict_variables import blank

SIDE = 256
"""Rows and columns of a part that is refined by itself, so that its result does not depend on what is beside it."""

_NEARBY = np.hypot(*np.mgrid[-4:5, -4:5]) < 4.3
"""The cells about a cell, itself in the middle, that cast doubt on it if they are computed and of another kind."""

Cells = Callable[[np.ndarray], dict[str, np.ndarray]]
"""From the numbers (L,) of some cells what is found of them, arrays (L,) by name."""

Rounds = Generator[np.ndarray, np.ndarray]
"""Asks for cells by their places (L,) and takes what kinds of motion they have (L,)."""


def refined(compute: Cells, cells: np.ndarray, columns: int, coarse: int) -> dict[str, np.ndarray]:
    """What is found, or inferred, of some cells (N,) of a map with so many columns, arrays (N,) by name.

    They are whole parts of `SIDE` rows and columns of it. ``coarse`` is the first step of the lattice, a power of two.
    ``inferred`` is 1 where a cell was not computed: it has the label and period of its block's corners, and nothing
    else. What all parts ask for next is computed together, since a few cells cost nearly as much as many.
    """
    parts = [_Refinement(places) for places in _parts(cells, columns)]
    running, found = [part.rounds(coarse) for part in parts], dict[str, np.ndarray]()
    asked = [next(one) for one in running]
    while running:
        places, ends = np.concatenate(asked), np.cumsum([len(a) for a in asked])
        new = compute(cells[places])
        _put(found, new, places, len(cells))
        answers = [_answer(*pair) for pair in zip(running, np.split(_kinds(new), ends[:-1]), strict=True)]
        running = [one for one, answer in zip(running, answers, strict=True) if answer is not None]
        asked = [answer for answer in answers if answer is not None]
    found["inferred"] = np.zeros(len(cells), dtype=np.int8)
    for part in parts:
        _infer(found, *part.guessed())
    return found


def _parts(cells: np.ndarray, columns: int) -> list[np.ndarray]:
    """Where the cells of every part stand among all, (rows, columns)."""
    row, column = np.divmod(cells, columns)
    number = (row // SIDE) * (columns // SIDE + 1) + column // SIDE
    order = np.argsort(number, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    return [places.reshape(len(np.unique(row[places])), -1) for places in parts]


def _kinds(found: dict[str, np.ndarray]) -> np.ndarray:
    """A number for every kind and period of motion."""
    return found["label"].astype(np.int64) * 2**32 + found["period"]


def _put(found: dict[str, np.ndarray], new: dict[str, np.ndarray], places: np.ndarray, count: int) -> None:
    """Put what is new in its places among all."""
    for name, values in new.items():
        if name not in found:
            found[name] = np.full(count, blank(name, values.dtype), values.dtype)
        found[name][places] = values


def _answer(one: Rounds, kinds: np.ndarray) -> np.ndarray | None:
    """What a part asks for after this answer, if anything."""
    try:
        return one.send(kinds)
    except StopIteration:
        return None


def _infer(found: dict[str, np.ndarray], places: np.ndarray, kinds: np.ndarray) -> None:
    """Give cells the kinds that were inferred, and say so."""
    found["label"][places], found["period"][places] = np.divmod(kinds, 2**32)
    found["reason"][places], found["inferred"][places] = Reason.INFERRED, 1


class _Refinement:
    """A rectangle of cells, asked for step by step; blocks that are alike are settled and left alone."""

    def __init__(self, places: np.ndarray) -> None:
        self.places = places
        self.known = np.zeros(places.shape, dtype=bool)
        self.kind = np.zeros(places.shape, dtype=np.int64)

    def rounds(self, coarse: int) -> Rounds:
        """The places of cells to be computed, again and again; takes their kinds."""
        step = coarse if min(self.places.shape) > 1 else 1
        yield from self.add(self.lattice(step))
        while step > 1:
            yield from self.add(self.refine(step, beside=step == coarse))
            step //= 2
        while (doubtful := self.doubtful()).any():
            yield from self.add(doubtful)

    def lines(self, step: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of a lattice, the last ones included."""
        rows, columns = (np.unique(np.append(np.arange(0, n, step), n - 1)) for n in self.places.shape)
        return rows, columns

    def lattice(self, step: int) -> np.ndarray:
        """Which cells (rows, columns) are on it."""
        out = np.zeros(self.places.shape, dtype=bool)
        out[np.ix_(*self.lines(step))] = True
        return out

    def add(self, wanted: np.ndarray) -> Rounds:
        """Ask for those of the wanted cells that are not known."""
        new = wanted & ~self.known
        if new.any():
            self.kind[new] = yield self.places[new]
            self.known |= new

    def refine(self, step: int, beside: bool) -> np.ndarray:
        """Which cells the next lattice has in blocks whose corners differ, or lie ``beside`` such; fill the others."""
        from scipy.ndimage import binary_dilation  # here, since it takes a tenth of a second to load

        rows, columns = self.lines(step)
        known, kind = _corners(self.known[np.ix_(rows, columns)]), _corners(self.kind[np.ix_(rows, columns)])
        complete = known.all(axis=0)
        mixed = complete & (kind != kind[0]).any(axis=0)
        finer = binary_dilation(mixed, np.ones((3, 3))) & complete if beside else mixed
        self._fill(complete & ~finer, rows, columns)
        return self.lattice(step // 2) & _cover(finer, rows, columns, self.places.shape)

    def _fill(self, blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        """Give the kind of their corners to the cells of some blocks that are not known."""
        inside = _cover(blocks, rows, columns, self.places.shape) & ~self.known
        i, j = np.nonzero(inside)
        at = rows[np.searchsorted(rows, i, side="right") - 1], columns[np.searchsorted(columns, j, side="right") - 1]
        self.kind[i, j] = self.kind[at]

    def doubtful(self) -> np.ndarray:
        """Which cells were inferred to be other than some cell computed nearby is."""
        from scipy.ndimage import maximum_filter, minimum_filter  # here, as in `refine`

        most, least = self.kind.max() + 1, self.kind.min() - 1
        high = maximum_filter(np.where(self.known, self.kind, least), footprint=_NEARBY)
        low = minimum_filter(np.where(self.known, self.kind, most), footprint=_NEARBY)
        return ~self.known & (((high > least) & (high != self.kind)) | ((low < most) & (low != self.kind)))

    def guessed(self) -> tuple[np.ndarray, np.ndarray]:
        """Places and kinds of the cells that were inferred."""
        return self.places[~self.known], self.kind[~self.known]


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
