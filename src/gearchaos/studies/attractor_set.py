"""Which motions are one and the same: attractors told apart by their orbits, or by statistics where there is none."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.dynamics import Classification, ClassificationState, Label, Reason, Verdicts, conclude
from gearchaos.dynamics import orbits as orbit
from gearchaos.flow import ExactFlow
from gearchaos.studies.classification import classify_batch
from gearchaos.studies.verdict_variables import verdict_variables

_LEVELS = ("v_rms", "contact_fraction", "contact", "dynamic_factor")
_FOUND = (
    "reason", "lyapunov", "lyapunov_lo", "lyapunov_hi", "trace_error", "residual", "multiplier", "rotation",
    "periods_spent",
)
_ATTRACTED = (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC)
_SAME = 1e-6
_ALIKE = 0.1
_BLOCKS = 8
_SIGMAS = 6.0
_SECTIONS = 1024
_AT_ONCE = 4096
"""Motions described together, since their sections take memory."""


@dataclass
class Attractor:
    """One attractor: coordinates of its stroboscopic section (n, d), or of a piece of it, and what was found of it.

    ``neutral`` motions, as rest without load, neither approach nor leave each other: all of one period count as one.
    """

    label: int
    period: int
    neutral: bool
    section: np.ndarray
    facts: dict[str, float]
    count: int = 0

    def holds(self, w: np.ndarray, sections: np.ndarray) -> np.ndarray:
        """Whether motions of this kind and period at w (d, L), with sections (S, d, L) if not periodic, are it.

        Periodic motions are the same if their orbits share a point. Others are if, in every coordinate, their means
        and their spreads agree within a tenth of the spread and six standard errors.
        """
        if self.neutral:
            return np.ones(w.shape[1], dtype=bool)
        if self.period:
            return np.min([np.abs(w - p[:, None]).max(axis=0) for p in self.section], axis=0) < _SAME
        mine, others = _statistics(self.section[:, :, None]), _statistics(sections)
        spread = mine[0][1]
        error = np.hypot(mine[1], others[1])
        return np.all(np.abs(mine[0] - others[0]) < _ALIKE * spread + _SIGMAS * error, axis=(0, 1))


def _statistics(sections: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and spread of sections (S, d, L) as (2, d, L), and their standard errors from block averages."""
    blocks = sections[: len(sections) // _BLOCKS * _BLOCKS].reshape(_BLOCKS, -1, *sections.shape[1:])
    means = np.stack([blocks.mean(axis=1), blocks.std(axis=1)], axis=1)
    return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(_BLOCKS)


@dataclass
class AttractorSet:
    """The attractors of one parameter point of a flow, found so far."""

    flow: ExactFlow
    point: int = 0
    known: list[Attractor] = field(default_factory=list)

    def find(self, w: np.ndarray, **options: Any) -> np.ndarray:
        """The number of the attractor (L,) to which each motion from w (d, L) leads, -1 for none.

        Options as of `final_states`.
        """
        return self.match(final_states(self.flow, w, self.point, **options))

    def tally(self, index: np.ndarray) -> None:
        """Count how many starts each attractor holds."""
        for number, attractor in enumerate(self.known):
            attractor.count = int(np.sum(index == number))

    def match(self, found: dict[str, np.ndarray]) -> np.ndarray:
        """The number of each motion's attractor (L,), -1 where it has none; new attractors are added.

        ``found`` is what `final_states` found.
        """
        index = np.full(len(found["label"]), -1, dtype=np.int32)
        for first in range(0, len(index), _AT_ONCE):
            tile = slice(first, first + _AT_ONCE)
            index[tile] = self._match({n: v[tile] for n, v in found.items()})
        return index

    def _match(self, found: dict[str, np.ndarray]) -> np.ndarray:
        """The same for so many motions at once."""
        index = np.full(len(found["label"]), -1, dtype=np.int32)
        kinds = np.stack([found[n] for n in ("label", "period", "neutral")])
        for kind in np.unique(kinds[:, np.isin(found["label"], _ATTRACTED)], axis=1).T:
            mine = np.flatnonzero((kinds == kind[:, None]).all(axis=0))
            index[mine] = self._match_alike({n: v[mine] for n, v in found.items()})
        return index

    def _match_alike(self, found: dict[str, np.ndarray]) -> np.ndarray:
        """The same for motions of one kind and period."""
        label, period, neutral = int(found["label"][0]), int(found["period"][0]), bool(found["neutral"][0])
        w, index = found["w"].T, np.full(len(found["label"]), -1, dtype=np.int32)
        sections = self._sections(w, period)
        for number, attractor in enumerate(self.known):
            if (attractor.label, attractor.period, attractor.neutral) == (label, period, neutral):
                index[(index < 0) & attractor.holds(w, sections)] = number
        while np.any(index < 0):
            first = int(np.flatnonzero(index < 0)[0])
            section = orbit_points(self.flow, w[:, first], self.point, period) if period else sections[:, :, first]
            facts = {n: float(found[n][first]) for n in _FOUND}
            self.known.append(Attractor(label, period, neutral, section, facts))
            same = (index < 0) & self.known[-1].holds(w, sections)
            same[first] = True
            index[same] = len(self.known) - 1
        return index

    def holds(self, attractor: Attractor, w: np.ndarray) -> np.ndarray:
        """Whether motions of the attractor's kind and period at w (d, L) are on it."""
        if w.shape[1] == 0:  # none has sections to compare
            return np.zeros(0, dtype=bool)
        return attractor.holds(w, self._sections(w, attractor.period))

    def _sections(self, w: np.ndarray, period: int) -> np.ndarray:
        """Sections (S, d, L) by which motions without a period are told apart; none of those with one."""
        if period:
            return np.empty((0, *w.shape))
        points = np.full(w.shape[1], self.point)
        return self.flow.advance(w, _SECTIONS, points=points, sections=_SECTIONS).sections

    def order(self) -> list[int]:
        """Numbers sorted by kind, then by period, then by how many starts they hold."""
        return sorted(range(len(self.known)), key=lambda i: (
            self.known[i].label, self.known[i].period, -self.known[i].count
        ))

    def ranks(self) -> np.ndarray:
        """The place of each number in that order, with -1 for none at the end; index it with numbers."""
        order = self.order()
        rank = np.full(len(order) + 1, -1, dtype=np.int32)
        rank[order] = np.arange(len(order))
        return rank

    def levels(self, settings: Classification | None) -> dict[str, np.ndarray]:
        """Levels of every attractor, by name."""
        w = np.stack([a.section[-1] for a in self.known], axis=1)
        state = ClassificationState(self.flow, np.full(len(self.known), self.point), settings or Classification(), w,
                                    spectrum=False)
        state.label, state.period = (np.array([getattr(a, n) for a in self.known]) for n in ("label", "period"))
        return verdict_variables(conclude(state))


def final_states(
    flow: ExactFlow, w: np.ndarray, point: int = 0, *, settings: Classification | None = None,
    progress: str | None = None,
    threads: int | None = None,
) -> dict[str, np.ndarray]:
    """Final states of motions from w (d, L): label, period, neutral, a point w and the verdict variables; (L, ...)."""

    def initial_states(tile: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        return flow, w[:, tile].copy(), np.full(len(tile), point)

    def keep(_: np.ndarray, __: ExactFlow, ___: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
        facts = {n: v for n, v in verdict_variables(found).items() if n in _FOUND}
        neutral = found.reason == Reason.NEUTRAL
        return {"label": found.label, "period": found.period, "neutral": neutral, "w": found.w.T, **facts}

    return classify_batch(
        initial_states, keep, np.arange(w.shape[1]), settings=settings, levels=False, progress=progress, threads=threads
    )


def described(catalogue: AttractorSet, settings: Classification | None) -> dict[str, xr.Variable]:
    """Label, period, levels and section (z and z', padded with NaN) of every attractor, in the catalogue's order."""
    order = catalogue.order()
    known = [catalogue.known[i] for i in order]
    out: dict[str, np.ndarray] = {
        "label": np.array([a.label for a in known], np.int8), "period": np.array([a.period for a in known], np.int32),
    }
    levels = catalogue.levels(settings) if known else {}
    out |= {name: levels[name][order] if known else np.zeros(0) for name in _LEVELS}
    out |= {name: np.array([a.facts[name] for a in known]) for name in _FOUND}
    out["reason"], out["periods_spent"] = out["reason"].astype(np.int8), out["periods_spent"].astype(np.int32)
    longest = max((len(a.section) for a in known), default=0)
    sections = np.full((2, len(known), longest), np.nan)
    for i, a in enumerate(known):
        sections[:, i, : len(a.section)] = a.section[:, :2].T
    names = ("attractor_section_z", "attractor_section_z_dot")
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), v) for n, v in out.items()} | {
        n: variable(n, ("number", "point"), v) for n, v in zip(names, sections, strict=True)
    }


def orbit_points(flow: ExactFlow, w: np.ndarray, point: int, period: int) -> np.ndarray:
    """The points (n, d) of the periodic orbit through w (d,)."""
    return orbit.sections(flow, w[:, None], np.array([point]), np.array([period]))[0]
