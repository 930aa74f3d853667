"""The quantities of a gear design: all that follows from it, with symbol, unit, formula and source.

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
from gearchaos.gears.dynamic_factor import DynamicFactor, Standard, standards
from gearchaos.gears.dynamic_factor.resonance import Resonance, lower_limit_ratio, resonance
from gearchaos.gears.fields import Formula, formulas
from gearchaos.gears.geometry.dimensions import DESIGN_FORMULAS, GEOMETRY_FORMULAS
from gearchaos.gears.mechanics import MeshLoad
from gearchaos.gears.stiffness import MeshStiffness
from gearchaos.gears.stiffness.iso6336 import ToothStiffness
from gearchaos.gears.transmission_error.harmonics import QualityError, from_quality
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from gearchaos.gears.transmission_error.quality import Tolerances, tolerances
from gearchaos.gears.units import RPM

_NO_ERROR = ("none given: the gears are taken to be exact; write transmission_error = \"from quality\" or "
             "{ orders = \"te.csv\" }")
"""What the rows of the transmission error say of a design without one."""

_QUALITY_FORMULA = ("from the grade e_j = 4 √(f_i1′² + f_i2′²)/(π j)², f_i′ = K (4.3 2^((Q−5)/2) + f_pt + F_α), "
                    "K = 0.2 (ε_γ + 4)/ε_γ, at least 0.4")

_PHASE = "θ_j"
_ROUNDING = 1e-9
"""Length in mm below which a value is a rounding error of lengths of the pair."""

_ANY_SPEED = 1.0
"""A speed, rpm, for values that do not depend on it."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One quantity of a datasheet, in ``unit``: a tuple of two for what belongs to each wheel, of any length for
    harmonics.

    It is None if it cannot be computed; then there is a reason. It is expected if the design is complete without the
    value, as without the frequency of rigid supports. See `gearchaos.gears.fields.Formula` for the rest.
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
        if self.symbol == _PHASE:
            values = tuple(v % 360 for v in values)
        if self.unit == "mm":
            values = tuple(0.0 if abs(v) < _ROUNDING else v for v in values)
        return values if isinstance(self.value, tuple) else values[0]


def datasheet(design: GearDesign) -> dict[str, Entry]:
    """All quantities of a design by name; those that need a missing input have a reason instead of a value."""
    results = _Results(design)
    entries = {name: _entry(name, group, formula, results, compute)
               for group, rows in _GROUPS.items() for name, (formula, compute) in rows.items()}
    amplitudes, phases = (entries[f"transmission_error_{what}"] for what in ("amplitudes", "phases"))
    if design.exact:
        amplitudes, phases = replace(amplitudes, formula=_NO_ERROR), replace(phases, formula=_NO_ERROR)
    elif not amplitudes.reason:
        amplitudes = replace(amplitudes, source=f"{amplitudes.source}; {design.error_harmonics.source}")
        if design.transmission_error == "from quality":
            amplitudes = replace(amplitudes, formula=f"{amplitudes.formula}; {_QUALITY_FORMULA}")
    return entries | {"transmission_error_amplitudes": amplitudes, "transmission_error_phases": phases}


def with_scanned_speeds(entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """The entries of a design without a speed that is shown along the speed: what lacks only the speed says so."""
    return {name: replace(e, reason="depends on speed: see the curve", expected=True)
            if e.reason.startswith("speed must be given") else e for name, e in entries.items()}


class _NoValueError(Exception):
    """There is no value; the message is the reason, ``expected`` as in `Entry`."""

    def __init__(self, reason: str, expected: bool = False) -> None:
        super().__init__(reason)
        self.expected = expected


class _Results:
    """What the quantities of a design are taken from; a missing input raises `InputError` at the first use."""

    def __init__(self, design: GearDesign) -> None:
        self.design, self.geometry = design, design.geometry

    @cached_property
    def tooth(self) -> ToothStiffness:
        """Tooth stiffness by ISO 6336-1."""
        return self.design.tooth_stiffness

    @cached_property
    def mesh(self) -> MeshStiffness:
        """Mesh stiffness by the method of the design."""
        return self.design.mesh_stiffness

    @cached_property
    def load(self) -> MeshLoad:
        """Load of the mesh; its velocity is that of the design if this has a speed, else 0."""
        return replace(self.design, speed=self.design.speed or _ANY_SPEED).load

    @cached_property
    def tolerances(self) -> tuple[Tolerances, Tolerances]:
        """Flank tolerances of both wheels."""
        return tolerances(self.design.given("quality"), self.geometry)

    @property
    def mean_stiffness(self) -> float:
        """Mean of the mesh stiffness by the method of the design, over the face width, N/m²."""
        return self.mesh.reference / self.geometry.common_face_width

    @property
    def reduced_mass(self) -> float:
        """Equivalent mass over the face width, kg/m."""
        return self.design.equivalent_mass / self.geometry.common_face_width

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
            raise _NoValueError("The supports are rigid.", expected=True)
        (c1, c2), (m1, m2) = self.design.supports.stiffness, self.design.masses
        return math.sqrt(c1 / m1), math.sqrt(c2 / m2)

    def factor(self, standard: Standard) -> DynamicFactor:
        """The dynamic factor by a standard, in method B without running-in; raises `_NoValueError` if there is none."""
        for name in standard.needs:
            self.design.given(name)
        found = standard.factor(self.design)
        if found.value is None:
            raise _NoValueError(found.reason)
        return found


def _entry(name: str, group: str, formula: Formula, results: _Results, compute: Callable[[_Results], Any]) -> Entry:
    """One entry, with the value in the unit that is shown, or the reason why there is none."""
    value, reason, expected = None, "", False
    try:
        value = compute(results)
    except (InputError, _NoValueError) as error:
        reason, expected = str(error), getattr(error, "expected", False)
    if value is not None and formula.factor != 1.0:  # whole numbers stay so
        value = tuple(v * formula.factor for v in value) if isinstance(value, tuple) else value * formula.factor
    return Entry(value=value, unit=formula.unit, symbol=formula.symbol, formula=formula.text, source=formula.source,
                 group=group, words=formula.words or name.replace("_", " "), reason=reason, expected=expected)


_Row = tuple[Formula, Callable[[_Results], Any]]


def _of(result: Callable[[_Results], Any], table: Mapping[str, Formula]) -> dict[str, _Row]:
    """Rows for the values of one result by the names of its fields."""
    def getter(name: str) -> Callable[[_Results], Any]:
        return lambda results: getattr(result(results), name)

    return {name: (formula, getter(name)) for name, formula in table.items()}


def _tolerance(symbol: str, name: str) -> _Row:
    """The row of one flank tolerance of both wheels."""
    formula = Formula(symbol, "µm", 1e6, "by module, diameter and grade", "ISO 1328-1, edition of the quality")
    return formula, lambda results: tuple(getattr(t, name) for t in results.tolerances)


def _standard_rows(standard: Standard) -> dict[str, _Row]:
    """The rows of K_v by a standard, and of what it shows beside it."""
    rows = _of(lambda results: results.factor(standard), formulas(standard.result))
    formula, compute = rows["value"]
    return {standard.name: (replace(formula, words=standard.long_name), compute),
            **{name: rows[field] for name, field in standard.beside.items()}}


_MODEL = "gearchaos, docs/gears.md"
_RESONANCE = formulas(Resonance)

_GROUPS: dict[str, dict[str, _Row]] = {
    "Geometry": _of(lambda results: results.geometry, GEOMETRY_FORMULAS),
    "Backlash and inertia": _of(lambda results: results.design, DESIGN_FORMULAS),
    "Load": {
        **_of(lambda results: results.load, formulas(MeshLoad)),
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
    "Tooth stiffness by ISO 6336-1": _of(lambda results: results.tooth, {
        name: formula for name, formula in formulas(ToothStiffness).items() if name != "mesh_stiffness"}),
    "Mesh stiffness": {
        "mesh_stiffness": (
            Formula("c_γα", "N/(mm µm)", 1e-9, "mean over the mesh cycle, by the method of the design", _MODEL),
            lambda results: results.mean_stiffness),
        "mesh_stiffness_mean": (
            Formula("c0", "N/µm", 1e-6, "mean over the mesh cycle, over the whole face width: c_γα b", _MODEL),
            lambda results: results.mesh.reference),
        "mesh_stiffness_range": (
            Formula("c_min, c_max", "N/µm", 1e-6, "least and greatest over the mesh cycle", _MODEL),
            lambda results: results.mesh.extremes),
        "mesh_period_roll_angle": (
            Formula("", "deg", 180 / math.pi, "360°/z1: roll angle of wheel 1 over the mesh period, that of the "
                    "stiffness curve", "kinematics"), lambda results: 2 * math.pi / results.design.teeth[0]),
        "mesh_stiffness_truncation": (
            Formula("", "", 1.0, "root mean square error of steps or harmonics over the mean", _MODEL),
            lambda results: results.mesh.truncation),
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
                    "kinematics, base tangent plane"), lambda results: tuple(
                e * (2 * math.sin(results.geometry.working_pressure_angle)) for e in results.design.eccentricity)),
    },
    "Damping": {
        "damping_ratio": (
            Formula("ζ", "", 1.0, "given; usual are 0.03 to 0.1, the least known of all inputs",
                    "Kasuba and Evans 1981; Wang and Cheng 1981"),
            lambda results: results.design.given("damping_ratio")),
    },
    "Resonance": {
        **_of(lambda results: results.resonance, _RESONANCE),
        "reduced_mass": (_RESONANCE["reduced_mass"], lambda results: results.reduced_mass),
        "lower_limit_ratio": (_RESONANCE["lower_limit_ratio"], lambda results: lower_limit_ratio(results.line_load)),
        "resonance_ratio": (
            Formula("N", "", 1.0, "n1/n_E1 at the mean stiffness by the method of the design",
                    "ISO 6336-1:2006, 6.4.2, (9)"),
            lambda results: results.resonance.ratio(results.design.given("speed") * RPM)),
    },
    "Dynamic factor": {name: row for each in standards() for name, row in _standard_rows(each).items()},
}
"""The quantities by heading and name: how each is described, and a function that takes it from the results."""
