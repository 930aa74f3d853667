"""The seam between the flow and everything above it: points, states and a plan in; arrays and a status per trajectory
out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from gearchaos.flow.grids import prepare_points
from gearchaos.flow.kernels.advance import advance_packs
from gearchaos.flow.kernels.arrays import Call, new_lanes, new_slots, new_workspace
from gearchaos.flow.kernels.cancellation import raise_if_cancelled
from gearchaos.flow.kernels.constants import SLOTS, WIDTH, Measure
from gearchaos.flow.system import SwitchedSystem

_MAX_MATRIX_SETS = 2
"""Entries of the step tables that every slot keeps in memory at the same time: one for each level of the stiffness."""

_TICKS = 20_000
"""Steps between two tests for cancelling: a few hundredths of a second."""

System = TypeVar("System", bound=SwitchedSystem)


@dataclass(frozen=True)
class Flowed:
    """Results for L trajectories over whole mesh periods.

    Attributes
    ----------
    w : (d, L)
        Final coordinates.
    tangent : (K, d, L)
        Final tangent vectors.
    growth : (periods, K, L)
        Logarithms of the growth of orthonormalised tangent vectors in each period; 0 once a trajectory has had its
        periods. Empty if not asked for.
    sections : (S, d, L)
        Coordinates after each of a trajectory's last S periods; NaN before its first.
    measures : (len(Measure), L)
        Rows as numbered by `Measure`; empty if not asked for.
    samples : (periods, samples, d + 1, L)
        Coordinates and contact state at the sampled instants; empty if not asked for.
    status : (L,)
        `OK`, `DIVERGED` (|z| or |z'| was `DIVERGED_AT` or more, or not a number, at the end of a period) or `CHATTER`
        (more than 64 contact switches in a step: the state from there on is meaningless).
    """

    w: np.ndarray
    tangent: np.ndarray
    growth: np.ndarray
    sections: np.ndarray
    measures: np.ndarray
    samples: np.ndarray
    status: np.ndarray


def empty_measures(lanes: int) -> np.ndarray:
    """Measures (len(Measure), lanes) of motions of no duration."""
    out = np.zeros((len(Measure), lanes))
    out[[Measure.Z_MAX, Measure.Z_DOT_MAX, Measure.FORCE_MAX]] = -np.inf
    out[[Measure.Z_MIN, Measure.Z_DOT_MIN, Measure.FORCE_MIN]] = np.inf
    return out


class ExactFlow(Generic[System]):
    """The exact flow of a batch of switched affine systems; tables are built once and serve any number of calls.

    Parameters
    ----------
    system : SwitchedSystem
        P parameter points with d coordinates.
    samples : int, optional
        Make this many equidistant instants of the period available to ``advance(sample=True)``. Every step then has
        matrices of its own, which costs speed.

    Attributes
    ----------
    system : SwitchedSystem
        As given.
    dimension : int
        d.
    step_count : (P,)
        Steps in a mesh period at each point.

    Raises
    ------
    ValueError
        If samples are asked for and the split of the period differs from point to point.
    """

    def __init__(self, system: System, samples: int = 0) -> None:
        self.system = system
        self.dimension = system.dimension
        (self._points, self._grid), self._samples = prepare_points(system, samples), samples
        self.step_count = self._points.grids.step_count
        entries = int(self._points.steps.entry.max()) + 1
        self._matrix_sets = entries if entries <= _MAX_MATRIX_SETS else 1

    def advance(
        self, w: np.ndarray, periods: int | np.ndarray, *, points: np.ndarray | None = None,
        tangent: np.ndarray | None = None, growth: bool = False, sections: int = 0, measured: bool = False,
        sample: bool = False,
    ) -> Flowed:
        """Advance trajectories by whole mesh periods from phase 0.

        Parameters
        ----------
        w : (d, L)
            Coordinates at the start.
        periods : int or (L,)
            Mesh periods to advance, the same for all trajectories or each its own.
        points : (L,), optional
            Parameter point of each trajectory; by default trajectory i runs at point i.
        tangent : (K, d, L), optional
            Tangent vectors to advance with the states.
        growth : bool
            Orthonormalise the tangent vectors on the way and record the logarithms of their growth. Without it
            unit vectors come back as the columns of the monodromy matrix.
        sections : int
            After how many of each trajectory's last periods its state is recorded.
        measured, sample : bool
            Integrate the measures; record the state at the sampled instants.

        Raises
        ------
        StoppedError
            If the computation is cancelled, see `cancel_event`.
        """
        lanes = w.shape[1]
        points = np.arange(lanes) if points is None else np.asarray(points)
        ends = np.broadcast_to(np.asarray(periods, dtype=np.int64), lanes).copy()  # kernels know no read-only arrays
        tangent = np.zeros((0, self.dimension, lanes)) if tangent is None else tangent
        out = self._empty(w, ends, tangent, growth, sections, measured, sample)
        self._run(Call(
            self._packs(points, ends), ends, points.astype(np.int64), out.w, out.tangent,
            out.growth, out.sections, out.measures, out.samples, out.status,
        ))
        return out

    def _empty(
        self, w: np.ndarray, periods: np.ndarray, tangent: np.ndarray, growth: bool, sections: int, measured: bool,
        sample: bool,
    ) -> Flowed:
        """Results before the first step."""
        (d, lanes), k, longest = w.shape, len(tangent), int(periods.max(initial=0))
        recorded = np.empty((min(sections, longest), d, lanes))
        recorded[:, :, periods < len(recorded)] = np.nan
        return Flowed(
            w=np.array(w, order="C", dtype=float), tangent=np.array(tangent, order="C", dtype=float),
            growth=np.zeros((longest if growth else 0, k, lanes)),
            sections=recorded,
            measures=empty_measures(lanes) if measured else np.empty((0, lanes)),
            samples=np.zeros((longest if sample else 0, self._samples, d + 1, lanes)),
            status=np.zeros(lanes, dtype=np.int64),
        )

    def _packs(self, points: np.ndarray, periods: np.ndarray) -> np.ndarray:
        """Trajectories that share a grid in packs (C, WIDTH), -1 where a pack has none; packs with most steps first."""
        order = np.lexsort((-periods, self._grid[points]))
        order = order[periods[order] > 0]
        grid = self._grid[points[order]]
        lanes = np.bincount(grid, minlength=1)
        packs = -(-lanes // WIDTH)
        unused = WIDTH * (np.cumsum(packs) - packs) - (np.cumsum(lanes) - lanes)  # positions in packs of other grids
        out = np.full((int(packs.sum()), WIDTH), -1)
        out.flat[np.arange(len(order)) + unused[grid]] = order
        steps = periods[out[:, 0]] * self.step_count[points[out[:, 0]]]
        return out[np.argsort(-steps, kind="stable")]

    def _run(self, call: Call) -> None:
        """Have all packs of a call advanced, unless it is cancelled."""
        if len(call.packs) == 0:
            return
        points, measuring, dims = self._points, len(call.measures) > 0, (0,) * self.dimension
        count = min(SLOTS, len(call.packs))
        saved = points.harmonics.point_rows if measuring else 0
        lanes = new_lanes(self.dimension, len(call.tangent), points.table.shape[2], self._matrix_sets, count, saved)
        slots, work = new_slots(count), new_workspace(points.harmonics)
        raise_if_cancelled()
        while advance_packs(dims, points, call, lanes, slots, work, measuring, _TICKS):
            raise_if_cancelled()
