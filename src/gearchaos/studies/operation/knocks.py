"""The least knock after which a good motion becomes one to avoid: a step of the speed of wheel 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from gearchaos.dynamics import Classification, Verdicts
from gearchaos.flow import ExactFlow
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import gears_of, pair_of
from gearchaos.model import vary
from gearchaos.model.switched import begun_at, coordinates
from gearchaos.studies.core.initial_value_problems import Motions, initial_value_problems
from gearchaos.studies.motion.batch_classification import classify_batch
from gearchaos.studies.operation.followed_motions import Criterion, FollowedMotions, Motion, brief_settings
from gearchaos.studies.operation.known_orbits import LONGEST_ORBIT, KnownOrbit, reach

LARGEST = 3.0
"""Of the steps of the relative velocity that are tried, over the natural frequency times half the backlash."""
_SMALLEST = LARGEST / 64
PHASES = 16  # of the mesh period, at which the good motion is knocked
_SPEEDS = 24  # most speeds at which it is, of all that are good in operation and after a load change
_ACCURACY = 1.1  # to this ratio the least knock is known


@dataclass(frozen=True)
class Knock:
    """The least knock found in a range of speed, from ``start`` to ``stop`` of those tried, rpm, at ``speed``.

    Attributes
    ----------
    speed_step : float
        Step of the speed of wheel 1, rpm.
    impulse : float
        That of the torque at wheel 1, N m s, which makes this step: its moment of inertia times it. The same step of
        the relative velocity is made by the impulse of its size over the ratio of the base radii at wheel 2.
    phase : float
        Of the mesh period, from 0 to 1.
    dynamic_factor : float
        Of the motion that it leads to; NaN where that is ``beyond_the_teeth``.
    """

    start: float
    stop: float
    speed: float
    speed_step: float
    impulse: float
    phase: float
    dynamic_factor: float
    beyond_the_teeth: bool

    def document(self, torque: float) -> dict[str, Any]:
        """It ready for JSON."""
        return {"torque": torque, "from": self.start, "to": self.stop,
                **{n: getattr(self, n) for n in ("speed", "speed_step", "impulse", "phase")},
                "dynamic_factor": None if self.beyond_the_teeth else self.dynamic_factor,
                "beyond_the_teeth": self.beyond_the_teeth}


class _Tried(NamedTuple):
    """Knocks (L,): the number of the good motion, its phase, the step of the velocity, and what it leads to: None a
    motion that is not to be avoided; ``reached`` has it all the same."""

    number: np.ndarray
    phase: np.ndarray
    step: np.ndarray
    to: list[Motion | None]
    reached: list[Motion | None]


class Knocked:
    """Good periodic motions at speeds, and the motions that knocks lead to from them."""

    def __init__(
        self, motions: FollowedMotions, speeds: Sequence[float], criterion: Criterion, settings: Classification,
        threads: int | None = None,
    ) -> None:
        self.criterion, self.settings, self.threads = criterion, settings, threads
        self.speeds = [s for s in speeds if 0 < motions.at[s][0].period <= LONGEST_ORBIT]
        at = [[m for m in motions.at[s] if 0 < m.period <= LONGEST_ORBIT] for s in self.speeds]
        names = coordinates(vary(motions.model, {}))
        if not self.speeds:
            return
        self._values = {"speed": np.array(self.speeds)}
        if motions.torque is not None:
            self._values["torque"] = np.full(len(self.speeds), motions.torque)
        flow = initial_value_problems(motions.model, self._values, names, 2 * PHASES).flow
        self._system = flow.system
        run = flow.advance(np.stack([m.w for own in at for m in own], axis=1), 1, sample=True,
                           points=np.repeat(np.arange(len(at)), list(map(len, at))))
        passed = iter(np.moveaxis(run.samples[0, 1::2, :-1], -1, 0))  # (phases, d) of each orbit
        self._orbits = [[(m, next(passed)) for m in own] for own in at]
        self._model = motions.model

    def tried(self, number: np.ndarray, phase: np.ndarray, step: np.ndarray, *, brief: bool = True) -> _Tried:
        """What knocks lead to: steps (L,) of the velocity at phases, numbered from 0, of the motions with these
        numbers; ``brief`` ones are followed as by `brief_settings`."""
        settings = brief_settings(self.settings) if brief else self.settings
        pairs, points = np.unique(np.stack([number, phase]), axis=1, return_inverse=True)
        flow = ExactFlow(begun_at(self._system.take(pairs[0]), (pairs[1] + 0.5) / PHASES))
        known = [[KnownOrbit(m.period, states[j]) for m, states in self._orbits[i]] for i, j in pairs.T.tolist()]
        w = np.stack([self._orbits[i][0][1][j] for i, j in zip(number, phase, strict=True)], axis=1)
        w[1] += step
        started = Motions(flow, w, points)
        reached = reach(started, known)
        out = [self._orbits[i][r][0] if r >= 0 else None for i, r in zip(number, reached, strict=True)]
        others = np.flatnonzero(reached < 0)

        def collect(_: np.ndarray, final: Motions, found: Verdicts) -> dict[str, np.ndarray]:
            return {"label": found["label"], "period": found.period, "contact": found["contact"],
                    "factor": found.variables()["dynamic_factor"],
                    "deflection": found["deflection"]}

        if len(others):
            found = classify_batch(lambda chosen: started.take(others[chosen]), collect, np.arange(len(others)),
                                   settings=settings, threads=self.threads)
            for i, label, period, contact, factor, deflection in zip(
                    others, *(found[n].tolist() for n in ("label", "period", "contact", "factor", "deflection")),
                    strict=True):
                out[i] = Motion(label, period, contact, factor, np.nan, (0.0, 0.0), w[:, i], (), deflection)
        return _Tried(number, phase, step, [m if m and self.criterion(m) else None for m in out], out)

    def sampled(self, number: int, phase: int, steps: Sequence[float], periods: int, samples: int) -> np.ndarray:
        """The displacement (S, L) of a good motion after steps (L,) of the velocity at a phase, from there over mesh
        periods with so many samples each."""
        system = begun_at(self._system.take(np.array([number])), np.array([(phase + 0.5) / PHASES]))
        flow = ExactFlow(replace(system, same_starts=True), samples)  # it has a single point
        w = np.repeat(self._orbits[number][0][1][phase][:, None], len(steps), axis=1)
        w[1] += steps
        run = flow.advance(w, periods, points=np.zeros(len(steps), int), sample=True)
        return run.samples[:, :, 0].reshape(periods * samples, len(steps))

    def least(self, found: _Tried, numbers: Sequence[int]) -> tuple[int, float, int, Motion] | None:
        """The least step that leads from one of some motions to one to avoid, to `_ACCURACY`: the number of the motion,
        the step, its phase, and what it leads to."""
        mine = np.isin(found.number, numbers)
        own = [(n, j, step, to) for n, j, step, to, own in zip(*found[:4], mine, strict=True) if own and to]
        first = self._lasting(sorted(own, key=lambda each: (abs(each[2]), *each[:2])))
        if first is None:
            return None
        high, sizes = abs(first[2]), np.abs(found.step[mine])
        low = float(sizes[sizes < high].max(initial=0.0))
        while high > _ACCURACY * low:
            middle = np.sqrt(low * high) if low else high / 2
            grid = np.meshgrid(numbers, np.arange(PHASES), [middle, -middle])
            again = self.tried(*(each.ravel() for each in grid))
            leads = self._lasting([(n, j, step, m) for n, j, step, m in zip(*again[:4], strict=True) if m])
            if leads:
                high, first = middle, leads
            elif low == 0.0 and middle < _SMALLEST / 8:
                break
            else:
                low = middle
        number, phase, step, to = first
        return int(number), float(step), int(phase), to

    def _lasting(self, knocks: list[tuple[int, int, float, Motion]]) -> tuple[int, int, float, Motion] | None:
        """The first of knocks (number, phase, step, motion) that leads to no mere transient, however long."""
        def again(number: int, phase: int, step: float) -> Motion | None:
            return self.tried(np.array([number]), np.array([phase]), np.array([step]), brief=False).to[0]

        return next((each for each in knocks if each[3].period or again(*each[:3])), None)


def unit_step(pair: GearPair) -> float:
    """The step of the speed of wheel 1, rad/s, that changes the dimensionless relative velocity by 1."""
    return pair.half_backlash * pair.omega0 / pair.R1


def find_knocks(
    motions: FollowedMotions, good: Sequence[float], criterion: Criterion, beyond: Any, settings: Classification,
    threads: int | None = None,
) -> tuple[tuple[Knock, ...], float]:
    """The least knocks that lead from the motion from rest to one to avoid, in ranges of the speeds that are ``good``,
    and the largest step of the speed of wheel 1 that was tried, rpm, 0 where none was.

    ``beyond`` says of a motion whether teeth can bear it.
    """
    chosen = [good[i] for i in sorted({round(i) for i in np.linspace(0, len(good) - 1, min(_SPEEDS, len(good)))})]
    knocked = Knocked(motions, chosen, criterion, settings, threads)
    if not knocked.speeds:
        return (), 0.0
    sizes = _SMALLEST * 2.0 ** (np.arange(13) / 2)
    grid = np.meshgrid(np.arange(len(knocked.speeds)), np.arange(PHASES), np.concatenate([sizes, -sizes]))
    found = knocked.tried(*(each.ravel() for each in grid))
    leads = {int(n) for n, to in zip(found.number, found.to, strict=True) if to}
    pair, out = pair_of(gears_of(motions.model), motions.torque), list[Knock]()
    unit = unit_step(pair)
    for hit, run in groupby(range(len(knocked.speeds)), key=leads.__contains__):
        numbers = [*run]
        if not hit or not (least := knocked.least(found, numbers)):
            continue
        number, step, phase, to = least
        turn = step * unit
        is_beyond = beyond(to)
        out.append(Knock(
            knocked.speeds[numbers[0]], knocked.speeds[numbers[-1]], knocked.speeds[number], turn / RPM,
            turn * pair.I1, (phase + 0.5) / PHASES, np.nan if is_beyond else to.dynamic_factor, is_beyond))
    return tuple(out), LARGEST * unit / RPM
