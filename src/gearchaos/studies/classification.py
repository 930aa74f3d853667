"""Verdicts on many motions, stage by stage: what a stage leaves open is gathered from all tiles for the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gearchaos.dynamics import STAGES, Classification, ClassificationState, Verdicts, conclude
from gearchaos.execute import tiles
from gearchaos.flow import WIDTH, ExactFlow

InitialStates = Callable[[np.ndarray], tuple[ExactFlow, np.ndarray, np.ndarray]]
"""From the numbers of L motions their flow, their starts (d, L) and their parameter points (L,)."""

Collect = Callable[[np.ndarray, ExactFlow, np.ndarray, Verdicts], dict[str, np.ndarray]]
"""From the numbers of L motions, their flow, points and verdicts what to keep of them: arrays (L, ...) by name."""


_RECORDED = 1_100_000
"""Sections that a tile keeps at once at most, to find how long a motion takes to come back."""


def classify_batch(
    initial_states: InitialStates, keep: Collect, order: np.ndarray, *, settings: Classification | None = None,
    levels: bool = True,
    largest: int = tiles.TILE, progress: str | None = None, threads: int | None = None,
) -> dict[str, np.ndarray]:
    """Verdicts on the motions numbered 0 to N - 1, as arrays (N, ...) of what ``keep`` keeps of them.

    Parameters
    ----------
    order : (N,)
        The numbers, motions of about the same mesh frequency side by side: they share node counts.
    settings, levels
        As in `classify`.
    largest : int
        Most motions in a tile.
    progress : str, optional
        Name of the progress bar.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Chaos must be followed ten times as long as anything else, to see whether it lasts, and exponents are sought of few
    motions; in one tile they are too rare to fill the blocks of lanes that the kernels run on. So they are put aside,
    and gathered from all tiles for the stage that judges them.
    """
    run, columns = BatchClassifier(initial_states, keep, settings or Classification(), levels), _Columns(len(order))
    largest = min(largest, max(WIDTH, _RECORDED // (2 * run.settings.longest_period + 1)))
    still = Unresolved(order)
    for stage in STAGES:
        rest = {}
        for tile, (settled, facts, left) in tiles.run(
            partial(run.judge, stage, still), tiles.split(len(still.number), largest, threads),
            progress=progress and f"{progress}, {stage}", threads=threads,
        ):
            columns.put(settled, facts)
            rest[tile.start] = left
        still = concatenated([rest[first] for first in sorted(rest)])
        if len(still.number) == 0:
            break
    return columns.arrays


@dataclass(frozen=True)
class Unresolved:
    """Motions not yet judged: their numbers (L,), and once under way what `ClassificationState` knows of them."""

    number: np.ndarray
    known: dict[str, np.ndarray] = field(default_factory=dict)

    def take(self, which: slice | np.ndarray) -> Unresolved:
        """Some of them."""
        return Unresolved(self.number[which], {name: v[..., which] for name, v in self.known.items()})


def concatenated(parts: list[Unresolved]) -> Unresolved:
    """All of them, in that order."""
    known = {name: np.concatenate([p.known[name] for p in parts], axis=-1) for name in parts[0].known}
    return Unresolved(np.concatenate([p.number for p in parts]), known)


@dataclass(frozen=True)
class BatchClassifier:
    """How a tile is judged; the fields are as in `classify_batch`."""

    initial_states: InitialStates
    keep: Collect
    settings: Classification
    levels: bool = True

    def judge(self, stage: str, still: Unresolved, tile: slice) -> tuple[np.ndarray, dict[str, np.ndarray], Unresolved]:
        """The motions of a tile that a stage of `STAGES` can judge, what is kept of them, and the rest."""
        state = self._state(still.take(tile))
        STAGES[stage](state)
        settled, number = np.flatnonzero(state.label), still.number[tile]
        known = {name: getattr(state, name)[..., state.unresolved] for name in ("w", "periods_run", "chaotic_so_far")}
        return number[settled], self._kept(number[settled], state.take(settled)), Unresolved(number[state.unresolved],
            known)

    def _state(self, still: Unresolved) -> ClassificationState:
        flow, w, points = self.initial_states(still.number)
        state = ClassificationState(flow, points, self.settings, w, spectrum=False)
        for name, value in still.known.items():
            setattr(state, name, value.copy())
        return state

    def _kept(self, number: np.ndarray, state: ClassificationState) -> dict[str, np.ndarray]:
        if len(number) == 0:
            return {}
        return self.keep(number, state.flow, state.points, conclude(state, levels=self.levels))


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
