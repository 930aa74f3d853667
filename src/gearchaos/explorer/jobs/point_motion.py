"""The motion at one point: its verdict, its trajectory and more points of its portrait, each once it is computed."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import xarray as xr

from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.explorer.view.bounds import PORTRAIT_POINTS
from gearchaos.model import COORDINATES, MeshModel
from gearchaos.studies.regime import regime
from gearchaos.studies.simulate import simulate
from gearchaos.studies.steady import steady
from gearchaos.studies.verdict import Verdict

QUICK = replace(SINGLE_MOTION, exponent_run=1000, doublings=0, longest_transient=0, averaging_periods=200)
"""Settings of the first verdict.

Its transients are as long as those of `gearchaos.regime`, so a stable orbit that is found within them has the
verdict of that function. For a motion that has not converged by then, exponents from a short run give a preliminary
verdict.
"""


@dataclass(frozen=True)
class PointMotion:
    """What is known about the motion at a point.

    Attributes
    ----------
    model : MeshModel
        The model at the point, with the initial values of the motion.
    verdict : Verdict
    final : bool
        Whether this is the verdict of `gearchaos.regime`; otherwise it is preliminary.
    trajectory : xarray.Dataset or None
        The steady motion sampled in time; None until it is computed, and for a motion that diverged.
    portrait : xarray.Dataset or None
        More stroboscopic points than the verdict has, for a motion that is not periodic.
    """

    model: MeshModel
    verdict: Verdict
    final: bool
    trajectory: xr.Dataset | None = None
    portrait: xr.Dataset | None = None

    @property
    def stage(self) -> str:
        """How complete it is: "verdict" (no trajectory yet), "preliminary" (the verdict is), or "complete"."""
        if self.trajectory is None and self.verdict.section:
            return "verdict"
        return "complete" if self.final else "preliminary"

    def with_trajectory_of(self, before: PointMotion | None) -> PointMotion:
        """The same with the trajectory of an earlier one of the same motion, so that it is computed only once."""
        if before is None or self.trajectory is not None:
            return self
        same = (before.model, before.verdict.label) == (self.model, self.verdict.label)
        return replace(self, trajectory=before.trajectory) if same else self


def point_motion(model: MeshModel) -> Generator[PointMotion]:
    """The motion of a model: its verdict, then its trajectory, then more points of its portrait.

    If the verdict is preliminary, `final_verdict` computes the final one.
    """
    verdict = regime(model, settings=QUICK)
    found = PointMotion(model, verdict, final=verdict.periods_spent <= sum(QUICK.transient_lengths))
    yield found
    if verdict.section:
        yield replace(found, trajectory=steady(model, verdict))
        if found.final:
            yield from _with_portrait(found)


def final_verdict(model: MeshModel, label: str) -> Generator[PointMotion]:
    """The final verdict on a motion with a preliminary one, and more points of its portrait.

    The trajectory is included only if the verdict differs from ``label``, the preliminary one.
    """
    verdict = regime(model)
    found = PointMotion(model, verdict, final=True)
    changed = verdict.section and verdict.label != label
    yield replace(found, trajectory=steady(model, verdict)) if changed else found
    yield from _with_portrait(found)


def _with_portrait(found: PointMotion) -> Generator[PointMotion]:
    """`PORTRAIT_POINTS` stroboscopic points of a motion that is not periodic."""
    verdict = found.verdict
    if verdict.period is None and verdict.section:
        on_attractor = {n: verdict.section[n][-1] for n in COORDINATES[found.model.kind]}
        yield replace(found, portrait=simulate(replace(found.model, initial=on_attractor), PORTRAIT_POINTS))
