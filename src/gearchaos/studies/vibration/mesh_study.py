"""What studies of the vibration of one mesh of given gears share: the mesh, the instants, turns of the first wheel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import variable
from gearchaos.dynamics.response import MESH
from gearchaos.errors import InputError, unknown_name
from gearchaos.model.switched import SwitchedAffine
from gearchaos.studies.core.options import option
from gearchaos.studies.core.study import WholeStudy
from gearchaos.studies.motion.simulate import mesh_forces
from gearchaos.studies.speeds.speed_and_torque import checked_operating_model

if TYPE_CHECKING:
    import xarray as xr

_DENSITY = 5.0  # fewest instants in a unit of τ, of which a free vibration in contact has about 6
TURNS = 2
"""Turns of the first wheel in a window of a spectrum: half orders have a line of their own."""


@dataclass(frozen=True)
class MeshStudy(WholeStudy):
    """A study of the vibration of one mesh of given gears."""

    mesh: str | None = option(None, "Of a train, the mesh that is looked at; by default the first.")
    samples: int = option(64, "Instants of each mesh period at which it is taken for its spectrum.", least=16)

    def __post_init__(self) -> None:
        super().__post_init__()
        checked_operating_model(self.model)  # type: ignore[arg-type]
        model: Any = self.model
        if model.mesh_names and not model.train.meshes:
            raise InputError("model", "must have a mesh", "a train of shafts with stops alone")
        if self.mesh is not None and not self.model.mesh_names:
            raise InputError("mesh", "must be left out for a single pair", self.mesh)
        if self.mesh is not None and self.mesh not in self.model.mesh_names:
            raise unknown_name("mesh", self.mesh, self.model.mesh_names)

    @property
    def _cycles_per_rpm(self) -> float:
        """Periods per second over the speed in rpm."""
        model: Any = self.model
        return model.gears.to_pair().scales.rate / (model.period * model.value("speed"))

    @property
    def _at(self) -> int:
        """The index of the mesh that is looked at."""
        return self.model.mesh_names.index(self.mesh) if self.mesh else 0

    @property
    def mesh_order(self) -> float:
        """Mesh cycles in a turn of the first wheel."""
        model: Any = self.model
        if self.model.mesh_names:
            return float(model.train.mesh_order(model.train.meshes[self._at]))
        return float(model.gears.to_pair().n1)

    @property
    def _mesh_coordinate(self) -> dict[str, xr.Variable]:
        """The name of the mesh, as a coordinate of results of a train."""
        return {MESH: variable(MESH, (), np.array(self.model.mesh_names[self._at]))} if self.model.mesh_names else {}

    @property
    def _cycles_per_turn(self) -> Fraction:
        return Fraction(60 * self._cycles_per_rpm).limit_denominator(10_000)

    @property
    def _samples(self) -> int:
        """Instants in a period: of a train in its fastest mesh cycle as many as are asked for."""
        return self.samples * self.model.most_cycles

    @property
    def _window(self) -> int:
        """Periods in a window of the spectrum."""
        return TURNS * self._cycles_per_turn.numerator

    def _finer(self, speed: float) -> int:
        """How many times as many instants the flow samples as the spectrum needs, a power of 2: then they are filtered,
        for a force that jumps and rings has lines far above those that are looked at."""
        model: Any = self.model
        period = model.period * model.value("speed") / speed
        return int(2 ** max(0, math.ceil(math.log2(_DENSITY * period / self._samples))))

    def _forces(self, system: SwitchedAffine, samples: np.ndarray) -> np.ndarray:
        """The force of the mesh (N M,) at samples (N, M, d + 1) of N periods, in the last column the contact state."""
        periods, count, _ = samples.shape
        flat, share = samples.reshape(periods * count, -1), np.arange(count) / count
        several = system.contacts
        arrays = (several.damping, several.stiffness, several.edges, several.offset) if several is not None else (
            system.damping, system.levels, system.starts, system.chi_cos, system.chi_sin)
        if all((array == array[:1]).all() for array in arrays):  # at all points the force follows from the state alike
            return mesh_forces(system, flat[:, :-1], flat[:, -1], np.tile(share, periods))[:, self._at]
        return np.concatenate([mesh_forces(system.take(np.array([p])), own[:, :-1], own[:, -1], share)[:, self._at]
                               for p, own in enumerate(samples)])
