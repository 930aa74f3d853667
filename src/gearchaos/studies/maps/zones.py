"""Maps of the kind of motion over two parameters, as in figures 2, 5, 10 and 11 of the paper.

Zones are the regions of such a map with one kind of motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import flag_attributes
from gearchaos.dynamics import ON_ATTRACTOR, Verdicts
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.execute import tiles
from gearchaos.execute.machine import check_memory
from gearchaos.flow import WIDTH, ExactFlow
from gearchaos.gears.operation.operating import gears_of
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.axis import Axis, at_cells, check_plane, corners, shared_coordinates
from gearchaos.studies.core.cost import Cost, estimate
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import (
    PERIODS_PER_VALUE,
    Motions,
    initial_value_problems,
    swept_initial_values,
)
from gearchaos.studies.core.options import axis_option, option
from gearchaos.studies.core.study import ClassifyingStudy, Results
from gearchaos.studies.maps.cells_to_avoid import TO_AVOID, force_and_signature, to_avoid
from gearchaos.studies.maps.refine import SIDE, refined
from gearchaos.studies.motion.batch_classification import SAME_CENTRE, InitialStates, classify_batch, signature
from gearchaos.studies.operation.load_change import CHANGE, LOAD_CHANGES, REVERSAL, LoadChange
from gearchaos.studies.proofs.proofs import check_can_prove
from gearchaos.studies.proofs.proved_cells import certificate_files, check_folder, mark_inferred, orbit_points, proofs

if TYPE_CHECKING:
    import xarray as xr

_REFINED = 8  # the refinement that is proposed for a map that takes long
_COMPUTED_SHARE = 0.74
"""Rough estimate of the share of the cells of a lattice that are computed of one twice as fine."""

_LEAST_ROWS = 4 * WIDTH  # of the part by which a map with several starts is tried: few motions side by side take long

_NO_CONTACT = CONTACTS.index("none")


@dataclass(frozen=True)
class Zones(ClassifyingStudy):
    """Map the kinds of motion over two parameters.

    Returns
    -------
    xarray.Dataset
        With dims (y.name, x.name): label, period, reason, largest Lyapunov exponent with its interval, residual and
        largest multiplier of the orbit, response measures, contact, periods spent. With more than one start also the
        number of ``attractors`` found in each cell, ``v_rms_least`` and ``v_rms_most`` among them, ``contact_worst``,
        ``v_rms_up`` and ``v_rms_down`` after the sweeps, and ``hysteresis``: 1 where the two sweeps end in different
        motions. Of given gears, unless ``wide``, then also ``to_avoid``, what happens where the teeth separate, in
        operation or after a load change alone, and ``share_of_load_changes``, after which they do, with its interval.
        With ``prove`` also ``proved``: 1 where the motion is proved, 0 where it is not, -1 where it is not
        periodic; and ``proof_reason``, why it is not proved. Inferred cells are not proved.

    Raises
    ------
    InputError
        If an axis or an option is wrong, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> zones.label.dims, zones.label.shape
    (('eps1', 'omega'), (16, 24))
    >>> zones.v_rms.attrs["units"]
    'delta*omega0'

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1, eps1=0.1), "omega=0.9:1.1:4", "eps1=0.1:0.2:4")
    >>> study.kind, study.count
    ('zones', 16)
    """

    kind: ClassVar[str] = "zones"
    rank: ClassVar[int] = 5
    gridded: ClassVar[bool] = True
    needs_out: ClassVar[bool] = True
    variables: ClassVar[tuple[str, ...]] = ("label", "period", "contact")
    summary: ClassVar[str] = "map"
    model_words: ClassVar[str] = "All parameters but the two of the axes; its initial values hold in every cell."

    x: Axis = axis_option('A parameter, or an initial value, and its range, as a text "omega=0.2:3:400".')
    y: Axis = axis_option("Another one.")
    starts: int = option(
        1, "Number of initial states in each cell, to find all its motions. They are those of the model, and others "
        "spread as by `attractors`, of given gears those after a load change. With more than one, the motions after "
        "slow sweeps along x, upwards and downwards, are also found.", least=1)
    load_change: float = option(
        REVERSAL.ratio, f"{CHANGE} The further initial states of given gears are those after it.", rule=LOAD_CHANGES,
        metavar="LAMBDA")
    wide: bool = option(
        False, "Of given gears too, look at wide ranges of states, which no load stores.")
    refine: int = option(
        1, "Every N-th row and column; more cells only where neighbours differ. N is a power of two; the other cells "
        "are inferred, and marked by ``inferred`` and ``reason``. 1 computes every cell.", least=1, metavar="N")
    prove: bool = option(
        False, "Prove the periodic motions in ball arithmetic. See `prove`; with more than one start, the motion from "
        "the initial values of the model is proved in each computed cell.")
    certificates: str | None = option(
        None, "Write a certificate for each proved cell to this folder. The files are ``row0003/column0012.json``, "
        "with the script that verifies them. It needs ``prove``.", metavar="DIR")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_plane(self.model, self.x, self.y)
        check_memory("cells of a row times starts", self.x.count * self.starts)
        if self.starts > 1 and {self.x.name, self.y.name} & set(self.model.state_names):
            raise InputError("starts", "must be 1 where an axis is an initial value", self.starts)
        if gears_of(self.model) is None and (self.wide or self.load_change != REVERSAL.ratio):
            name = "wide" if self.wide else "load_change"
            raise InputError(name, "needs gears", getattr(self, name),
                             "A dimensionless model is looked at from wide ranges of states: leave it out.")
        if self.wide and self.load_change != REVERSAL.ratio:
            raise InputError("load_change", "must be left out with wide", self.load_change)
        if self.starts == 1 and (self.wide or self.load_change != REVERSAL.ratio):
            raise InputError("starts", "must be at least 2 for states after a load change, or wide ones", self.starts)
        if self.refine > SIDE // 2 or self.refine & (self.refine - 1):
            raise InputError("refine", f"must be a power of two, at most {SIDE // 2}", self.refine)
        if self.refine > 1 and self.starts > 1:
            raise InputError("refine", "must be 1 where there is more than one start", self.refine)
        if self.prove:
            check_can_prove(self.model)
        check_folder(self.certificates, self.prove)
        _ = self.cost

    @property
    def block(self) -> dict[str, int]:
        if self.refine > 1:
            return {self.y.name: min(SIDE, self.y.count), self.x.name: min(SIDE, self.x.count)}
        return {self.y.name: 1, self.x.name: self.x.count if self.starts > 1 else 1}

    @property
    def motions_per_item(self) -> float:
        if self.refine > 1:
            return _COMPUTED_SHARE ** math.log2(self.refine)
        return self.starts + 2 if self.starts > 1 else 1  # the two sweeps add one motion each

    @cached_property
    def cost(self) -> Cost:
        """Bound for all cells, of a refined map for as many as are usually computed; with several starts also for
        sweeps along all rows, `WIDTH` rows at a time.

        Raises `InputError` if a single row, which one machine computes, cannot end.
        """
        motions, sequential = self.x.count * self.motions_per_item, 0
        if self.starts > 1:
            sequential = 2 * self.x.count * PERIODS_PER_VALUE
        system = switched_system(corners(self.model, self.x, self.y))
        row = estimate(system, math.ceil(motions), self.classification.max_periods, sequential, model=self.model)
        rounds = -(-self.y.count // WIDTH)
        return replace(row, motions=math.ceil(motions * self.y.count), sequential=sequential * rounds)

    def check_in_memory(self) -> None:
        check_memory("cells", self.x.count * self.y.count)
        check_memory("cells times starts", self.x.count * self.y.count * self.starts)
        super().check_in_memory()

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        if self.refine == 1:
            return self._cells(items, progress, threads)
        found = refined(lambda cells: self._cells(cells, progress, threads), items, self.x.count, self.refine)
        if self.prove:
            mark_inferred(found)
        return found

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        dataset = super().finish(found, progress=progress, threads=threads)
        if "to_avoid" in dataset:
            dataset["to_avoid"].attrs.update(flag_attributes(TO_AVOID))
        return dataset

    @property
    def recorded(self) -> dict[str, Any]:
        return {"starts": self.starts, "refine": self.refine, **({"prove": 1} if self.prove else {}),
                **({"load_change": self.load_change} if self.follows_load_changes else {})}

    @property
    def follows_load_changes(self) -> bool:
        """Whether further initial states are those after a load change."""
        return self.starts > 1 and not self.wide and gears_of(self.model) is not None

    def thinned(self, share: float) -> Self:
        """As of every study, without certificates; of a refined map with as many cells in its coarsest lattice, of one
        with several starts with enough rows to follow side by side."""
        spread = replace(super().thinned(share), certificates=None)
        if self.starts > 1:
            rows = min(self.y.count, max(_LEAST_ROWS, spread.y.count))
            spread = replace(spread, y=replace(self.y, count=rows))
        finer = math.log2(self.refine * math.sqrt(spread.count / self.count))
        return replace(spread, refine=2 ** max(0, round(finer)))

    def smaller(self, share: float) -> tuple[str, Self] | None:
        """The same map refined; fewer cells of one that is, or that has several starts."""
        if self.refine == self.starts == 1:
            return f"--refine {_REFINED}", replace(self, refine=_REFINED)
        found = super(Zones, replace(self, refine=1)).smaller(share)
        return found and (found[0], replace(found[1], refine=self.refine))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates of the dynamic state, the same in all cells."""
        return shared_coordinates(self.model, self.x, self.y)

    def initial_states(self, cells: np.ndarray) -> Motions:
        """The motions of the cells with these numbers (L,)."""
        return initial_value_problems(self.model, at_cells(self.x, self.y, cells), self.names)

    def distinguished(self, motions: Motions, found: Verdicts) -> dict[str, np.ndarray]:
        """The variables (L,) by which the motions of a cell are told apart, and judged where load changes are met."""
        if self.follows_load_changes:
            return force_and_signature(motions, found)
        return signature(motions, found)

    def _cells(self, cells: np.ndarray, progress: bool, threads: int | None) -> dict[str, np.ndarray]:
        """Results of cells (N,), which are whole rows if there is more than one start."""
        order = np.arange(len(cells), dtype=cells.dtype)
        if self.x.name in ("omega", "speed"):  # so that neighbours in a tile have equal step counts
            order = np.argsort(cells % self.x.count, kind="stable").astype(cells.dtype)
        most = self.cost.max_parameter_points(threads)

        def collect(_: np.ndarray, motions: Motions, found: Verdicts) -> dict[str, np.ndarray]:
            out = found.variables() | (self.distinguished(motions, found) if self.starts > 1 else {})
            return out | orbit_points(motions, found) if self.prove else out

        out = classify_batch(
            lambda tile: self.initial_states(cells[tile]), collect, order, settings=self.classification,
            largest=most, progress="zones" if progress else None, threads=threads)
        if self.starts > 1:
            out |= _Coexistence(self, cells, order, progress, threads, most).found(out)
            for name in {"centre_z", "centre_z_dot", "deflection"} & out.keys():
                del out[name]
        if self.prove:
            at, orbits = at_cells(self.x, self.y, cells), out.pop("orbit")  # None where the motion is not periodic
            models = [None if orbit is None else self.model.with_values({n: float(v[i]) for n, v in at.items()})
                      for i, orbit in enumerate(orbits)]
            files = certificate_files(self.certificates, cells, self.x.count)
            out |= proofs(models, orbits, files, progress=progress, threads=threads)
        return out


zones = function_of(Zones)


@dataclass(frozen=True)
class _Coexistence:
    """The motions that coexist in the cells (N,) of a map, which are whole rows of constant y, one after another.

    ``order`` (N,) is that of the computation, as positions in ``cells``; see `classify_batch`.
    """

    study: Zones
    cells: np.ndarray
    order: np.ndarray
    progress: bool
    threads: int | None
    largest: int

    def found(self, own: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The variables (N,) that a map with several starts has, from those (N,) of the motions with one.

        The worst contact state is the last one in `CONTACTS` other than "none".
        """
        further, swept = self._from_further_starts(own["dynamic_factor"]), self._from_sweeps()
        motions = {n: np.concatenate([own[n][:, None], further[n], swept[n]], axis=1) for n in swept}
        settled: np.ndarray = np.isin(motions["label"], ON_ATTRACTOR)
        contact = np.where(settled & (motions["contact"] != _NO_CONTACT), motions["contact"], -1).max(axis=1)
        none, v_rms = ~np.any(settled, axis=1), motions["v_rms"]
        up, down = ({n: v[:, i] for n, v in motions.items()} for i in (-2, -1))
        at = self._at(np.arange(len(self.cells)))
        judged = to_avoid(self.study.model, at, motions, slice(1, -2)) if self.study.follows_load_changes else {}
        return {**judged,
            "attractors": _count_distinct(motions, settled),
            "v_rms_least": np.where(none, np.nan, np.where(settled, v_rms, np.inf).min(axis=1)),
            "v_rms_most": np.where(none, np.nan, np.where(settled, v_rms, -np.inf).max(axis=1)),
            "contact_worst": np.where(contact < 0, _NO_CONTACT, contact).astype(np.int8),
            "v_rms_up": up["v_rms"], "v_rms_down": down["v_rms"],
            "hysteresis": (settled[:, -2] & settled[:, -1] & ~_same(up, down)).astype(np.int8),
        }

    def _at(self, position: np.ndarray) -> dict[str, np.ndarray]:
        """The values of both axes, by name, in the cells at these positions."""
        return at_cells(self.study.x, self.study.y, self.cells[position])

    def _from_further_starts(self, factors: np.ndarray) -> dict[str, np.ndarray]:
        """`Zones.distinguished` of the motions from further initial states, the same in all cells, or after load
        changes from motions with dynamic factors (N,); arrays (N, starts)."""
        study, model, starts, drawn = self.study, self.study.model, self.study.starts - 1, None
        if study.follows_load_changes:  # states (d, N starts), those of each row drawn for itself
            rows = np.arange(len(self.cells)).reshape(-1, study.x.count)
            drawn = np.concatenate([LoadChange(study.load_change)(
                model, self._at(row), factors[row], starts, (int(self.cells[row[0]]) // study.x.count,), study.names)
                for row in rows], axis=1)
        conditions = spread(default_box(model), starts, 0)
        # the single model accepts only one of z and x1 as initial displacement, so the model's own is dropped
        base = replace(model, initial={}) if model.kind == "single" else model

        def initial_states(number: np.ndarray) -> Motions:
            position, condition = np.divmod(number, starts)
            positions, points = np.unique(position, return_inverse=True)
            flow = ExactFlow(switched_system(vary(model, self._at(positions)), self.study.names))
            if drawn is not None:
                return Motions(flow, drawn[:, number], points)
            batch = vary(base, self._at(position) | {n: v[condition] for n, v in conditions.items()})
            return Motions(flow, initial_state(batch, flow.system).T.copy(), points)

        numbers = (self.order[:, None].astype(np.int64) * starts + np.arange(starts)).ravel()
        return {n: v.reshape(-1, starts) for n, v in self._classified(initial_states, numbers, "more starts").items()}

    def _from_sweeps(self) -> dict[str, np.ndarray]:
        """`Zones.distinguished` of the motions after slow sweeps along x, upwards and downwards; arrays (N, 2)."""
        x, y, swept = self.study.x, self.study.y, []
        values = y.values[self.cells[:: x.count] // x.count]
        for upwards in (True, False):
            def sweep(rows: slice, upwards: bool = upwards) -> dict[str, np.ndarray]:
                return swept_initial_values(self.study.model, x, upwards, {y.name: values[rows]})

            found = dict[str, np.ndarray]()
            for rows, reached in tiles.run(
                sweep, tiles.split(len(values), self.largest), threads=self.threads,
                progress=f"sweeps {'up' if upwards else 'down'}" if self.progress else None,
            ):
                for name, value in reached.items():
                    found.setdefault(name, np.empty((len(values), x.count)))[rows] = value
            swept.append({n: v.ravel() for n, v in found.items()})
        (up, down), base, count = swept, replace(self.study.model, initial={}), len(self.cells)

        def initial_states(number: np.ndarray) -> Motions:
            direction, position = np.divmod(number, count)
            initial = {n: np.where(direction == 0, up[n][position], down[n][position]) for n in up}
            return initial_value_problems(base, self._at(position) | initial, self.study.names)

        numbers = np.concatenate([self.order, self.order.astype(np.int64) + count])
        return {n: v.reshape(2, -1).T for n, v in self._classified(initial_states, numbers, "swept").items()}

    def _classified(self, initial_states: InitialStates, order: np.ndarray, name: str) -> dict[str, np.ndarray]:
        """`Zones.distinguished` of the motions with the numbers ``order``; arrays by name."""
        return classify_batch(
            initial_states, lambda _, *found: self.study.distinguished(*found), order,
            settings=self.study.classification, progress=name if self.progress else None, threads=self.threads,
            largest=self.largest)


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
