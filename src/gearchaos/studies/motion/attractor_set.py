"""The attractors of one operating point, distinguished by their orbits, or by statistics where there is no orbit."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import variable
from gearchaos.dynamics import ON_ATTRACTOR, Classification, ClassificationState, Reason, Verdicts, conclude, orbits
from gearchaos.dynamics.response import Response
from gearchaos.flow import ExactFlow
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.studies.core.initial_value_problems import Motions, initial_value_problems
from gearchaos.studies.core.study import ClassifyingStudy, Results
from gearchaos.studies.motion.batch_classification import classify_batch

if TYPE_CHECKING:
    import xarray as xr

_RESPONSE = tuple(c.variable for c in Response.declared().values() if c.variable and c.of_attractors)
"""Response measures that the Datasets report of each attractor."""

_VERDICT_VARIABLES = ("reason", "lyapunov", "lyapunov_lo", "lyapunov_hi", "trace_error", "residual", "multiplier",
                      "rotation", "periods_spent")
"""Verdict variables that the Datasets report of each attractor, taken from one motion on it."""

NOT_COMPUTED = -2
"""Number of the attractor of a motion that an unfinished run has not computed yet."""

_SECTIONS = 1024
"""Number of stroboscopic points by which motions without a period are compared."""

_BLOCKS = 8
"""Number of blocks of these points; the standard deviation of their averages gives the standard errors."""

_TOLERANCE = 0.1
"""Two motions agree if their statistics differ by at most this share of the standard deviation of the section, plus
`_STANDARD_ERRORS` standard errors of the difference."""

_STANDARD_ERRORS = 6.0
_TILE = 4096
"""Largest number of motions matched at once, which bounds the memory for their stroboscopic sections."""


@dataclass
class Attractor:
    """One attractor, with a `Label`, a minimal period in mesh periods (0 where there is none) and stroboscopic points.

    These are all of a periodic orbit, `_SECTIONS` of any other attractor. Neighbouring motions neither approach nor
    leave a ``neutral`` one, as at rest without load; all neutral motions of one period count as one attractor.
    """

    label: int
    period: int
    neutral: bool
    section: np.ndarray  # (n, d)
    verdict_variables: dict[str, float]  # the `_VERDICT_VARIABLES` of a motion on it, by name
    count: int = 0  # of the initial states that lead to it

    def contains(self, w: np.ndarray, sections: np.ndarray) -> np.ndarray:
        """Whether motions of the same kind and period are on this attractor, (L,).

        Periodic motions in the stroboscopic states w (d, L) are the same if their orbits share a point. Others are the
        same if in every coordinate the means and standard deviations of the ``sections`` (S, d, L) that follow agree to
        a tenth of the standard deviation plus six standard errors.
        """
        if self.neutral:
            return np.ones(w.shape[1], dtype=bool)
        if self.period:
            return np.min([np.abs(w - p[:, None]).max(axis=0) for p in self.section], axis=0) < orbits.SAME_POINT
        own, others = _statistics(self.section[:, :, None]), _statistics(sections)
        margin = _TOLERANCE * own[0][1] + _STANDARD_ERRORS * np.hypot(own[1], others[1])
        return np.all(np.abs(own[0] - others[0]) < margin, axis=(0, 1))


def _statistics(sections: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (2, d, L) of sections (S, d, L), and their standard errors from block averages."""
    blocks = sections[: len(sections) // _BLOCKS * _BLOCKS].reshape(_BLOCKS, -1, *sections.shape[1:])
    values = np.stack([blocks.mean(axis=1), blocks.std(axis=1)], axis=1)
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(_BLOCKS)


@dataclass
class AttractorSet:
    """The attractors found so far at the parameter point ``point`` of a flow, numbered in the order of discovery."""

    flow: ExactFlow
    point: int = 0
    members: list[Attractor] = field(default_factory=list)

    def find(self, w: np.ndarray, **options: Any) -> np.ndarray:
        """The number (L,) of the attractor that each initial state w (d, L) leads to, −1 for none.

        ``options`` are those of `final_states`.
        """
        return self.match(final_states(Motions.at(self.flow, w, self.point), **options))

    def count_starts(self, index: np.ndarray) -> None:
        """Count the initial states that lead to each attractor, from the number (L,) of that of each, −1 for none."""
        for number, attractor in enumerate(self.members):
            attractor.count = int(np.sum(index == number))

    def match(self, final: dict[str, np.ndarray]) -> np.ndarray:
        """The number (L,) of the attractor of each motion, −1 where it has none; new attractors are added.

        ``final`` is the result of `final_states`.
        """
        index = np.full(len(final["label"]), -1, dtype=np.int32)
        for first in range(0, len(index), _TILE):
            tile = slice(first, first + _TILE)
            part = {n: v[tile] for n, v in final.items()}
            kinds = np.stack([part[n] for n in ("label", "period", "neutral")])
            for kind in np.unique(kinds[:, np.isin(part["label"], ON_ATTRACTOR)], axis=1).T:
                same = np.flatnonzero((kinds == kind[:, None]).all(axis=0))
                index[first + same] = self._match_kind({n: v[same] for n, v in part.items()})
        return index

    def _match_kind(self, final: dict[str, np.ndarray]) -> np.ndarray:
        """`match` for motions of the same label and period, either all neutral or none."""
        label, period, neutral = int(final["label"][0]), int(final["period"][0]), bool(final["neutral"][0])
        w, index = final["w"].T, np.full(len(final["label"]), -1, dtype=np.int32)
        sections = self._sections(w, period)
        for number, attractor in enumerate(self.members):
            if (attractor.label, attractor.period, attractor.neutral) == (label, period, neutral):
                index[(index < 0) & attractor.contains(w, sections)] = number
        while np.any(index < 0):
            first = int(np.flatnonzero(index < 0)[0])
            start, at = w[:, first : first + 1], np.array([self.point])
            section = orbits.sections(self.flow, start, at, np.array([period]))[0] if period else sections[:, :, first]
            values = {n: float(final[n][first]) for n in _VERDICT_VARIABLES}
            self.members.append(Attractor(label, period, neutral, section, values))
            same = (index < 0) & self.members[-1].contains(w, sections)
            same[first] = True
            index[same] = len(self.members) - 1
        return index

    def contains(self, attractor: Attractor, w: np.ndarray) -> np.ndarray:
        """Whether motions in the states w (d, L) are on the attractor, (L,); they have its label and period."""
        if w.shape[1] == 0:  # there are no sections to compare
            return np.zeros(0, dtype=bool)
        return attractor.contains(w, self._sections(w, attractor.period))

    def _sections(self, w: np.ndarray, period: int) -> np.ndarray:
        """Stroboscopic states (S, d, L) by which motions without a period are compared; S = 0 for periodic ones."""
        if period:
            return np.empty((0, *w.shape))
        points = np.full(w.shape[1], self.point)
        return self.flow.advance(w, _SECTIONS, points=points, sections=_SECTIONS).sections

    def order(self) -> list[int]:
        """Numbers of the members sorted by label, period and decreasing count, as Datasets list them."""
        keys = [(a.label, a.period, -a.count) for a in self.members]
        return sorted(range(len(keys)), key=keys.__getitem__)

    @property
    def ordered(self) -> list[Attractor]:
        """The members in the `order`."""
        return [self.members[i] for i in self.order()]

    def ranks(self) -> np.ndarray:
        """The position of each attractor in the `order`, followed by −1, so that the index −1 (none) gives −1."""
        order = self.order()
        rank = np.full(len(order) + 1, -1, dtype=np.int32)
        rank[order] = np.arange(len(order))
        return rank

    def numbers(self, index: np.ndarray, label: np.ndarray) -> np.ndarray:
        """Positions (L,) of the attractors in the `order`, from those in `members` and the labels (L,) of the motions.

        −1 for a motion that is on none, `NOT_COMPUTED` where the label is 0 or −1.
        """
        return np.where(label <= 0, NOT_COMPUTED, self.ranks()[index])

    def variables(self, settings: Classification | None) -> dict[str, xr.Variable]:
        """Label, period, response measures, verdict variables and section of every attractor, as Datasets contain them.

        The variables are named ``attractor_...`` and have the dim "number", in the `order`; the section (z and z') also
        has the dim "point", padded with NaN.
        """
        members = self.ordered
        out: dict[str, np.ndarray] = {"label": np.array([a.label for a in members], np.int8),
                                      "period": np.array([a.period for a in members], np.int32)}
        response = dict.fromkeys(_RESPONSE, np.zeros(0))
        if members:
            w, points = np.stack([a.section[-1] for a in members], axis=1), np.full(len(members), self.point)
            state = ClassificationState(self.flow, points, settings or Classification(), w, all_exponents=False)
            state.verdicts.label[:], state.verdicts.period[:] = out["label"], out["period"]
            response = conclude(state).variables()
        out |= {name: response[name] for name in _RESPONSE}
        out |= {name: np.array([a.verdict_variables[name] for a in members]) for name in _VERDICT_VARIABLES}
        out["reason"], out["periods_spent"] = out["reason"].astype(np.int8), out["periods_spent"].astype(np.int32)
        sections = np.full((2, len(members), max((len(a.section) for a in members), default=0)), np.nan)
        for i, a in enumerate(members):
            sections[:, i, : len(a.section)] = a.section[:, :2].T
        names = ("attractor_section_z", "attractor_section_z_dot")
        return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), v) for n, v in out.items()} | {
            n: variable(n, ("number", "point"), v) for n, v in zip(names, sections, strict=True)}


def final_states(motions: Motions, **options: Any) -> dict[str, np.ndarray]:
    """Classify L motions at one parameter point, for `AttractorSet.match`.

    By name, (L, ...): ``label``, ``period``, whether the motion is ``neutral``, its final state ``w`` (L, d),
    `_VERDICT_VARIABLES`. ``options`` are settings, progress and threads of `classify_batch`.
    """

    def collect(_: np.ndarray, __: Motions, found: Verdicts) -> dict[str, np.ndarray]:
        variables = found.variables()
        chosen = {n: variables[n] for n in ("label", "period", *_VERDICT_VARIABLES)}
        return {**chosen, "neutral": found.reason == Reason.NEUTRAL, "w": found.w.T}

    return classify_batch(motions.take, collect, np.arange(len(motions.points)), response=False, **options)


class AttractorStudy(ClassifyingStudy):
    """A study that finds to which attractor of one operating point each of many initial states leads."""

    @abstractmethod
    def initial_values(self, items: np.ndarray) -> dict[str, np.ndarray]:
        """The initial values (L,) by name with these numbers (L,)."""

    @cached_property
    def flow(self) -> ExactFlow:
        """That of the operating point."""
        return initial_value_problems(self.model).flow

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        w = initial_state(vary(self.model, self.initial_values(items)), self.flow.system).T
        return final_states(Motions.at(self.flow, w), settings=self.classification,
                            progress=self.kind if progress else None, threads=threads)

    def attractors(self, found: Results) -> tuple[AttractorSet, np.ndarray]:
        """The attractors, their initial states counted, and the number (N,) in `members` of that of each."""
        attractors = AttractorSet(self.flow)
        index = attractors.match(found)
        attractors.count_starts(index)
        return attractors, index
