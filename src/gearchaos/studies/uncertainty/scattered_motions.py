"""The motions of scattered gears along the speed: those that operation meets, and those after a change of the load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.dynamics.initial_conditions import default_box
from gearchaos.dynamics.response import CONTACTS
from gearchaos.execute import tiles
from gearchaos.flow import OK, Measure
from gearchaos.model.coordinates import initial_state
from gearchaos.studies.core.initial_value_problems import Motions
from gearchaos.studies.core.study import Results
from gearchaos.studies.motion.batch_classification import classify_batch
from gearchaos.studies.operation.beyond_the_teeth import TeethLimits
from gearchaos.studies.operation.known_orbits import LONGEST_ORBIT, KnownOrbit, reach
from gearchaos.studies.operation.load_change import LoadChange, Meshes
from gearchaos.studies.uncertainty.scattered_models import Machine, ScatteredModels

PERMANENT, TWO_SIDED = CONTACTS.index("permanent"), CONTACTS.index("two-sided")
_SETTLING, _WATCHED = 80, 16  # mesh periods at a speed before it is seen whether contact is still lost, and in which
_PASSING = 16  # the first of these at a speed at which contact is lost from rest
_ROUNDING = 1e-9  # of the share of the time in contact


def lost(found: Results) -> np.ndarray:
    """Whether contact is lost in motions, (L,); it counts as lost in one that diverges."""
    return (found["contact"] != PERMANENT) | (found["label"] == Label.DIVERGED)


@dataclass(frozen=True)
class ScatteredMotions:
    """The motions of M machines that are alike at S speeds, in cells that are numbered machine by machine.

    Results are arrays (L, ...) by name: ``label``, ``contact``, ``excess``, the dynamic factor over the quasi-static
    ratio, ``beyond`` for those beyond the teeth, ``dynamic_factor``, ``period`` and a state ``w`` (L, d).
    """

    models: ScatteredModels
    machines: Sequence[Machine]
    speeds: np.ndarray
    settings: Classification
    largest: int  # motions of a tile
    progress: str | None
    threads: int | None

    def found(self, cells: np.ndarray, unit: np.ndarray, change: LoadChange | None) -> tuple[Results, Results]:
        """The motions in operation (M S,), and those of cells (L,) after a change of the load; None: from wide ranges.

        Even numbers ``unit`` (n, L) say which states these begin in."""
        every = np.arange(len(self._begun.points))
        operation = self._classified(self._begun.take, every)
        to, carried = self._carried(operation)
        w, reached = operation["w"][cells].T, np.zeros(len(cells), bool)
        if len(cells):
            machine, speed = np.divmod(cells, len(self.speeds))
            system, initial = self._begun.flow.system.take(cells), dict[str, np.ndarray]()
            if change is None:
                initial = {n: low + (high - low) * u for (n, (low, high)), u in zip(
                    default_box(self.machines[0].model).items(), unit, strict=True)}
            w = initial_state(self.models.batch(self.machines, machine, self.speeds[speed], initial), system).T
            if change is not None:
                w = change.states(Meshes.of(system), w, operation["dynamic_factor"][cells], unit)
            w, reached = self._followed(cells, w, operation)
        others = np.flatnonzero(~reached)
        begun = replace(self._begun, w=np.concatenate([w[:, others], carried], axis=1),
                        points=np.concatenate([cells[others], to]))
        changed = {name: values[cells] for name, values in operation.items()}
        if len(begun.points):
            more = self._classified(begun.take, begun.points)
            stays = np.flatnonzero(lost(more)[len(others):])
            for name, values in operation.items():
                changed[name][others] = more[name][:len(others)]
                values[to[stays]] = more[name][len(others):][stays]
        return operation, changed

    def _followed(self, cells: np.ndarray, w: np.ndarray, found: Results) -> tuple[np.ndarray, np.ndarray]:
        """The states (d, L) to which motions in cells (L,) were followed, and whether they reached the orbit found."""
        reached = np.zeros(len(cells), bool)
        known = [[KnownOrbit(period, state)] if 0 < period <= LONGEST_ORBIT else [] for period, state in zip(
            found["period"].tolist(), found["w"], strict=True)]

        def follow(tile: slice) -> None:
            motions = Motions(self._begun.flow, w[:, tile].copy(), cells[tile])
            reached[tile] = reach(motions, known) >= 0
            w[:, tile] = motions.w

        if not any(known):
            return w, reached

        for _ in tiles.run(follow, tiles.split(len(cells), self.largest, self.threads), threads=self.threads):
            pass
        return w, reached

    @cached_property
    def _begun(self) -> Motions:
        """The motions of all cells from the initial states of the scatter."""
        machine, speed = np.divmod(np.arange(len(self.machines) * len(self.speeds)), len(self.speeds))
        return self.models.motions(self.machines, machine, self.speeds[speed])

    def _carried(self, found: Results) -> tuple[np.ndarray, np.ndarray]:
        """The cells (L,) with contact to which a motion that lost it is carried, and its states there (d, L).

        Such a motion goes on from speed to speed, rising and falling, as long as it loses contact."""
        count, w, is_lost = len(self.speeds), found["w"].T, lost(found)
        begins, first = is_lost & (found["label"] != Label.DIVERGED), np.arange(0, len(is_lost), count)
        cells, step = np.concatenate([first, first + count - 1]), np.repeat([1, -1], len(first))
        state, going, to = w[:, cells], begins[cells], [(cells[:0], w[:, :0])]
        for _ in range(count - 1):
            cells, now = cells + step, np.flatnonzero(going)
            if len(now):
                state[:, now], going[now] = self._swept(
                    cells[now], state[:, now], np.where(is_lost[cells[now]], _PASSING, _SETTLING))
                new = going & ~is_lost[cells]
                to.append((cells[new], state[:, new]))
            begun = ~going & begins[cells]
            state[:, begun], going = w[:, cells[begun]], going | begun
        reached, states = zip(*to, strict=True)
        return np.concatenate(reached), np.concatenate(states, axis=1)

    def _swept(self, cells: np.ndarray, w: np.ndarray, periods: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The states (d, L) after so many mesh periods (L,) in cells (L,), and whether contact is lost then."""
        flow, is_lost = self._begun.flow, np.zeros(len(cells), bool)

        def follow(tile: slice) -> None:
            points = cells[tile]
            run = flow.advance(w[:, tile], periods[tile], points=points)
            bounded = np.flatnonzero(run.status == OK) + tile.start
            run = flow.advance(run.w[:, bounded - tile.start], _WATCHED, points=cells[bounded], measured=True)
            w[:, bounded] = run.w
            touching = run.measures[Measure.FRONT_TIME] + run.measures[Measure.BACK_TIME]
            whole = _WATCHED * flow.system.period[cells[bounded]]
            is_lost[bounded] = (run.status == OK) & (touching < (1 - _ROUNDING) * whole)

        for _ in tiles.run(follow, tiles.split(len(cells), self.largest, self.threads), threads=self.threads):
            pass
        return w, is_lost

    def _classified(self, started: Callable[[np.ndarray], Motions], cells: np.ndarray) -> Results:
        """The results of motions in cells (L,), those of similar mesh frequency computed together."""
        machine, speed = np.divmod(cells, len(self.speeds))
        ratio, factor, deflection = np.array([(each.quasi_static, each.limits.factor, each.limits.deflection)
                                              for each in self.machines]).T

        def collect(number: np.ndarray, final: Motions, found: Verdicts) -> Results:
            own, of_factor = machine[number], found["dynamic_factor"]
            limits = TeethLimits(deflection[own], factor[own])
            beyond = limits.exceeded(np.nan_to_num(of_factor), found["deflection"]) | (found["label"] == Label.DIVERGED)
            return {"label": found["label"], "period": found.period, "contact": found["contact"], "beyond": beyond,
                    "excess": of_factor / ratio[own], "dynamic_factor": of_factor, "w": found.w.T}

        return classify_batch(started, collect, np.argsort(speed, kind="stable"), settings=self.settings,
                              progress=self.progress, threads=self.threads, largest=self.largest)
