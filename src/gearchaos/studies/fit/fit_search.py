"""The least squares of a fit: parameters of a gear pair between bounds, and searches from points within them.

A search alternates between the choice of a motion at each speed and a descent along which the chosen motions are
continued. Derivatives are central differences of amplitudes on orbits that are converged to rounding. The derivatives
of the flow by parameters (`gearchaos.flow.SensitivityFlow`) are exact, but at the end of a period alone; a harmonic
needs them throughout.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.design.values import BELOW_ONE
from gearchaos.gears.io import units
from gearchaos.gears.io.measured_quantities import MeasuredQuantity
from gearchaos.gears.io.order_spectrum import OrderSpectrum
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE
from gearchaos.studies.fit.fitted_motions import FittedMotions, PairsAtSpeeds
from gearchaos.validation import MAX_HARMONICS, check_rule

_STEP = 1e-4  # half the distance of the differences by a parameter, over the distance of its bounds
_SINGULAR = 1e-6  # least singular value of the derivatives, over the largest, at which a combination is identified
_SHARE = 1e-3  # of a parameter in combinations that are not identified, above which it is not identified
_SAME, _SAME_SQUARE = 1e-6, 1e-12  # of sums of squares that differ by rounding, relative and absolute
_ROUNDS = 10  # most times that the motions are chosen anew
_BESIDE, _RINGS = 0.15, 3  # how far beside the best end searches begin, and how often while they find a better one
_AT_ONCE = 16  # pairs whose motions are computed at once
_EVALUATIONS = 60  # most parameter vectors in a descent
_CONFIDENCE = 0.95
_BACKLASH = "no measured motion touches the back flanks, so that none depends on it"


class Varied(NamedTuple):
    """A parameter with its bounds in SI, the unit in which they were given, and one of it in SI."""

    name: str
    low: float
    high: float
    unit: str
    size: float

    @classmethod
    def parse(cls, text: str) -> Varied:
        """The parameter and the bounds of a text such as "backlash=0.05:0.25 mm"; the unit may stand at both."""
        number = r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([^\s\d.,:]*)"
        match = re.fullmatch(rf"\s*(\w+)\s*=\s*{number}\s*:\s*{number}\s*", text) if isinstance(text, str) else None
        if match is None:
            raise InputError("vary", "must read name=low:high with a unit", text,
                             "E.g. backlash=0.05:0.25 mm, with decimal points.")
        name, low, first_unit, high, unit = match.groups()
        order = re.fullmatch(r"error([1-9]\d?)", name)
        if name not in ("damping_ratio", "backlash") and not (order and int(order[1]) <= MAX_HARMONICS):
            raise unknown_name("vary", name, ("damping_ratio", "backlash", "error1", "error2", "error3"))
        if name == "damping_ratio":
            if first_unit or unit:
                raise InputError(name, "must have bounds without a unit", text, "E.g. damping_ratio=0.02:0.15.")
            ends: list[float] = [float(low), float(high)]
            check_rule(name, np.array(ends), BELOW_ONE)
        else:
            rule = POSITIVE if name == "backlash" else NOT_NEGATIVE
            ends = [units.to_si(name, f"{end} {own}".strip(), units.LENGTH, rule) for end, own in (
                (low, first_unit or unit), (high, unit))]
        if not ends[0] < ends[1]:
            raise InputError(name, "must have a lower bound below the upper one", text,
                             "Exchange them." if ends[0] > ends[1] else "To hold it, leave it out of what is varied.")
        return cls(name, float(ends[0]), float(ends[1]), unit, getattr(ends[1], "size", 1.0))


class FitEnd(NamedTuple):
    """Where a search has ended: the parameters as shares of the way between their bounds, the motions, how each is
    reached (index of `HISTORIES`, or their number for another way), and the sum of squares."""

    x: np.ndarray  # (Q,)
    motions: FittedMotions  # at P speeds
    history: np.ndarray  # (P,)
    square: float


@dataclass(frozen=True)
class FitSearch:
    """A fit of Q parameters to M amplitudes at P speeds; ``of`` is what was measured, ``kind`` that of the models.

    ``uncertainty`` is a relative and an absolute one in SI, one of which is 0; it is ``known``, or only a weight.
    """

    pair: GearPair
    kind: str
    of: MeasuredQuantity
    spectrum: OrderSpectrum
    varied: tuple[Varied, ...]
    uncertainty: tuple[float, float]
    known: bool

    def values(self, x: np.ndarray) -> np.ndarray:
        """The parameters in SI at shares x (Q,) of the way between their bounds."""
        low, high = np.array([(each.low, each.high) for each in self.varied]).T
        return low + x * (high - low)

    def run(self, x: np.ndarray) -> FitEnd:
        """The end of the search from x (Q,)."""
        motions, history = self._choose(x)
        for _ in range(_ROUNDS):
            x, motions, square = self._descend(x, motions)
            chosen, history = self._choose(x, motions)
            if chosen is motions:
                break
            motions = chosen
        return FitEnd(x, motions, history, square)

    def screened(self, points: np.ndarray, count: int) -> np.ndarray:
        """Those ``count`` of some points (N, Q) at which the motions are nearest to the measurement."""
        squares = []
        for some in np.array_split(points, -(-len(points) // _AT_ONCE)):
            pairs = self._at(*some)
            squares.append(self._nearest(pairs, pairs.by_history())[2].reshape(len(some), -1).sum(axis=1))
        return points[np.argsort(np.concatenate(squares), kind="stable")[:count]]

    def with_neighbours(self, ends: Sequence[FitEnd]) -> list[FitEnd]:
        """The ends of searches, and of others from both sides of the best one along each parameter, until none is
        better; least squares first. Beside a jump of the motion there are several minima, often close together."""
        found = sorted(ends, key=lambda end: end.square)
        for _ in range(_RINGS):
            best = found[0]
            steps = _BESIDE * np.concatenate([np.eye(len(best.x)), -np.eye(len(best.x))])
            found = sorted([*found, *map(self.run, np.clip(best.x + steps, 0.0, 1.0))], key=lambda end: end.square)
            if found[0].square > best.square * (1 - _SAME):
                break
        return found

    def _at(self, *points: np.ndarray) -> PairsAtSpeeds:
        """The pairs at some x (Q,), at the measured speeds."""
        pairs = []
        for x in points:
            orders, changes = [*self.pair.error_amplitudes], dict[str, Any]()
            for each, value in zip(self.varied, self.values(x).tolist(), strict=True):
                if each.name == "damping_ratio":
                    changes["k"] = 2 * self.pair.mass * self.pair.omega0 * value
                elif each.name == "backlash":
                    changes["backlash"] = value
                else:
                    order = int(each.name.removeprefix("error"))
                    orders += [0.0] * (order - len(orders))
                    orders[order - 1] = value
            pairs.append(replace(self.pair, **changes, error_amplitudes=tuple(orders)))
        return PairsAtSpeeds(pairs, self.spectrum.speeds, self.kind)

    def _amplitudes(
        self, pairs: PairsAtSpeeds, motions: FittedMotions, points: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The amplitudes that were measured, (N, M), of N motions at each of the speeds, and contact states (N, P)."""
        found, contact = pairs.harmonics(motions, points, int(self.spectrum.harmonic.max()))
        count = len(self.spectrum.speeds)
        each = found[self.of].reshape(-1, count, found[self.of].shape[1])
        return each[:, self.spectrum.at, self.spectrum.harmonic - 1], contact.reshape(-1, count)

    def amplitudes(self, end: FitEnd) -> tuple[np.ndarray, np.ndarray]:
        """The amplitudes (M,) at the end of a search, SI, and the contact states (P,)."""
        pairs = self._at(end.x)
        amplitude, contact = self._amplitudes(pairs, end.motions, pairs.points)
        return amplitude[0], contact[0]

    def _residuals(self, amplitude: np.ndarray) -> np.ndarray:
        """Amplitudes (..., M) less those measured, over the uncertainty; a relative one is of the mean of both."""
        (relative, absolute), measured = self.uncertainty, self.spectrum.amplitude
        scale = absolute + relative * (amplitude + measured) / 2
        return (amplitude - measured) / np.where(scale > 0, scale, 1.0)

    def _nearest(self, pairs: PairsAtSpeeds, found: FittedMotions) -> tuple[FittedMotions, np.ndarray, np.ndarray]:
        """Of N motions at each of L points, one after the other, those nearest to the measurement: motions, their index
        (L,), the first of those that are equal, and their sums of squares (L,)."""
        count, speeds = len(pairs.points), len(self.spectrum.speeds)
        amplitude = self._amplitudes(pairs, found, np.tile(pairs.points, len(found.period) // count))[0]
        misfit = (self._residuals(amplitude) ** 2 @ np.eye(speeds)[self.spectrum.at]).reshape(-1, count)
        least = misfit.min(axis=0)
        index = np.argmax(misfit <= least * (1 + _SAME) + _SAME_SQUARE, axis=0)
        return found.take(index * count + pairs.points), index, least

    def _choose(self, x: np.ndarray, current: FittedMotions | None = None) -> tuple[FittedMotions, np.ndarray]:
        """The motions at x that are nearest to the measurement, and how each is reached; the current ones themselves
        where no other is nearer."""
        pairs = self._at(x)
        known = pairs.by_history()
        if current is None:
            return self._nearest(pairs, known)[:2]
        found = FittedMotions(*(np.concatenate(both, axis=-1) for both in zip(known, current, strict=True)))
        motions, history, least = self._nearest(pairs, found)
        own = self._nearest(pairs, current)[2]
        return (current if np.all(own <= least * (1 + _SAME) + _SAME_SQUARE) else motions), history

    def _descend(self, x: np.ndarray, motions: FittedMotions) -> tuple[np.ndarray, FittedMotions, float]:
        """The least squares near x, with motions continued from x; their parameters, motions and sum of squares."""
        from scipy.optimize import least_squares  # here, since it takes a third of a second to load

        at, trials = motions, dict[bytes, FittedMotions]()

        def residuals(x: np.ndarray) -> np.ndarray:
            pairs = self._at(x)
            trials[x.tobytes()] = found = pairs.steady(at, pairs.points)
            return self._residuals(self._amplitudes(pairs, found, pairs.points)[0][0])

        def derivatives(x: np.ndarray) -> np.ndarray:  # of the last trial that was accepted
            nonlocal at
            at = trials[x.tobytes()]
            return self.derivatives(x, at)

        found = least_squares(residuals, x, derivatives, bounds=(0.0, 1.0), max_nfev=_EVALUATIONS)
        return found.x, at, float(2 * found.cost)

    def derivatives(self, x: np.ndarray, motions: FittedMotions) -> np.ndarray:
        """Derivatives (M, Q) of the residuals at x by central differences; 0 of a motion that is no orbit nearby."""
        ends = np.clip(x + _STEP * np.array([-1.0, 1.0])[:, None, None] * np.eye(len(x)), 0.0, 1.0)  # (2, Q, Q)
        pairs, number = self._at(*ends.reshape(-1, len(x))), 2 * len(x)
        orbits = np.flatnonzero(np.tile(motions.period, number))
        around = motions.take(orbits % len(motions.period))
        found = pairs.steady(around, pairs.points[orbits], wait=False)
        kept = found.period > 0
        amplitude = np.full((len(pairs.points), int(self.spectrum.harmonic.max())), np.nan)
        amplitude[orbits[kept]] = pairs.harmonics(
            found.take(kept), pairs.points[orbits[kept]], amplitude.shape[1])[0][self.of]
        each = amplitude.reshape(2, len(x), -1, amplitude.shape[1])[:, :, self.spectrum.at, self.spectrum.harmonic - 1]
        before, after = self._residuals(each)
        steps = np.einsum("qq->q", ends[1] - ends[0])
        return np.nan_to_num((after - before) / steps[:, None]).T

    def _variances(self, end: FitEnd) -> tuple[np.ndarray, np.ndarray]:
        """Variances (Q,) of the parameters for residuals of variance 1, infinite for one that is not identified, and
        the projection (Q, Q) on the combinations that are not: their singular value is as good as 0."""
        _, sizes, axes = np.linalg.svd(self.derivatives(end.x, end.motions), full_matrices=False)
        known = sizes > _SINGULAR * sizes.max()
        lost = axes[~known].T @ axes[~known]
        variances = np.sum((axes[known] / sizes[known, None]) ** 2, axis=0)
        return np.where(lost.diagonal() > _SHARE, np.inf, variances), lost

    def intervals(self, ends: Sequence[FitEnd]) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """Both ends (Q,) of the 95 % interval of each parameter, and why one is not identified, or nothing.

        ``ends`` are those of all searches, least squares first. An interval has all parameters at which the sum of
        squares is larger by at most t² s², by the linearisation at the best end, and at each other one that is as good:
        beside a jump of the motion there may be several. Where the uncertainty is known, s is at least that.
        """
        from scipy.stats import t  # here, since it takes a third of a second to load

        best, (variances, lost) = ends[0], self._variances(ends[0])
        free = len(self.spectrum.amplitude) - len(best.x) + round(float(lost.trace()))
        width = max(best.square / free, float(self.known)) * t.ppf((1 + _CONFIDENCE) / 2, free) ** 2
        low, high = (best.x + side * np.sqrt(width * variances) for side in (-1, 1))
        for end in ends[1:]:
            if end.square < best.square + width:
                half = np.sqrt((best.square + width - end.square) * self._variances(end)[0])
                low, high = np.minimum(low, end.x - half), np.maximum(high, end.x + half)
        reasons = []
        touched = CONTACTS.index("two-sided") in self.amplitudes(best)[1]
        for k, each in enumerate(self.varied):
            others = [other.name for other, share in zip(self.varied, lost[k], strict=True)
                      if abs(share) > _SHARE and other is not each]
            if lost[k, k] <= _SHARE:
                reasons.append("its 95 % interval is wider than its bounds" if not high[k] - low[k] <= 1 else "")
            elif others:
                reasons.append(f"only a combination with {' and '.join(others)} is")
            else:
                reasons.append("no motion that was found is periodic" if not best.motions.period.any() else
                               _BACKLASH if each.name == "backlash" and not touched else
                               "no measured amplitude depends on it")
        return low.clip(0.0, 1.0), high.clip(0.0, 1.0), reasons
