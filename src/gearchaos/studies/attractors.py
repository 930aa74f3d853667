"""All motions of one operating point: attractors from many starts, with the shares of the starts they take."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.stats import binomtest

from gearchaos.coordinates import start
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.motion import Budget, Verdicts, classify
from gearchaos.studies import tiles
from gearchaos.studies.catalogue import Catalogue
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.evidence import evidence
from gearchaos.studies.simulate import whole_number
from gearchaos.studies.starts import default_box, spread
from gearchaos.switched import switched

_CONFIDENCE = 0.95
_FACTS = ("v_rms", "contact_fraction", "contact", "dynamic_factor", "lyapunov", "multiplier", "residual")


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
    system = switched(vary(model, {}))
    flow, values = ExactFlow(system), spread(box or default_box(model), starts, seed)
    vary(model, values)  # checked before any work
    index, catalogue = np.full(starts, -1, dtype=np.int16), Catalogue(flow)

    def work(tile: np.ndarray) -> Verdicts:
        w = start(vary(model, {k: v[tile] for k, v in values.items()}), system).T.copy()
        return classify(flow, w, np.zeros(len(tile), dtype=int), budget=budget, levels=False)

    done = tiles.run(
        work, tiles.split(np.arange(starts)), progress="attractors" if progress else None, threads=threads
    )
    for tile, found in sorted(done, key=lambda item: item[0][0]):  # so that no result depends on which came first
        index[tile] = catalogue.place(found)
    rank = catalogue.ranks()
    data = {
        "attractor": variable("attractor", ("start",), rank[index]),
        **described(catalogue), **_shares(catalogue, starts),
        **{f"start_{n}": variable(n, ("start",), v) for n, v in values.items()},
    }
    return xr.Dataset(data, attrs=provenance("attractors", model, starts=starts, seed=seed))


def _shares(catalogue: Catalogue, starts: int) -> dict[str, xr.Variable]:
    """The share of the starts that each attractor takes, with its interval."""
    counts = [catalogue.known[i].count for i in catalogue.order()]
    intervals = [binomtest(c, starts).proportion_ci(_CONFIDENCE) for c in counts]
    values = {
        "fraction": [c / starts for c in counts], "fraction_lo": [i.low for i in intervals],
        "fraction_hi": [i.high for i in intervals],
    }
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), np.array(v, float)) for n, v in values.items()}


def described(catalogue: Catalogue) -> dict[str, xr.Variable]:
    """Label, period, levels and section (z and z', padded with NaN) of every attractor, in the catalogue's order."""
    order = catalogue.order()
    known = [catalogue.known[i] for i in order]
    out: dict[str, np.ndarray] = {
        "label": np.array([a.label for a in known], np.int8), "period": np.array([a.period for a in known], np.int32),
    }
    facts = evidence(catalogue.judged()) if known else {}
    out |= {name: facts[name][order] if known else np.zeros(0) for name in _FACTS}
    longest = max((len(a.section) for a in known), default=0)
    sections = np.full((2, len(known), longest), np.nan)
    for i, a in enumerate(known):
        sections[:, i, : len(a.section)] = a.section[:, :2].T
    names = ("attractor_section_z", "attractor_section_z_dot")
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), v) for n, v in out.items()} | {
        n: variable(n, ("number", "point"), v) for n, v in zip(names, sections, strict=True)
    }
