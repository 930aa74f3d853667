"""Classification of many motions in tiles; each stage takes the unresolved motions of all tiles together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gearchaos.dynamics import STAGES, Classification, ClassificationState, Verdicts, conclude
from gearchaos.execute import tiles
from gearchaos.flow import WIDTH
from gearchaos.studies.initial_value_problems import Motions

InitialStates = Callable[[np.ndarray], Motions]
"""Function from the numbers (L,) of motions to these, in their initial states; such as `Motions.take`."""

Collect = Callable[[np.ndarray, Motions, Verdicts], dict[str, np.ndarray]]
"""Function from numbers (L,) of motions, these in their final states, and verdicts to results, (L, ...) by name."""

_MAX_SECTIONS = 1_100_000
"""Largest number of stroboscopic states that a tile records at once."""


def classify_batch(
    initial_states: InitialStates, collect: Collect, order: np.ndarray, *, settings: Classification | None = None,
    response: bool = True, largest: int = tiles.TILE, progress: str | None = None, threads: int | None = None,
) -> dict[str, np.ndarray]:
    """Classify the motions numbered 0 to N − 1.

    Parameters
    ----------
    initial_states : InitialStates
    collect : Collect
    order : (N,)
        The numbers in the order of computation. Motions of similar mesh frequency should be neighbours, since they take
        the same number of steps per period.
    settings, response
        As in `classify`.
    largest : int
        Largest number of motions in a tile.
    progress : str, optional
        Name of the progress bar.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    dict of str to (N, ...)
        The results that ``collect`` returns, for all motions in the order of their numbers.

    Notes
    -----
    Lyapunov exponents are computed for few motions, and chaotic ones are followed ten times as long as others, since
    chaos may be transient. A single tile has too few of them to fill the SIMD lanes of the kernels. Therefore each
    stage of `STAGES` runs over the unresolved motions of all tiles together.
    """
    classifier = BatchClassifier(initial_states, collect, settings or Classification(), response)
    results = _Results(len(order))
    largest = min(largest, max(WIDTH, _MAX_SECTIONS // (2 * classifier.settings.longest_period + 1)))
    unresolved = Unresolved(order)
    for stage in STAGES:
        remaining = {}
        for tile, (resolved, found, rest) in tiles.run(
            partial(classifier.run_stage, stage, unresolved), tiles.split(len(unresolved.number), largest, threads),
            progress=progress and f"{progress}, {stage}", threads=threads,
        ):
            results.put(resolved, found)
            remaining[tile.start] = rest
        unresolved = concatenated([remaining[first] for first in sorted(remaining)])
        if len(unresolved.number) == 0:
            break
    return results.arrays


@dataclass(frozen=True)
class Unresolved:
    """Motions that are not classified yet.

    Attributes
    ----------
    number : (L,)
        Numbers of the motions.
    checkpoint : dict of str to (..., L)
        The `ClassificationState.checkpoint` of the motions after the last stage; empty before the first.
    """

    number: np.ndarray
    checkpoint: dict[str, np.ndarray] = field(default_factory=dict)

    def take(self, which: slice | np.ndarray) -> Unresolved:
        """The motions selected by the index ``which``."""
        return Unresolved(self.number[which], {name: v[..., which] for name, v in self.checkpoint.items()})


def concatenated(parts: list[Unresolved]) -> Unresolved:
    """The motions of all parts, in order."""
    checkpoint = {name: np.concatenate([p.checkpoint[name] for p in parts], axis=-1) for name in parts[0].checkpoint}
    return Unresolved(np.concatenate([p.number for p in parts]), checkpoint)


@dataclass(frozen=True)
class BatchClassifier:
    """Classification of tiles of motions; the fields are the arguments of `classify_batch`."""

    initial_states: InitialStates
    collect: Collect
    settings: Classification
    response: bool = True

    def run_stage(
        self, stage: str, unresolved: Unresolved, tile: slice
    ) -> tuple[np.ndarray, dict[str, np.ndarray], Unresolved]:
        """Run a stage of `STAGES` on a tile of the unresolved motions.

        Returns
        -------
        resolved : (M,)
            Numbers of the motions that the stage classified.
        results : dict of str to (M, ...)
            What ``collect`` returns for them.
        unresolved : Unresolved
            The other motions of the tile.
        """
        chosen = unresolved.take(tile)
        motions = self.initial_states(chosen.number)
        state = ClassificationState(motions.flow, motions.points, self.settings, motions.w, all_exponents=False)
        state.resume(chosen.checkpoint)
        STAGES[stage](state)
        resolved, rest = np.flatnonzero(state.resolved), state.unresolved
        number = chosen.number[resolved]
        remaining = Unresolved(chosen.number[rest], state.checkpoint(rest))
        if len(number) == 0:
            return number, {}, remaining
        state = state.take(resolved)
        verdicts = conclude(state, response=self.response)
        return number, self.collect(number, Motions(state.flow, verdicts.w, state.points), verdicts), remaining


class _Results:
    """Arrays of N rows by name, filled tile by tile."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.arrays: dict[str, np.ndarray] = {}

    def put(self, rows: np.ndarray, values: dict[str, np.ndarray]) -> None:
        """Put values (L, ...) by name into rows (L,); arrays are made when a name first appears."""
        for name, value in values.items():
            if name not in self.arrays:
                self.arrays[name] = np.zeros((self.count, *value.shape[1:]), value.dtype)
            self.arrays[name][rows] = value
