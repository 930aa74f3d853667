"""What else the cells of a map can do: how many motions more starts and slow sweeps find, and their levels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import switched
from gearchaos.studies.axis import Axis
from gearchaos.studies.classification import InitialStates, classify_batch
from gearchaos.studies.initial_conditions import default_box, spread
from gearchaos.studies.plane import at_cells, shared_coordinates
from gearchaos.studies.sweep import carried

_APART = 1e-6
_KNOWN = (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC)


def identity(flow: ExactFlow, points: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
    """By what motions are told apart, and their levels; arrays (L,) by name.

    The mean point of z and z' over an orbit is 0 for motions without one: all chaotic motions of a cell count as one,
    and so do all quasi-periodic ones.
    """
    centre, most = np.zeros((2, len(points))), int(found.period.max(initial=0))
    sections = flow.advance(found.w, found.period, points=points, sections=most).sections
    for n in np.unique(found.period[found.period > 0]):
        mine = np.flatnonzero(found.period == n)
        centre[:, mine] = sections[most - n :, :2, mine].mean(axis=0)
    return {
        "label": found.label, "period": found.period, "v_rms": found.response.v_rms,
        "contact": np.nan_to_num(found.response.contact, nan=3).astype(np.int8),
        "centre_z": centre[0], "centre_z_dot": centre[1],
    }


def coexisting(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, own: dict[str, np.ndarray], starts: int,
    **options: Any,
) -> dict[str, np.ndarray]:
    """What the cells of a map do from more starts and after slow sweeps along x.

    Parameters
    ----------
    cells : (N,)
        Numbers of the cells, whole rows of constant y one after another.
    order : (N,)
        Their places in an order that suits `classify_batch`.
    own : dict of str to (N,)
        `identity` of the motions from the model's own starts.
    starts : int
        How many more in each cell.
    **options
        ``settings``, ``progress``, ``threads`` and ``largest`` of `classify_batch`.

    Returns
    -------
    dict of str to (N,)
        Number of ``attractors`` found, ``v_rms_least`` and ``v_rms_most`` among them, ``contact_worst``, levels
        ``v_rms_up`` and ``v_rms_down`` after the sweeps, and ``hysteresis`` where these end in different motions.
    """
    more = _from_starts(model, x, y, cells, order, starts, **options)
    swept = _from_sweeps(model, x, y, cells, order, **options)
    every = {n: np.concatenate([own[n][:, None], more[n], swept[n]], axis=1) for n in swept}
    known: np.ndarray = np.isin(every["label"], _KNOWN)
    none, touching = ~np.any(known, axis=1), np.where(known & (every["contact"] < 3), every["contact"], -1).max(axis=1)
    up, down = ({n: v[:, i] for n, v in every.items()} for i in (-2, -1))
    return {
        "attractors": _distinct(every, known),
        "v_rms_least": np.where(none, np.nan, np.where(known, every["v_rms"], np.inf).min(axis=1)),
        "v_rms_most": np.where(none, np.nan, np.where(known, every["v_rms"], -np.inf).max(axis=1)),
        "contact_worst": np.where(touching < 0, 3, touching).astype(np.int8),
        "v_rms_up": up["v_rms"], "v_rms_down": down["v_rms"],
        "hysteresis": (known[:, -2] & known[:, -1] & ~_same(up, down)).astype(np.int8),
    }


def _from_starts(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, starts: int, **options: Any
) -> dict[str, np.ndarray]:
    """Motions from the same starts in all cells, told by `identity`; arrays (N, starts)."""
    chosen = spread(default_box(model), starts, 0)
    bare = replace(model, initial={}) if model.kind == "single" else model  # whose start is z or x1, never both
    names = shared_coordinates(model, x, y)

    def initial_states(number: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        place, at = np.divmod(number, starts)
        places, points = np.unique(place, return_inverse=True)
        flow = ExactFlow(switched(vary(model, at_cells(x, y, cells[places])), names))
        begin = vary(bare, at_cells(x, y, cells[place]) | {n: v[at] for n, v in chosen.items()})
        return flow, start(begin, flow.system).T.copy(), points

    every = (order[:, None].astype(np.int64) * starts + np.arange(starts)).ravel()
    found = _classified(initial_states, every, "more starts", **options)
    return {n: v.reshape(-1, starts) for n, v in found.items()}


def _from_sweeps(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, **options: Any
) -> dict[str, np.ndarray]:
    """Motions after slow sweeps along x, upwards and downwards, told by `identity`; arrays (N, 2)."""
    across = {y.name: y.values[cells[:: x.count] // x.count]}
    arrived = [_swept(model, x, across, up, **options) for up in (True, False)]
    bare, count, names = replace(model, initial={}), len(cells), shared_coordinates(model, x, y)

    def initial_states(number: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        way, place = np.divmod(number, count)
        begin = {n: np.where(way == 0, up[place], arrived[1][n][place]) for n, up in arrived[0].items()}
        batch = vary(bare, at_cells(x, y, cells[place]) | begin)
        system = switched(batch, names)
        return ExactFlow(system), start(batch, system).T.copy(), np.arange(len(number))

    found = _classified(initial_states, np.concatenate([order, order.astype(np.int64) + count]), "swept", **options)
    return {n: v.reshape(2, -1).T for n, v in found.items()}


def _swept(
    model: MeshModel, x: Axis, across: dict[str, np.ndarray], up: bool, *, settings: Classification | None,
    progress: bool,
    threads: int | None, largest: int,
) -> dict[str, np.ndarray]:
    """Initial values (N,) of the cells by name, as sweeps along x reach them, one for each value across it."""
    out: dict[str, np.ndarray] = {}
    (count,) = {len(v) for v in across.values()}
    for rows, reached in tiles.run(
        lambda rows: carried(model, x, up, {n: v[rows] for n, v in across.items()}), tiles.split(count, largest),
        progress=f"sweeps {'up' if up else 'down'}" if progress else None, threads=threads,
    ):
        for name, value in reached.items():
            out.setdefault(name, np.empty((count, x.count)))[rows] = value
    return {n: v.ravel() for n, v in out.items()}


def _classified(
    initial_states: InitialStates, order: np.ndarray, name: str, *, settings: Classification | None, progress: bool,
    threads: int | None,
    largest: int,
) -> dict[str, np.ndarray]:
    return classify_batch(
        initial_states, lambda _, *judged: identity(*judged), order, settings=settings,
        progress=name if progress else None,
        threads=threads, largest=largest,
    )


def _same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> np.ndarray:
    """Whether two motions are one: of the same kind and period, with the same mean point."""
    alike = [one[n] == other[n] for n in ("label", "period")]
    near = [np.abs(one[n] - other[n]) < _APART for n in ("centre_z", "centre_z_dot")]
    return np.logical_and.reduce(alike + near)


def _distinct(motions: dict[str, np.ndarray], known: np.ndarray) -> np.ndarray:
    """How many different motions (N,) there are in each row of (N, starts)."""
    left, count = known.copy(), np.zeros(len(known), dtype=np.int16)
    while np.any(left):
        some, first = np.any(left, axis=1), np.argmax(left, axis=1)
        one = {n: np.take_along_axis(v, first[:, None], axis=1) for n, v in motions.items()}
        left &= ~(_same(one, motions) & some[:, None])
        count += some
    return count
