"""`GearDesign`: a gear pair as its drawing describes it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from gearchaos.display import HasCard
from gearchaos.errors import InputError
from gearchaos.gears.design.checks import check_inputs, check_load_sharing, check_wheels, design_warnings
from gearchaos.gears.design.drawing import Drawing
from gearchaos.gears.design.inputs import TEETH
from gearchaos.gears.design.values import Choice, DrawnPitch, TableFile, method_in_words, module_of
from gearchaos.gears.geometry.backlash import check_backlash
from gearchaos.gears.geometry.checks import check_geometry
from gearchaos.gears.geometry.mechanics import PLASTIC_MODULUS
from gearchaos.gears.io.fields import check_plausible, convert_fields, unknown_key
from gearchaos.gears.io.units import FREQUENCY, to_si
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.stiffness import methods
from gearchaos.gears.stiffness.iso6336 import ISO
from gearchaos.gears.train.faults import check_faults
from gearchaos.gears.train.teeth import check_pitch
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY
from gearchaos.model import MeshModel, ToothPairStiffness
from gearchaos.quantities import POSITIVE

if TYPE_CHECKING:
    from gearchaos.gears.train.train import Train

_MOST_DEVIATION = 0.2  # of a flank, in modules
_A_DEVIATION = "Deviations of flanks are some µm, at most a fifth of a module."
# the inputs of a design that the table ``[operation]`` of a study file may hold
OPERATION = ("speed", "torque", "application_factor")
# the keys of ``[operation]`` that may take the place of ``speed``: turns of wheel 1, or its teeth, per second
FREQUENCIES = ("shaft_frequency", "mesh_frequency")


@dataclass(frozen=True, kw_only=True)
class GearDesign(Drawing, HasCard):
    """A spur or helical gear pair as its drawing describes it; wheel 1 drives.

    A value with a unit is a number in SI, a text such as ``"8 mm"`` or a pint quantity. It is kept as a number in SI,
    what belongs to each wheel as a tuple of two; speeds are in rpm. Where one value may stand for two, it holds for
    both wheels. Designs are values: they are equal if their fields are, and can be hashed, pickled, and made again from
    `dataclasses.asdict`.

    Parameters
    ----------
    teeth : (int, int)
        z1, z2.
    internal : bool, optional
        Whether wheel 2 is a ring, with internal teeth; by default both are external. Teeth, diameters and the centre
        distance stay positive, and profile shifts have the signs of ISO 21771: a positive one moves the teeth of the
        ring inwards. Inertias must be given.
    module : length
        Normal module m_n; or leave it out and give ``diametral_pitch``.
    diametral_pitch : float or str
        Normal diametral pitch in 1/in, e.g. ``8`` or ``"8 1/in"``, instead of the module: m_n = 25.4 mm/P_nd.
    face_width : length, one or two
        b1, b2.
    pressure_angle : angle, optional
        Normal pressure angle α_n; by default 20°, ISO 53:1998.
    helix_angle : angle, optional
        β at the reference cylinder; its sign does not matter. By default 0, a spur gear.
    centre_distance : length, optional
        Working centre distance a. If left out it is that without theoretical backlash, from ``profile_shift``.
    profile_shift : (float, float), optional
        x1, x2 in normal modules. If left out both are 0. With a centre distance that needs shifts they must be given.
    rack : Rack or table, optional
        Basic rack in normal modules; by default profile A of ISO 53:1998: addendum 1, dedendum 1.25, root radius 0.38.
    tip_alteration : length, one or two, or ``"keep clearance"``, optional
        k m_n, negative for shortened teeth; by default 0. ``"keep clearance"`` shortens the teeth of both wheels until
        the tip clearance is the one of the basic rack.
    tip_diameter : length, one or two, optional
        Tip diameters of the drawing, instead of a tip alteration.
    tip_relief : length, one or two, ReliefDimensions or table, optional
        C_a, or a table with the amount and the diameter where the relief begins; none by default. It acts where tooth
        pairs share the load and the diameter is given; elsewhere a warning says what the model leaves out of it.
    material : str, Material or table, one or two, optional
        By default ``"steel"``: E = 206 GPa, ν = 0.3 (ISO 6336-2:2006), 7830 kg/m³ (ISO 6336-1:2006).
    bore : length, one or two, optional
        Bore diameters. The mass of a wheel left out of ``mass``, and the moment of inertia left out of ``inertia``, are
        those of a disc of the wheel's face width with this bore, without hub, whose outer diameter is the mean of tip
        and root diameter, as in ISO 6336-1:2006 (30).
    blank : table, one or two, optional
        Rim and web of a wheel for its stiffness by ISO 6336-1: ``{"rim": s_R, "web": b_s}``, the thickness of the rim
        from the root circle inwards and that of the web; ``"solid"``, the default, for a disc.
    inertia : inertia, one or two, optional
        Moments of inertia about the axes, with all that turns rigidly with the wheels.
    mass : mass, one or two, optional
        Masses of the wheels. Without ``inertia`` they are those of discs as above, without a bore if ``bore`` is left
        out.
    quality : Quality or table, optional
        Accuracy grade. With ``deviations = [0.3, -0.5]`` the transmission error from quality is that of wheels with
        these tooth-to-tooth deviations, over the permissible ones.
    backlash : Backlash, ThicknessAllowances or table, optional
        By its value and what the value is of, or by allowances of tooth thickness and centre distance.
    damping_ratio : float, optional
        ζ of the mesh. A model needs it; there is no default. Usual are 0.03 to 0.1 (Kasuba and Evans, J. Mech. Des.
        103, 1981; Wang and Cheng, J. Mech. Des. 103, 1981).
    damping_law : {"always", "contact", "unilateral"}, optional
        Where this damping acts, by default in contact alone; see `MeshModel`.
    stiffness : str or table, optional
        Method: ``"ISO 6336-1"`` (the default), ``"potential energy"``, or ``{"table": path}`` for a curve in a file,
        with ``columns`` (headers by the names of columns) and ``speed`` (of the times) where it needs them.
    load_sharing : {"prescribed", "tooth pairs", "under load"}, optional
        Whether the mesh is one spring, whose stiffness is prescribed, or each tooth pair one with a gap of its own, as
        spur gears have it by default. Helical gears are by default one spring whose stiffness and error are those of
        strips across the width that share the load at rest under the torque. Both need a contact ratio up to 4 and a
        stiffness that is not from a table.
    lead_crowning, lead_slope : length, optional
        By how much the flanks of helical teeth are apart at both ends of the common face width where they touch in its
        middle, as a parabola, C_β, and at the trailing end (negative: the leading one) where they touch at the other;
        by default 0. Both are sums of both wheels, along the line of action.
    corner_contact : bool, optional
        Whether tooth pairs touch with their tip corners before their path begins and after it ends, as bent teeth do.
        By default they do; where the corners of these teeth cannot, a warning says so.
    transmission_error : str or table, optional
        ``"none"``, ``"from quality"``, both wheels at the limit of the grade, ``"from quality (typical)"``, a third,
        ``{"orders": path}`` or ``{"table": path}``, with ``columns`` as above and ``wheel`` for an error that is the
        angle of a wheel. Left out it is none as well, with a warning beside a quality.
    eccentricity : length, one or two, optional
        Distance of the axis of the toothing from the axis of rotation; by default 0. With one, or with pitch errors or
        faults, studies take the pair as a `Train` that repeats with the turns of its wheels; see `to_train`.
    pitch_errors : two lists of lengths, two paths, or table, optional
        Cumulative pitch deviation of each tooth, positive where it comes later, at the reference circle, teeth in the
        order in which they mesh: of each wheel a list, a file with the columns ``tooth`` and ``cumulative pitch
        deviation`` or ``single pitch deviation``, or none, ``[]``. Or ``{"seed": 1}``: drawn at random within the
        grade of ``quality``.
    faults : list of tables, optional
        Teeth that differ, each with ``wheel``, ``tooth``, and ``stiffness_loss``, the share of the stiffness that is
        lost in the pairs in which it meshes, ``crack_depth``, from which that follows by the potential energy of the
        tooth, or ``wear`` of its driving flank along the line of action.
    supports : Supports or table, optional
        Elastic supports along the line of action; rigid by default.
    application_factor : float, optional
        K_A of ISO 6336-1; by default 1, a load that the torque describes fully.
    speed : angular velocity, optional
        Of wheel 1; a plain number is in rpm.
    torque : torque, optional
        At wheel 1, not negative.

    Raises
    ------
    InputError
        For a value that breaks a rule, or a pair that cannot run. The message has the field, the rule, the value and
        what to do.

    Examples
    --------
    >>> design = GearDesign(teeth=(17, 103), module="8 mm", helix_angle="15.8 deg", face_width="100 mm",
    ...                     centre_distance="500 mm", profile_shift=(0.145, 0.0),
    ...                     tip_diameter=("159.66 mm", "872.35 mm"))
    >>> round(design.geometry.contact_ratio, 4)
    1.5491
    """

    def __post_init__(self, diametral_pitch: Any) -> None:
        if diametral_pitch is not None:
            if self.module is not None:
                raise InputError("diametral_pitch", "must be left out beside module", diametral_pitch)
            object.__setattr__(self, "module", module_of(diametral_pitch))
        if self.module is None:
            raise InputError("module", "must be given", None, "E.g. '3 mm'; or give diametral_pitch, e.g. 8.")
        convert_fields(self)
        check_inputs(self)
        check_geometry(self.geometry)
        check_wheels(self)
        check_load_sharing(self)
        check_faults(self.faults, self.teeth, drawn=True)
        for i, fault in enumerate(self.faults):
            for name, (kind, value) in fault.found.items():
                check_plausible(f"faults[{i}].{name}", kind.back(value), 0.0, _MOST_DEVIATION * self.module,
                                _A_DEVIATION)
        if not isinstance(self.pitch_errors, DrawnPitch):
            check_pitch(self.pitch_errors, self.teeth)
            for i, wheel in enumerate(self.pitch_errors):
                check_plausible(f"pitch_errors[{i}]", max(map(abs, wheel), default=0.0), 0.0,
                                _MOST_DEVIATION * self.module, _A_DEVIATION)
        elif self.quality is None:
            raise InputError("quality", "must be given where pitch errors are drawn", None,
                             "E.g. { standard = 'ISO 1328-1:1995', grade = 5 }.")
        _ = self.tooth_faults
        if self.backlash is not None:
            check_backlash(self.backlash, self.geometry)

    @classmethod
    def from_tables(cls, design: Mapping[str, Any], operation: Mapping[str, Any] | None = None) -> GearDesign:
        """A design from the tables ``[design]`` and ``[operation]`` of a study file.

        Parameters
        ----------
        design : mapping
            Inputs by name, without ``speed`` and ``torque``.
        operation : mapping, optional
            ``speed``, ``torque`` and ``application_factor``, all optional. Instead of the speed ``shaft_frequency`` or
            ``mesh_frequency`` may be given, in Hz or with a unit.

        Raises
        ------
        InputError
            For an unknown or missing name, one that is given twice, or a value that breaks a rule.
        """
        operation = operation or {}
        known = ["diametral_pitch", *(f.name for f in fields(cls) if f.name not in ("speed", "torque"))]
        for table, given, names in (("design", design, known), ("operation", operation, (*OPERATION, *FREQUENCIES))):
            for name in given:
                if name not in names:
                    raise unknown_key(f"[{table}]", name, given[name], names, {f.name: f for f in fields(cls)})
        if missing := [name for name in ("teeth", "module", "face_width") if name not in design and not (
                name == "module" and "diametral_pitch" in design)]:
            raise InputError(" and ".join(missing), "must be given in [design]", None,
                             "E.g. teeth = [20, 40], module = '3 mm', face_width = '20 mm'.")
        for name in operation:
            if name in design:
                raise InputError(name, "must be given in one table only", operation[name],
                                 "It is in [design] and in [operation].")
        speeds = [name for name in ("speed", *FREQUENCIES) if name in operation]
        if len(speeds) > 1:
            raise InputError(speeds[1], f"must be left out beside {speeds[0]}", operation[speeds[1]])
        out = dict(operation)
        if speeds and speeds[0] in FREQUENCIES:
            turns = to_si(speeds[0], out.pop(speeds[0]), FREQUENCY, POSITIVE)
            out["speed"] = 60 * turns / (TEETH("teeth", design["teeth"])[0] if "mesh" in speeds[0] else 1)
        return cls(**design, **out)

    def at(self, *, speed: float | str | None = None, torque: float | str | None = None) -> GearDesign:
        """The same design at another speed, in rpm, or torque, in N m, of wheel 1; or texts with other units."""
        given: dict[str, Any] = {
            name: value for name, value in (("speed", speed), ("torque", torque)) if value is not None}
        return replace(self, **given)

    def to_pair(self) -> GearPair:
        """The gear pair of (2.1) at this speed and torque.

        The reference stiffness c0 is the time mean of the mesh stiffness. The resisting torque balances the driving
        one; there is no bearing friction.

        Raises
        ------
        InputError
            If an input that the pair needs is missing: speed, torque, backlash, damping ratio, and inertia or bore.
        """
        weighed = self.mass is not None or (self.inertia is not None and self.supports is None)
        bodies = ["bore"] * (not weighed)
        if self.internal:
            bodies = ["inertia", *["mass"] * (self.supports is not None)]
        needed = [*["quality"] * (self.transmission_error in FROM_QUALITY), *bodies,
                  *(() if isinstance(self.stiffness, TableFile) else methods()[self.stiffness].needs),
                  "backlash", "damping_ratio", "speed", "torque"]
        self.require(dict.fromkeys(needed))
        stiffness, error, radii = self.mesh_stiffness, self.mesh_error, self.geometry.base_diameter
        reference, supports = stiffness.reference, dict[str, Any]()
        backlash, pairs = self.backlash_line_of_action, self.tooth_pairs
        if self.supports is not None:
            (c1, c2), (m1, m2), (first, second) = self.supports.stiffness, self.masses, self.supports.damping_ratio
            supports = {"m1": m1, "m2": m2, "c1": c1, "c2": c2, "k1": 2 * first * math.sqrt(c1 * m1),
                        "k2": 2 * second * math.sqrt(c2 * m2)}
        return GearPair(
            n1=self.teeth[0], n2=self.teeth[1], I1=self.inertias[0], I2=self.inertias[1], R1=radii[0] / 2,
            R2=radii[1] / 2, c0=reference, k=2 * self.given("damping_ratio") * math.sqrt(
                reference * self.equivalent_mass),
            backlash=backlash, M10=self.torque, speed=self.speed,
            error_amplitudes=error.amplitudes, error_phases=error.phases, damping_law=self.damping_law,
            **({"tooth_pairs": pairs} if pairs else stiffness.waveform.to_pair(reference, backlash / 2)), **supports)

    def to_model(self, kind: str | None = None) -> MeshModel:
        """The dimensionless model at this speed and torque; see `GearPair.to_model`."""
        model, one_pair = self.to_pair().to_model(kind), self._one_pair
        if isinstance(model.stiffness, ToothPairStiffness) and one_pair is not None:
            return replace(model, stiffness=replace(model.stiffness, levels=one_pair(self)[0]))
        return replace(model, stiffness=self.mesh_stiffness.waveform)

    def with_like_teeth(self) -> GearDesign:
        """The same design without what repeats once per turn."""
        return replace(self, faults=(), pitch_errors=((), ()), eccentricity=0.0) if self.turning else self

    def to_train(self) -> Train:
        """This pair as a train of the bodies wheel1 and wheel2, which can contain what repeats once per turn."""
        from gearchaos.gears.train.train import Train  # many modules, for teeth that differ alone

        return Train.of_pair(self.to_pair(), self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about unusual values, and about the transmission error; studies warn of them, too."""
        found = design_warnings(self)
        try:
            return (*found, *sentences(self.error_harmonics.warnings))
        except InputError as error:
            if isinstance(self.transmission_error, str):  # an input is missing, which is named elsewhere
                return found
            return (*found, *sentences([f"the transmission error cannot be used: {error}"]))

    @property
    def assumed(self) -> dict[str, str]:
        """In words what stands for what a drawing leaves open: stiffness, transmission error and damping, by the names
        of these fields of a mesh."""
        plastic = " (found for metals)" * (min(each.E for each in self.material) < PLASTIC_MODULUS)
        exact = f"no transmission error{' in spite of the grade' * (self.quality is not None)}"
        error = exact if self.exact else f"error {method_in_words(self.transmission_error)}"
        damping = {} if self.damping_ratio is None else {"damping": f"ζ {self.damping_ratio:g}"}
        rack = ", the ring as a rack" * (self.internal and self.stiffness == ISO)
        stiffness = f"stiffness {method_in_words(self.stiffness)}{rack}{plastic}"
        return {"stiffness": stiffness, "error_amplitudes": error, **damping}

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Sentences about what the methods of the transmission error and of the stiffness assume, how files were read,
        and what is not known of a ring.
        """
        found: list[str] = []
        with suppress(InputError):  # reported by what needs the transmission error
            found.extend(self.error_harmonics.assumptions)
        with suppress(InputError):  # reported by what needs the stiffness
            found.extend(self.mesh_stiffness.notes)
        if self.internal:
            free = 1e3 * self.geometry.start_of_active_profile[1]
            found.append("root stresses are those of the pinion. The root of the ring is that of its cutter, which "
                         f"must leave the involute up to {free:.5g} mm in diameter. Its rim counts as rigid. Formulae "
                         "have the signs of ISO 21771: z2, the diameters of the ring and a are negative there")
        return sentences(found)


def sentences(texts: Iterable[str]) -> tuple[str, ...]:
    """Texts with a capital letter and a full stop."""
    return tuple(f"{text[0].upper()}{text[1:].rstrip('.')}." for text in texts)


# the inputs that may name a file, and the key of its path, which is relative to the folder of a study file
FILES: tuple[tuple[str, str], ...] = tuple(
    (f.name, key) for f in fields(GearDesign) if isinstance(choice := f.metadata["convert"], Choice)
    for key in choice.files)
