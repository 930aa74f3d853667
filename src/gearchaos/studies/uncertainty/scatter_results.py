"""The variables of a scatter: probabilities, percentiles, indices, and what tightening brings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import variables
from gearchaos.dynamics.response import CONTACTS
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.uncertainty.distributions import Scattered
from gearchaos.studies.uncertainty.scatter_estimates import at_best, at_half, probability, sobol_indices

if TYPE_CHECKING:
    import xarray as xr

OUTCOMES = ("contact loss", "both flanks hit", "no repetition", "force over limit", BEYOND)
OUTPUTS = ("share of speeds with contact loss", "largest force over the quasi-static one")
AIMS = ("contact loss anywhere", "share of speeds with contact loss")
AFTER = "_after_load_change"
"""What the names of results end in that hold after a change of the load."""
PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True)
class ScatterResults:
    """What was found for all D designs, at T torques and S speeds."""

    inputs: tuple[Scattered, ...]
    points: np.ndarray  # (blocks, R, n, inputs), of which the designs are the rows
    values: np.ndarray
    speeds: Axis
    indices: bool
    independent: bool
    outcomes: np.ndarray  # (outcomes, D, T, S) of bool, in operation
    after: np.ndarray | None  # the same after a change of the load; None where the load never changes
    contact: np.ndarray  # (D, T, S), indices into `CONTACTS`
    excess: np.ndarray  # (D, T, S), the dynamic factor over the quasi-static ratio, NaN beyond the teeth
    possible: np.ndarray  # (D,) of bool
    loaded: np.ndarray  # (D,): possible, with a static load

    def by_scrambling(self, designs: np.ndarray) -> np.ndarray:
        """Values (D, ...) of the designs that are samples of the inputs: (R, samples of a scrambling, ...)."""
        blocks = designs.reshape(*self.points.shape[:3], *designs.shape[1:])[: 2 if self.indices else 1]
        return np.concatenate(list(blocks), axis=1)

    @cached_property
    def share_lost(self) -> np.ndarray:
        """The share of the speeds at which contact is lost, (D, T)."""
        return self.outcomes[0].mean(axis=2)

    @cached_property
    def largest(self) -> np.ndarray:
        """The largest excess over the speeds, (D, T)."""
        return np.fmax.reduce(self.excess, axis=2)

    def coordinates(self) -> dict[str, xr.Variable]:
        return {name: values[name] for name, values in (
            (n, variables((n,), {n: np.array(of)})) for n, of in (
                ("outcome", OUTCOMES), ("output", OUTPUTS), ("aim", AIMS), ("percentile", PERCENTILES),
                ("varied", [each.name for each in self.inputs])))}

    def variables(self) -> dict[str, xr.Variable]:
        """All variables by name."""
        units = np.array([each.unit for each in self.inputs])
        words = np.array([each.words for each in self.inputs])
        among = self.by_scrambling(self.possible)
        changed = {} if self.after is None else self._probabilities(self.after, among, AFTER)
        return {
            **self._probabilities(self.outcomes, among), **changed, **self._percentiles(among), **self._indices(),
            **self._tightened(among),
            **variables(("varied",), {"distribution": words, "varied_unit": units, "cut_share": np.array([
                each.cut for each in self.inputs])}),
            **variables((), {"impossible": np.array(1 - among.mean())}), **self._samples()}

    def _probabilities(self, outcomes: np.ndarray, among: np.ndarray, after: str = "") -> dict[str, xr.Variable]:
        outcomes = np.moveaxis(outcomes, 0, 1)  # (D, outcomes, T, S)
        loaded = np.array([name == "force over limit" for name in OUTCOMES])[:, None, None]
        counted = np.where(loaded, self.by_scrambling(self.loaded)[..., None, None, None],
                           among[..., None, None, None])
        counted = np.broadcast_to(counted, (*among.shape, len(OUTCOMES), *outcomes.shape[2:]))
        found = probability(self.by_scrambling(outcomes), counted)
        anywhere = probability(self.by_scrambling(np.any(outcomes, axis=3)), counted[..., 0])
        return {**variables(("outcome", "torque", self.speeds.name), _with_ends(f"probability{after}", found)),
                **variables(("outcome", "torque"), _with_ends(f"anywhere{after}", anywhere))}

    def _percentiles(self, among: np.ndarray) -> dict[str, xr.Variable]:
        lost = self.by_scrambling(self.outcomes[0])[among]  # (samples, T, S)
        found = np.full((3, lost.shape[1], len(PERCENTILES)), np.nan)
        first, last = lost.argmax(axis=2), self.speeds.count - 1 - lost[..., ::-1].argmax(axis=2)
        for t in range(lost.shape[1]):
            has = lost[:, t].any(axis=1)
            for row, values in enumerate((self.speeds.values[first[has, t]], self.speeds.values[last[has, t]],
                                          lost[:, t].mean(axis=1))):
                if len(values):
                    found[row, t] = np.percentile(values, PERCENTILES, method="inverted_cdf")
        names = ("lowest_speed_lost", "highest_speed_lost", "share_lost")
        out = variables(("torque", "percentile"), dict(zip(names, found, strict=True)))
        for name in names[:2]:
            out[name].attrs["units"] = "rpm" if self.speeds.name == "speed" else "omega0"
        return out

    def _indices(self) -> dict[str, xr.Variable]:
        torques, count = self.outcomes.shape[2], len(self.inputs)
        found = np.full((2, 3, len(OUTPUTS), torques, count), np.nan)
        if self.indices and self.possible.all():
            for o, output in enumerate((self.share_lost, self.largest)):
                a, b, *mixed = output.reshape(*self.points.shape[:3], torques)
                for t in range(torques):
                    if np.isfinite(output[:, t]).all():
                        found[:, :, o, t] = sobol_indices(a[..., t], b[..., t], np.stack(mixed)[..., t])
        return {name: value for each, of in (("first_index", found[0]), ("total_index", found[1])) for name, value in
                variables(("output", "torque", "varied"), _with_ends(each, of)).items()}

    def _tightened(self, among: np.ndarray) -> dict[str, xr.Variable]:
        """What is expected where one input is tightened; NaN where inputs are correlated, which then change too."""
        torques, count = self.outcomes.shape[2], len(self.inputs)
        best, half = np.full((2, 3, len(AIMS), torques, count), np.nan)
        ends = np.full((2, len(AIMS), torques, count), np.nan)
        possible = self.independent and self.by_scrambling(self.possible).any(axis=1).all()
        for a, t, i in np.ndindex(len(AIMS), torques, count) if possible else ():
            lost: np.ndarray = self.outcomes[0][:, t].any(axis=1)
            aimed = self.by_scrambling(lost if a == 0 else self.share_lost[:, t])
            u = self.by_scrambling(self.points.reshape(-1, count)[:, i])
            best[:, a, t, i], ends[:, a, t, i] = at_best(aimed, among, u, self.inputs[i])
            half[:, a, t, i] = at_half(aimed, among, u, self.inputs[i])
        dims = "aim", "torque", "varied"
        return {**variables(dims, _with_ends("if_best", best)), **variables(dims, _with_ends("if_halved", half)),
                **variables(dims, {"best_from": ends[0], "best_to": ends[1]})}

    def _samples(self) -> dict[str, xr.Variable]:
        def flat(designs: np.ndarray) -> np.ndarray:
            found = self.by_scrambling(designs)
            return found.reshape(-1, *found.shape[2:])

        possible = flat(self.possible)
        values: dict[str, Any] = {
            n: np.where(possible[:, None], flat(v), np.nan).T for n, v in (
                ("sample_share_lost", self.share_lost), ("sample_factor", self.largest))}
        worst = np.where(possible[:, None], flat(self.contact.max(axis=2)), CONTACTS.index("none"))
        values["sample_contact"] = worst.T.astype(np.int8)
        return {**variables(("torque", "sample"), values),
                **variables(("varied", "sample"), {"sample_value": flat(self.values.reshape(-1, len(self.inputs))).T}),
                **variables(("sample",), {"sample_possible": possible.astype(np.int8)})}


def _with_ends(name: str, found: np.ndarray) -> dict[str, np.ndarray]:
    """An estimate (3, ...) and the ends of its interval by name."""
    return {name: found[0], f"{name}_lo": found[1], f"{name}_hi": found[2]}
