"""The seam between studies and flow: points, states and a plan in; arrays and a status per trajectory out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import layout, measure, stop
from gearchaos.flow.course import lay_out
from gearchaos.flow.layout import SEATS, WIDTH, Call
from gearchaos.flow.period import advance_block
from gearchaos.model.switched import SwitchedAffine

_MOST_SLOTS = 2
"""So many pieces of the period keep their matrices at hand for all lanes: the two levels of the stiffness."""

_AT_ONE_GO = 20_000
"""Steps after which the kernels look up whether anybody still waits for them: a few hundredths of a second."""


@dataclass(frozen=True)
class Flowed:
    """What became of L trajectories over whole mesh periods.

    Attributes
    ----------
    w : (d, L)
        Final coordinates.
    tangent : (K, d, L)
        Final tangent vectors.
    growth : (periods, K, L)
        Logarithms of the growth of orthonormalised tangent vectors in each period; 0 once a lane has had its periods.
    sections : (S, d, L)
        Coordinates after each trajectory's last S periods; NaN before its first.
    measures : (MEASURES, L)
        Rows as numbered in `flow.layout`; empty if not asked for.
    samples : (periods, samples, d + 1, L)
        Coordinates and contact state at the sample nodes; empty if not asked for.
    status : (L,)
        OK, DIVERGED or CHATTER of `flow.layout`.
    """

    w: np.ndarray
    tangent: np.ndarray
    growth: np.ndarray
    sections: np.ndarray
    measures: np.ndarray
    samples: np.ndarray
    status: np.ndarray


class ExactFlow:
    """The exact flow of a batch of switched affine systems; tables are built once and serve any number of calls.

    Parameters
    ----------
    system : SwitchedAffine
        P parameter points with d coordinates.
    samples : int, optional
        Make this many equidistant instants of the period available to ``advance(sample=True)``; then every step has
        its own matrices, so leave it out for speed.

    Attributes
    ----------
    node_count : (P,)
        Steps that the flow makes in a mesh period at each point.
    """

    def __init__(self, system: SwitchedAffine, samples: int = 0) -> None:
        self.system = system
        self.dimension = system.dimension
        (self._points, self._plan), self._samples = lay_out(system, samples), samples
        self.node_count = self._points.courses.steps
        pieces = int(self._points.nodes.piece.max()) + 1
        self._slots = pieces if pieces <= _MOST_SLOTS else 1

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
            Tangent vectors to carry along.
        growth : bool
            Orthonormalise the tangent vectors on the way and record the logarithms of their growth. Without it
            unit vectors come back as the columns of the monodromy matrix.
        sections : int
            How many of each trajectory's last periods to record the state after.
        measured, sample : bool
            Integrate the measures; record the state at the sample nodes.

        Raises
        ------
        StoppedError
            If ``flow.stop.asked`` says so.
        """
        lanes = w.shape[1]
        points = np.arange(lanes) if points is None else np.asarray(points)
        ends = np.broadcast_to(np.asarray(periods, dtype=np.int64), lanes).copy()  # kernels know no read-only arrays
        tangent = np.zeros((0, self.dimension, lanes)) if tangent is None else tangent
        out = self._empty(w, ends, tangent, growth, sections, measured, sample)
        self._run(Call(
            self._chunks(points, ends), ends, points.astype(np.int64), out.w, out.tangent,
            out.growth, out.sections, out.measures, out.samples, out.status,
        ))
        return out

    def _empty(
        self, w: np.ndarray, ends: np.ndarray, tangent: np.ndarray, growth: bool, sections: int, measured: bool,
        sample: bool,
    ) -> Flowed:
        (d, lanes), k, periods = w.shape, len(tangent), int(ends.max(initial=0))
        kept = np.empty((min(sections, periods), d, lanes))
        kept[:, :, ends < len(kept)] = np.nan
        return Flowed(
            w=np.array(w, order="C", dtype=float), tangent=np.array(tangent, order="C", dtype=float),
            growth=np.zeros((periods if growth else 0, k, lanes)),
            sections=kept,
            measures=measure.empty(lanes) if measured else np.empty((0, lanes)),
            samples=np.zeros((periods if sample else 0, self._samples, d + 1, lanes)),
            status=np.zeros(lanes, dtype=np.int64),
        )

    def _chunks(self, points: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Lanes that share their steps side by side, (C, WIDTH), -1 where there is none; the longest work first."""
        order = np.lexsort((-ends, self._plan[points]))
        order = order[ends[order] > 0]
        plan = self._plan[points[order]]
        lanes = np.bincount(plan, minlength=1)
        chunks = -(-lanes // WIDTH)
        before = WIDTH * (np.cumsum(chunks) - chunks) - (np.cumsum(lanes) - lanes)  # places left free by other plans
        who = np.full((int(chunks.sum()), WIDTH), -1)
        who.flat[np.arange(len(order)) + before[plan]] = order
        steps = ends[who[:, 0]] * self.node_count[points[who[:, 0]]]
        return who[np.argsort(-steps, kind="stable")]

    def _run(self, call: Call) -> None:
        """Have all chunks of a call advanced, as long as anybody waits for it."""
        if len(call.who) == 0:
            return
        d, points = self.dimension, self._points
        count, measuring = min(SEATS, len(call.who)), len(call.measures) > 0
        kept = layout.kept_rows(d, points.h, points.k) if measuring else 0
        lanes = layout.lanes(d, len(call.v), points.table.shape[2], self._slots, count, kept)
        seats, work = layout.seats(count), layout.chunk(d, points.h, points.k)
        stop.check()
        while advance_block((0,) * d, points, call, lanes, seats, work, measuring, _AT_ONE_GO):
            stop.check()
