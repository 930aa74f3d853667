"""The motions of scattered gears along the speed: those that operation meets, and those after a change of the load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.dynamics.initial_conditions import default_box
from gearchaos.dynamics.response import CONTACTS
from gearchaos.model.coordinates import initial_state
from gearchaos.studies.batch_classification import classify_batch, measured_at_end
from gearchaos.studies.beyond_the_teeth import TeethLimits
from gearchaos.studies.followed_motions import largest_deflection
from gearchaos.studies.initial_value_problems import Motions
from gearchaos.studies.load_change import LoadChange, Meshes
from gearchaos.studies.scattered_models import Machine, ScatteredModels
from gearchaos.studies.study import Results

PERMANENT, TWO_SIDED = CONTACTS.index("permanent"), CONTACTS.index("two-sided")


def lost(found: Results) -> np.ndarray:
    """Whether contact is lost in motions, (L,); it counts as lost in one that diverges."""
    return (found["contact"] != PERMANENT) | (found["label"] == Label.DIVERGED)


@dataclass(frozen=True)
class ScatteredMotions:
    """The motions of M machines that are alike at S speeds, in cells that are numbered machine by machine.

    Results are arrays (L, ...) by name: ``label``, ``contact``, ``excess``, the dynamic factor over the quasi-static
    ratio, ``beyond`` for those beyond the teeth, ``dynamic_factor`` and a state ``w`` (L, d).
    """

    models: ScatteredModels
    machines: Sequence[Machine]
    speeds: np.ndarray
    settings: Classification
    largest: int  # motions of a tile
    progress: str | None
    threads: int | None

    def from_start(self) -> Results:
        """The motions of all cells from the initial states of the scatter."""
        every = np.arange(len(self.machines) * len(self.speeds))
        return self._classified(every, lambda number: self._at(every[number], self.models.begin))

    def carry(self, found: Results) -> None:
        """Carry the motions of all cells that lose contact to the next speeds, up and down, as far as they lose it.

        Where contact was kept, they take the place of the motion found: as the speed rises or falls, a motion in
        permanent contact is followed by the one in permanent contact, if there is one."""
        new, last = np.flatnonzero(lost(found)), len(self.speeds) - 1
        while True:
            up, down = new[new % len(self.speeds) < last], new[new % len(self.speeds) > 0]
            here, there = np.concatenate([up, down]), np.concatenate([up + 1, down - 1])
            going = ~lost(found)[there] & (found["label"][here] != Label.DIVERGED)
            if not going.any():
                return
            new, w = there[going], found["w"][here[going]]
            reached = self._from_states(new, w)
            stays = lost(reached)
            new = new[stays]
            for name, values in found.items():
                values[new] = reached[name][stays]

    def after_change(self, cells: np.ndarray, factors: np.ndarray, unit: np.ndarray,
                     change: LoadChange | None) -> Results:
        """The motions of cells (L,) after a change of the load, or from wide ranges for None.

        ``factors`` (L,) are the dynamic factors before, and even numbers ``unit`` (n, L) say which states they are."""
        box = default_box(self.machines[0].model)

        def started(number: np.ndarray) -> Motions:
            if change is None:
                initial = {n: low + (high - low) * u for (n, (low, high)), u in zip(box.items(), unit[:, number],
                                                                                    strict=True)}
                return self._at(cells[number], initial_state, initial)
            return self._at(cells[number], lambda batch, system: change.states(
                Meshes.of(system), initial_state(batch, system).T, factors[number], unit[:, number]).T, {})

        return self._classified(cells, started)

    def _from_states(self, cells: np.ndarray, w: np.ndarray) -> Results:
        """The motions of cells (L,) from states (L, d)."""
        return self._classified(cells, lambda number: self._at(cells[number], lambda *_: w[number]))

    def _at(self, cells: np.ndarray, *states: Any) -> Motions:
        machine, speed = np.divmod(cells, len(self.speeds))
        return self.models.motions(self.machines, machine, self.speeds[speed], *states)

    def _classified(self, cells: np.ndarray, started: Callable[[np.ndarray], Motions]) -> Results:
        """The results of cells (L,), those of similar mesh frequency computed together."""
        machine, speed = np.divmod(cells, len(self.speeds))
        ratio, factor, deflection = np.array([(each.quasi_static, each.limits.factor, each.limits.deflection)
                                              for each in self.machines]).T

        def collect(number: np.ndarray, final: Motions, found: Verdicts) -> Results:
            own, of_factor = machine[number], found["dynamic_factor"]
            limits = TeethLimits(deflection[own], factor[own])
            teeth = largest_deflection(measured_at_end(final, found, self.settings))
            beyond = limits.exceeded(np.nan_to_num(of_factor), teeth) | (found["label"] == Label.DIVERGED)
            return {"label": found["label"], "contact": found["contact"], "excess": of_factor / ratio[own],
                    "beyond": beyond, "dynamic_factor": of_factor, "w": found.w.T}

        return classify_batch(started, collect, np.argsort(speed, kind="stable"), settings=self.settings,
                              progress=self.progress, threads=self.threads, largest=self.largest)
