"""The motion behind one point, as soon as anything of it is known."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import xarray as xr

from gearchaos.app.bounds import PORTRAIT
from gearchaos.model import COORDINATES, MeshModel
from gearchaos.studies.regime import PATIENT, Regime, regime
from gearchaos.studies.simulate import simulate
from gearchaos.studies.steady import steady

QUICK = replace(PATIENT, patience=0)
"""As `gearchaos.regime` looks, but chaos is not outlasted: every other verdict of both is the same."""


@dataclass(frozen=True)
class Dossier:
    """What is known of the motion at a point.

    Attributes
    ----------
    model : MeshModel
        The point, with the initial values of the motion.
    verdict : Regime
    final : bool
        Whether it is the verdict of `gearchaos.regime`; if not, the motion is chaotic so far, and being followed.
    motion : xarray.Dataset or None
        The steady motion sampled in time, once it is computed; None for good where it diverged.
    portrait : xarray.Dataset or None
        More of its stroboscopic points than the verdict has, where it does not repeat.
    """

    model: MeshModel
    verdict: Regime
    final: bool
    motion: xr.Dataset | None = None
    portrait: xr.Dataset | None = None


def dossier(model: MeshModel) -> Generator[Dossier]:
    """The dossier of a point: verdict and portrait, then the motion in time, then what takes patience."""
    verdict = regime(model, budget=QUICK)
    found = Dossier(model, verdict, verdict.label != "chaotic")
    yield found
    if not verdict.section:
        return
    yield (found := replace(found, motion=steady(model, verdict)))
    if not found.final:
        yield (found := _followed(found))
    if found.verdict.period is None and found.verdict.section:
        yield replace(found, portrait=simulate(_on(model, found.verdict), PORTRAIT))


def _followed(found: Dossier) -> Dossier:
    """The same after chaos has been followed as long as `gearchaos.regime` does."""
    verdict = regime(found.model)
    motion = found.motion if verdict.label == found.verdict.label else None
    if motion is None and verdict.section:
        motion = steady(found.model, verdict)
    return replace(found, verdict=verdict, final=True, motion=motion)


def _on(model: MeshModel, verdict: Regime) -> MeshModel:
    """The model started on the motion itself."""
    return replace(model, initial={n: verdict.section[n][-1] for n in COORDINATES[model.kind]})
