"""Verdicts on many motions: in tiles, and then the chaos that may pass, gathered from all tiles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.motion import Budget, Sheet, Verdicts, conclude, look
from gearchaos.studies import tiles

Launch = Callable[[np.ndarray], tuple[ExactFlow, np.ndarray, np.ndarray]]
"""From the numbers of L motions their flow, their starts (d, L) and their parameter points (L,)."""

Keep = Callable[[np.ndarray, ExactFlow, np.ndarray, Verdicts], dict[str, np.ndarray]]
"""From the numbers of L motions, their flow, points and verdicts what to keep of them: arrays (L, ...) by name."""


def survey(
    launch: Launch, keep: Keep, order: np.ndarray, *, budget: Budget | None = None, levels: bool = True,
    largest: int = tiles.TILE, progress: str | None = None, threads: int | None = None,
) -> dict[str, np.ndarray]:
    """Verdicts on the motions numbered 0 to N - 1, as arrays (N, ...) of what ``keep`` keeps of them.

    Parameters
    ----------
    order : (N,)
        The numbers, motions of about the same mesh frequency side by side: they share node counts.
    budget, levels
        As in `classify`.
    largest : int
        Most motions in a tile.
    progress : str, optional
        Name of the progress bar.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Chaos must be followed ten times as long as anything else, to see whether it lasts, but in one tile it is too rare
    to fill the blocks of lanes that the kernels run on. So it is put aside, and outlasted for all tiles together.
    """
    run, columns = _Survey(launch, keep, budget or Budget(), levels), _Columns(len(order))
    aside = {}
    parts = tiles.split(len(order), largest, threads)
    for tile, (settled, facts, rest) in tiles.run(
        lambda tile: run.look(order[tile]), parts, progress=progress, threads=threads
    ):
        columns.put(settled, facts)
        aside[tile.start] = rest
    chaos = _together([aside[first] for first in sorted(aside)])
    if len(chaos.number) == 0:
        return columns.arrays
    for tile, facts in tiles.run(
        lambda tile: run.outlast(chaos.take(tile)), tiles.split(len(chaos.number), threads=threads),
        progress=progress and f"{progress}, chaos", threads=threads,
    ):
        columns.put(chaos.number[tile], facts)
    return columns.arrays


@dataclass(frozen=True)
class _Open:
    """Motions not yet judged: their numbers (L,), states (d, L) and the periods spent on them (L,)."""

    number: np.ndarray
    w: np.ndarray
    spent: np.ndarray

    def take(self, which: slice) -> _Open:
        return _Open(self.number[which], self.w[:, which], self.spent[which])


def _together(parts: list[_Open]) -> _Open:
    """All of them, in that order."""
    number, spent = (np.concatenate([getattr(part, name) for part in parts]) for name in ("number", "spent"))
    return _Open(number, np.concatenate([part.w for part in parts], axis=1), spent)


@dataclass(frozen=True)
class _Survey:
    """How a tile is judged."""

    launch: Launch
    keep: Keep
    budget: Budget
    levels: bool

    def look(self, tile: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray], _Open]:
        """The motions of a tile that can be judged, what is kept of them, and the rest."""
        flow, w, points = self.launch(tile)
        sheet = look(Sheet(flow, points, self.budget, w, spectrum=False))
        settled, rest = np.flatnonzero(sheet.label), sheet.open
        return (
            tile[settled], self._kept(tile[settled], sheet.take(settled)),
            _Open(tile[rest], sheet.w[:, rest], sheet.spent[rest]),
        )

    def outlast(self, chaos: _Open) -> dict[str, np.ndarray]:
        """What is kept of motions that were chaotic at first sight."""
        flow, _, points = self.launch(chaos.number)
        sheet = Sheet(flow, points, self.budget, chaos.w, spectrum=False)
        sheet.spent, sheet.wild = chaos.spent, np.ones(len(chaos.number), dtype=bool)
        return self._kept(chaos.number, sheet)

    def _kept(self, number: np.ndarray, sheet: Sheet) -> dict[str, np.ndarray]:
        if len(number) == 0:
            return {}
        return self.keep(number, sheet.flow, sheet.points, conclude(sheet, levels=self.levels))


class _Columns:
    """Arrays of ``count`` rows by name, filled piece by piece."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.arrays: dict[str, np.ndarray] = {}

    def put(self, rows: np.ndarray, values: dict[str, np.ndarray]) -> None:
        for name, value in values.items():
            if name not in self.arrays:
                self.arrays[name] = np.zeros((self.count, *value.shape[1:]), value.dtype)
            self.arrays[name][rows] = value
