"""Maps of the kind of motion over two parameters, as in figures 2, 5, 10 and 11 of the paper.

Zones are the regions of such a map with one kind of motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics import Classification, Verdicts
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.flow import WIDTH, ExactFlow
from gearchaos.gears.operating import AnyModel
from gearchaos.model import state_names
from gearchaos.model.switched import switched_system
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.batch_classification import InitialStates, classify_batch
from gearchaos.studies.coexistence import coexisting, signature
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.plane import at_cells, check_plane, corners, shared_coordinates
from gearchaos.studies.proofs import check_installed
from gearchaos.studies.proved_cells import certificate_files, check_folder, mark_inferred, orbit_points, proofs
from gearchaos.studies.refine import SIDE, refined
from gearchaos.studies.study import ClassifyingStudy, option
from gearchaos.studies.sweep import PERIODS_PER_VALUE

if TYPE_CHECKING:
    import xarray as xr

_COMPUTED_SHARE = 1 / 8
"""Rough estimate of the share of the cells of a refined map that are computed."""


def zones(
    model: AnyModel, x: Axis | str, y: Axis | str, *, starts: int = 1, refine: int = 1, prove: bool = False,
    certificates: str | None = None, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """A map of the kinds of motion over two parameters, with the initial values of the model in every cell.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        All parameters but the two of the axes.
    x, y : Axis or str
        Parameters (or initial values) and their ranges, as a text "omega=0.2:3:400".
    starts : int
        Number of initial states in each cell: those of the model, and others spread as by `attractors`. With more than
        one, the motions after slow sweeps along x, upwards and downwards, are also found.
    refine : int
        Spacing of the first lattice of computed rows and columns, a power of two. Cells in between are computed only
        where neighbours differ; the others are inferred, and marked by ``inferred`` and ``reason``. 1 computes every
        cell.
    prove : bool
        Prove the periodic motion of each computed cell, see `prove`; with more than one start, that from the initial
        values of the model.
    certificates : str, optional
        Folder to which a certificate is written for each proved cell, ``row0003/column0012.json``, and the script that
        verifies them. It needs ``prove``.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.
    progress : bool
        Show a progress bar on stderr.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        With dims (y.name, x.name): label, period, reason, largest Lyapunov exponent with its interval, residual and
        largest multiplier of the orbit, response measures, contact, periods spent. With more than one start also the
        number of ``attractors`` found in each cell, ``v_rms_least`` and ``v_rms_most`` among them, ``contact_worst``,
        ``v_rms_up`` and ``v_rms_down`` after the sweeps, and ``hysteresis``: 1 where the two sweeps end in different
        motions. With ``prove`` also ``proved``: 1 where the motion is proved, 0 where it is not, -1 where it is not
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
    """
    study = Zones(
        model, x, y, starts=starts, refine=refine, prove=prove, certificates=certificates, settings=settings)
    return study.run(progress=progress, threads=threads)


@dataclass(frozen=True)
class Zones(ClassifyingStudy):
    """The study that `zones` runs. Its work items are the cells.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        All parameters but the two of the axes.
    x, y : Axis or str
        Parameters (or initial values) and their ranges.
    starts : int
        Number of initial states in each cell.
    refine : int
        Spacing of the first lattice of computed rows and columns, a power of two.
    prove : bool
        Prove the periodic motion of each computed cell.
    certificates : str, optional
        Folder to which a certificate is written for each proved cell.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1, eps1=0.1), "omega=0.9:1.1:4", "eps1=0.1:0.2:4")
    >>> study.kind, study.count
    ('zones', 16)
    """

    kind: ClassVar[str] = "zones"
    axis_fields: ClassVar[tuple[str, ...]] = ("x", "y")
    gridded: ClassVar[bool] = True

    x: Axis
    y: Axis
    starts: int = option(1, least=1)
    refine: int = option(1, least=1)
    prove: bool = option(False)
    certificates: str | None = option(None)

    if TYPE_CHECKING:  # what `__post_init__` converts is accepted, too

        def __init__(
            self, model: AnyModel, x: Axis | str, y: Axis | str, *, starts: int = 1, refine: int = 1,
            prove: bool = False, certificates: str | None = None, settings: Classification | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(x=as_axis(self.x, "x"), y=as_axis(self.y, "y"), **self._whole_numbers("starts"))
        check_plane(self.model, self.x, self.y)
        check_memory("cells of a row times starts", self.x.count * self.starts)
        if self.starts > 1 and {self.x.name, self.y.name} & set(state_names(self.model.kind)):
            raise InputError("starts", "must be 1 where an axis is an initial value", self.starts)
        self._set(refine=_checked_refine(self.refine, self.starts))
        self._check_proofs()
        _ = self.cost

    @property
    def grid(self) -> dict[str, int]:
        return {self.y.name: self.y.count, self.x.name: self.x.count}

    @property
    def block(self) -> dict[str, int]:
        if self.refine > 1:
            return {self.y.name: min(SIDE, self.y.count), self.x.name: min(SIDE, self.x.count)}
        return {self.y.name: 1, self.x.name: self.x.count if self.starts > 1 else 1}

    @property
    def motions_per_item(self) -> float:
        if self.refine > 1:
            return _COMPUTED_SHARE
        return self.starts + 2 if self.starts > 1 else 1  # the two sweeps add one motion each

    @cached_property
    def cost(self) -> Cost:
        """Bound for all cells; with several starts also for sweeps along all rows, `WIDTH` rows at a time.

        Raises `InputError` if a single row, which one machine computes, cannot end.
        """
        motions, sequential = self.x.count, 0
        if self.starts > 1:
            motions *= self.starts + 2
            sequential = 2 * self.x.count * PERIODS_PER_VALUE
        system = switched_system(corners(self.model, self.x, self.y))
        row = estimate(system, motions, self.classification.max_periods, sequential)
        return replace(row, motions=motions * self.y.count, sequential=sequential * -(-self.y.count // WIDTH))

    def check_in_memory(self) -> None:
        check_memory("cells", self.x.count * self.y.count)
        check_memory("cells times starts", self.x.count * self.y.count * self.starts)
        super().check_in_memory()

    def compute(
        self, items: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        if self.refine == 1:
            return self._cells(items, progress, threads)
        found = refined(lambda cells: self._cells(cells, progress, threads), items, self.x.count, self.refine)
        if self.prove:
            mark_inferred(found)
        return found

    def finish(
        self, found: dict[str, np.ndarray], *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset:
        dims, shape = tuple(self.grid), tuple(self.grid.values())
        data = {n: variable(n, dims, v.reshape(shape)) for n, v in found.items()}
        coords = {a.name: variable(a.name, (a.name,), a.values) for a in (self.x, self.y)}
        options = {"prove": 1} if self.prove else {}
        return new_dataset(data, coords, self.provenance(starts=self.starts, refine=self.refine, **options))

    @cached_property
    def initial_states(self) -> InitialStates:
        """Function from the numbers (L,) of cells to their flow, initial states (d, L) and parameter points (L,)."""
        names = shared_coordinates(self.model, self.x, self.y)

        def initial_states(cells: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
            chosen = initial_value_problems(self.model, at_cells(self.x, self.y, cells), names)
            return chosen.flow, chosen.w, chosen.points

        return initial_states

    def _cells(self, cells: np.ndarray, progress: bool, threads: int | None) -> dict[str, np.ndarray]:
        """Results of cells (N,), which are whole rows if there is more than one start."""
        order = np.arange(len(cells), dtype=cells.dtype)
        if self.x.name in ("omega", "speed"):  # so that neighbours in a tile have equal step counts
            order = np.argsort(cells % self.x.count, kind="stable").astype(cells.dtype)
        options: dict[str, Any] = {
            "settings": self.classification, "threads": threads, "largest": self.cost.max_parameter_points(threads),
        }
        out = classify_batch(
            lambda tile: self.initial_states(cells[tile]), self._collect, order,
            progress="zones" if progress else None, **options,
        )
        if self.starts > 1:
            options["progress"] = progress
            out |= coexisting(self.model, self.x, self.y, cells, order, out, self.starts - 1, **options)
            del out["centre_z"], out["centre_z_dot"]
        if self.prove:
            out |= self._proofs(cells, out.pop("orbit"), progress, threads)
        return out

    def _proofs(
        self, cells: np.ndarray, orbits: np.ndarray, progress: bool, threads: int | None
    ) -> dict[str, np.ndarray]:
        """The proofs of the orbits in cells (N,), which are None where the motion is not periodic."""
        at = at_cells(self.x, self.y, cells)
        models = [None if orbit is None else self.model.with_values({n: float(v[i]) for n, v in at.items()})
                  for i, orbit in enumerate(orbits)]
        files = certificate_files(self.certificates, cells, self.x.count)
        return proofs(models, orbits, files, progress=progress, threads=threads)

    def _check_proofs(self) -> None:
        """Raise `InputError` unless the proofs that are wanted can be made."""
        if not isinstance(self.prove, bool):
            raise InputError("prove", "must be true or false", self.prove)
        if self.prove:
            check_installed()
        check_folder(self.certificates, self.prove)

    def _collect(
        self, _: np.ndarray, flow: ExactFlow, points: np.ndarray, found: Verdicts
    ) -> dict[str, np.ndarray]:
        """The variables of the verdicts, and what `coexisting` and proofs need."""
        out = found.variables() | (signature(flow, points, found) if self.starts > 1 else {})
        return out | orbit_points(flow, points, found) if self.prove else out


def _checked_refine(refine: int, starts: int) -> int:
    """The spacing of the first lattice; raises `InputError` unless it is a power of two that is allowed."""
    refine = whole_number("refine", refine, 1)
    if refine > SIDE // 2 or refine & (refine - 1):
        raise InputError("refine", f"must be a power of two, at most {SIDE // 2}", refine)
    if refine > 1 and starts > 1:
        raise InputError("refine", "must be 1 where there is more than one start", refine)
    return refine
