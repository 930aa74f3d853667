"""The steady motions of gear pairs at measured speeds, and the amplitudes of their mesh harmonics in SI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gearchaos.dynamics.orbits import candidates, polish
from gearchaos.dynamics.response import CONTACTS
from gearchaos.flow import OK, ExactFlow, Measure
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state, prescribed_rates_at_start, relative_rotation
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.initial_value_problems import PERIODS_PER_VALUE

_INSTANTS = 128  # of a mesh period at which motions are sampled: the first harmonics of z are then right to about 1e-7
_LONGEST = 8  # longest period of a motion that is known as an orbit
_AVERAGED = 32  # periods over which any other motion is averaged
_GAPS = ("relief1", "relief2", "crowning")  # of tooth pairs, in half backlashes
_REACH = 1.0  # farthest that an orbit may be from the one from which it is continued, half backlashes


HISTORIES = ("rest", "rising", "falling")
"""How a motion is reached: from rest, or by a slow sweep through the speeds."""


class FittedMotions(NamedTuple):
    """L motions at phase 0, in a form that pairs with other backlashes share while the back flanks are not touched."""

    state: np.ndarray  # (d, L), the coordinates in m and m ω0, z from the front flank on
    period: np.ndarray  # (L,) mesh periods of the stable orbit; 0 for a motion that is none, or not known yet

    def take(self, which: np.ndarray) -> FittedMotions:
        return FittedMotions(self.state[:, which], self.period[which])


class PairsAtSpeeds:
    """The motions of V gear pairs at P speeds each, rpm: V P points, those of the first pair, then those of the next.

    The pairs differ in damping, backlash and amplitudes of the error alone. ``kind`` is that of their models.
    """

    def __init__(self, pairs: Sequence[GearPair], speeds: np.ndarray, kind: str) -> None:
        models = [pair.to_model(kind) for pair in pairs]
        each, self._count, self.scales = [model.parameters() for model in models], len(speeds), pairs[0].scales
        values = {n: np.repeat([own[n] for own in each], len(speeds)) for n in each[0]
                  if any(own[n] != each[0][n] for own in each)}
        values["omega"] = np.tile(pairs[0].n1 * RPM * speeds / pairs[0].omega0, len(pairs))
        self._batch = vary(models[0], values)
        self._length = np.repeat([pair.half_backlash for pair in pairs], len(speeds))  # (V P,)
        if not any(name.startswith("corner") for name in models[0].stiffness.unnamed()):
            system = switched_system(self._batch)
        else:
            # Gaps beyond the path have no name by which a batch varies them. They are those with the least backlash,
            # which has the finest pieces, in the ratio of the backlashes.
            finest = int(np.argmin(self._length)) // self._count
            system = switched_system(vary(models[finest], {n: v for n, v in values.items() if n not in _GAPS}))
            assert system.contacts is not None
            ratio, flank = (self._length.min() / self._length)[:, None, None, None], np.array([1.0, 0.0, 0.0])
            gap = (system.contacts.offset - flank) * ratio + flank
            system = replace(system, contacts=system.contacts._replace(offset=gap))
        self._flow = ExactFlow(system, _INSTANTS)
        self._front = np.eye(self._flow.dimension)[:, :1]
        self.points = np.arange(self._batch.size)

    def _states(self, w: np.ndarray, period: np.ndarray, points: np.ndarray) -> FittedMotions:
        return FittedMotions((w - self._front) * self._length[points], period)

    def steady(self, motions: FittedMotions, points: np.ndarray, wait: bool = True) -> FittedMotions:
        """The orbits near L motions, each at one of the points.

        A motion that is no orbit, or ceases to be a stable one, is followed for some hundred periods, and then for an
        orbit where it returns; not without ``wait``: then its period is 0.
        """
        w, period = motions.state / self._length[points] + self._front, motions.period.copy()
        self._polish(w, period, points, np.flatnonzero(period))
        lost = np.flatnonzero(period == 0)
        if wait and len(lost):
            run = self._flow.advance(w[:, lost], PERIODS_PER_VALUE, points=points[lost], sections=2 * _LONGEST + 1)
            w[:, lost] = np.where(run.status == OK, run.w, 0.0)
            period[lost] = np.where(run.status == OK, candidates(run.sections, _LONGEST, 1)[0], 0)
            self._polish(w, period, points, lost[period[lost] > 0])
        return self._states(w, period, points)

    def _polish(self, w: np.ndarray, period: np.ndarray, points: np.ndarray, which: np.ndarray) -> None:
        """Move motions to stable orbits of their periods, in place; where there is none, the period becomes 0."""
        orbits = polish(self._flow, w[:, which], points[which], period[which], reach=_REACH)
        w[:, which] = np.where(orbits.stable, orbits.w, w[:, which])
        period[which] *= orbits.stable

    def by_history(self) -> FittedMotions:
        """The motions from rest, and after slow sweeps of the speed, rising and falling: 3 V P of them in turn."""
        system, count = self._flow.system, self._count
        rest, kicks = initial_state(self._batch, system).T, prescribed_rates_at_start(self._batch, system.names).T
        w, first = np.stack([rest] * len(HISTORIES), axis=1), self.points[::count]
        at = np.concatenate([first, first + count - 1])
        swept = rest[:, at]
        for step in range(count):
            before, at = at, np.concatenate([first + step, first + count - 1 - step])
            swept = self._flow.advance(swept + kicks[:, at] - kicks[:, before], PERIODS_PER_VALUE, points=at).w
            w[:, 1, at[: len(first)]], w[:, 2, at[len(first):]] = np.split(swept, 2, axis=1)
        points = np.tile(self.points, len(HISTORIES))
        w = w.reshape(len(w), -1)
        return self.steady(self._states(w, np.zeros(w.shape[1], np.int64), points), points)

    def harmonics(
        self, motions: FittedMotions, points: np.ndarray, highest: int
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """The amplitudes (L, ``highest``) of the mesh harmonics by kind of measurement, SI, and contact states (L,).

        Of a motion of several mesh periods they are those of its mean over them. The force follows from the balance of
        the row z'', since harmonics of z fall off faster than those of a force that jumps.
        """
        system, count = self._flow.system, np.where(motions.period > 0, motions.period, _AVERAGED)
        w = motions.state / self._length[points] + self._front
        mean, measures = np.zeros((_INSTANTS, *w.shape)), np.zeros((len(Measure), len(points)))
        for number in range(count.max(initial=0)):  # one at a time: samples of all would take much memory
            on = np.flatnonzero(count > number)
            run = self._flow.advance(w[:, on], 1, points=points[on], measured=True, sample=True)
            w[:, on], measures[:, on] = run.w, measures[:, on] + run.measures
            mean[:, :, on] += run.samples[0, :, :-1] / count[on]
        order = np.arange(1, highest + 1)[:, None]
        rate = 1j * order * system.omega[points]
        lines = np.fft.rfft(mean, axis=0)[1 : highest + 1] * (2 / _INSTANTS)  # w = Re Σ lines exp(i j ω τ)
        lines[:, 1] = rate * lines[:, 0]
        forcing, error = np.zeros((2, highest, len(points)), complex)
        known = min(highest, system.f_cos.shape[1])
        forcing[:known] = (system.f_cos - 1j * system.f_sin)[points, :known].T
        amplitude, phase = self._batch.harmonics("eps", "theta")
        error[:known] = (amplitude * np.exp(-1j * phase))[:known, points]
        inertia = rate * lines[:, 1] - forcing - np.einsum("li,hil->hl", system.A[points, 1], lines)
        force = -inertia / system.b[points, 1]
        if not system.law.in_contact:  # the damping is a part of A
            force += system.damping[points] * lines[:, 1]
        relative = relative_rotation(system.names, np.moveaxis(lines, 1, 2), error)
        found = {"mesh force": force * self.scales.stiffness, "deflection": lines[:, 0], "transmission error": relative,
                 "acceleration": rate**2 * relative * self.scales.rate**2}
        front, back = measures[Measure.FRONT_TIME] > 0, measures[Measure.BACK_TIME] > 0
        whole = measures[Measure.SWITCHES] == 0
        contact = np.select([front & back, (front | back) & whole, front | back], [
            CONTACTS.index("two-sided"), CONTACTS.index("permanent"), CONTACTS.index("one-sided")],
            CONTACTS.index("none"))
        return {kind: np.abs(each * self._length[points]).T for kind, each in found.items()}, contact
