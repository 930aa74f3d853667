"""The datasheet of a gear design: every quantity that follows from it, with symbol, unit, formula and source.

A quantity that cannot be computed has no value but a reason: an input that is missing, or a standard that does not
apply.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor.agma import DynamicFactorAGMA
from gearchaos.gears.dynamic_factor.all_standards import DynamicFactors, dynamic_factors
from gearchaos.gears.dynamic_factor.iso_method_b import DynamicFactorB
from gearchaos.gears.dynamic_factor.iso_method_c import DynamicFactorC
from gearchaos.gears.dynamic_factor.resonance import Resonance, lower_limit_ratio, resonance
from gearchaos.gears.formulas import Formula, formulas
from gearchaos.gears.geometry.formulas import DESIGN_FORMULAS, GEOMETRY_FORMULAS
from gearchaos.gears.mesh_load import MeshLoad
from gearchaos.gears.stiffness.iso6336 import ToothStiffness
from gearchaos.gears.transmission_error.harmonics import QualityError, from_quality
from gearchaos.gears.transmission_error.quality import ISO_1995, Tolerances, tolerances
from gearchaos.gears.units import RPM


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One quantity of a datasheet.

    Attributes
    ----------
    value : float, tuple of float or None
        In ``unit``; a tuple of two for what belongs to each wheel, of any length for harmonics. None if it cannot be
        computed.
    unit, symbol, formula, source : str
        See `gearchaos.gears.formulas.Formula`.
    group : str
        Heading under which it is shown.
    reason : str
        Why there is no value; empty if there is one.
    expected : bool
        Whether the design is complete without the value, as without the frequency of rigid supports.
    """

    value: float | tuple[float, ...] | None
    unit: str
    symbol: str
    formula: str
    source: str
    group: str
    reason: str = ""
    expected: bool = False


def datasheet(design: GearDesign) -> dict[str, Entry]:
    """All quantities of a design by name.

    Parameters
    ----------
    design : GearDesign
        May lack inputs; the quantities that need them have a reason instead of a value.
    """
    results = _Results(design)
    entries = {
        name: _entry(group, formula, results, compute)
        for group, rows in _GROUPS.items() for name, (formula, compute) in rows.items()
    }
    return {**entries, **_error_entries(design, entries)}


def with_scanned_speeds(entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """The entries of a design without a speed that is shown along the speed: what lacks only the speed says so."""
    return {
        name: replace(e, reason="depends on speed: see the curve", expected=True)
        if e.reason.startswith("speed must be given") else e for name, e in entries.items()
    }


def shown_value(entry: Entry) -> float | tuple[float, ...] | None:
    """The value as text and page show it: phases in 0 to 360°, and 0 for a length that is a rounding error."""
    if entry.value is None:
        return None
    values = entry.value if isinstance(entry.value, tuple) else (entry.value,)
    if entry.symbol == _PHASE:
        values = tuple(v % 360 for v in values)
    if entry.unit == "mm":
        values = tuple(0.0 if abs(v) < _ROUNDING else v for v in values)
    return values if isinstance(entry.value, tuple) else values[0]


_PHASE = "θ_j"
_ROUNDING = 1e-9
"""Length in mm below which a value is a rounding error of lengths of the pair."""


def _error_entries(design: GearDesign, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """The rows of the transmission error with the formula and source of its method, or with what to write for one."""
    rows = {name: entries[name] for name in ("transmission_error_amplitudes", "transmission_error_phases")}
    if design.exact:
        return {name: replace(row, formula=NO_ERROR_ADVICE) for name, row in rows.items()}
    try:
        error = design.error_harmonics
    except InputError:  # the rows have the reason
        return {}
    row = rows["transmission_error_amplitudes"]
    formula = f"{row.formula}; {_QUALITY_FORMULA}" if design.transmission_error == "from quality" else row.formula
    return {"transmission_error_amplitudes": replace(row, formula=formula, source=f"{row.source}; {error.source}")}


NO_ERROR_ADVICE = ("none given: the gears are taken to be exact; write transmission_error = \"from quality\" or "
                   "{ orders = \"te.csv\" }")
"""What the rows of the transmission error say of a design without one."""

_QUALITY_FORMULA = ("from the grade e_j = 4 √(f_i1′² + f_i2′²)/(π j)², f_i′ = K (4.3 2^((Q−5)/2) + f_pt + F_α), "
                    "K = 0.2 (ε_γ + 4)/ε_γ, at least 0.4")


_ANY_SPEED = 1.0
"""A speed, rpm, for values that do not depend on it."""


class _Results:
    """What the quantities of a design are taken from; a missing input raises `InputError` at the first use."""

    def __init__(self, design: GearDesign) -> None:
        self.design = design

    @cached_property
    def tooth(self) -> ToothStiffness:
        """Tooth stiffness by ISO 6336-1."""
        return self.design.tooth_stiffness

    @cached_property
    def load(self) -> MeshLoad:
        """Load of the mesh; its velocity is that of the design if this has a speed, else 0."""
        return replace(self.design, speed=self.design.speed or _ANY_SPEED).load

    @cached_property
    def tolerances(self) -> tuple[Tolerances, Tolerances]:
        """Flank tolerances of both wheels."""
        return tolerances(self.design.given("quality"), self.design.geometry)

    @cached_property
    def mean_stiffness(self) -> float:
        """Mean of the mesh stiffness by the method of the design, over the face width, N/m²."""
        return self.design.mesh_stiffness.reference / self.design.geometry.common_face_width

    @property
    def reduced_mass(self) -> float:
        """Equivalent mass over the face width, kg/m."""
        return self.design.equivalent_mass / self.design.geometry.common_face_width

    @property
    def line_load(self) -> float:
        """Line load for the limit of the main resonance, N/m; without a torque as high as not to matter."""
        return 100e3 if self.design.torque is None else self.load.line_load

    @cached_property
    def resonance(self) -> Resonance:
        """Main resonance at the mean stiffness of the design."""
        return resonance(self.design.teeth[0], self.mean_stiffness, self.reduced_mass, self.line_load)

    @property
    def tangential_composite_deviation(self) -> tuple[float, float]:
        """f_i′ of both wheels, m; raises `_RefusedError` for an edition that does not derive it from f_pt and F_α."""
        quality = self.design.given("quality")
        if quality.standard != ISO_1995:
            raise _RefusedError(
                f"{quality.standard} has no formula for f_i′ in terms of f_pt and F_α. The transmission error from "
                f"quality uses that of {ISO_1995}, annex A, with these deviations: an assumption, see e_j.")
        return from_quality(self.design.geometry, quality, self.tolerances).tooth_to_tooth

    @property
    def support_frequencies(self) -> tuple[float, float]:
        """Natural frequencies of the wheels on their supports, without the mesh, rad/s."""
        if self.design.supports is None:
            raise _RefusedError("The supports are rigid.", expected=True)
        (c1, c2), (m1, m2) = self.design.supports.stiffness, self.design.masses
        return math.sqrt(c1 / m1), math.sqrt(c2 / m2)

    @property
    def eccentric_backlash(self) -> tuple[float, float]:
        """Amplitudes of the backlash along the line of action by eccentricity, m."""
        factor = 2 * math.sin(self.design.geometry.working_pressure_angle)
        first, second = self.design.eccentricity
        return first * factor, second * factor

    @cached_property
    def factors(self) -> DynamicFactors:
        """Dynamic factors by the standards, without running-in."""
        for name in ("quality", "speed", "torque"):
            self.design.given(name)
        return dynamic_factors(self.design)

    def granted(self, name: str) -> Any:
        """A dynamic factor by its name in `DynamicFactors`; raises `_RefusedError` if the standard gives none."""
        found = getattr(self.factors, name)
        if found.value is None:
            raise _RefusedError(found.reason)
        return found


class _RefusedError(Exception):
    """There is no value; the message is the reason, ``expected`` as in `Entry`."""

    def __init__(self, reason: str, expected: bool = False) -> None:
        super().__init__(reason)
        self.expected = expected


def _entry(group: str, formula: Formula, results: _Results, compute: Callable[[_Results], Any]) -> Entry:
    """One entry, with the value in the unit that is shown, or the reason why there is none."""
    value, reason, expected = None, "", False
    try:
        value = compute(results)
    except (InputError, _RefusedError) as error:
        reason, expected = str(error), getattr(error, "expected", False)
    return Entry(value=_shown(value, formula.factor), unit=formula.unit, symbol=formula.symbol, formula=formula.text,
                 source=formula.source, group=group, reason=reason, expected=expected)


def _shown(value: Any, factor: float) -> Any:
    """A number or a tuple of numbers times a factor; whole numbers and None stay as they are where the factor is 1."""
    if value is None or factor == 1.0:
        return value
    return tuple(v * factor for v in value) if isinstance(value, tuple) else value * factor


_Row = tuple[Formula, Callable[[_Results], Any]]


def _of(attribute: str, table: Mapping[str, Formula], *skipped: str) -> dict[str, _Row]:
    """Rows for the values of one result by the names of its fields."""
    def getter(name: str) -> Callable[[_Results], Any]:
        def compute(results: _Results) -> Any:
            found = results
            for part in attribute.split("."):
                found = getattr(found, part)
            return getattr(found, name)
        return compute

    return {name: (formula, getter(name)) for name, formula in table.items() if name not in skipped}


def _tolerance(symbol: str, name: str) -> _Row:
    """The row of one flank tolerance of both wheels."""
    formula = Formula(symbol, "µm", 1e6, "by module, diameter and grade", "ISO 1328-1, edition of the quality")
    return formula, lambda results: tuple(getattr(t, name) for t in results.tolerances)


def _parameter(name: str) -> Callable[[_Results], Any]:
    """A function that takes a parameter of method B from the results."""
    return lambda results: getattr(results.granted("iso_b"), name)


_FACTOR_B = formulas(DynamicFactorB)
_TOOTH = formulas(ToothStiffness)
_RESONANCE = formulas(Resonance)
_MODEL = "gearchaos, docs/gears.md"
_GROUPS: dict[str, dict[str, _Row]] = {
    "Geometry": _of("design.geometry", GEOMETRY_FORMULAS),
    "Backlash and inertia": _of("design", DESIGN_FORMULAS),
    "Load": {
        **_of("load", formulas(MeshLoad), "velocity"),
        "velocity": (formulas(MeshLoad)["velocity"], lambda results: results.design.load.velocity),
    },
    "Tolerances": {
        "single_pitch_deviation": _tolerance("f_pt", "single_pitch"),
        "cumulative_pitch_deviation": _tolerance("F_p", "cumulative_pitch"),
        "profile_deviation": _tolerance("F_α", "profile"),
        "profile_form_deviation": _tolerance("f_fα", "profile_form"),
        "profile_slope_deviation": _tolerance("f_Hα", "profile_slope"),
        "runout": _tolerance("F_r", "runout"),
        "tangential_composite_deviation": (
            formulas(QualityError)["tooth_to_tooth"], lambda results: results.tangential_composite_deviation),
    },
    "Tooth stiffness by ISO 6336-1": _of("tooth", _TOOTH, "mesh_stiffness"),
    "Mesh stiffness": {
        "mesh_stiffness": (
            Formula("c_γα", "N/(mm µm)", 1e-9, "mean over the mesh cycle, by the method of the design", _MODEL),
            lambda results: results.mean_stiffness),
        "mesh_stiffness_mean": (
            Formula("c0", "N/µm", 1e-6, "mean over the mesh cycle, over the whole face width: c_γα b", _MODEL),
            lambda results: results.design.mesh_stiffness.reference),
        "mesh_stiffness_range": (
            Formula("c_min, c_max", "N/µm", 1e-6, "least and greatest over the mesh cycle", _MODEL),
            lambda results: results.design.mesh_stiffness.extremes),
        "mesh_period_roll_angle": (
            Formula("", "deg", 180 / math.pi, "360°/z1: roll angle of wheel 1 over the mesh period, that of the "
                    "stiffness curve", "kinematics"), lambda results: 2 * math.pi / results.design.teeth[0]),
        "mesh_stiffness_truncation": (
            Formula("", "", 1.0, "root mean square error of steps or harmonics over the mean", _MODEL),
            lambda results: results.design.mesh_stiffness.truncation),
    },
    "Supports": {
        "support_frequency": (
            Formula("f_n", "Hz", 1 / (2 * math.pi), "√(c_n/m_n)/(2π): each wheel on its support, without the mesh",
                    "Łuczko 2008, (2.1)"), lambda results: results.support_frequencies),
    },
    "Transmission error of the unloaded gears": {
        "transmission_error_amplitudes": (
            Formula("e_j", "µm", 1e6, "e(t) = Σ e_j cos(jω_z t − θ_j), peak amplitudes along the line of action",
                    "Łuczko 2008, (2.4)"), lambda results: results.design.error_harmonics.amplitudes),
        "transmission_error_phases": (
            Formula(_PHASE, "deg", 180 / math.pi, "phases; at t = 0 a tooth pair enters contact", "Łuczko 2008, (2.4)"),
            lambda results: results.design.error_harmonics.phases),
    },
    "Eccentricity": {
        "eccentricity_error_amplitude": (
            Formula("", "µm", 1e6, "e; once per turn, order 1/z of the mesh frequency: not part of the model",
                    "kinematics, base tangent plane"), lambda results: results.design.eccentricity),
        "eccentricity_backlash_amplitude": (
            Formula("", "µm", 1e6, "2 e sin α_wt; once per turn: not part of the model",
                    "kinematics, base tangent plane"), lambda results: results.eccentric_backlash),
    },
    "Damping": {
        "damping_ratio": (
            Formula("ζ", "", 1.0, "given; usual are 0.03 to 0.1, the least known of all inputs",
                    "Kasuba and Evans 1981; Wang and Cheng 1981"),
            lambda results: results.design.given("damping_ratio")),
    },
    "Resonance": {
        **_of("resonance", _RESONANCE),
        "reduced_mass": (_RESONANCE["reduced_mass"], lambda results: results.reduced_mass),
        "lower_limit_ratio": (_RESONANCE["lower_limit_ratio"], lambda results: lower_limit_ratio(results.line_load)),
        "resonance_ratio": (
            Formula("N", "", 1.0, "n1/n_E1 at the mean stiffness by the method of the design",
                    "ISO 6336-1:2006, 6.4.2, (9)"),
            lambda results: results.resonance.ratio(results.design.given("speed") * RPM)),
    },
    "Dynamic factor": {
        "Kv_ISO_B": (_FACTOR_B["value"], lambda results: results.granted("iso_b").value),
        "resonance_ratio_ISO_B": (_FACTOR_B["resonance_ratio"], _parameter("resonance_ratio")),
        **{name: (formula, _parameter(name)) for name, formula in _FACTOR_B.items()
           if name not in ("value", "resonance_ratio")},
        "Kv_ISO_C": (formulas(DynamicFactorC)["value"], lambda results: results.granted("iso_c").value),
        "Kv_AGMA": (formulas(DynamicFactorAGMA)["value"], lambda results: results.granted("agma").value),
    },
}
"""The quantities by heading and name: how each is described, and a function that takes it from the results."""
