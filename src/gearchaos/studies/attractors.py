"""All motions of one operating point: attractors from many starts, with the shares of the starts they take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import provenance, variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import MeshModel, expand, state_names, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import SwitchedAffine, switched
from gearchaos.studies.attractor_set import AttractorSet, attractor_variables, final_states
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.cost import Effort, effort
from gearchaos.studies.initial_conditions import checked_box, default_box, spread
from gearchaos.studies.perturbation import BYTES_PER_DIRECTION, MOTIONS_PER_DIRECTION, smallest_perturbation
from gearchaos.studies.plan import Plan
from gearchaos.studies.sweep import CARRY, carried

_CONFIDENCE = 0.95


def attractors(
    model: MeshModel | GearPair, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None,
    seed: int = 0, sweep: Axis | str | None = None, kicks: int = 0, settings: Classification | None = None,
    progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """All motions that many starts lead to at one operating point.

    Parameters
    ----------
    model : MeshModel or GearPair
        The operating point; initial values not in the box are the model's.
    starts : int
        How many starts: points of a scrambled Sobol sequence.
    box : mapping of str to (low, high), optional
        Ranges of initial values; by default ±3 half backlashes and ±2 for the velocities, in every coordinate that
        matters for the relative motion.
    seed : int
        Another seed gives other starts.
    sweep : Axis or str, optional
        A parameter that is also swept slowly to its value in the model, upwards from the axis' first value and
        downwards from its last, ``count`` values each way.
    kicks : int
        Directions in which to look for the smallest kick that leaves each attractor; none by default.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        With dim "number": of each attractor its label, period, share of the starts with a 95 % interval
        (Clopper-Pearson), levels, exponent or multiplier and section. ``attractor(start)`` says where each start led,
        -1 if it diverged or stayed undecided; ``attractor_up`` and ``attractor_down`` where the sweeps did.
        ``attractor_kick`` is the length of the smallest sudden change of the state found (Euclid's, in half backlashes
        and their velocities) after which a motion on the attractor settles elsewhere, NaN if none up to 4 does;
        ``attractor_kick_change`` and ``attractor_kick_point`` are that change and the state in which it strikes, at the
        start of a mesh period.

    Raises
    ------
    InputError
        If a number or a range is out of bounds; before any work.
    """
    options: dict[str, Any] = {"box": box, "seed": seed, "sweep": sweep, "kicks": kicks, "settings": settings}
    return plan(model, starts, **options).run(progress=progress, threads=threads)


def plan(
    model: MeshModel | GearPair, starts: int = 256, *, box: Mapping[str, tuple[float, float]] | None = None,
    seed: int = 0, sweep: Axis | str | None = None, kicks: int = 0, settings: Classification | None = None,
) -> Plan:
    """The starts of `attractors`, checked and ready to be followed; sweeps and kicks come after."""
    model, settings = as_model(model), as_settings(settings)
    sweep = None if sweep is None else as_axis(sweep, "sweep")
    starts, seed, kicks = (
        whole_number(*v) for v in (("starts", starts, 1), ("seed", seed, 0), ("kicks", kicks, 0))
    )
    box = checked_box(box) if box else default_box(model)
    system = switched(vary(model, {}))
    cost = _cost(system, starts, sweep, kicks, settings)
    values, flow = spread(box, starts, seed), ExactFlow(system)
    w = start(vary(model, values), flow.system).T
    if sweep:
        _check_sweep(model, sweep)

    def compute(
        numbers: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        name = "attractors" if progress else None
        return final_states(flow, w[:, numbers], settings=settings, progress=name, threads=threads)

    def finish(
        found: dict[str, np.ndarray], *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset:
        catalogue = AttractorSet(flow)
        index = catalogue.match(found)
        catalogue.count_members(index)
        ends = catalogue.find(_swept(model, sweep), settings=settings, threads=threads) if sweep else np.empty(0,
            dtype=int)
        rank = catalogue.ranks()
        swept = zip(("up", "down"), ends, strict=False)
        data = {
            "attractor": variable("attractor", ("start",), rank[index]),
            **{f"attractor_{n}": variable("attractor", (), rank[i]) for n, i in swept},
            **attractor_variables(catalogue, settings), **_shares(catalogue, starts),
            **(_kicks(catalogue, kicks, progress, settings=settings, threads=threads) if kicks else {}),
            **{f"start_{n}": variable(n, ("start",), v) for n, v in values.items()},
        }
        said = {"starts": starts, "seed": seed, "box": box, "sweep": sweep and asdict(sweep), "kicks": kicks}
        return xr.Dataset(data, attrs=provenance("attractors", model, **said))

    return Plan({"start": starts}, {"start": 1}, compute, finish, cost, labelled=False)


def _cost(system: SwitchedAffine, starts: int, sweep: Axis | None, kicks: int,
          settings: Classification | None) -> Effort:
    """What all starts, sweeps and kicks take at most; raises where memory or time do not suffice."""
    tiles.check_memory("starts", starts)
    tiles.check_memory("kicks", kicks, BYTES_PER_DIRECTION)
    sequential = 2 * sweep.count * CARRY if sweep else 0
    return effort(system, starts + kicks * MOTIONS_PER_DIRECTION, (settings or Classification()).most, sequential)


def _check_sweep(model: MeshModel, sweep: Axis) -> float:
    """The model's own value of the parameter swept; raises if it cannot be swept to from both sides."""
    if sweep.name in state_names(model.kind):
        raise InputError(f"sweep {sweep.name}", "must be a parameter, not an initial value", sweep.name)
    whole_number(f"sweep {sweep.name} count", sweep.count, 2)
    vary(model, {sweep.name: sweep.values})  # checked before any work
    batch = vary(model, {})
    value, *others = {float(batch[n]) for n in expand({sweep.name: 0.0}, model)}
    if others:
        raise InputError(f"sweep {sweep.name}", "must be one value for both wheels", (value, *others))
    if not sweep.start < value < sweep.stop:
        raise InputError(f"sweep {sweep.name}", f"must run from below to above the model's value {value:g}",
                         f"{sweep.start:g}:{sweep.stop:g}")
    return value


def _swept(model: MeshModel, sweep: Axis) -> np.ndarray:
    """States (d, 2) with which sweeps up and down reach the model's own value of a parameter."""
    value = _check_sweep(model, sweep)
    up = carried(model, Axis(sweep.name, sweep.start, value, sweep.count), True)
    down = carried(model, Axis(sweep.name, value, sweep.stop, sweep.count), False)
    ends = {n: np.array([up[n][0, -1], down[n][0, 0]]) for n in up}
    return start(vary(replace(model, initial={}), ends), switched(vary(model, {}))).T


def _kicks(catalogue: AttractorSet, directions: int, progress: bool, **options: Any) -> dict[str, xr.Variable]:
    """The smallest kick found for every attractor, in the catalogue's order."""
    names = catalogue.flow.system.names
    found = [
        smallest_perturbation(
            catalogue.flow, catalogue.attractors[i], directions, progress=f"kicks {n}" if progress else None, **options
        ) for n, i in enumerate(catalogue.order(), start=1)
    ]
    none = np.full(len(names), np.nan)
    rows = {
        "attractor_kick": np.array([k.size if k else np.nan for k in found]),
        "attractor_kick_change": np.array([k.change if k else none for k in found]).reshape(-1, len(names)),
        "attractor_kick_point": np.array([k.point if k else none for k in found]).reshape(-1, len(names)),
    }
    out = {n: variable(n, ("number", "coordinate")[: v.ndim], v) for n, v in rows.items()}
    return out | {"coordinate": xr.Variable("coordinate", list(names))}


def _shares(catalogue: AttractorSet, starts: int) -> dict[str, xr.Variable]:
    """The share of the starts that each attractor takes, with its interval."""
    from scipy.stats import binomtest  # here, since scipy.stats takes a second to load

    counts = [catalogue.attractors[i].count for i in catalogue.order()]
    intervals = [binomtest(c, starts).proportion_ci(_CONFIDENCE) for c in counts]
    values = {
        "fraction": [c / starts for c in counts], "fraction_lo": [i.low for i in intervals],
        "fraction_hi": [i.high for i in intervals],
    }
    return {f"attractor_{n}": variable(f"attractor_{n}", ("number",), np.array(v, float)) for n, v in values.items()}
