"""All motions of one operating point: attractors from many starts, with the shares of the starts they take."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.stats import binomtest

from gearchaos.model import MeshModel, vary
from gearchaos.motion import Budget
from gearchaos.studies import tiles
from gearchaos.studies.catalogue import Catalogue, catalogued, described
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.simulate import whole_number
from gearchaos.studies.starts import default_box, spread

_CONFIDENCE = 0.95


def attractors(
    model: MeshModel, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None, seed: int = 0,
    budget: Budget | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """All motions that many starts lead to at one operating point.

    Parameters
    ----------
    model : MeshModel
        The operating point; initial values not in the box are the model's.
    starts : int
        How many starts: points of a scrambled Sobol sequence.
    box : mapping of str to (low, high), optional
        Ranges of initial values; by default ±3 half backlashes and ±2 for the velocities, in every coordinate that
        matters for the relative motion.
    seed : int
        Another seed gives other starts.
    budget, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        With dim "number": of each attractor its label, period, share of the starts with a 95 % interval
        (Clopper-Pearson), levels, exponent or multiplier and section. ``attractor(start)`` says where each start led,
        -1 if it diverged or stayed undecided.

    Raises
    ------
    InputError
        If a number or a range is out of bounds; before any work.
    """
    starts, seed = whole_number("starts", starts, 1), whole_number("seed", seed, 0)
    tiles.check_memory("starts", starts)
    box = dict(box) if box else default_box(model)
    values = spread(box, starts, seed)
    vary(model, values)  # checked before any work
    index, catalogue = catalogued(
        model, values, budget=budget, progress="attractors" if progress else None, threads=threads
    )
    data = {
        "attractor": variable("attractor", ("start",), index),
        **described(catalogue), **_shares(catalogue, starts),
        **{f"start_{n}": variable(n, ("start",), v) for n, v in values.items()},
    }
    return xr.Dataset(data, attrs=provenance("attractors", model, starts=starts, seed=seed, box=box))


def _shares(catalogue: Catalogue, starts: int) -> dict[str, xr.Variable]:
    """The share of the starts that each attractor takes, with its interval."""
    counts = [catalogue.known[i].count for i in catalogue.order()]
    intervals = [binomtest(c, starts).proportion_ci(_CONFIDENCE) for c in counts]
    values = {
        "fraction": [c / starts for c in counts], "fraction_lo": [i.low for i in intervals],
        "fraction_hi": [i.high for i in intervals],
    }
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), np.array(v, float)) for n, v in values.items()}
