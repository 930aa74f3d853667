"""The mesh deflection, the loaded transmission error of exact teeth: by how much the mesh gives way at rest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.gears.geometry.corner_contact import DEEPEST
from gearchaos.gears.io import units
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.mesh.tooth_pairs import PairsAlone
from gearchaos.model import Stiffness, ToothPairStiffness
from gearchaos.model.static import static_contacts, static_deflection
from gearchaos.quantities import POSITIVE

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign

_POSITIONS = 4096  # positions in the mesh cycle from which peak to peak is taken
_CYCLE = np.arange(_POSITIONS) / _POSITIONS
_LARGEST_RELIEF = 4.0  # amount up to which a relief is varied, over the deflection of one pair that carries all
_AMOUNTS = 65  # amounts that are tried before the search between two of them
_TORQUES = 1e-4  # to which a torque is found, relative
_LIGHT = 1e-5  # torque that counts as any, over the largest: gaps of corner contact are not known to its deflection
_NO_GAIN = 1e-3  # by less than this share of the variation without relief no relief lessens it


def loaded_error(gears: GearPair | GearDesign, torque: float | str | None, positions: np.ndarray) -> np.ndarray:
    """Deflection of the mesh along the line of action at rest, m, at positions (n,) in the mesh cycle.

    It is that of teeth that are exact but for their relief and crowning: the transmission error of the unloaded gears
    is left out. The torque is that at wheel 1, in N m or with a unit, by default that of the gears. A tooth pair enters
    contact at position 0. Raises `InputError` without a torque, or one that is not positive.
    """
    given = own_torque(gears) if torque is None else torque
    moment = units.to_si("torque", given, units.TORQUE, POSITIVE)
    if not isinstance(gears, GearPair) and gears.under_load:
        return gears.at(torque=moment).strips.at(positions).deflection
    stiffness, c0, length, radius = _mesh(gears, moment)
    return (static_deflection(stiffness, moment / (radius * c0 * length), positions) - 1) * length


def own_torque(gears: GearPair | GearDesign) -> float:
    """The torque of gears at wheel 1, N m; raises `InputError` for a design without one."""
    return float(gears.M10 if isinstance(gears, GearPair) else gears.given("torque"))


def peak_to_peak(gears: GearPair | GearDesign) -> float:
    """The mesh deflection under the torque of the gears from its least to its greatest value, m."""
    if not isinstance(gears, GearPair) and gears.under_load:
        return float(np.ptp(gears.strips.cycle.deflection))
    return float(np.ptp(loaded_error(gears, None, _CYCLE)))


def contact_ratio_under_load(design: GearDesign) -> float:
    """How many tooth pairs touch at rest under the torque, the mean over the mesh cycle; of pairs that share the load.

    Of helical pairs a part of the width counts as that part of a pair: the length of the contact lines over the width.
    """
    if design.under_load:
        return float(design.strips.cycle.pairs.mean())
    return float(_pairs_in_contact(design, own_torque(design)).mean())


def two_pairs_from(design: GearDesign) -> float | None:
    """The torque at wheel 1, N m, from which at least two tooth pairs touch at rest at every position, by bisection.

    0 where any torque does: at contact ratios from 2 on, where no relief keeps pairs apart. None where no torque does
    so that the teeth can bear.
    """
    def always(torque: float) -> bool:
        return bool(_pairs_in_contact(design, torque).min() >= 2)

    deepest = DEEPEST * design.geometry.normal_module  # as far as corner contact is followed
    low, high = 0.0, design.mesh_stiffness.reference * deepest * design.geometry.base_diameter[0] / 2
    if not always(high):
        return None
    if always(_LIGHT * high):
        return 0.0
    while high - low > _TORQUES * high:
        middle = (low + high) / 2
        low, high = (low, middle) if always(middle) else (middle, high)
    return high


def _pairs_in_contact(design: GearDesign, torque: float) -> np.ndarray:
    """How many tooth pairs touch at rest under a torque, N m, over the mesh cycle."""
    stiffness, c0, length, radius = _mesh(design, torque)
    assert isinstance(stiffness, ToothPairStiffness)
    return static_contacts(stiffness, torque / (radius * c0 * length), _CYCLE)


def best_relief(design: GearDesign) -> tuple[tuple[float, float], float] | None:
    """Tip relief of both wheels, m, with which the mesh deflection under the torque varies least, and by how much it
    then varies, m.

    The amounts are in the ratio of those of the design, over the same lengths and in the same shape, and at most four
    times what one pair alone bends. Of several minima they are the first: larger amounts keep pairs apart, so that one
    bears all. They are 0 where no relief lessens the variation. None without a relief that tooth pairs have.
    """
    from scipy.optimize import minimize_scalar  # here, since most of what is computed of gears does not need it

    stiffness, c0, length, radius = _mesh(design, own_torque(design))
    if not isinstance(stiffness, ToothPairStiffness) or not (stiffness.relief1 or stiffness.relief2):
        return None
    reliefs, force = np.array([stiffness.relief1, stiffness.relief2]), own_torque(design) / (radius * c0 * length)
    largest = _LARGEST_RELIEF * force / min(stiffness.levels)

    def variation(amount: float) -> float:
        first, second = (amount * reliefs / reliefs.max()).tolist()
        return float(np.ptp(static_deflection(replace(stiffness, relief1=first, relief2=second), force, _CYCLE)))

    tried = np.linspace(0.0, largest, _AMOUNTS)
    varied = np.array([variation(amount) for amount in tried])
    minima = np.flatnonzero((varied[1:-1] < varied[:-2]) & (varied[1:-1] <= varied[2:])) + 1
    minima = minima[varied[minima] < (1 - _NO_GAIN) * varied[0]]
    least = tried[minima[0] if len(minima) else np.argmin(varied)]
    found = minimize_scalar(variation, bounds=(max(least - tried[1], 0.0), least + tried[1]), method="bounded",
                            options={"xatol": 1e-4 * largest})
    amount = found.x if found.fun < (1 - _NO_GAIN) * variation(0.0) else 0.0
    first, second = (amount * length * reliefs / reliefs.max()).tolist()
    return (first, second), variation(amount) * length


def _mesh(gears: GearPair | GearDesign, torque: float) -> tuple[Stiffness, float, float, float]:
    """Stiffness at a torque over a reference, this in N/m, the unit of its lengths, m, and base radius 1, m."""
    if isinstance(gears, GearPair):
        return gears.to_model().stiffness, gears.c0, gears.half_backlash, gears.R1
    design = gears.at(torque=torque)
    mesh, pairs, radius = design.mesh_stiffness, design.tooth_pairs, design.geometry.base_diameter[0] / 2
    if pairs is None:
        return mesh.waveform, mesh.reference, 1.0, radius
    found = PairsAlone(mesh.reference, pairs)
    return found.stiffness, found.c0, found.half_backlash, radius
