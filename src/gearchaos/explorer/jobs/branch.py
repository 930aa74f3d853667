"""The branch of the periodic motion at a point: its orbit, stable or not, along the line of the bifurcation diagram."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import Branch, follow_branch
from gearchaos.continuation.orbit import find_cycle
from gearchaos.datasets import provenance, variable
from gearchaos.errors import InputError
from gearchaos.explorer.jobs.point_motion import PointMotion
from gearchaos.explorer.jobs.point_studies import in_units
from gearchaos.explorer.view.bounds import BRANCH_POINTS
from gearchaos.explorer.view.state import View
from gearchaos.model import COORDINATES, MeshModel, state_names
from gearchaos.studies.branch_dataset import branch_dataset

_SETTINGS = Settings(longest=2e-2, points=BRANCH_POINTS)
"""Steps short enough that a branch looks smooth over the whole range of the diagram."""


@dataclass(frozen=True)
class PeriodicMotion:
    """A periodic motion whose branch can be followed.

    Attributes
    ----------
    model : MeshModel
        The operating point.
    label : str
        Kind of motion, e.g. "2T".
    period : int
        Minimal period in mesh periods.
    state : tuple of (name, value)
        A stroboscopic point of its orbit, by names of initial values.
    """

    model: MeshModel
    label: str
    period: int
    state: tuple[tuple[str, float], ...]


def obstacle(found: PointMotion) -> str:
    """Why the branch of a motion cannot be followed; empty for a periodic motion."""
    if found.verdict.period is not None and found.verdict.section:
        return ""
    so_far = "" if found.final else " so far"
    return f"Only a periodic motion can be followed along a parameter; this one is {found.verdict.label}{so_far}."


def periodic_motion(found: PointMotion) -> PeriodicMotion:
    """The motion at a point as one to follow; raises `InputError` if it is not periodic."""
    verdict, reason = found.verdict, obstacle(found)
    if reason or verdict.period is None:
        raise InputError("motion", "must be periodic", verdict.label, reason)
    state = tuple((n, float(verdict.section[n][0])) for n in COORDINATES[found.model.kind])
    return PeriodicMotion(found.model, verdict.label, verdict.period, state)


def branch(view: View, motion: PeriodicMotion) -> Generator[xr.Dataset]:
    """The branch of a motion along the line of the diagram, over its whole range, in the units that the view shows.

    The only result is a Dataset as from `gearchaos.branch`, with the displacement z at the stroboscopic points of all
    orbits, ``section_z`` (point, cycle), and of those at the events, ``event_section_z`` (event, cycle). Its attributes
    have the period of the orbits too.

    Raises
    ------
    InputError
        If the line varies an initial value, or no orbit is found at the motion.
    """
    axis = view.line_axis
    if axis.name in state_names(motion.model.kind):
        raise InputError("line", "must vary a parameter", axis.name,
                         "Along an initial value the orbit stays the same: choose another axis or the other line.")
    try:
        family, cycle = find_cycle(motion.model, (axis.name,), motion.period, dict(motion.state))
    except InputError as error:
        rule = f"must lie on an orbit of minimal period {motion.period} that Newton's method finds"
        raise InputError("motion", rule, motion.label, error.advice) from None
    found = follow_branch(family, cycle, (axis.start, axis.stop), _SETTINGS)
    attributes = provenance("branch", family.model, axis=[axis.name, axis.start, axis.stop], period=found.period)
    dataset = branch_dataset(found, [], [], [], axis, {**attributes, "period": found.period})
    yield in_units(dataset.assign(_displacements(found)), view)


def _displacements(found: Branch) -> dict[str, xr.Variable]:
    """The displacement z, the first dynamic coordinate, at the stroboscopic points of all orbits."""
    orbits = {"point": [p.data for p in found.points], "event": [e.cycle for e in found.events]}
    values = {dim: np.array([c.points[:, 0] for c in cycles]).reshape(-1, found.period)
              for dim, cycles in orbits.items()}
    return {
        "section_z": variable("section_z", ("point", "cycle"), values["point"]),
        "event_section_z": variable("event_section_z", ("event", "cycle"), values["event"]),
    }
