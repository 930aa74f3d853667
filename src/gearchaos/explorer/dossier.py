"""The motion behind one point, as soon as anything of it is known."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.explorer.bounds import PORTRAIT
from gearchaos.explorer.units import in_units
from gearchaos.gears.pair import GearPair
from gearchaos.model import COORDINATES, MeshModel
from gearchaos.studies.regime import REGIME_SETTINGS, Regime, regime
from gearchaos.studies.simulate import simulate
from gearchaos.studies.steady import steady

_PLANE = ("z", "z_dot")
QUICK = replace(REGIME_SETTINGS, exponent_run=1000, doublings=0, longest_transient=0, averaging_periods=200)
"""As long transients as `gearchaos.regime` has, so that a stable orbit found in them is its verdict too; what is open
then is only glanced at."""


@dataclass(frozen=True)
class Dossier:
    """What is known of the motion at a point.

    Attributes
    ----------
    model : MeshModel
        The point, with the initial values of the motion.
    verdict : Regime
    final : bool
        Whether it is the verdict of `gearchaos.regime`; if not, it is what the motion looks like so far.
    motion : xarray.Dataset or None
        The steady motion sampled in time, once it is computed; never where it diverged.
    portrait : xarray.Dataset or None
        More of its stroboscopic points than the verdict has, where it does not repeat.
    """

    model: MeshModel
    verdict: Regime
    final: bool
    motion: xr.Dataset | None = None
    portrait: xr.Dataset | None = None

    def after(self, before: Dossier | None) -> Dossier:
        """With the motion that was known before, if it is the same; it is sent only once."""
        if before is None or self.motion is not None:
            return self
        alike = (before.model, before.verdict.label) == (self.model, self.verdict.label)
        return replace(self, motion=before.motion) if alike else self

    def points(self, pair: GearPair | None) -> tuple[xr.Variable, xr.Variable]:
        """Displacement and velocity of the stroboscopic points, in the units of the pair if there is one."""
        section = self.verdict.section if self.portrait is None else {
            n: self.portrait[f"section_{n}"].values for n in _PLANE}
        names = [f"section_{n}" for n in _PLANE]
        points = {name: np.asarray(section[n]) for n, name in zip(_PLANE, names, strict=True)}
        found = in_units({name: variable(name, ("period",), values) for name, values in points.items()}, pair)
        return found[names[0]], found[names[1]]


def dossier(model: MeshModel) -> Generator[Dossier]:
    """The dossier of a point: verdict and portrait, then the motion in time, then more of its portrait.

    Of a motion that has to be followed on, `followed` has the rest.
    """
    verdict = regime(model, settings=QUICK)
    found = Dossier(model, verdict, final=verdict.periods_spent <= sum(QUICK.transient_lengths))
    yield found
    if verdict.section:
        yield replace(found, motion=steady(model, verdict))
        if found.final:
            yield from _portrayed(found)


def followed(model: MeshModel, label: str) -> Generator[Dossier]:
    """The dossier of a motion that did not repeat so far, followed as long as `gearchaos.regime` does.

    Its motion comes only if the verdict is not ``label`` any more.
    """
    verdict = regime(model)
    found = Dossier(model, verdict, final=True)
    anew = verdict.section and verdict.label != label
    yield replace(found, motion=steady(model, verdict)) if anew else found
    yield from _portrayed(found)


def _portrayed(found: Dossier) -> Generator[Dossier]:
    if found.verdict.period is None and found.verdict.section:
        yield replace(found, portrait=simulate(_on(found.model, found.verdict), PORTRAIT))


def _on(model: MeshModel, verdict: Regime) -> MeshModel:
    """The model started on the motion itself."""
    return replace(model, initial={n: verdict.section[n][-1] for n in COORDINATES[model.kind]})
