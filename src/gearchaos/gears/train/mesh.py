"""The meshes of a gear train, in SI."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import check_plausible, convert_fields, each, having, name_of, one, read_by, record, two
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.mesh.tooth_pairs import PairsAlone, ToothPairs
from gearchaos.gears.train.faults import Fault, check_faults
from gearchaos.gears.train.parts import JOINED, NO_DAMPING, ends_of, part_name, terms, texts
from gearchaos.gears.train.stiffness import in_steps, of_model, read_stiffness, with_mean
from gearchaos.gears.train.teeth import as_pairs, check_pitch, uneven_wheels
from gearchaos.model import DAMPING_LAWS, ToothPairStiffness
from gearchaos.model.contacts import OneSidedContacts
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE

_MOST_PAIRS = 8  # in contact at the same time
_GAP_UNIT = 2.0**-13  # m, about half a backlash, of which gaps beyond the path are exact; a power of 2 rounds nothing
_RADII = 1e-4, 10.0  # m, of base circles
_RATIO_TOLERANCE = 0.01  # largest relative difference between the ratio of base radii and that of numbers of teeth

_OF_DESIGN = ("teeth", "base_radii", "stiffness", "tooth_pairs", "damping", "backlash", "error_amplitudes",
              "error_phases", "faults", "pitch_errors", "eccentricity", "contact_ratio")
"""The fields of a mesh that a design has."""

_ANY_DAMPING = 0.05  # of a design that lacks it, where the damping is given beside it


def _values_of(design: Any, without: Collection[str]) -> dict[str, Any]:
    """The values of a mesh by name that a design or a pair has, those left out that are not wanted."""
    pair: GearPair = design.to_pair()
    found: dict[str, Any] = {
        "teeth": (pair.n1, pair.n2), "base_radii": (pair.R1, pair.R2), "damping": pair.k, "backlash": pair.backlash,
        "error_amplitudes": pair.error_amplitudes, "error_phases": pair.error_phases}
    stiffness = design.to_model().stiffness
    if hasattr(design, "geometry"):
        found |= {"faults": design.tooth_faults, "pitch_errors": design.late_teeth,
                  "eccentricity": design.eccentricity, "contact_ratio": design.geometry.total_contact_ratio}
    elif not stiffness.shared:  # tooth pairs have one of their own
        found["contact_ratio"] = stiffness.parameters().get("contact_ratio")
    if stiffness.shared:
        found["tooth_pairs"] = pair.tooth_pairs
    elif "stiffness" not in without:
        found["stiffness"] = of_model(stiffness, pair.c0)
    return {name: value for name, value in found.items() if name not in without}


def _ratio(field: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 1 <= value <= _MOST_PAIRS:
        raise InputError(field, f"must be a number from 1 to {_MOST_PAIRS}", value, "Of helical gears the total one.")
    return float(value)


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A gear mesh between two bodies of a `Train`.

    Its deflection is s = r_a φ_a − r_b φ_b − e(t), φ in each wheel's own sense of rotation: s > 0 on the front flank,
    by which the first body drives the second one, and s < −backlash on the back flank.

    Parameters
    ----------
    between : two names
        Driving and driven body.
    name : str, optional
        By default both names with a slash.
    design : GearDesign or GearPair, optional
        Whose teeth, base radii, stiffness, damping, backlash and error are those of the mesh. In a study file the path
        of a file with ``[design]`` or ``[gearpair]``. What is given beside it replaces its value.
    teeth : two int
    base_radii : two lengths
        In the ratio of the teeth to 1 %; the second one is taken to be in that ratio exactly.
    stiffness : force/length, or table
        Constant, or ``levels`` and where each ``starts`` in the mesh cycle, or a Fourier series with ``mean``,
        ``amplitudes`` and ``phases``, as in (2.7), which is followed in 48 steps.
    tooth_pairs : table
        Or tooth pairs that share the load, as of `GearPair`.
    damping : force time/length
    backlash : length
        Total, along the line of action.
    error_amplitudes, error_phases : list of length, list of angle
        Static transmission error e(t) = Σ e_j cos(j ψ − θ_j), ψ the phase of the mesh cycle; teeth touch later where it
        is positive.
    eccentricity, eccentricity_phases : two lengths, two angles
        Distance of the axis of each toothing from its axis of rotation: e(t) has E cos(ψ_w − phase) too, ψ_w the angle
        of the wheel.
    faults : list of Fault or tables
        Teeth that differ, with ``wheel``, ``tooth``, ``stiffness_loss`` and ``wear``: see `Fault`.
    pitch_errors : two lists of lengths
        How much later each tooth of each wheel comes, along the line of action: the cumulative pitch deviation times
        the cosine of the pressure angle, teeth in the order in which they mesh. An empty list is a wheel without.
    contact_ratio : float, optional
        Tooth pairs in contact on the average, which share the stiffness; the mesh cycle begins where one enters. Where
        teeth differ it must be given, but beside ``tooth_pairs`` or a design.
    phase : angle
        ψ at t = 0.
    damping_law : {"always", "contact", "unilateral"}, optional
        That of the train by default. With ``unilateral``, for meshes of one spring, the force never pulls.
    internal : bool, optional
        Whether one of the wheels is a ring; by default as the design says, of which the second body is the ring.
    line_of_action : angle
        Direction along which a displacement of the centre of the first body presses the flanks together; matters
        where centres move. Of a planet it follows from ``pressure_angle``.
    pressure_angle : angle, optional
        Working pressure angle, of a mesh with a planet.
    assumed : table of texts
        What stands for what a drawing leaves open, by field, as it is printed; that of a ``design`` by default.

    Examples
    --------
    >>> import gearchaos as gc
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> mesh.name, mesh.backlash
    ('driver/loose', 0.00012)
    """

    between: Any = field(metadata=read_by(ends_of))
    name: Any = field(default=None, metadata=read_by(part_name))
    design: Any = field(default=None, metadata=read_by(having(
        "to_pair", "must be a GearDesign or a GearPair, in a study file the path of one")))
    teeth: Any = field(default=None, metadata=read_by(two(units.teeth, "must be a list of two numbers of teeth")))
    base_radii: Any = field(default=None, metadata=read_by(two(one(units.LENGTH, POSITIVE), "must be a list of two")))
    stiffness: Any = field(default=None, metadata=read_by(read_stiffness))
    tooth_pairs: Any = field(default=None, metadata=read_by(record(ToothPairs)))
    damping: Any = field(default=None, metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    backlash: Any = field(default=None, metadata=read_by(one(units.LENGTH, NOT_NEGATIVE)))
    error_amplitudes: Any = field(default=None, metadata=read_by(each(units.LENGTH)))
    error_phases: Any = field(default=None, metadata=read_by(each(units.ANGLE)))
    eccentricity: Any = field(default=None, metadata=read_by(two(one(units.LENGTH, NOT_NEGATIVE))))
    eccentricity_phases: Any = field(default=(0.0, 0.0), metadata=read_by(two(one(units.ANGLE))))
    faults: Any = field(default=None, metadata=read_by(terms(Fault)))
    pitch_errors: Any = field(default=None, metadata=read_by(two(each(units.LENGTH), "must be a list of two lists")))
    contact_ratio: Any = field(default=None, metadata=read_by(_ratio))
    phase: Any = field(default=0.0, metadata=read_by(one(units.ANGLE)))
    damping_law: Any = field(default=None, metadata=read_by(name_of(*DAMPING_LAWS.own)))
    internal: Any = None
    line_of_action: Any = field(default=None, metadata=read_by(one(units.ANGLE)))
    pressure_angle: Any = field(default=None, metadata=read_by(one(
        units.ANGLE, POSITIVE, (math.radians(5), math.radians(45)))))
    assumed: Any = field(default=None, compare=False, metadata=read_by(texts))

    def __post_init__(self) -> None:
        convert_fields(self)
        object.__setattr__(self, "name", self.name or JOINED["mesh"].join(self.between))
        drawn = getattr(self.design, "internal", None)
        if self.internal not in (None, True, False):
            raise InputError("internal", "must be true or false", self.internal)
        if drawn is not None and self.internal not in (None, drawn):
            raise InputError("internal", "must be left out or as in the design", self.internal,
                             f"The pair of the design is {'internal' if drawn else 'external'}.")
        object.__setattr__(self, "internal", bool(drawn or self.internal))
        if self.stiffness is not None and self.tooth_pairs is not None:
            raise InputError("stiffness", "must be left out beside tooth_pairs", self.stiffness,
                             "The stiffness of the mesh is that of its tooth pairs.")
        if self.contact_ratio is not None and self.tooth_pairs is not None:
            raise InputError("contact_ratio", "must be left out beside tooth_pairs", self.contact_ratio,
                             "They have one of their own.")
        own = {name for name in _OF_DESIGN if getattr(self, name) is not None}
        own |= {"stiffness", "tooth_pairs"} if own & {"stiffness", "tooth_pairs"} else set()
        of_design = getattr(self.design, "assumed", {})
        object.__setattr__(self, "assumed", self.assumed or {n: text for n, text in of_design.items() if n not in own})
        for name, value in self._of_design(own).items():
            object.__setattr__(self, name, value)
        missing = [name for name in ("teeth", "base_radii", "backlash") if getattr(self, name) is None]
        if self.stiffness is None and self.tooth_pairs is None:
            missing.append("stiffness or tooth_pairs")
        if missing:
            raise InputError(", ".join(missing), "must be given", None,
                             "E.g. base_radii = ['19 mm', '38 mm'], backlash = '0.1 mm', stiffness = '3e8 N/m'. "
                             "Or give a design.")
        if self.damping is None:
            self.assumed["damping"] = NO_DAMPING
        for name, default in (("damping", 0.0), ("error_amplitudes", ()), ("error_phases", ()),
                              ("eccentricity", (0.0, 0.0)), ("faults", ()), ("pitch_errors", ((), ()))):
            if getattr(self, name) is None:
                object.__setattr__(self, name, default)
        if len(self.error_phases) > len(self.error_amplitudes):
            raise InputError("error_phases", "must not be longer than error_amplitudes", len(self.error_phases))
        self._check_teeth()
        (z1, z2), (r1, r2) = self.teeth, self.base_radii
        if abs(r1 / r2 * z2 / z1 - 1) > _RATIO_TOLERANCE:
            raise InputError("base_radii", f"must be in the ratio of the teeth, {z1}/{z2} = {z1 / z2:.6g}, to 1 %",
                             round(r1 / r2, 6), "Base radii are m z cos(α)/2.")
        check_plausible("base_radii[0]", r1, *_RADII)
        object.__setattr__(self, "base_radii", (r1, r1 * z2 / z1))  # without the rounding of drawings
        object.__setattr__(self, "design", None)  # its values are those of the mesh
        if self.phase and not self.varies:
            raise InputError("phase", "must be left out for a mesh of constant stiffness without error",
                             units.Shown(self.phase, self.phase), "It has no effect.")

    def _check_teeth(self) -> None:
        """Raise `InputError` for faults and deviations that the wheels cannot have, or whose effect is not known."""
        check_faults(self.faults, self.teeth, drawn=False)
        check_pitch(self.pitch_errors, self.teeth)
        needed = self.uneven and self.tooth_pairs is None
        if needed and self.contact_ratio is None:
            raise InputError("contact_ratio", "must be given where teeth differ", None,
                             "It says for how long each is in contact. Or give tooth_pairs, or a design.")
        if not needed:  # so that a mesh of like teeth is the same with it and without
            object.__setattr__(self, "contact_ratio", None)
        for i, (length, phase) in enumerate(zip(self.eccentricity, self.eccentricity_phases, strict=True)):
            if phase and not length:
                raise InputError(f"eccentricity_phases[{i}]", "must be left out without eccentricity",
                                 units.Shown(phase, phase), "It has no effect.")

    def _of_design(self, own: set[str]) -> dict[str, Any]:
        """The values of the design, by the names of fields, but for those that the mesh has of its ``own``."""
        if self.design is None:
            return {}
        design = self.design
        if "damping" in own and getattr(design, "damping_ratio", own) is None:
            design = replace(design, damping_ratio=_ANY_DAMPING)
        # one that lacks speed or torque at two of each, between which it must not differ
        lacks = {name: values for name, values in (("speed", (600.0, 900.0)), ("torque", (50.0, 75.0)))
                 if getattr(design, name, values) is None}
        try:
            points = [_values_of(each, own) for each in (
                [design.at(**{name: values[i] for name, values in lacks.items()}) for i in (0, 1)]
                if lacks else [design])]
        except InputError as error:
            raise InputError(f"design: {error.field}", error.rule, error.value, error.advice) from None
        for name, value in points[0].items():
            if any(point[name] != value for point in points[1:]):
                raise InputError("design", "must have a speed and a torque", "none",
                                 f"Its {name} depends on them: write [operation] with speed and torque in its file, or "
                                 f"give {name} beside it.")
        return points[0]

    def with_mean_stiffness(self, mean: Any, own: float) -> Mesh:
        """This mesh with another mean stiffness than its ``own`` one, and a stiffness of the same form."""
        mean = units.to_si("stiffness", mean, units.STIFFNESS, POSITIVE)
        if self.tooth_pairs is not None:
            levels = tuple(level * mean / own for level in self.tooth_pairs.stiffness)
            return replace(self, tooth_pairs=replace(self.tooth_pairs, stiffness=levels))
        return replace(self, stiffness=with_mean(self.stiffness, mean, own))

    def contacts(self, on_path: bool = False) -> OneSidedContacts:
        """The contacts of one mesh cycle, stiffnesses in N/m and gaps in m; of tooth pairs also those on their path
        alone."""
        if self.tooth_pairs is not None:
            pairs_given = replace(self.tooth_pairs, corner=None) if on_path else self.tooth_pairs
            found = ToothPairStiffness.contacts(PairsAlone(1.0, pairs_given, _GAP_UNIT).stiffness.numbers(), 1)
            return found._replace(gap=found.gap * _GAP_UNIT)
        levels, starts = in_steps(self.stiffness)
        if starts[0] > 0:  # until then the last level of the cycle before lasts on
            levels, starts = (levels[-1], *levels), (0.0, *starts)
        both = np.array([levels, levels], float)[None]
        found = OneSidedContacts(np.array([1, -1]), np.zeros(2, int), np.array([starts], float), both,
                                 np.zeros((*both.shape, 3)))
        return as_pairs(found, self.contact_ratio) if self.uneven else found

    @property
    def uneven(self) -> bool:
        """Whether the teeth of a wheel are not all alike."""
        return bool(uneven_wheels(self))

    @property
    def turning(self) -> list[int]:
        """The wheels, 0 and 1, by which something repeats once per turn."""
        return sorted({*uneven_wheels(self), *(i for i, length in enumerate(self.eccentricity) if length)})

    @property
    def constant(self) -> bool:
        """Whether the stiffness is the same along the mesh cycle."""
        return not (self.tooth_pairs is not None or self.uneven or len(set(in_steps(self.stiffness)[0])) > 1)

    @property
    def varies(self) -> bool:
        """Whether stiffness or error change along the mesh cycle."""
        return not self.constant or any((*self.error_amplitudes, *self.eccentricity))
