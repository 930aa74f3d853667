"""The seam between studies and flow: points, states and a plan in; arrays and a status per trajectory out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import measure, stop, tables
from gearchaos.flow.layout import BLOCK, Lanes, Nodes, chunk, row_length
from gearchaos.flow.period import advance_block
from gearchaos.switched import SwitchedAffine

_MOST_SLOTS = 2
"""So many pieces of the period keep their matrices at hand for all lanes: the two levels of the stiffness."""


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


@dataclass(frozen=True)
class _Group:
    """Points that share their steps."""

    phys: np.ndarray
    nodes: Nodes
    table: np.ndarray
    kept: int
    stride: int


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
        Steps that the flow makes in a mesh period at each point, unless there are samples.
    """

    def __init__(self, system: SwitchedAffine, samples: int = 0) -> None:
        self.system = system
        self.dimension = system.dimension
        counts = tables.node_count(system)
        self.node_count = counts.sum(axis=1)
        self.sample_at = np.zeros(0, dtype=np.int64)
        plans, plan = np.unique(np.column_stack([counts, tables.runs(system)]), axis=0, return_inverse=True)
        self._plan, self._place = plan.ravel(), np.zeros(system.points, dtype=np.int64)
        self._groups = []
        for i, (first, second, runs) in enumerate(plans.tolist()):
            members = np.flatnonzero(self._plan == i)
            self._place[members] = np.arange(len(members))
            self._groups.append(self._group(system.take(members), first, second, runs, samples))

    def _group(self, system: SwitchedAffine, first: int, second: int, runs: int, samples: int) -> _Group:
        split = system.split[:1] if system.one_split else system.split
        if samples:
            if not system.one_split:
                raise ValueError("samples need one contact ratio for all points")
            length, start, self.sample_at = tables.sampled(first + second, float(split[0]), samples)
        else:
            length, start = tables.two_lengths(first, second, split)
        node = tables.nodes(system, length, start)
        phys = tables.parameter_array(system)
        table, kept = tables.tabulate(system, phys, node)
        return _Group(phys, node, table, kept, max(1, len(length) // runs))

    @property
    def harmonics(self) -> tuple[int, int]:
        return self.system.f_cos.shape[1], self.system.chi_cos.shape[1]

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
        ends = np.broadcast_to(np.asarray(periods, dtype=np.int64), lanes)
        tangent = np.zeros((0, self.dimension, lanes)) if tangent is None else tangent
        out = self._empty(lanes, int(ends.max(initial=0)), len(tangent), growth, sections, measured, sample)
        plan = self._plan[points]
        for i in np.unique(plan):
            mine = np.flatnonzero(plan == i)
            mine = mine[np.argsort(-ends[mine], kind="stable")]
            blocks = -(-len(mine) // BLOCK)  # all about as full, since a few lanes cost as much as many
            for block in np.array_split(mine, blocks):
                stop.check()
                self._block(self._groups[i], block, points, w, tangent, ends, out)
        return out

    def _empty(
        self, lanes: int, periods: int, k: int, growth: bool, sections: int, measured: bool, sample: bool
    ) -> Flowed:
        d = self.dimension
        return Flowed(
            w=np.empty((d, lanes)), tangent=np.empty((k, d, lanes)),
            growth=np.zeros((periods if growth else 0, k, lanes)),
            sections=np.full((min(sections, periods), d, lanes), np.nan),
            measures=measure.empty(lanes) if measured else np.empty((0, lanes)),
            samples=np.empty((periods if sample else 0, len(self.sample_at), d + 1, lanes)),
            status=np.zeros(lanes, dtype=np.int64),
        )

    def _block(
        self, group: _Group, mine: np.ndarray, points: np.ndarray, w: np.ndarray, tangent: np.ndarray,
        ends: np.ndarray, out: Flowed,
    ) -> None:
        """Run one block of lanes and put its results in their places."""
        d, n, k = self.dimension, len(mine), len(tangent)
        width = row_length(n)
        lanes = Lanes(
            np.zeros(width, np.int64), np.zeros(width), np.zeros((2, d, width)), np.zeros((2, k, d, width)),
            np.zeros(width, np.int64), measure.empty(width),
        )
        lanes.point[:n] = self._place[points[mine]]
        lanes.w[0, :, :n] = w[:, mine]
        lanes.v[0, :, :, :n] = tangent[:, :, mine]
        w_end, v_end, growth = np.empty((d, n)), np.empty((k, d, n)), np.zeros((len(out.growth), k, n))
        sections = np.full((len(out.sections), d, n), np.nan)
        samples = np.zeros((len(out.samples), out.samples.shape[1], d + 1, n))
        slots = group.table.shape[1] if group.table.shape[1] <= _MOST_SLOTS else 1
        active, bounds = np.zeros((slots, group.table.shape[3], width)), np.zeros((slots, d, width))
        h, k = self.harmonics
        measured = out.measures.shape[0] > 0
        advance_block(
            (0,) * d, group.phys, h, k, group.nodes, group.table, group.kept, lanes, chunk(d, h, k), active,
            np.full((slots, width), np.nan), bounds, np.zeros(width), ends[mine], measured,
            group.stride if len(growth) else 0, w_end, v_end, growth, sections, samples,
            self.sample_at if len(samples) else np.zeros(0, np.int64),
        )
        out.w[:, mine] = w_end
        out.tangent[:, :, mine] = v_end
        out.status[mine] = lanes.status[:n]
        out.growth[:, :, mine] = growth
        out.sections[:, :, mine] = sections
        out.samples[:, :, :, mine] = samples
        if measured:
            out.measures[:, mine] = lanes.measures[:, :n]
