"""Coexisting motions in the cells of a map: attractors reached from further initial states and by slow sweeps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.dynamics import ON_ATTRACTOR, Classification, Verdicts
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.dynamics.response import CONTACTS
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.axis import Axis
from gearchaos.studies.batch_classification import InitialStates, classify_batch
from gearchaos.studies.initial_value_problems import Motions, initial_value_problems
from gearchaos.studies.plane import at_cells, shared_coordinates
from gearchaos.studies.sweep import swept_initial_values

SAME_CENTRE = 1e-6
"""Orbits of the same period are the same if their centres differ by less than this in z and in z'."""

_NO_CONTACT = CONTACTS.index("none")


def signature(motions: Motions, found: Verdicts) -> dict[str, np.ndarray]:
    """The variables by which the motions of a cell are distinguished, and their response; arrays (L,) by name.

    The motions are in the final states of the verdicts ``found``.
    ``centre_z`` and ``centre_z_dot`` are the means of z and z' over the stroboscopic points of an orbit, and 0 for
    other motions: all chaotic motions of a cell count as one, and so do all quasi-periodic ones.
    """
    centre, longest = np.zeros((2, len(motions.points))), int(found.period.max(initial=0))
    sections = motions.flow.advance(motions.w, found.period, points=motions.points, sections=longest).sections
    for n in np.unique(found.period[found.period > 0]):
        same = np.flatnonzero(found.period == n)
        centre[:, same] = sections[longest - n :, :2, same].mean(axis=0)
    variables = {n: found[n] for n in ("label", "period", "v_rms", "contact")}
    return {**variables, "centre_z": centre[0], "centre_z_dot": centre[1]}


def coexisting(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, own: dict[str, np.ndarray], starts: int,
    **options: Any,
) -> dict[str, np.ndarray]:
    """The motions that coexist in the cells of a map.

    Parameters
    ----------
    model : MeshModel
    x, y : Axis
    cells : (N,)
        Numbers of the cells: whole rows of constant y, one after another.
    order : (N,)
        The order of computation, as positions in ``cells``; see `classify_batch`.
    own : dict of str to (N,)
        `signature` of the motions from the initial values of the model.
    starts : int
        Number of further initial states in each cell.
    **options
        ``settings``, ``progress``, ``threads`` and ``largest`` of `classify_batch`.

    Returns
    -------
    dict of str to (N,)
        Number of ``attractors`` found, smallest and largest V_RMS, ``v_rms_least`` and ``v_rms_most`` among them,
        worst contact state ``contact_worst`` (the last one in `CONTACTS` other than "none"), rms velocities
        ``v_rms_up`` and ``v_rms_down`` after slow sweeps along x, and ``hysteresis``: 1 where the two sweeps end in
        different motions.
    """
    further = _from_further_starts(model, x, y, cells, order, starts, **options)
    swept = _from_sweeps(model, x, y, cells, order, **options)
    motions = {n: np.concatenate([own[n][:, None], further[n], swept[n]], axis=1) for n in swept}
    settled: np.ndarray = np.isin(motions["label"], ON_ATTRACTOR)
    contact = np.where(settled & (motions["contact"] != _NO_CONTACT), motions["contact"], -1).max(axis=1)
    none, v_rms = ~np.any(settled, axis=1), motions["v_rms"]
    up, down = ({n: v[:, i] for n, v in motions.items()} for i in (-2, -1))
    return {
        "attractors": _count_distinct(motions, settled),
        "v_rms_least": np.where(none, np.nan, np.where(settled, v_rms, np.inf).min(axis=1)),
        "v_rms_most": np.where(none, np.nan, np.where(settled, v_rms, -np.inf).max(axis=1)),
        "contact_worst": np.where(contact < 0, _NO_CONTACT, contact).astype(np.int8),
        "v_rms_up": up["v_rms"], "v_rms_down": down["v_rms"],
        "hysteresis": (settled[:, -2] & settled[:, -1] & ~_same(up, down)).astype(np.int8),
    }


def _from_further_starts(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, starts: int, **options: Any
) -> dict[str, np.ndarray]:
    """`signature` of the motions from further initial states, the same in all cells; arrays (N, starts)."""
    conditions = spread(default_box(model), starts, 0)
    # the single model accepts only one of z and x1 as initial displacement, so the model's own is dropped
    base = replace(model, initial={}) if model.kind == "single" else model
    names = shared_coordinates(model, x, y)

    def initial_states(number: np.ndarray) -> Motions:
        position, condition = np.divmod(number, starts)
        positions, points = np.unique(position, return_inverse=True)
        flow = ExactFlow(switched_system(vary(model, at_cells(x, y, cells[positions])), names))
        initial = {n: v[condition] for n, v in conditions.items()}
        batch = vary(base, at_cells(x, y, cells[position]) | initial)
        return Motions(flow, initial_state(batch, flow.system).T.copy(), points)

    numbers = (order[:, None].astype(np.int64) * starts + np.arange(starts)).ravel()
    found = _classified(initial_states, numbers, "more starts", **options)
    return {n: v.reshape(-1, starts) for n, v in found.items()}


def _from_sweeps(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, order: np.ndarray, **options: Any
) -> dict[str, np.ndarray]:
    """`signature` of the motions after slow sweeps along x, upwards and downwards; arrays (N, 2)."""
    row_values = {y.name: y.values[cells[:: x.count] // x.count]}
    up, down = (_sweep_rows(model, x, row_values, upwards, **options) for upwards in (True, False))
    base, count, names = replace(model, initial={}), len(cells), shared_coordinates(model, x, y)

    def initial_states(number: np.ndarray) -> Motions:
        direction, position = np.divmod(number, count)
        initial = {n: np.where(direction == 0, up[n][position], down[n][position]) for n in up}
        return initial_value_problems(base, at_cells(x, y, cells[position]) | initial, names)

    found = _classified(initial_states, np.concatenate([order, order.astype(np.int64) + count]), "swept", **options)
    return {n: v.reshape(2, -1).T for n, v in found.items()}


def _sweep_rows(
    model: MeshModel, x: Axis, row_values: dict[str, np.ndarray], upwards: bool, *, settings: Classification | None,
    progress: bool, threads: int | None, largest: int,
) -> dict[str, np.ndarray]:
    """Initial values (N,) by name with which sweeps along x reach the cells.

    ``row_values`` has the value of y in each row, (rows,), by the name of y; there is one sweep for each row.
    """
    out: dict[str, np.ndarray] = {}
    (count,) = {len(v) for v in row_values.values()}
    for rows, reached in tiles.run(
        lambda rows: swept_initial_values(model, x, upwards, {n: v[rows] for n, v in row_values.items()}),
        tiles.split(count, largest), progress=f"sweeps {'up' if upwards else 'down'}" if progress else None,
        threads=threads,
    ):
        for name, value in reached.items():
            out.setdefault(name, np.empty((count, x.count)))[rows] = value
    return {n: v.ravel() for n, v in out.items()}


def _classified(
    initial_states: InitialStates, order: np.ndarray, name: str, *, settings: Classification | None, progress: bool,
    threads: int | None, largest: int,
) -> dict[str, np.ndarray]:
    """`signature` of the motions with the numbers ``order``; arrays by name."""
    return classify_batch(
        initial_states, lambda _, *found: signature(*found), order, settings=settings,
        progress=name if progress else None, threads=threads, largest=largest,
    )


def _same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> np.ndarray:
    """Whether two motions have the same label and period and the same centre; elementwise, from `signature`."""
    alike = [one[n] == other[n] for n in ("label", "period")]
    near = [np.abs(one[n] - other[n]) < SAME_CENTRE for n in ("centre_z", "centre_z_dot")]
    return np.logical_and.reduce(alike + near)


def _count_distinct(motions: dict[str, np.ndarray], settled: np.ndarray) -> np.ndarray:
    """The number (N,) of different motions in each row of arrays (N, M), among those that are ``settled`` (N, M)."""
    uncounted, count = settled.copy(), np.zeros(len(settled), dtype=np.int16)
    while np.any(uncounted):
        some, first = np.any(uncounted, axis=1), np.argmax(uncounted, axis=1)
        one = {n: np.take_along_axis(v, first[:, None], axis=1) for n, v in motions.items()}
        uncounted &= ~(_same(one, motions) & some[:, None])
        count += some
    return count
