"""Checks of a gear design: slips of units, wheels that cannot be, and warnings about unusual values."""

from __future__ import annotations

import math
from contextlib import suppress

from gearchaos.errors import InputError
from gearchaos.gears.design.drawing import Drawing
from gearchaos.gears.design.values import ErrorFile
from gearchaos.gears.geometry.checks import check_rack, geometry_warnings
from gearchaos.gears.geometry.corner_contact import DEEPEST
from gearchaos.gears.geometry.dimensions import KEEP_CLEARANCE
from gearchaos.gears.geometry.mechanics import PLASTIC_MODULUS, disc_diameter, disc_inertia, disc_mass, mesh_load
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import check_plausible, check_toothing
from gearchaos.gears.stiffness import methods, other_methods
from gearchaos.gears.stiffness.iso6336 import ISO, LOW_LINE_LOAD
from gearchaos.gears.transmission_error.harmonics import BOUND, FROM_QUALITY
from gearchaos.gears.transmission_error.tip_relief import unrelieved_length

USUAL_DAMPING = (0.03, 0.1)  # usual damping ratios of a mesh, see the parameter ``damping_ratio`` of `GearDesign`
# pitch line velocities in m/s above which a speed is refused, and above which there is a warning
FASTEST, FAST = 300.0, 60.0
# limits of a moment of inertia over that of a solid disc of the wheel's size, beyond which there is a warning. What is
# given may include all that turns with the wheel; what follows from the mass of a wheel is that of a disc of its size.
LEAST_INERTIA, MOST_INERTIA, MOST_MASS = 0.02, 1000.0, 20.0
# ratio of the stiffness of a table to that by ISO 6336-1, or its inverse, from which on there is a warning
FACTOR_TO_ISO = 10.0
CONSTANT = 1e-6  # variation of a stiffness over its greatest value below which it is taken to be constant
# load F_t/(b m_n) in Pa above which there is a warning: the bending stress at the root is several times as large
HIGH_LOAD = 3e8


def check_inputs(design: Drawing) -> None:
    """Raise `InputError` for slips of units and impossible racks, before what follows from the geometry is checked."""
    module = design.module
    check_toothing(module, design.pressure_angle, design.helix_angle)
    transverse, kind = module / math.cos(design.helix_angle), design.geometry_kind
    if design.internal:
        _check_ring(design)
    for wheel, width in enumerate(design.face_width):
        check_plausible(f"face_width[{wheel}]", width, 0.1 * module, 20 * transverse * max(design.teeth),
                        "It is between a tenth of the module and 20 reference diameters.")
    if design.centre_distance is not None:
        reference = transverse * kind.sum_of(design.teeth) / 2
        nominal = units.Length(reference, design.centre_distance)
        check_plausible("centre_distance", design.centre_distance, 0.8 * reference, 1.3 * reference,
                        f"Without profile shift it is {nominal} for these teeth and this module.")
    alterations = () if design.tip_alteration == KEEP_CLEARANCE else design.tip_alteration
    for name, lengths in (("tip_alteration", alterations), ("eccentricity", design.eccentricity)):
        for wheel, length in enumerate(lengths):
            check_plausible(f"{name}[{wheel}]", length, -module, module, "It is at most a module.")
    if design.tip_diameter is not None:
        if design.tip_alteration != (0.0, 0.0):
            shown = design.tip_alteration if isinstance(design.tip_alteration, str) else tuple(
                units.Length(each, each) for each in design.tip_alteration)
            raise InputError("tip_alteration", "must be left out beside tip_diameter", shown)
        for wheel, shift in enumerate(design.profile_shift or (0.0, 0.0)):
            diameter = design.tip_diameter[wheel]
            height = kind.signs[wheel] * module * (design.rack.addendum + shift)
            nominal = transverse * design.teeth[wheel] + 2 * height
            check_plausible(f"tip_diameter[{wheel}]", diameter, nominal - 2 * module, nominal + 2 * module,
                            f"The nominal tip diameter is {units.Length(nominal, diameter)}.")
    check_rack(design.rack, design.pressure_angle)
    if design.quality is not None and design.quality.deviations is not None and design.transmission_error != BOUND:
        raise InputError("quality.deviations", f'must be left out unless transmission_error = "{BOUND}"',
                         design.quality.deviations, "They make the error from what the grade permits.")


def _check_ring(design: Drawing) -> None:
    """Raise `InputError` for what an internal pair cannot have, or what is known of external teeth alone."""
    if design.teeth[0] >= design.teeth[1]:
        raise InputError("teeth", "must have the ring second, with more teeth than the pinion", list(design.teeth),
                         "Wheel 1, the pinion, drives. Where the ring drives, the pinion drives with its other flanks.")
    if design.bore is not None:
        raise InputError("bore", "must be left out beside internal", [units.Length(each) for each in design.bore],
                         "A ring has none. Give inertia, and mass with supports.")
    if design.blanks[1] is not None:
        raise InputError("blank[1]", "must be 'solid' beside internal", "a rim and a web",
                         "C_R of ISO 6336-1 is that of a web: a ring counts as rigid.")
    if any(fault.drawn for fault in design.faults):
        raise InputError("faults", "must not have a crack_depth beside internal", "a crack",
                         "What it takes away is known of external teeth: give stiffness_loss.")
    if isinstance(design.stiffness, str) and methods()[design.stiffness].external_only:
        raise InputError("stiffness", f"must be by {ISO} or from a table beside internal", design.stiffness,
                         "The root of a ring's tooth is that of its cutter. " + other_methods(
                             design.stiffness, design.geometry))


def check_load_sharing(design: Drawing) -> None:
    """Raise `InputError` for tooth pairs that a model cannot have, and for a relief that would have no effect."""
    if design.load_sharing == "tooth pairs" and design.one_spring:
        other = "" if design.no_tooth_pairs else "under load, "
        raise InputError("load_sharing", f"must be {other}prescribed or left out: {design.one_spring}",
                         design.load_sharing)
    if design.load_sharing == "under load" and (not design.helix_angle or design.no_tooth_pairs):
        raise InputError("load_sharing", "must be left out or prescribed for these teeth", design.load_sharing,
                         f"{design.no_tooth_pairs.capitalize()}." if design.no_tooth_pairs else
                         "Strips across the width are for helical teeth; spur teeth share the load as tooth pairs.")
    if design.corner_contact is not None and not design.has_gaps:
        reason = design.no_tooth_pairs
        raise InputError("corner_contact", "must be left out where the mesh is one spring", design.corner_contact,
                         f"{reason.capitalize()}." if reason else
                         "Tip corners meet where each tooth pair has a gap: leave load_sharing out.")
    for name in ("lead_crowning", "lead_slope"):
        if getattr(design, name) and not design.in_strips:
            raise InputError(name, "must be left out where the mesh is not in strips across the width"
                             if design.helix_angle else "must be left out for spur gears",
                             units.Shown(getattr(design, name), getattr(design, name)),
                             "It acts on helical pairs, by load_sharing = 'under load', their default.")
        check_plausible(name, getattr(design, name), -design.module / 5, design.module / 5,
                        "It is at most a fifth of a module.")
    if design.corner_contact:
        _ = design.corner_gaps  # raises where a corner is off the involute
    relief = design.tip_relief
    if design.load_sharing == "prescribed" and relief is not None and any(relief.amount) and not design.one_spring:
        raise InputError("load_sharing", "must not be prescribed beside a tip_relief", design.load_sharing,
                         "A relief acts where each tooth pair has a gap of its own; on one spring it would do nothing. "
                         "Leave load_sharing out, or tip_relief.")


def check_wheels(design: Drawing) -> None:
    """Raise `InputError` for bores, blanks, tip relief or speed that do not fit the wheels."""
    geometry, module = design.geometry, design.geometry.normal_module
    for wheel, bore in enumerate(design.bore or ()):
        check_plausible(f"bore[{wheel}]", bore, 0.0, geometry.root_diameter[wheel] - module,
                        "It leaves at least half a module below the root circle.")
    for wheel, blank in enumerate(design.blanks):
        if blank is not None:
            room = (geometry.root_diameter[wheel] - (0.0 if design.bore is None else design.bore[wheel])) / 2
            check_plausible(f"blank[{wheel}].rim", blank.rim, 0.1 * module, room,
                            "It lies between the root circle and the bore.")
            width = design.face_width[wheel]
            check_plausible(f"blank[{wheel}].web", blank.web, 0.01 * width, 2 * width,
                            "It is between a hundredth and twice the face width.")
    if design.tip_relief is not None:
        for wheel, amount in enumerate(design.tip_relief.amount):
            check_plausible(f"tip_relief.amount[{wheel}]", amount, 0.0, module / 5,
                            "It is at most a fifth of a module.")
        for wheel, start in enumerate(design.tip_relief.start_diameter or ()):
            least, most = sorted((geometry.start_of_active_profile[wheel], geometry.tip_diameter[wheel]))
            check_plausible(f"tip_relief.start_diameter[{wheel}]", start, least, most,
                            "It lies between the start of active profile and the tip.")
            if start == geometry.tip_diameter[wheel] and design.tip_relief.amount[wheel]:
                side = "smaller" if geometry.signs[wheel] > 0 else "greater"
                raise InputError(f"tip_relief.start_diameter[{wheel}]", f"must be {side} than the tip diameter",
                                 units.Shown(start, start), "A relief of no length has no effect: leave it out.")
    if design.speed is not None:
        check_speed_range(design, design.speed)


def check_speed_range(design: Drawing, *speeds: float) -> None:
    """Raise `InputError` for speeds of wheel 1, in rpm, above the limit of the pitch line velocity."""
    for speed in speeds:
        if (velocity := _velocity(design, speed)) > FASTEST:
            raise InputError("speed", f"must keep the pitch line velocity below {FASTEST:g} m/s",
                             units.Shown(speed, speed),
                             f"It gives {velocity:.4g} m/s. A speed without a unit is in rpm.")


def _velocity(design: Drawing, speed: float) -> float:
    """Pitch line velocity at the reference circles, m/s, at a speed of wheel 1 in rpm."""
    return mesh_load(design.geometry, speed * units.RPM, 0.0, 1.0).velocity


def design_warnings(design: Drawing) -> tuple[str, ...]:
    """Sentences about values that are possible but unusual."""
    (low, high), found = USUAL_DAMPING, [*geometry_warnings(design.geometry)]
    if design.damping_ratio is not None and not low <= design.damping_ratio <= high:
        found.append(f"damping_ratio is {design.damping_ratio:g}; usual are {low:g} to {high:g}.")
    if design.speed is not None and (velocity := _velocity(design, design.speed)) > FAST:
        found.append(f"The pitch line velocity is {velocity:.4g} m/s at {design.speed:.6g} rpm, unusually high.")
    if design.torque is not None:
        load = mesh_load(design.geometry, 0.0, design.torque, 1.0).line_load / design.module
        if load > HIGH_LOAD:
            found.append(f"The load F_t/(b m_n) is {load / 1e6:.4g} N/mm², unusually high: is the torque in N*m?")
    if plastic := [str(n) for n, each in enumerate(design.material, 1) if each.E < PLASTIC_MODULUS]:
        found.append(
            f"Plastic of wheel {' and '.join(plastic)}: E is that of a short load at one temperature and humidity; it "
            "may be half as large when warm, wet or under a lasting load. ISO 6336-1 was found for metals: its "
            "stiffness takes E alone into account, and its rule for low loads, (90), is that of steel. A plastic damps "
            "more than steel, to which the usual damping ratios belong.")
    found += [*_inertia_warnings(design), *_stiffness_warnings(design), *_error_warnings(design)]
    if design.has_gaps and design.corner_contact is None and (reason := design.no_corner_contact):
        found.append(f"Tooth pairs touch on their nominal path alone, without corner contact. {reason}")
    with suppress(InputError):  # reported by what needs the stiffness
        if design.torque is not None and design.has_gaps:
            force = 2 * abs(design.torque) / design.geometry.base_diameter[0]
            share = force / design.mesh_stiffness.reference / design.module
            if share > DEEPEST:
                found.append(f"Under the load the teeth give way by {share:.2g} modules. Corner contact is followed to "
                             f"{DEEPEST:g}, beyond which the stiffness is not valid either: the teeth are too soft, or "
                             "the torque too high, for what is said of motions.")
    if any(design.blanks) and design.stiffness != ISO:
        found.append("blank has no effect on the motion: C_R belongs to the mesh stiffness by ISO 6336-1, which is not "
                     "the method of the design. It counts in K_v of the standards.")
    if any(design.blanks) and design.inertia is None and not design.internal:
        found.append("blank has no effect on masses and moments of inertia, which are those of solid discs: give mass "
                     "and inertia.")
    return tuple(found)


def _inertia_warnings(design: Drawing) -> list[str]:
    """Warnings about a mass or a bore without effect, and about inertias far from those of solid discs of this size."""
    bored = [method.name for method in methods().values() if "bore" in method.needs]
    geometry, found = design.geometry, [
        f"{name} has no effect on the motion: inertia is given, and {reason}." for name, reason, holds in (
            ("mass", "the supports are rigid", design.supports is None),
            ("bore", f"the stiffness is not by {' or '.join(bored)}", design.stiffness not in bored and (
                design.supports is None or design.mass is not None)),
        ) if holds and design.inertia is not None and getattr(design, name) is not None]
    if design.inertia is None and design.mass is None:
        return []
    subject, unit, most = "inertia", "kg*m^2", MOST_INERTIA
    if design.inertia is None:
        subject, unit, most = "mass", "kg", MOST_MASS
    for wheel, inertia in enumerate(design.inertias):
        diameter, material = disc_diameter(geometry)[wheel], design.material[wheel]
        mass = disc_mass(diameter, 0.0, design.face_width[wheel], material.density)
        ratio = inertia / disc_inertia(diameter, 0.0, mass)
        if not LEAST_INERTIA < ratio < most:
            found.append(f"{subject}[{wheel}] is {ratio:.3g} times that of a solid disc of the size of wheel "
                         f"{wheel + 1}: is it in {unit}?")
    return found


def _stiffness_warnings(design: Drawing) -> list[str]:
    """Warnings about a mesh stiffness outside the range of its method, or from a table far from others or constant."""
    try:
        if isinstance(design.stiffness, str):
            found = [f"{text}." for text in methods()[design.stiffness].warnings(design)]
            if design.turning and design.stiffness == ISO and design.torque is not None and mesh_load(
                    design.geometry, 0.0, design.torque, design.application_factor).line_load < LOW_LINE_LOAD:
                found.append("Where teeth differ, the mesh stiffness stays that at the torque of the design where the "
                             "torque is varied, although that of ISO 6336-1 depends on it here.")
            if design.turning and design.under_load:
                found.append("Where teeth differ, stiffness and error under load stay those at the torque of the "
                             "design where the torque is varied.")
            return found
        own, *others = design.comparable_stiffnesses
    except InputError:  # reported by what needs the stiffness
        return []
    (least, greatest), mean = own.extremes, f"{own.reference / 1e6:.4g} N/µm"
    found = [f"The mesh stiffness of the table is constant, {mean}: it excites nothing."] * (
        greatest - least < CONSTANT * greatest)
    for other in others:
        ratio = own.reference / other.reference
        if other.method == ISO and not 1 / FACTOR_TO_ISO < ratio < FACTOR_TO_ISO:
            found.append(f"The mean mesh stiffness of the table is {mean}, {ratio:.3g} times the "
                         f"{other.reference / 1e6:.4g} N/µm by ISO 6336-1: is the unit in its header right?")
    return found


def _error_warnings(design: Drawing) -> list[str]:
    """Warnings about exact teeth, tip relief and what repeats once per turn: what of them the motion does not show."""
    found = []
    if design.quality is not None and design.transmission_error is None:
        found.append("The teeth are taken to be exact although a quality is given: write transmission_error = 'from "
                     "quality', { orders = 'te.csv' } or { table = 'te.csv' }, or 'none' if exact teeth are meant.")
    if design.relief_left_out:
        begins = " and ".join(str(units.Length(d, d)) for d in design.geometry.single_contact_diameter)
        found.append("tip_relief has no effect on the motion: give its start_diameter, where it begins. "
                     f"{design.geometry.least_contact.capitalize()} begins at {begins}.")
    elif design.has_gaps and any(getattr(design.tip_relief, "amount", ())) and isinstance(
            design.transmission_error, ErrorFile):
        found.append("tip_relief acts through the tooth pairs, and the transmission error comes from a file: it must "
                     "be that of teeth without relief.")
    elif design.tip_relief is not None and any(design.tip_relief.amount) and not design.has_gaps:
        # the model has no tooth pairs, which relief spares an impact under load
        effect = ("tip_relief is added to the transmission error as that of rigid teeth without load: it can raise the "
                  "dynamic factor, and more so the longer it is, where it lowers that of real gears.")
        with suppress(InputError):  # reported by what needs the transmission error
            if design.exact:
                effect = ("tip_relief has no effect on the motion, since the teeth are taken to be exact: "
                          f"transmission_error is {design.transmission_error or 'left out'}.")
            elif design.transmission_error not in FROM_QUALITY:
                effect = ("tip_relief has no effect on the motion, since the transmission error comes from a file, "
                          "which must contain the relief.")
            elif design.path_relief is not None:
                free, pitch = unrelieved_length(design.geometry, design.path_relief), design.geometry.base_pitch
                if free >= pitch:
                    effect = (f"tip_relief has no effect on the motion: it leaves {free * 1e3:.4g} mm of the path of "
                              f"contact as it is, at least the base pitch of {pitch * 1e3:.4g} mm, so that unloaded "
                              "teeth never touch there.")
            found.append(f"{effect} What relief is for, the entry of a tooth pair under load, is left out: the mesh "
                         "stiffness is that of teeth without relief.")
    if largest := max(design.eccentricity):
        backlash = 2 * math.sin(design.geometry.working_pressure_angle) * largest
        found.append(f"eccentricity acts as an error of ±{largest * 1e6:.4g} µm; that it changes the backlash by "
                     f"±{backlash * 1e6:.4g} µm is left out.")
    return found
