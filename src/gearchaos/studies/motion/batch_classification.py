"""Classification of many motions in tiles; each stage takes the unresolved motions of all tiles together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from gearchaos.dynamics import STAGES, Classification, ClassificationState, Verdicts, conclude
from gearchaos.execute import tiles
from gearchaos.flow import WIDTH
from gearchaos.studies.core.initial_value_problems import Motions

InitialStates = Callable[[np.ndarray], Motions]
"""Function from the numbers (L,) of motions to these, in their initial states; such as `Motions.take`."""

Collect = Callable[[np.ndarray, Motions, Verdicts], dict[str, np.ndarray]]
"""Function from numbers (L,) of motions, these in their final states, and verdicts to results, (L, ...) by name.

The motions are those of `InitialStates` with other states."""

_MAX_SECTIONS = 1_100_000
"""Largest number of stroboscopic states that a tile records at once."""

SAME_CENTRE = 1e-6
"""Orbits of the same period are the same if their centres differ by less than this in z and in z'."""


def classify_batch(
    initial_states: InitialStates, collect: Collect, order: np.ndarray, *, settings: Classification | None = None,
    response: bool = True, largest: int = tiles.TILE, points: np.ndarray | None = None, kept: int | None = None,
    progress: str | None = None, threads: int | None = None,
) -> dict[str, np.ndarray]:
    """Classify the motions numbered 0 to N − 1; returns the results of ``collect``, (N, ...) by name, by these numbers.

    ``order`` (N,) has the numbers in the order of computation. Motions of similar mesh frequency should be neighbours,
    since they take the same number of steps per period. A tile has at most ``largest`` motions, and those of at most
    ``kept`` of the parameter ``points`` (N,) if these are given; ``settings`` and ``response`` are as of `classify`,
    ``progress`` is the name of the progress bar.

    Lyapunov exponents are computed for few motions, and chaotic ones are followed ten times as long as others, since
    chaos may be transient. A single tile has too few of them to fill the SIMD lanes of the kernels. Therefore each
    stage of `STAGES` runs over the unresolved motions of all tiles together.
    """
    classifier = BatchClassifier(initial_states, collect, settings or Classification(), response)
    results: dict[str, np.ndarray] = {}
    largest = min(largest, max(WIDTH, _MAX_SECTIONS // (2 * classifier.settings.longest_period + 1)))
    unresolved = Unresolved(order)
    for stage in STAGES:
        remaining, number = {}, unresolved.number
        shares = (tiles.split(len(number), largest, threads) if points is None or kept is None
                  else tiles.split_points(points[number], kept, largest, threads))
        for tile, (resolved, found, rest) in tiles.run(
            partial(classifier.run_stage, stage, unresolved), shares,
            progress=progress and f"{progress}, {stage}", threads=threads,
        ):
            for name, value in found.items():
                if name not in results:
                    results[name] = np.zeros((len(order), *value.shape[1:]), value.dtype)
                results[name][resolved] = value
            remaining[tile.start] = rest
        unresolved = concatenated([remaining[first] for first in sorted(remaining)])
        if len(unresolved.number) == 0:
            break
    return results


@dataclass(frozen=True)
class Unresolved:
    """Motions (L,) that are not classified yet, by their numbers.

    ``checkpoint`` (..., L) is that of their `ClassificationState` after the last stage; empty before the first.
    """

    number: np.ndarray
    checkpoint: dict[str, np.ndarray] = field(default_factory=dict)

    def take(self, which: slice | np.ndarray) -> Unresolved:
        """The motions selected by the index ``which``."""
        return Unresolved(self.number[which], {name: v[..., which] for name, v in self.checkpoint.items()})


def concatenated(parts: list[Unresolved]) -> Unresolved:
    """The motions of all parts, in order; those without motions may have no checkpoint."""
    some = [part for part in parts if len(part.number)] or [Unresolved(np.zeros(0, int))]
    checkpoint = {name: np.concatenate([p.checkpoint[name] for p in some], axis=-1) for name in some[0].checkpoint}
    return Unresolved(np.concatenate([p.number for p in some]), checkpoint)


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

        Returns the numbers (M,) of the motions that it classified, what ``collect`` returns for them, and the others.
        """
        chosen = unresolved.take(tile)
        motions = self.initial_states(chosen.number)
        state = ClassificationState(motions.flow, motions.points, self.settings, motions.w, all_exponents=False)
        state.resume(chosen.checkpoint)
        STAGES[stage](state)
        resolved, rest = np.flatnonzero(state.resolved), state.unresolved
        number, remaining = chosen.number[resolved], Unresolved(chosen.number[rest], state.checkpoint(rest))
        if len(number) == 0:
            return number, {}, remaining
        verdicts = conclude(state.take(resolved), response=self.response)
        return number, self.collect(number, replace(motions.take(resolved), w=verdicts.w), verdicts), remaining


def signature(motions: Motions, found: Verdicts) -> dict[str, np.ndarray]:
    """The variables by which the motions of a cell are distinguished, and their response; arrays (L,) by name.

    The motions are in the final states of the verdicts ``found``.
    ``centre_z`` and ``centre_z_dot`` are the means of z and z' over the stroboscopic points of an orbit, and 0 for
    other motions: all chaotic motions of a cell count as one, and so do all quasi-periodic ones.
    """
    centre, longest = np.zeros((2, len(motions.points))), int(found.period.max(initial=0))
    sections = motions.flow.advance(motions.w, found.period, points=motions.points, sections=longest).sections
    for n in np.unique(found.period[found.period > 0]):
        same = np.flatnonzero(found.period == n)
        centre[:, same] = sections[longest - n :, :2, same].mean(axis=0)
    variables = {n: found[n] for n in ("label", "period", "v_rms", "contact")}
    return {**variables, "centre_z": centre[0], "centre_z_dot": centre[1]}
