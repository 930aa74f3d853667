"""`ExactFlow`: advance batches of trajectories by whole mesh periods, and return their states and measures as arrays.

The measures: how they begin, and how those of parts of motions are combined to those of whole ones.
"""

from __future__ import annotations

import threading
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from gearchaos.flow.contact_tables import MEMORY, contact_dimensions, prepare_contacts
from gearchaos.flow.kernels.many_contacts.contact_arrays import new_contact_work
from gearchaos.flow.kernels.many_contacts.contact_motion import advance_contact_sets
from gearchaos.flow.kernels.many_contacts.contact_shares import contact_shares
from gearchaos.flow.kernels.one_spring.advance import advance_packs
from gearchaos.flow.kernels.vector.arrays import Call, dimensions, new_lanes, new_slots, new_workspace
from gearchaos.flow.kernels.vector.constants import SLOTS, WIDTH
from gearchaos.flow.kernels.vector.measure import FIRST, Measure
from gearchaos.flow.parallel_compilation import compile_others
from gearchaos.flow.step_tables import prepare_points
from gearchaos.flow.system import SwitchedSystem, contact_states

cancel_event: ContextVar[threading.Event | None] = ContextVar("cancel_event", default=None)
"""The event that cancels computations of the flow in the current context.

Set the variable in the context in which the computation runs. The computation raises `StoppedError` some hundredths of
a second after the event is set. If the variable is None, it cannot be cancelled.
"""


class StoppedError(Exception):
    """The computation was cancelled through `cancel_event`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import threading
    >>> from gearchaos.flow import StoppedError, cancel_event
    >>> event = threading.Event()
    >>> token = cancel_event.set(event)
    >>> event.set()
    >>> try:
    ...     gc.simulate(gc.MeshModel.of(q0=0.1), periods=100)
    ... except StoppedError:
    ...     print("stopped")
    stopped
    >>> cancel_event.reset(token)
    """


def raise_if_cancelled() -> None:
    """Raise `StoppedError` if the event of the current context is set."""
    event = cancel_event.get()
    if event is not None and event.is_set():
        raise StoppedError


def empty_measures(system: SwitchedSystem, w: np.ndarray) -> np.ndarray:
    """The measures (K len(Measure), L) of motions that are in the states w (d, L), before their first step."""
    displacements = w[:1]
    if (several := system.contacts) is not None:  # in one order for any number of motions, as no matrix product is
        displacements = sum(row[:, None] * x for row, x in zip(several.rows.T, w, strict=True))
    out = np.empty((len(displacements), len(Measure), w.shape[1]))
    for measure in Measure:
        out[:, measure] = FIRST[measure.combined]
    out[:, Measure.Z_REFERENCE] = displacements
    return out.reshape(len(displacements) * len(Measure), w.shape[1])


def of_meshes(measures: np.ndarray) -> np.ndarray:
    """Measures by mesh.

    Parameters
    ----------
    measures : (K len(Measure), L)
        Those of L motions of a system with K meshes.

    Returns
    -------
    (K, len(Measure), L)

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import Measure, of_meshes
    >>> of_meshes(np.zeros((2 * len(Measure), 3))).shape[::2]
    (2, 3)
    """
    return measures.reshape(len(measures) // len(Measure), len(Measure), measures.shape[1])


def combine_measures(measures: np.ndarray, duration: np.ndarray, first: np.ndarray) -> np.ndarray:
    """The measures of motions from those of their parts.

    The integrals of z are shifted to the reference of the first part, as in the parallel computation of a variance
    (T. F. Chan, G. H. Golub, R. J. LeVeque, *Algorithms for computing the sample variance*, Am. Stat. 37 (1983) 242).

    Parameters
    ----------
    measures : (K len(Measure), P)
        Measures of the P parts, those of a motion one after the other.
    duration : (P,)
        Duration of each part in units of τ.
    first : (N,)
        Index of the first part of each of N motions.

    Returns
    -------
    (K len(Measure), N)

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> from gearchaos.flow import Measure, combine_measures
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> flow = problem.flow
    >>> first = flow.advance(problem.w, periods=4, measured=True)
    >>> second = flow.advance(first.w, periods=6, measured=True)
    >>> parts = np.hstack([first.measures, second.measures])
    >>> both = combine_measures(parts, np.array([4, 6]) * flow.system.period, np.array([0]))
    >>> both[Measure.SWITCHES].tolist()
    [18.0]
    """
    out = []
    for part in of_meshes(measures):
        reference = part[Measure.Z_REFERENCE]
        common = np.repeat(reference[first], np.diff(first, append=len(reference)))
        shift, about = reference - common, part.copy()
        about[Measure.Z] += shift * duration
        about[Measure.Z_SQUARE] += shift * (2 * part[Measure.Z] + shift * duration)
        about[Measure.Z_REFERENCE] = common
        out += [measure.combined.reduceat(about[measure], first) for measure in Measure]
    return np.stack(out)


_CACHE = 2 << 20
"""Bytes of step matrices that the packs advanced together may use, if there are at least `_MIN_SLOTS` of them: a part
of the last-level cache. Where contact states change often, matrices that do not fit took up to five times as long."""

_MIN_SLOTS = 4  # fewest packs that are advanced together

_MAX_BUFFER_BYTES = 4 << 20
"""Most bytes of the matrix buffers of one pack; where a buffer for each entry would take more, there is one."""

_STEPS_BETWEEN_CANCEL_CHECKS = 20_000
"""Steps of all trajectories between two checks for cancellation: a few hundredths of a second."""

System = TypeVar("System", bound=SwitchedSystem)


@dataclass(frozen=True)
class FlowResult:
    """Results for L trajectories over whole mesh periods.

    Attributes
    ----------
    w : (d, L)
        Final coordinates.
    tangent : (K, d, L)
        Final tangent vectors.
    growth : (periods, K, L)
        Logarithms of the growth of orthonormalised tangent vectors in each period; 0 after a trajectory's last period.
        Empty if not requested.
    sections : (S, d, L)
        Coordinates after each of a trajectory's last S periods; NaN for periods before its start.
    measures : (K len(Measure), L)
        Rows as numbered by `Measure`, of the first of K meshes, then of the next; empty if not requested.
    samples : (periods, samples, d + 1, L)
        Coordinates and contact state at the sampled instants; empty if not requested.
    status : (L,)
        `OK`, `DIVERGED` (|z| or |z'| was `DIVERGED_AT` or more, or not a number, at the end of a period) or `CHATTER`
        (64 contact switches in a step, or an exit not found: the state from there on is meaningless).

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = problem.flow.advance(problem.w, periods=10, sections=4)
    >>> result.sections.shape
    (4, 2, 1)
    """

    w: np.ndarray
    tangent: np.ndarray
    growth: np.ndarray
    sections: np.ndarray
    measures: np.ndarray
    samples: np.ndarray
    status: np.ndarray


class ExactFlow(Generic[System]):
    """The exact flow of a batch of switched affine systems.

    Step tables are built once, when an instance is made; `advance` can then be called any number of times.

    Parameters
    ----------
    system : SwitchedSystem
        P parameter points with d coordinates.
    samples : int, optional
        Number of equidistant instants of the period at which ``advance(sample=True)`` records the state; 0 for none.
        With samples every step needs its own matrices, which is slower.

    Attributes
    ----------
    system : SwitchedSystem
        The system given.
    dimension : int
        Number of coordinates d.
    step_count : (P,)
        Number of steps in a mesh period at each point.

    Raises
    ------
    ValueError
        If ``samples`` > 0 and ``system.starts`` are not the same at all points.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = problem.flow.advance(problem.w, periods=10)
    >>> result.w.shape, result.status.tolist()
    ((2, 1), [0])
    """

    def __init__(self, system: System, samples: int = 0) -> None:
        self.system = system
        self.dimension = system.dimension
        self._samples = samples
        if system.contacts is not None:
            self._contacts, self._tables = prepare_contacts(system, samples)
            self._lock = threading.Lock()  # the tables are filled while trajectories are advanced
            self.step_count = self._contacts.counts.sum(axis=1)
            return
        compile_others(system)
        self._points, self._grid = prepare_points(system, samples)
        self.step_count = self._points.grids.step_count
        self._entries = int(self._points.steps.entry.max()) + 1

    def advance(self, w: np.ndarray, periods: int | np.ndarray, *, points: np.ndarray | None = None,
                tangent: np.ndarray | None = None, growth: bool = False, sections: int = 0, measured: bool = False,
                sample: bool = False) -> FlowResult:
        """Advance trajectories by whole mesh periods from phase 0.

        Parameters
        ----------
        w : (d, L)
            Coordinates at the start.
        periods : int or (L,)
            Mesh periods to advance: one number for all trajectories, or one for each.
        points : (L,), optional
            Index of the parameter point of each trajectory; by default trajectory i has point i.
        tangent : (K, d, L), optional
            Tangent vectors to advance with the states.
        growth : bool
            Orthonormalise the tangent vectors as they are advanced, and record the logarithms of their growth. If
            false, unit vectors are advanced to the columns of the monodromy matrix.
        sections : int
            Number S of last periods of each trajectory after which its state is recorded.
        measured, sample : bool
            Whether to integrate the measures, and to record the state at the sampled instants.

        Returns
        -------
        FlowResult
            New arrays; the arguments are not changed.

        Raises
        ------
        StoppedError
            If the computation is cancelled, see `cancel_event`.
        """
        count = w.shape[1]
        points = np.arange(count) if points is None else np.asarray(points)
        ends = np.broadcast_to(np.asarray(periods, dtype=np.int64), count).copy()  # kernels take writable arrays only
        tangent = np.zeros((0, self.dimension, count)) if tangent is None else tangent
        longest = int(ends.max(initial=0))
        recorded = np.empty((min(sections, longest), self.dimension, count))
        recorded[:, :, ends < len(recorded)] = np.nan
        out = FlowResult(
            w=np.array(w, order="C", dtype=float), tangent=np.array(tangent, order="C", dtype=float),
            growth=np.zeros((longest if growth else 0, len(tangent), count)),
            sections=recorded,
            measures=empty_measures(self.system, w) if measured else np.empty((0, count)),
            samples=np.zeros((longest if sample else 0, self._samples, self.dimension + 1, count)),
            status=np.zeros(count, dtype=np.int64),
        )
        several = self.system.contacts is not None
        call = Call(
            np.zeros((0, WIDTH), np.int64) if several else self._packs(points, ends), ends, points.astype(np.int64),
            out.w, out.tangent, out.growth, out.sections, out.measures, out.samples, out.status,
            contact_states(self.system, out.w, points))
        (self._run_with_sets if several else self._run)(call)
        return out

    @property
    def points_kept(self) -> int | None:
        """Parameter points like the first one whose tables are kept from call to call; None where all are."""
        if self.system.contacts is None:
            return None
        return max(1, MEMORY // sum(array[0].nbytes for array in self._tables))

    def _run_with_sets(self, call: Call) -> None:
        """Advance the trajectories of a call where there are several contacts, those of a point in turn."""
        with self._lock:
            raise_if_cancelled()
            dims, points = contact_dimensions(self.system), self._contacts
            order = np.argsort(call.points, kind="stable")
            work = new_contact_work(points, len(call.tangent))
            while advance_contact_sets(dims, points, call, order, self._tables, work, len(call.measures) > 0,
                                       _STEPS_BETWEEN_CANCEL_CHECKS):
                raise_if_cancelled()

    @property
    def leaps_in_contact(self) -> bool:
        """Whether contact far from its end is followed in leaps of many steps."""
        return self.system.contacts is not None and self._tables.leap_closed.shape[1] > 0

    def contact_shares(self, w: np.ndarray, vectors: np.ndarray, point: int) -> np.ndarray | None:
        """How much of the distance to another change of contact small differences from a motion use in a period.

        Parameters
        ----------
        w : (d,)
            Coordinates at the start of the motion.
        vectors : (C, d)
            Differences from it at the start.
        point : int
            The parameter point.

        Returns
        -------
        (C,) or None
            The largest share of each, at any mesh and instant. Differences with sizes whose sum with these weights is
            below 1 change no contact but where the motion does. None where a contact may change in the motion itself
            amid a piece of the period. For systems with `leaps_in_contact`.
        """
        with self._lock:
            points, shares, moving = self._contacts, np.zeros(len(vectors)), np.array(vectors, order="C")
            work = new_contact_work(points, 0)
            work.w[:] = w
            found = contact_shares(
                contact_dimensions(self.system), points, point, self._tables, work, moving, moving.copy(), shares)
        return shares if found else None

    def _packs(self, points: np.ndarray, periods: np.ndarray) -> np.ndarray:
        """Group trajectories with the same step grid into packs: indices (C, WIDTH), -1 for unused positions.

        Packs with the most steps come first.
        """
        order = np.lexsort((-periods, self._grid[points]))
        order = order[periods[order] > 0]
        grid = self._grid[points[order]]
        members = np.bincount(grid, minlength=1)  # trajectories of each grid
        packs = -(-members // WIDTH)
        unused = WIDTH * (np.cumsum(packs) - packs) - (np.cumsum(members) - members)  # positions in other packs
        out = np.full((int(packs.sum()), WIDTH), -1)
        out.flat[np.arange(len(order)) + unused[grid]] = order
        steps = periods[out[:, 0]] * self.step_count[points[out[:, 0]]]
        return out[np.argsort(-steps, kind="stable")]

    def _run(self, call: Call) -> None:
        """Advance all packs of a call; raise `StoppedError` if the computation is cancelled."""
        if len(call.packs) == 0:
            return
        points, measuring = self._points, len(call.measures) > 0
        dims = dimensions(self.dimension, self.system.law.name)
        buffer = 8 * WIDTH * (self.dimension + points.table.shape[2])  # bytes: matrices and bounds of `WIDTH` lanes
        # With one buffer for each entry of the step tables, matrices are loaded again only for trajectories whose
        # contact state differs from that at the same entry one period ago. In a single period that saves nothing.
        all_fit = self._entries * buffer <= _MAX_BUFFER_BYTES
        buffers = self._entries if int(call.periods.max()) > 1 and all_fit else 1
        tables = WIDTH * self._entries * points.table[0].nbytes
        count = min(max(_MIN_SLOTS, min(SLOTS, _CACHE // (buffers * buffer + tables))), len(call.packs))
        saved = points.harmonics.point_rows if measuring else 0
        lanes = new_lanes(self.dimension, len(call.tangent), points.table.shape[2], buffers, count, saved)
        slots, work = new_slots(count), new_workspace(points.harmonics.rows.total)
        raise_if_cancelled()
        while advance_packs(dims, points, call, lanes, slots, work, measuring, _STEPS_BETWEEN_CANCEL_CHECKS):
            raise_if_cancelled()
