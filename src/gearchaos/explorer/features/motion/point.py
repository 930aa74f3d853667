"""What is computed at the chosen point: its motion, its basins, coexisting motions, a bifurcation diagram."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.initial_conditions import default_box
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.explorer.core.bounds import BASIN_CELLS, DIAGRAM_COLUMNS, DIAGRAM_POINTS, INITIAL_STATES, PORTRAIT_POINTS
from gearchaos.explorer.core.models import coarseness
from gearchaos.explorer.core.state import View
from gearchaos.gears.operation.results import physical
from gearchaos.model import MeshModel
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.study import Study
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.maps.refine import put
from gearchaos.studies.motion.attractors import Attractors
from gearchaos.studies.motion.basins import Basins
from gearchaos.studies.motion.regime import Verdict, regime, steady
from gearchaos.studies.motion.simulate import simulate

QUICK = replace(SINGLE_MOTION, exponent_run=1000, doublings=0, longest_transient=0, averaging_periods=200)
"""Settings of the first verdict.

Its transients are as long as those of `gearchaos.regime`, so a stable orbit that is found within them has the
verdict of that function. For a motion that has not converged by then, exponents from a short run give a preliminary
verdict.
"""


@dataclass(frozen=True)
class PointMotion:
    """What is known about the motion at a point."""

    model: MeshModel  # with the initial values of the motion
    verdict: Verdict
    final: bool  # whether this is the verdict of `gearchaos.regime`; otherwise it is preliminary
    trajectory: xr.Dataset | None = None  # the steady motion in time; None until computed, and if it diverged
    portrait: xr.Dataset | None = None  # more stroboscopic points than the verdict has, if it is not periodic

    @property
    def stage(self) -> str:
        """How complete it is: "verdict" (no trajectory yet), "preliminary" (the verdict is), or "complete"."""
        if self.trajectory is None and self.verdict.section:
            return "verdict"
        return "complete" if self.final else "preliminary"

    def of_mesh(self, mesh: str, half_backlash: float) -> PointMotion:
        """The same with the relative motion of one mesh of a train in the place of that of the first."""
        names = {"z": ("deflection", half_backlash), "z_dot": ("deflection_rate", 0.0)}

        def one(found: xr.Dataset | None) -> xr.Dataset | None:
            if found is None:
                return None
            of = found.sel(mesh=mesh)
            return of.assign({f"{prefix}{z}": variable(z, tuple(map(str, of[part].dims)), of[part].values + middle)
                              for prefix in ("", "section_") for z, (name, middle) in names.items()
                              if (part := f"{prefix}{name}") in of})

        trajectory, portrait = one(self.trajectory), one(self.portrait)
        if portrait is None and trajectory is not None:  # one period of an orbit, else all that there is
            portrait = trajectory.isel(period=slice(self.verdict.period))
        return replace(self, trajectory=trajectory, portrait=portrait)

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
        on_attractor = {n: verdict.section[n][-1] for n in found.model.coordinate_names}
        yield replace(found, portrait=simulate(replace(found.model, initial=on_attractor), PORTRAIT_POINTS))


_SETTINGS = Classification(doublings=2, longest_transient=1500)
"""Transients are shorter than those of `gearchaos.regime`, since a page needs many motions within seconds."""

_PARTS = 8  # parts in which a fine study is computed; it can be cancelled between them


def bifurcation(view: View, *strides: int) -> Generator[xr.Dataset]:
    """The bifurcation diagram along the line through the point, once for each stride between its columns.

    It is in the units that the view shows. An empty Dataset stands for progress without a result.
    """
    axis = view.line_axis
    for stride in strides:
        along = Axis(axis.name, axis.start, axis.stop, DIAGRAM_COLUMNS // coarseness(view.model) // stride)
        study = Bifurcation(view.operating_point, along, points=DIAGRAM_POINTS, settings=_SETTINGS)
        for found in _in_parts(study, _PARTS if stride == 1 else 1):
            yield in_units(found, view) if found else found


def in_units(dataset: xr.Dataset, view: View) -> xr.Dataset:
    """A dimensionless result along `View.line_axis` in the units that the view shows.

    Values of the parameter stay in the unit of the axis, on which the page draws them: ω is not turned into a frequency
    in Hz. Those of a branch are its coordinate, ``event_value``, ``jump_value`` and the JSON of some attributes.
    """
    if not view.physical or view.gears is None:
        return dataset
    name = view.line_axis.name
    found = physical(dataset, view.gears).assign_coords({name: dataset[name]})
    found = found.assign({n: dataset[n] for n in ("event_value", "jump_value") if n in dataset})
    return found.assign_attrs(dataset.attrs)


def basins(view: View) -> Generator[xr.Dataset]:
    """Basins of attraction of the point, coarse and then fine.

    The plane is that of displacement and velocity of wheel 1, or of the relative ones for the single model; initial
    values off the plane are those of the motion chosen at the point. Of a train the plane is that of its first mesh. An
    empty Dataset stands for progress without a result.
    """
    ends = list(default_box(view.point).items())[:2]
    for share in (4, 1):
        x, y = (Axis(name, *box, cells // coarseness(view.model) // share)
                for (name, box), cells in zip(ends, BASIN_CELLS, strict=True))
        in_plane = view.point.with_values({axis.name: axis.start for axis in (x, y)})
        yield from _in_parts(Basins(in_plane, x, y, settings=_SETTINGS), _PARTS if share == 1 else 1)


def attractors(view: View) -> Generator[xr.Dataset]:
    """The motions that `INITIAL_STATES` initial states lead to.

    In addition to the variables of `gearchaos.attractors` the Dataset has ``attractor_start_NAME``: initial values that
    lead to each motion.
    """
    found = Attractors(view.operating_point, INITIAL_STATES // coarseness(view.model), settings=_SETTINGS).run()
    index = found["attractor"].values
    first = np.array([int(np.flatnonzero(index == i)[0]) for i in range(found.sizes.get("number", 0))], dtype=int)
    yield found.assign({
        f"attractor_{n}": variable(n.removeprefix("start_"), ("number",), found[n].values[first])
        for n in map(str, found.data_vars) if n.startswith("start_")
    })


def _in_parts(study: Study, parts: int) -> Generator[xr.Dataset]:
    """Compute a study in parts: an empty Dataset after each part, then the result."""
    found: dict[str, np.ndarray] = {}
    for numbers in np.array_split(np.arange(study.count), parts):
        put(found, study.compute(numbers), numbers, study.count)
        yield xr.Dataset()
    yield study.finish(found)
