"""What else a cell of a map can do: how many motions several starts find, and the range of their levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearchaos.coordinates import start
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.motion import Budget, Label, Verdicts, classify
from gearchaos.studies.starts import default_box, spread

_DIGITS = 6


def _other_starts(model: MeshModel, values: dict[str, np.ndarray], flow: ExactFlow, count: int) -> np.ndarray:
    """Dynamic states (d, n * count) of the same ``count`` starts in each of n cells, all cells of a start together."""
    bare = replace(model, initial={}) if model.kind == "single" else model  # whose start is z or x1, never both
    cells, chosen = flow.system.points, spread(default_box(model), count, 0)
    starts = [{name: np.full(cells, v[k]) for name, v in chosen.items()} for k in range(count)]
    return np.concatenate([start(vary(bare, {**values, **here}), flow.system).T for here in starts], axis=1)


def coexisting(
    model: MeshModel, values: dict[str, np.ndarray], flow: ExactFlow, own: Verdicts, starts: int, budget: Budget | None
) -> dict[str, np.ndarray]:
    """Number of attractors, least and largest V_RMS and the worst contact state of each cell (n,).

    Parameters
    ----------
    values : dict of str to (n,)
        What varies from cell to cell.
    own : Verdicts
        On the model's own start in every cell, the first of the ``starts``, which are two or more.

    Motions are one if their orbits have the same period and the same mean point to 1e-6; all chaotic motions of a
    cell count as one, and so do all quasi-periodic ones.
    """
    cells = len(own.label)
    points = np.tile(np.arange(cells), starts - 1)
    others = classify(flow, _other_starts(model, values, flow, starts - 1), points, budget=budget)
    label, period, v_rms, contact = (
        np.concatenate(pair).reshape(starts, cells) for pair in (
            (own.label, others.label), (own.period, others.period), (own.reading.v_rms, others.reading.v_rms),
            (own.reading.contact, others.reading.contact),
        )
    )
    w, at = np.concatenate([own.w, others.w], axis=1), np.concatenate([np.arange(cells), points])
    centres = _centres(flow, w, at, period.ravel()).reshape(2, starts, cells)
    known = np.isin(label, (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC))
    touching = np.where(known & (contact < 3), contact, -1).max(axis=0)
    none = ~known.any(axis=0)
    least, most = (np.where(known, v_rms, fill) for fill in (np.inf, -np.inf))
    return {
        "attractors": _distinct(label, period, centres, known),
        "v_rms_least": np.where(none, np.nan, least.min(axis=0)),
        "v_rms_most": np.where(none, np.nan, most.max(axis=0)),
        "contact_worst": np.where(touching < 0, 3, touching).astype(np.int8),
    }


def _centres(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Mean of z and z' over the points of each orbit, (2, L); 0 for motions without one."""
    out = np.zeros((2, len(period)))
    for n in np.unique(period[period > 0]):
        mine = np.flatnonzero(period == n)
        sections = flow.advance(w[:, mine], int(n), points=points[mine], sections=int(n)).sections
        out[:, mine] = sections[:, :2].mean(axis=0)
    return out


def _distinct(label: np.ndarray, period: np.ndarray, centres: np.ndarray, known: np.ndarray) -> np.ndarray:
    """How many different motions each cell has; label, period and known are (starts, n), centres (2, starts, n)."""
    starts, cells = label.shape
    cell = np.tile(np.arange(cells), (starts, 1))
    keys = np.stack([cell, label, period, *np.round(centres, _DIGITS)], axis=-1)[known]
    return np.bincount(np.unique(keys, axis=0)[:, 0].astype(int), minlength=cells).astype(np.int16)
