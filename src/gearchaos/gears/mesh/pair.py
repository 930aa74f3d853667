"""`GearPair`: the parameters of a gear pair in SI units, and its dimensionless model by (2.1)-(2.11).

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4),
2008, read with the corrections listed in ``docs/model.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Generic, TypeVar

from gearchaos.display import HasCard
from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import convert_fields, each, name_of, one, read_by, record
from gearchaos.gears.mesh.tooth_pairs import ToothPairs
from gearchaos.model import (
    DAMPING_LAWS,
    DEFAULT_LAW_OF_GEARS,
    KINDS,
    STIFFNESS_KINDS,
    MeshModel,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
)
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE
from gearchaos.validation import to_floats

Value = TypeVar("Value")
# a float in SI, of a speed in rpm, a text with a unit such as "3 mm", or a pint quantity; the fields of a `GearPair`
# are floats
PhysicalValue = Any
_KINDS = [kind for kind in STIFFNESS_KINDS.own.values() if kind.pair_fields]  # those that a pair can have
_STIFFNESS_FIELDS = tuple(tuple(kind.pair_fields.values()) for kind in _KINDS)
_STIFFNESSES = ", or ".join(f"{kind.predicate} {kind.equation}".rstrip() for kind in _KINDS)
_RATIO_TOLERANCE = 0.01  # largest relative difference between the ratio of base radii and that of numbers of teeth
# damping ratio, backlash in m, velocity of the base circles in m/s, and an amplitude of the error over the backlash,
# above which there is a warning
_MOST_DAMPING, _MOST_BACKLASH, _MOST_VELOCITY, _MOST_ERROR = 0.3, 5e-3, 300.0, 10.0


@dataclass(frozen=True)
class Scales(Generic[Value]):
    """SI value of one unit of each dimensionless quantity, (2.8)-(2.11): a float, or an array over operating points."""

    length: Value  # half the backlash Δ, m
    time: Value  # 1/ω0, s
    velocity: Value  # Δ ω0
    force: Value  # c0 Δ
    stiffness: Value  # c0
    frequency: Value  # ω0/2π, Hz: the mesh frequency at omega = 1
    rate: Value  # ω0, 1/s, for Lyapunov exponents
    torque1: Value  # c0 R_n Δ, for the driving and the driven wheel
    torque2: Value

    angular: ClassVar[bool] = False  # whether lengths are angles, rad, and forces torques, N m


class AngularScales(Scales[Value]):
    """Those of a train whose contacts are stops of shafts alone."""

    angular = True


@dataclass(frozen=True, kw_only=True)
class GearPair(HasCard):
    """A pair of spur gears with the parameters of (2.1); wheel 1 is the driving one.

    A value is a number in SI, for the speed in rpm, or a text with a unit such as ``"3 mm"``. The angles of (2.1) are
    deviations from uniform rotation. Therefore ``M10`` and ``M20`` are the torques that the mesh transmits: the torques
    at the shafts less the drag of the bearings at the mean speed.

    Parameters
    ----------
    n1, n2 : int
        Numbers of teeth, from 3 to a million. All other values that are not 0 must have a magnitude from 1e-40 to 1e40
        in SI.
    I1, I2 : length² mass
        Moments of inertia about the axes of rotation.
    R1, R2 : length
        Base radii; R1/R2 must equal n1/n2 to 1 %.
    c0 : force/length
        Reference stiffness of the mesh: ω0 and ζ refer to it, and the varying stiffness is c0 χ(τ). The time mean of a
        Fourier stiffness is c0, that of a two-level stiffness c0 (1 + (α − 1) χ1 − (2 − α) χ2).
    k : force time/length
        Mesh damping.
    backlash : length
        Total backlash 2Δ along the line of action, (2.6).
    M10 : torque
        Driving torque.
    M20 : torque, optional
        Resisting torque; M10 R2/R1 if left out, which balances ``M10``.
    speed : angular velocity
        Of the driving wheel; a plain number is in rpm.
    b1, b2 : torque time
        Bearing friction, (2.2).
    m1, m2, c1, c2, k1, k2 : mass, force/length, force time/length, optional
        Masses of the wheels, stiffness and damping of their supports along the line of action. Without ``c1``
        and ``c2`` the supports are rigid.
    error_amplitudes, error_phases : list of length, list of angle
        Static transmission error e(t) = Σ e_j cos(jω_z t − θ_j), (2.4).
    chi1, chi2, contact_ratio : float, optional
        Two-level mesh stiffness, (2.16); the paper's 0.25, 0.25 and 1.5 if left out.
    stiffness_amplitudes, stiffness_phases : list of force/length, list of angle
        Mesh stiffness c(t) = c0 + Σ c_j cos(jω_z t − α_j) instead, (2.7).
    stiffness_levels, stiffness_starts : list of force/length, list of float
        Or a mesh stiffness in steps, and where each begins as a fraction of the mesh period; see `SteppedStiffness`.
    tooth_pairs : table, optional
        Or tooth pairs that share the load: ``stiffness`` of one pair, a force/length or a list of them with the
        ``starts`` of their parts as shares of the path of contact; ``contact_ratio``; ``relief``, a table with
        ``amount``, a length, ``length``, a share of the path, and ``shape``, linear or parabolic; ``crowning`` of the
        profile, a length; ``back_phase`` of the back flanks; ``corner``, the ``length`` and ``gap`` of contact beyond
        both ends of the path. See `ToothPairStiffness`.
    damping_law : {"always", "contact", "unilateral"}
        Where the mesh damping acts, by default in contact alone; see `MeshModel`.

    Raises
    ------
    InputError
        For a value that breaks a rule. The message has the field, the rule, the value and what to do.

    Examples
    --------
    >>> pair = GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1="35 mm", R2="70 mm", c0="400 N/um", k="500 N*s/m",
    ...                 backlash="0.12 mm", M10="85 N*m", speed="14000 rpm", error_amplitudes=["6 um"])
    >>> pair.to_model().error.amplitudes
    (0.1,)
    """

    n1: int = field(metadata=read_by(units.teeth))
    n2: int = field(metadata=read_by(units.teeth))
    I1: PhysicalValue = field(metadata=read_by(one(units.INERTIA, POSITIVE)))
    I2: PhysicalValue = field(metadata=read_by(one(units.INERTIA, POSITIVE)))
    R1: PhysicalValue = field(metadata=read_by(one(units.LENGTH, POSITIVE)))
    R2: PhysicalValue = field(metadata=read_by(one(units.LENGTH, POSITIVE)))
    c0: PhysicalValue = field(metadata=read_by(one(units.STIFFNESS, POSITIVE)))
    k: PhysicalValue = field(metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    backlash: PhysicalValue = field(metadata=read_by(one(units.LENGTH, POSITIVE)))
    M10: PhysicalValue = field(metadata=read_by(one(units.TORQUE)))
    speed: PhysicalValue = field(metadata=read_by(one(units.SPEED, POSITIVE)))
    M20: PhysicalValue = field(default=None, metadata=read_by(one(units.TORQUE)))
    b1: PhysicalValue = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    b2: PhysicalValue = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    m1: PhysicalValue = field(default=None, metadata=read_by(one(units.MASS, POSITIVE)))
    m2: PhysicalValue = field(default=None, metadata=read_by(one(units.MASS, POSITIVE)))
    c1: PhysicalValue = field(default=None, metadata=read_by(one(units.STIFFNESS, POSITIVE)))
    c2: PhysicalValue = field(default=None, metadata=read_by(one(units.STIFFNESS, POSITIVE)))
    k1: PhysicalValue = field(default=0.0, metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    k2: PhysicalValue = field(default=0.0, metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    error_amplitudes: tuple[PhysicalValue, ...] = field(default=(), metadata=read_by(each(units.LENGTH)))
    error_phases: tuple[PhysicalValue, ...] = field(default=(), metadata=read_by(each(units.ANGLE)))
    chi1: float | None = None
    chi2: float | None = None
    contact_ratio: float | None = None
    stiffness_amplitudes: tuple[PhysicalValue, ...] = field(default=(), metadata=read_by(each(units.STIFFNESS)))
    stiffness_phases: tuple[PhysicalValue, ...] = field(default=(), metadata=read_by(each(units.ANGLE)))
    stiffness_levels: tuple[PhysicalValue, ...] = field(default=(), metadata=read_by(each(units.STIFFNESS)))
    stiffness_starts: tuple[float, ...] = field(default=(), metadata=read_by(to_floats))
    tooth_pairs: ToothPairs | Any = field(default=None, metadata=read_by(record(ToothPairs)))
    damping_law: str = field(default=DEFAULT_LAW_OF_GEARS, metadata=read_by(name_of(*DAMPING_LAWS)))

    def __post_init__(self) -> None:
        convert_fields(self)
        if self.M20 is None:
            object.__setattr__(self, "M20", units.to_si("M20", self.M10 * self.R2 / self.R1, units.TORQUE))
        teeth, radii = self.n1 / self.n2, self.R1 / self.R2
        if abs(radii / teeth - 1) > _RATIO_TOLERANCE:
            raise InputError("R1/R2", f"must equal n1/n2 = {teeth:.6g} to 1 %", round(radii, 6),
                             f"With R1 = {units.Length(self.R1, self.R1)} and these teeth R2 would be "
                             f"{units.Length(self.R1 / teeth, self.R1)}. R1 and R2 are base radii, m n cos(α)/2.")
        missing = [name for name in ("c1", "c2", "m1", "m2") if getattr(self, name) is None]
        if missing and not self.rigid:
            raise InputError(missing[0], "must be given where the supports are elastic", None,
                             "Give c1, c2, m1 and m2, or leave c1 and c2 out for rigid supports.")
        for name in ("m1", "m2", "k1", "k2"):
            if self.rigid and (value := getattr(self, name)):
                raise InputError(name, "must be left out where the supports are rigid", value,
                                 "It has no effect there. Or give c1, c2, m1 and m2.")
        kinds = [[n for n in names if getattr(self, n) not in (None, (), [])] for names in _STIFFNESS_FIELDS]
        (first, *_), *others = [names for names in kinds if names] or [["none"]]
        for names in others:
            raise InputError(first, f"must be left out beside {names[0]}", getattr(self, first),
                             f"The mesh stiffness {_STIFFNESSES}.")
        if len(self.stiffness_starts) and not len(self.stiffness_levels):
            raise InputError("stiffness_starts", "must be left out without stiffness_levels", self.stiffness_starts,
                             "They are where the steps of the mesh stiffness begin.")
        for kind in ("error", "stiffness"):
            amplitudes, phases = getattr(self, f"{kind}_amplitudes"), getattr(self, f"{kind}_phases")
            if len(phases) > len(amplitudes):
                raise InputError(f"{kind}_phases", f"must not be longer than {kind}_amplitudes ({len(amplitudes)})",
                                 len(phases), "Give one phase per harmonic; missing ones are 0.")
        self._stiffness()  # raises for a stiffness that is not positive

    @property
    def rigid(self) -> bool:
        """Whether the supports are rigid: neither c1 nor c2 is given."""
        return self.c1 is None and self.c2 is None

    @property
    def mass(self) -> float:
        """Equivalent mass of the pair along the line of action, (2.9), kg."""
        return self.I1 * self.I2 / (self.I1 * self.R2**2 + self.I2 * self.R1**2)

    @property
    def omega0(self) -> float:
        """Natural frequency of the pair with the teeth in contact, at the reference stiffness c0, (2.8), rad/s."""
        return math.sqrt(self.c0 / self.mass)

    @property
    def half_backlash(self) -> float:
        """Δ of (2.6), m."""
        return self.backlash / 2

    @property
    def mesh_frequency(self) -> float:
        """ω_z = n1 ω1, rad/s."""
        return self.n1 * (self.speed * units.RPM)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about values that are possible but unusual; studies warn of them, too."""
        damping, velocity = self.k / (2 * self.mass * self.omega0), self.speed * units.RPM * self.R1
        errors = max(map(abs, self.error_amplitudes), default=0.0)
        pairs = self.tooth_pairs
        gap = 0.0 if pairs is None else max(pairs.crowning, *(pairs.relief.amount if pairs.relief else ()), 0.0)
        phases = max((abs(phase) / j for series in (self.error_phases, self.stiffness_phases) for j, phase in enumerate(
            series, 1) if not isinstance(phase, units.Measured)), default=0.0)  # in angles of the first harmonic
        found = {
            f"The damping ratio k/(2 m ω0) is {damping:.3g}, unusually high: usual are 0.03 to 0.1. Check k, c0 and "
            "I1.": damping > _MOST_DAMPING,
            f"The backlash is {self.backlash * 1e3:.4g} mm, unusually large: a plain number is in m.":
                self.backlash > _MOST_BACKLASH,
            f"error_amplitudes has {errors * 1e6:.4g} µm, {errors / self.backlash:.4g} times the backlash: a plain "
            "number is in m.": errors > _MOST_ERROR * self.backlash,
            f"tooth_pairs have a gap of {gap * 1e6:.4g} µm, more than the backlash: a plain number is in m.":
                gap > self.backlash,
            f"A phase is {phases:.6g} rad of the first harmonic, more than a turn: a plain number is in rad.":
                phases > 2 * math.pi,
            f"The base circles move at {velocity:.4g} m/s at {self.speed:.6g} rpm, unusually fast. A plain one is in "
            "rpm.": velocity > _MOST_VELOCITY,
            f"chi1 is {self.chi1}: the greater stiffness is more than twice c0. It is a fraction of c0, not a "
            "percentage.": (self.chi1 or 0.0) > 1}
        return tuple(text for text, holds in found.items() if holds)

    @property
    def scales(self) -> Scales[float]:
        """SI value of one unit of each dimensionless quantity."""
        length, rate, force = self.half_backlash, self.omega0, self.c0 * self.half_backlash
        return Scales(length=length, time=1 / rate, velocity=length * rate, force=force, stiffness=self.c0,
                      frequency=rate / (2 * math.pi), rate=rate, torque1=force * self.R1, torque2=force * self.R2)

    def at(self, *, speed: float | None = None, torque: float | None = None) -> GearPair:
        """The same pair at another speed, rpm, or driving torque, N m.

        The resisting torque changes in the ratio of the driving ones.
        """
        values: dict[str, Any] = {} if speed is None else {"speed": speed}
        if torque is not None:
            balanced = self.M20 == self.M10 * self.R2 / self.R1
            if not balanced and self.M10 == 0:
                raise InputError("M20", "must be 0 where M10 is, if the torque is to be varied", self.M20,
                                 "The resisting torque changes in the ratio of the driving ones.")
            values |= {"M10": torque, "M20": None if balanced else self.M20 * torque / self.M10}
        return replace(self, **values)

    def to_pair(self) -> GearPair:
        """The pair itself; a `GearDesign` has the same method."""
        return self

    def to_model(self, kind: str | None = None) -> MeshModel:
        """The dimensionless model by (2.11).

        Parameters
        ----------
        kind : {"full", "torsional", "single"}, optional
            By default ``full`` for elastic supports and ``torsional`` for rigid ones. ``single``, (2.17), has no
            bearing friction.

        Raises
        ------
        InputError
            For ``full`` without supports, ``single`` with bearing friction, or a value that breaks a rule of the model.
        """
        if kind is None:
            kind = "torsional" if self.rigid else "full"
        if kind not in KINDS:
            raise unknown_name("kind", str(kind), KINDS)
        return MeshModel(
            kind=kind,  # type: ignore[arg-type]
            omega=self.mesh_frequency / self.omega0, zeta=self.k / (2 * self.mass * self.omega0),
            stiffness=self._stiffness(), damping_law=self.damping_law, error=TransmissionError(
                tuple(e / self.half_backlash for e in self.error_amplitudes) or (0.0,), self.error_phases),
        ).with_values({**self._wheel(1), **self._wheel(2), **(self.lateral_parameters() if kind == "full" else {})})

    def _wheel(self, n: int) -> dict[str, float]:
        """J_n, q_n and β_n of (2.11)."""
        inertia, radius, torque, friction = (getattr(self, name) for name in (f"I{n}", f"R{n}", f"M{n}0", f"b{n}"))
        return {
            f"J{n}": inertia / (self.mass * radius**2), f"q{n}": torque / (self.c0 * radius * self.half_backlash),
            f"beta{n}": friction / (2 * self.mass * self.omega0 * radius**2)}

    def lateral_parameters(self) -> dict[str, float]:
        """μ_n, κ_n and ζ_n of (2.11), by name; raises `InputError` for rigid supports."""
        if self.rigid:
            raise InputError("kind", "must be torsional or single where the supports are rigid", "full",
                             "Give supports to a GearDesign, or c1, c2, m1 and m2 to a GearPair, for elastic supports.")
        values = dict[str, float]()
        for n, m, c, k in ((1, self.m1, self.c1, self.k1), (2, self.m2, self.c2, self.k2)):
            values |= {f"mu{n}": m / self.mass, f"kappa{n}": c / self.c0, f"zeta_support{n}": k / (2 * m * self.omega0)}
        return values

    def _stiffness(self) -> Stiffness:
        """χ(τ) = c(t)/c0, (2.16) or (2.7)."""
        given = (kind.from_pair(self) for kind in STIFFNESS_KINDS.own.values())
        return next((found for found in given if found is not None), TwoLevelStiffness())
