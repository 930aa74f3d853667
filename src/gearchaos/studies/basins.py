"""Which motion from which start: basins of attraction on a plane of initial values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearchaos.axis import Axis
from gearchaos.coordinates import start
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, state_names, vary
from gearchaos.motion import Budget, Label, classify, orbit
from gearchaos.studies import tiles
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.zones import plane
from gearchaos.switched import switched

_SAME = 1e-6


@dataclass
class _Attractor:
    """One attractor: the minimal coordinates of its section (n, d), or a piece of it."""

    label: int
    period: int
    section: np.ndarray
    count: int = 0
    v_rms: float = float("nan")


def basins(
    model: MeshModel, x: Axis, y: Axis, *, budget: Budget | None = None, progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Basins of attraction on a plane of initial values, attractors told apart by their polished orbits.

    Parameters
    ----------
    model : MeshModel
        The operating point; initial values off the plane are the model's.
    x, y : Axis
        Two coordinates: z and z_dot of the single model, x1, x1_dot, ... of the others.
    budget, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        ``attractor(y, x)``, an index into the dim "attractor" or -1 where the motion diverged or stayed undecided;
        per attractor its label, period, share of the plane, rms velocity and section. All chaotic motions count
        as one attractor, and so do all quasi-periodic ones.
    """
    for axis in (x, y):
        if axis.name not in state_names(model.kind):
            raise InputError(f"axis {axis.name}", "must be an initial value of the model", axis.name,
                             f"Choose from {', '.join(state_names(model.kind))}.")
    grid = plane(model, x, y)
    system = switched(vary(model, {}))
    flow = ExactFlow(system)
    index = np.full(x.count * y.count, -1, dtype=np.int16)
    known: list[_Attractor] = []

    def work(tile: np.ndarray):
        w = start(vary(model, {k: v[tile] for k, v in grid.items()}), system).T.copy()
        return classify(flow, w, np.zeros(len(tile), dtype=int), budget=budget, levels=False)

    pieces = tiles.split(np.arange(len(index)))
    done = tiles.run(work, pieces, progress="basins" if progress else None, threads=threads)
    for tile, found in sorted(done, key=lambda item: item[0][0]):  # so that no result depends on which came first
        index[tile] = _identify(flow, found, known)
    _weigh(flow, known)
    order = sorted(range(len(known)), key=lambda i: (known[i].label, known[i].period, -known[i].count))
    rank = np.full(len(known) + 1, -1, dtype=np.int16)
    rank[order] = np.arange(len(known))
    return _dataset(model, x, y, rank[index].reshape(y.count, x.count), [known[i] for i in order])


def _identify(flow: ExactFlow, found, known: list[_Attractor]) -> np.ndarray:
    """The attractor of each trajectory; new ones are added to ``known``."""
    index = np.full(len(found.label), -1, dtype=np.int16)
    for label in (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC):
        for period in np.unique(found.period[found.label == label]):
            left = (found.label == label) & (found.period == period)
            for number, attractor in enumerate(known):
                if (attractor.label, attractor.period) == (label, period):
                    index[left & _belongs(attractor, found.w)] = number
            while np.any(left & (index < 0)):
                first = int(np.flatnonzero(left & (index < 0))[0])
                known.append(_new(flow, int(label), int(period), found.w[:, first]))
                index[left & (index < 0) & _belongs(known[-1], found.w)] = len(known) - 1
    for number, attractor in enumerate(known):
        attractor.count += int(np.sum(index == number))
    return index


def _belongs(attractor: _Attractor, w: np.ndarray) -> np.ndarray:
    """Whether states w (d, L) lie on the orbit; motions without one are taken together."""
    if attractor.period == 0:
        return np.ones(w.shape[1], dtype=bool)
    return np.min([np.abs(w - p[:, None]).max(axis=0) for p in attractor.section], axis=0) < _SAME


def _new(flow: ExactFlow, label: int, period: int, w: np.ndarray) -> _Attractor:
    if period:
        points = orbit.sections(flow, w[:, None], np.zeros(1, dtype=int), np.array([period]))[0]
    else:
        points = flow.advance(w[:, None], 512, points=np.zeros(1, dtype=int), sections=512).sections[:, :, 0]
    return _Attractor(label, period, points)


def _weigh(flow: ExactFlow, known: list[_Attractor]) -> None:
    """The rms velocity of every attractor."""
    if known:
        w = np.stack([a.section[-1] for a in known], axis=1)
        levels = classify(flow, w, np.zeros(len(known), dtype=int)).reading
        for attractor, v_rms in zip(known, levels.v_rms, strict=True):
            attractor.v_rms = float(v_rms)


def _dataset(model: MeshModel, x: Axis, y: Axis, index: np.ndarray, known: list[_Attractor]) -> xr.Dataset:
    total = index.size
    data = {
        "attractor": variable("attractor", (y.name, x.name), index),
        "attractor_label": variable("attractor_label", ("number",), np.array([a.label for a in known], np.int8)),
        "attractor_period": variable("attractor_period", ("number",), np.array([a.period for a in known], np.int32)),
        "attractor_fraction": variable("attractor_fraction", ("number",), np.array([a.count / total for a in known])),
        "attractor_v_rms": variable("attractor_v_rms", ("number",), np.array([a.v_rms for a in known], float)),
        **_attractor_sections(known),
    }
    coords = {a.name: variable(a.name, (a.name,), a.values) for a in (x, y)}
    return xr.Dataset(data, coords, provenance("basins", model))


def _attractor_sections(known: list[_Attractor]) -> dict[str, xr.Variable]:
    """z and z' of every attractor's section, padded with NaN."""
    longest = max((len(a.section) for a in known), default=0)
    values = np.full((2, len(known), longest), np.nan)
    for i, a in enumerate(known):
        values[:, i, : len(a.section)] = a.section[:, :2].T
    names = ("attractor_section_z", "attractor_section_z_dot")
    return {n: variable(n, ("number", "point"), v) for n, v in zip(names, values, strict=True)}
