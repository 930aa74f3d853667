"""The list of the coexisting motions found at the point."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from gearchaos.plot._basins import attractor_colours, attractor_names


@dataclass(frozen=True)
class Choice:
    """One of the motions of a point.

    Attributes
    ----------
    name, colour : str
    share : float
        Share of the initial states that lead to it.
    initial : tuple of (name, value)
        Initial values that lead to it.
    """

    name: str
    colour: str
    share: float
    initial: tuple[tuple[str, float], ...]


def choices(found: xr.Dataset) -> list[Choice]:
    """The motions of a Dataset from `gearchaos.explorer.jobs.point_studies.attractors`."""
    prefix = "attractor_start_"
    variables = [n for n in map(str, found.data_vars) if n.startswith(prefix)]
    return [
        Choice(name, colour, float(found["attractor_fraction"][i]),
               tuple((n.removeprefix(prefix), float(found[n][i])) for n in variables))
        for i, (name, colour) in enumerate(zip(attractor_names(found), attractor_colours(found), strict=True))
    ]
