"""The quantities of a gear design: all that follows from it, with symbol, unit, formula and source.

A quantity that cannot be computed has no value but a reason: an input that is missing, or a standard that does not
apply.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import DynamicFactor, Standard, standards
from gearchaos.gears.dynamic_factor.main_resonance import Resonance, lower_limit_ratio, resonance
from gearchaos.gears.geometry.dimensions import DESIGN_FORMULAS, GEOMETRY_FORMULAS
from gearchaos.gears.geometry.mechanics import MeshLoad
from gearchaos.gears.geometry.root_stress import ROOT_STRESS, RootFactors, root_factors, root_stress
from gearchaos.gears.io.fields import Formula, formulas
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.helical import AtRest
from gearchaos.gears.operation.loaded_error import best_relief, contact_ratio_under_load, peak_to_peak, two_pairs_from
from gearchaos.gears.stiffness import MeshStiffness
from gearchaos.gears.stiffness.iso6336 import ToothStiffness
from gearchaos.gears.transmission_error import Tolerances, tolerances
from gearchaos.gears.transmission_error.harmonics import BOUND, FROM_QUALITY, QualityError, from_quality
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995

# what the rows of the transmission error say of a design without one
_NO_ERROR = ("none given: the gears are taken to be exact; write transmission_error = \"from quality\" or "
             "{ orders = \"te.csv\" }")
_QUALITY_FORMULA = ("from the grade e_j = 4 √(f_i1′² + f_i2′²)/(π j)², f_i′ = K (4.3 2^((Q−5)/2) + f_pt + F_α), "
                    "K = 0.2 (ε_γ + 4)/ε_γ, at least 0.4")
_AMPLITUDES, _PHASES, _PHASE = "transmission_error_amplitudes", "transmission_error_phases", "θ_j"
_ROUNDING = 1e-9  # length in mm below which a value is a rounding error of lengths of the pair
_ANY_SPEED = 1.0  # a speed, rpm, for values that do not depend on it


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One quantity of a datasheet, in ``unit``: a tuple of two for both wheels, of any length for harmonics.

    It is None if it cannot be computed; then there is a reason. It is expected if the design is complete without the
    value, as without the frequency of rigid supports. See `gearchaos.gears.io.fields.Formula` for the rest.
    """

    value: float | tuple[float, ...] | None
    unit: str
    symbol: str
    formula: str
    source: str
    group: str
    words: str = ""
    reason: str = ""
    expected: bool = False

    @property
    def shown(self) -> float | tuple[float, ...] | None:
        """The value as text and page show it: phases in 0 to 360°, and 0 for a length that is a rounding error."""
        if self.value is None:
            return None
        values = self.value if isinstance(self.value, tuple) else (self.value,)
        shown = tuple(v % 360 if self.symbol == _PHASE else 0.0 if self.unit == "mm" and abs(v) < _ROUNDING else v
                      for v in values)
        return shown if isinstance(self.value, tuple) else shown[0]


def datasheet(design: GearDesign, names: Collection[str] = ()) -> dict[str, Entry]:
    """The quantities of a design with these ``names``, or all; those that need a missing input have a reason instead of
    a value."""
    results, entries = _Results(design), dict[str, Entry]()
    of_standards = {name: row for each in standards() for name, row in _standard_rows(each).items()}
    groups = {**_GROUPS, "Dynamic factor": of_standards}
    for group, name, (formula, compute) in ((g, n, row) for g, rows in groups.items() for n, row in rows.items()
                                            if n in (names or rows)):
        value: Any = None
        reason, expected = "", False
        try:
            value = compute(results)
        except _NoValueError as error:
            reason, expected = error.args[0], len(error.args) > 1
        except InputError as error:
            reason = str(error)
        if isinstance(value, tuple):  # wheel 2 has no root form diameter where it is a ring, nor others of the kind
            value = tuple(v for v in value if math.isfinite(v))
        if value is not None and formula.factor != 1.0:  # whole numbers stay so
            value = tuple(v * formula.factor for v in value) if isinstance(value, tuple) else value * formula.factor
        entries[name] = Entry(
            value=value, unit=formula.unit, symbol=formula.symbol, formula=formula.text, source=formula.source,
            group=group, words=formula.words or name.replace("_", " "), reason=reason, expected=expected)
    if _AMPLITUDES not in entries:
        return entries
    if design.exact:
        entries |= {name: replace(entries[name], formula=_NO_ERROR) for name in (_AMPLITUDES, _PHASES)}
    elif not (amplitudes := entries[_AMPLITUDES]).reason:
        text, method = amplitudes.formula, design.transmission_error
        if method in FROM_QUALITY:
            text += f"; {_QUALITY_FORMULA}" + "; a third of that for typical pairs" * (method != BOUND)
        entries[_AMPLITUDES] = replace(
            amplitudes, source=f"{amplitudes.source}; {design.error_harmonics.source}", formula=text)
    return entries


def with_scanned_speeds(entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """The entries of a design without a speed that is shown along the speed: what lacks only the speed says so."""
    return {name: replace(e, reason="depends on speed: see the curve", expected=True)
            if e.reason.startswith("speed must be given") else e for name, e in entries.items()}


class _NoValueError(Exception):
    """There is no value; the message is the reason, followed by True if that is ``expected``."""


class _Results:
    """What the quantities of a design are taken from; a missing input raises `InputError` at the first use."""

    def __init__(self, design: GearDesign) -> None:
        self.design, self.geometry = design, design.geometry

    @cached_property
    def tooth(self) -> ToothStiffness:
        return self.design.tooth_stiffness

    @cached_property
    def mesh(self) -> MeshStiffness:
        return self.design.nominal_stiffness

    @cached_property
    def load(self) -> MeshLoad:
        """Load of the mesh; its velocity is that of the design if this has a speed, else 0."""
        return replace(self.design, speed=self.design.speed or _ANY_SPEED).load

    @property
    def root(self) -> RootFactors:
        return root_factors(self.geometry)

    @property
    def root_stress(self) -> tuple[float, ...]:
        return root_stress(self.geometry, self.design.given("torque"))

    @cached_property
    def tolerances(self) -> tuple[Tolerances, Tolerances]:
        return tolerances(self.design.given("quality"), self.geometry)

    @property
    def mean_stiffness(self) -> float:
        """Mean of the mesh stiffness by the method of the design, over the face width, N/m²."""
        return self.mesh.reference / self.geometry.common_face_width

    @property
    def reduced_mass(self) -> float:
        return self.design.equivalent_mass / self.geometry.common_face_width

    @property
    def line_load(self) -> float:
        """Line load for the limit of the main resonance, N/m; without a torque as high as not to matter."""
        return 100e3 if self.design.torque is None else self.load.line_load

    @cached_property
    def resonance(self) -> Resonance:
        return resonance(self.design.teeth[0], self.mean_stiffness, self.reduced_mass, self.line_load)

    @property
    def tangential_composite_deviation(self) -> tuple[float, float]:
        """f_i′ of both wheels, m; raises `_NoValueError` for an edition that does not derive it from f_pt and F_α."""
        quality = self.design.given("quality")
        if quality.standard != ISO_1995:
            raise _NoValueError(
                f"{quality.standard} has no formula for f_i′ in terms of f_pt and F_α. The transmission error from "
                f"quality uses that of {ISO_1995}, annex A, with these deviations: an assumption, see e_j.")
        return from_quality(self.geometry, quality, self.tolerances).tooth_to_tooth

    @property
    def support_frequencies(self) -> tuple[float, float]:
        """Natural frequencies of the wheels on their supports, without the mesh, rad/s."""
        if self.design.supports is None:
            raise _NoValueError("The supports are rigid.", True)
        (c1, c2), (m1, m2) = self.design.supports.stiffness, self.design.masses
        return math.sqrt(c1 / m1), math.sqrt(c2 / m2)

    @cached_property
    def best_relief(self) -> tuple[tuple[float, float], float]:
        """The tip relief with which the deflection varies least: without a start from single contact to the tip,
        without an amount alike on both wheels; raises `_NoValueError` where tooth pairs do not share the load."""
        design, relief = self.design, self.design.tip_relief
        given = relief is not None and any(relief.amount)
        if design.shares_load and (relief is None or not given or relief.start_diameter is None):
            design = replace(design, tip_relief={"start_diameter": list(self.geometry.single_contact_diameter),
                                                 "amount": list(relief.amount) if given else 1e-3 * design.module})
        found = best_relief(design)
        if found is None:
            raise _NoValueError("The best relief is sought for spur gears alone." if self.design.in_strips else
                                "The mesh is one spring, on which a relief does not share the load.", True)
        return found

    @property
    def best_relief_start(self) -> tuple[float, float]:
        """Where that tip relief begins, m; raises `_NoValueError` as it does."""
        _ = self.best_relief
        relief = self.design.tip_relief
        return (relief and relief.start_diameter) or self.geometry.single_contact_diameter

    @property
    def loaded(self) -> GearDesign:
        """The design; raises `_NoValueError` where nothing is known of its teeth under load."""
        return self.design if self.design.under_load else self.sharing

    @property
    def strips(self) -> AtRest:
        """The strips of a helical pair at rest; raises `_NoValueError` where there are none."""
        if not self.design.under_load:
            raise _NoValueError("Strips across the width need a torque." if self.design.in_strips else
                                "The mesh is one spring." if self.design.helix_angle else
                                "Spur gears are not cut into strips across the width.", True)
        return self.design.strips.cycle

    @property
    def sharing(self) -> GearDesign:
        """The design; raises `_NoValueError` where tooth pairs are no springs of their own."""
        if self.design.in_strips:
            raise _NoValueError("Helical gears have it along the width, not at one instant." if self.design.torque
                                else "There is no load.", True)
        if not self.design.shares_load:
            reason = f", since {self.design.no_tooth_pairs}" if self.design.no_tooth_pairs else (
                ". Leave load_sharing out to give each tooth pair its own")
            raise _NoValueError(f"The mesh is one spring{reason}.", True)
        return self.design

    @property
    def two_pairs_from(self) -> float:
        """Raises `_NoValueError` where there is no such torque."""
        if (found := two_pairs_from(self.sharing)) is None:
            raise _NoValueError("No torque that the teeth can bear keeps two tooth pairs in contact.", True)
        return found

    @property
    def corner_gap_coefficient(self) -> tuple[float, float]:
        """1/m, leaving and entering; raises `_NoValueError` without corner contact."""
        design = self.design if self.design.in_strips else self.sharing
        if not design.has_corner_contact:
            reason = self.design.no_corner_contact or "corner_contact = true goes beyond it."
            raise _NoValueError(f"Contact is on the nominal path alone. {reason}", True)
        leaving, entering = self.design.corner_gaps
        return leaving.gap[0], entering.gap[0]

    def factor(self, standard: Standard) -> DynamicFactor:
        """The dynamic factor by a standard, in method B without running-in; raises `_NoValueError` if there is none."""
        for name in standard.needs:
            self.design.given(name)
        found = standard.factor(self.design)
        if found.value is None:
            raise _NoValueError(found.reason)
        return found


_Row = tuple[Formula, Callable[[_Results], Any]]


def _of(path: str, table: Mapping[str, Formula]) -> dict[str, _Row]:
    """Rows for the values of one result by the names of its fields."""
    return {name: (formula, attrgetter(f"{path}.{name}")) for name, formula in table.items()}


def _row(value: str | Callable[[_Results], Any], symbol: str, unit: str, factor: float, text: str, source: str) -> _Row:
    """The row of a value, which is an attribute of the results or computed from them."""
    return Formula(symbol, unit, factor, text, source), attrgetter(value) if isinstance(value, str) else value


def _tolerance(symbol: str, name: str) -> _Row:
    return _row(lambda results: tuple(getattr(t, name) for t in results.tolerances), symbol, "µm", 1e6,
                "by module, diameter and grade", "ISO 1328-1, edition of the quality")


def _standard_rows(standard: Standard) -> dict[str, _Row]:
    """The rows of K_v by a standard, and of what it shows beside it."""
    def getter(field: str) -> Callable[[_Results], Any]:
        return lambda results: getattr(results.factor(standard), field)

    rows = formulas(standard.result)
    return {standard.name: (replace(rows["value"], words=standard.long_name), getter("value")),
            **{name: (rows[field], getter(field)) for name, field in standard.beside.items()}}


_MODEL = "gearchaos, docs/gears.md"
_RESONANCE = formulas(Resonance)

# the quantities by heading and name, but those of standards: how each is described, and a function that takes it from
# the results
_GROUPS: dict[str, dict[str, _Row]] = {
    "Geometry": _of("geometry", GEOMETRY_FORMULAS),
    "Backlash and inertia": _of("design", DESIGN_FORMULAS),
    "Load": {
        **_of("load", formulas(MeshLoad)),
        "velocity": (formulas(MeshLoad)["velocity"], attrgetter("design.load.velocity"))},
    "Tooth root": {**_of("root", formulas(RootFactors)), "root_stress": (ROOT_STRESS, attrgetter("root_stress"))},
    "Tolerances": {
        **{each: _tolerance(symbol, each.removesuffix("_deviation")) for symbol, each in (
            ("f_pt", "single_pitch_deviation"), ("F_p", "cumulative_pitch_deviation"), ("F_α", "profile_deviation"),
            ("f_fα", "profile_form_deviation"), ("f_Hα", "profile_slope_deviation"), ("F_r", "runout"))},
        "tangential_composite_deviation": (
            formulas(QualityError)["tooth_to_tooth"], attrgetter("tangential_composite_deviation"))},
    "Tooth stiffness by ISO 6336-1": _of("tooth", {
        name: formula for name, formula in formulas(ToothStiffness).items() if name != "mesh_stiffness"}),
    "Mesh stiffness": {
        "mesh_stiffness": _row("mean_stiffness", "c_γα", "N/(mm µm)", 1e-9,
                               "mean over the mesh cycle, by the method of the design", _MODEL),
        "mesh_stiffness_mean": _row("mesh.reference", "c0", "N/µm", 1e-6,
                                    "mean over the mesh cycle of teeth on their nominal path, over the whole "
                                    "face width: c_γα b", _MODEL),
        "mesh_stiffness_under_load": _row(
            lambda results: float(results.strips.stiffness.mean()), "", "N/µm", 1e-6,
            "mean over the mesh cycle at rest under the torque, of helical gears: c0 of the model", _MODEL),
        "mesh_stiffness_range": _row("mesh.extremes", "c_min, c_max", "N/µm", 1e-6,
                                     "least and greatest over the mesh cycle", _MODEL),
        "mesh_period_roll_angle": _row(
            lambda results: 2 * math.pi / results.design.teeth[0], "", "deg", 180 / math.pi,
            "360°/z1: roll angle of wheel 1 over the mesh period, that of the stiffness curve", "kinematics"),
        "mesh_stiffness_truncation": _row("mesh.truncation", "", "", 1.0,
                                          "root mean square error of steps or harmonics over the mean", _MODEL)},
    "Load sharing": {
        "loaded_error_peak_to_peak": _row(
            lambda results: peak_to_peak(results.design), "", "µm", 1e6, "mesh deflection at rest under the "
            "torque, peak to peak: loaded transmission error of teeth exact but for a relief that tooth pairs have",
            _MODEL),
        "contact_ratio_under_load": _row(
            lambda results: contact_ratio_under_load(results.loaded), "", "", 1.0, "tooth pairs in contact at rest "
            "under the torque, mean over the mesh cycle; of helical pairs length of the contact lines over the face "
            "width", _MODEL),
        "width_in_contact": _row(
            lambda results: float(results.strips.width.mean()), "", "%", 100.0, "share of the face width on which "
            "tooth pairs touch at rest under the torque, mean over the mesh cycle", _MODEL),
        "largest_line_load": _row(
            lambda results: float(results.strips.line_load.max()), "", "N/mm", 1e-3, "largest force per width between "
            "two teeth at rest under the torque, along the line of action", _MODEL),
        "two_pairs_from": _row(
            "two_pairs_from", "", "N m", 1.0, "torque at wheel 1 from which two tooth pairs touch at rest at every "
            "position; 0 where any torque does, as at contact ratios from 2 on without relief", _MODEL),
        "corner_gap_coefficient": _row(
            "corner_gap_coefficient", "", "1/mm", 1e-3, "gap at a small way x beyond the path, leaving and "
            "entering: this times x²", _MODEL),
        "best_tip_relief": _row(
            lambda results: results.best_relief[0], "C_a", "µm", 1e6, "amounts in the given ratio, over the given "
            "lengths, or else alike from single contact to the tip, up to four times what one pair bends, with which "
            "the mesh deflection under the torque varies least", _MODEL),
        "best_tip_relief_start": _row(
            "best_relief_start", "d_Ca", "mm", 1e3, "diameters at which the best tip relief begins: those given, or of "
            "the highest points of single contact", _MODEL),
        "best_loaded_error_peak_to_peak": _row(
            lambda results: results.best_relief[1], "", "µm", 1e6, "mesh deflection under the torque with that "
            "relief, peak to peak", _MODEL)},
    "Supports": {
        "support_frequency": _row("support_frequencies", "f_n", "Hz", 1 / (2 * math.pi), "√(c_n/m_n)/(2π): each wheel "
                                  "on its support, without the mesh", "Łuczko 2008, (2.1)")},
    "Transmission error of the unloaded gears": {
        _AMPLITUDES: _row("design.error_harmonics.amplitudes", "e_j", "µm", 1e6, "e(t) = Σ e_j cos(jω_z t − θ_j), peak "
                          "amplitudes along the line of action", "Łuczko 2008, (2.4)"),
        _PHASES: _row("design.error_harmonics.phases", _PHASE, "deg", 180 / math.pi,
                      "phases; at t = 0 a tooth pair enters contact", "Łuczko 2008, (2.4)")},
    "Eccentricity": {
        "eccentricity_error_amplitude": _row(
            "design.eccentricity", "", "µm", 1e6, "e; once per turn, order 1/z of the mesh frequency",
            "kinematics, base tangent plane"),
        "eccentricity_backlash_amplitude": _row(
            lambda results: tuple(e * (2 * math.sin(results.geometry.working_pressure_angle))
                                  for e in results.design.eccentricity),
            "", "µm", 1e6, "2 e sin α_wt; once per turn: not part of the model", "kinematics, base tangent plane")},
    "Damping": {
        "damping_ratio": _row(
            lambda results: results.design.given("damping_ratio"), "ζ", "", 1.0, "given; usual are 0.03 to 0.1, the "
            "least known of all inputs", "Kasuba and Evans 1981; Wang and Cheng 1981")},
    "Resonance": {
        **_of("resonance", _RESONANCE),
        "reduced_mass": (_RESONANCE["reduced_mass"], attrgetter("reduced_mass")),
        "lower_limit_ratio": (_RESONANCE["lower_limit_ratio"], lambda results: lower_limit_ratio(results.line_load)),
        "resonance_ratio": _row(lambda results: results.resonance.ratio(results.design.given("speed") * RPM), "N", "",
                                1.0, "n1/n_E1 at the mean stiffness by the method of the design",
                                "ISO 6336-1:2006, 6.4.2, (9)")},
}


def pair_title(design: GearDesign) -> str:
    """Kind, teeth and module of a pair."""
    kind = "Helical" if design.helix_angle else "Spur"
    kind = f"Internal {kind.lower()}" if design.internal else f"{kind} gear"
    return f"{kind} pair {design.teeth[0]}/{design.teeth[1]}, module {design.module * 1e3:.6g} mm"
