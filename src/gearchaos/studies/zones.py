"""Maps of the kind of motion over two parameters, as in figures 2, 5, 10 and 11 of the paper.

Zones are the regions of such a map with one kind of motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.flow import WIDTH
from gearchaos.model import state_names
from gearchaos.model.switched import switched_system
from gearchaos.studies.axis import Axis
from gearchaos.studies.batch_classification import InitialStates, classify_batch
from gearchaos.studies.coexistence import coexisting, signature
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.declaration import function_of
from gearchaos.studies.initial_value_problems import Motions, initial_value_problems
from gearchaos.studies.options import axis_option, option
from gearchaos.studies.plane import at_cells, check_plane, corners, shared_coordinates
from gearchaos.studies.proofs import check_installed
from gearchaos.studies.proved_cells import certificate_files, check_folder, mark_inferred, orbit_points, proofs
from gearchaos.studies.refine import SIDE, refined
from gearchaos.studies.study import ClassifyingStudy, Results
from gearchaos.studies.sweep import PERIODS_PER_VALUE

_COMPUTED_SHARE = 1 / 8
"""Rough estimate of the share of the cells of a refined map that are computed."""


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
    summary: ClassVar[str] = "map"
    model_words: ClassVar[str] = "All parameters but the two of the axes; its initial values hold in every cell."

    x: Axis = axis_option('A parameter, or an initial value, and its range, as a text "omega=0.2:3:400".')
    y: Axis = axis_option("Another one.")
    starts: int = option(
        1, "Number of initial states in each cell, to find all its motions. They are those of the model, and others "
        "spread as by `attractors`. With more than one, the motions after slow sweeps along x, upwards and downwards, "
        "are also found.", least=1)
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
        if self.starts > 1 and {self.x.name, self.y.name} & set(state_names(self.model.kind)):
            raise InputError("starts", "must be 1 where an axis is an initial value", self.starts)
        if self.refine > SIDE // 2 or self.refine & (self.refine - 1):
            raise InputError("refine", f"must be a power of two, at most {SIDE // 2}", self.refine)
        if self.refine > 1 and self.starts > 1:
            raise InputError("refine", "must be 1 where there is more than one start", self.refine)
        if self.prove:
            check_installed()
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

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        if self.refine == 1:
            return self._cells(items, progress, threads)
        found = refined(lambda cells: self._cells(cells, progress, threads), items, self.x.count, self.refine)
        if self.prove:
            mark_inferred(found)
        return found

    @property
    def recorded(self) -> dict[str, Any]:
        return {"starts": self.starts, "refine": self.refine, **({"prove": 1} if self.prove else {})}

    @cached_property
    def initial_states(self) -> InitialStates:
        """Function from the numbers (L,) of cells to their motions."""
        names = shared_coordinates(self.model, self.x, self.y)
        return lambda cells: initial_value_problems(self.model, at_cells(self.x, self.y, cells), names)

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
            at, orbits = at_cells(self.x, self.y, cells), out.pop("orbit")  # None where the motion is not periodic
            models = [None if orbit is None else self.model.with_values({n: float(v[i]) for n, v in at.items()})
                      for i, orbit in enumerate(orbits)]
            files = certificate_files(self.certificates, cells, self.x.count)
            out |= proofs(models, orbits, files, progress=progress, threads=threads)
        return out

    def _collect(self, _: np.ndarray, motions: Motions, found: Verdicts) -> dict[str, np.ndarray]:
        """The variables of the verdicts, and what `coexisting` and proofs need."""
        out = found.variables() | (signature(motions, found) if self.starts > 1 else {})
        return out | orbit_points(motions, found) if self.prove else out


zones = function_of(Zones)
