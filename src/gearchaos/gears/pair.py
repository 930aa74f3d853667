"""A physical gear pair in SI: its dimensionless model by (2.1)-(2.11), and results scaled back.

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4),
2008, read with the corrections listed in ``docs/model.md``.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears import units
from gearchaos.gears.scales import Scales, scaled, unit_of
from gearchaos.model import (
    KINDS,
    HarmonicStiffness,
    MeshModel,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
)

if TYPE_CHECKING:
    import xarray as xr

Measure = Any
"""A float in SI, a string with a unit such as "3 mm", or a pint quantity; a float once the pair is built."""

# field -> (what it is, rule in words)
_MEASURES: dict[str, tuple[units.Quantity, str]] = {
    **dict.fromkeys(("I1", "I2"), (units.INERTIA, units.POSITIVE)),
    **dict.fromkeys(("R1", "R2", "backlash"), (units.LENGTH, units.POSITIVE)),
    "c0": (units.STIFFNESS, units.POSITIVE),
    "k": (units.DAMPING, units.NOT_NEGATIVE),
    "speed": (units.SPEED, units.POSITIVE),
    **dict.fromkeys(("M10", "M20"), (units.TORQUE, units.ANY)),
    **dict.fromkeys(("b1", "b2"), (units.BEARING_FRICTION, units.NOT_NEGATIVE)),
    **dict.fromkeys(("m1", "m2"), (units.MASS, units.POSITIVE)),
    **dict.fromkeys(("c1", "c2"), (units.STIFFNESS, units.POSITIVE)),
    **dict.fromkeys(("k1", "k2"), (units.DAMPING, units.NOT_NEGATIVE)),
}
_LISTS: dict[str, units.Quantity] = {
    "error_amplitudes": units.LENGTH,
    "error_phases": units.ANGLE,
    "stiffness_amplitudes": units.STIFFNESS,
    "stiffness_phases": units.ANGLE,
}
_OPTIONAL = ("M20", "m1", "m2", "c1", "c2")
_RATIO_TOLERANCE = 0.01


@dataclass(frozen=True, kw_only=True)
class GearPair:
    """A pair of spur gears as (2.1) has it; wheel 1 drives. Values are numbers in SI or e.g. ``"3 mm"``.

    The angles of (2.1) are deviations from uniform rotation, so the torques are those that the mesh
    transmits, with the drag of the bearings at the mean speed taken off.

    Parameters
    ----------
    n1, n2 : int
        Numbers of teeth, from 3 to a million. No other measure may be larger than 1e40 in SI, or smaller
        than 1e-40 if it is not 0.
    I1, I2 : length² mass
        Moments of inertia about the axes of rotation.
    R1, R2 : length
        Base radii; R1/R2 must equal n1/n2 to 1 %.
    c0 : force/length
        Reference stiffness of the mesh, which ``chi1``, ``chi2`` or the harmonics vary about; ω0 and ζ refer to it. It
        is the time mean of a Fourier series; that of two levels is c0 (1 + (α − 1) χ1 − (2 − α) χ2).
    k : force time/length
        Mesh damping.
    backlash : length
        The whole play 2Δ along the line of action, (2.6).
    M10 : torque
        Driving torque.
    M20 : torque, optional
        Resisting torque; left out, the one in balance with ``M10``: M10 R2/R1.
    speed : angular velocity
        Of the driving wheel, e.g. ``"2500 rpm"``.
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

    Raises
    ------
    InputError
        Naming the field, the rule, the value and what to do.

    Examples
    --------
    >>> pair = GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1="35 mm", R2="70 mm", c0="400 N/um", k="500 N*s/m",
    ...                 backlash="0.12 mm", M10="85 N*m", speed="14000 rpm", error_amplitudes=["6 um"])
    >>> pair.to_model().error.amplitudes
    (0.1,)
    """

    n1: int
    n2: int
    I1: Measure
    I2: Measure
    R1: Measure
    R2: Measure
    c0: Measure
    k: Measure
    backlash: Measure
    M10: Measure
    speed: Measure
    M20: Measure = None
    b1: Measure = 0.0
    b2: Measure = 0.0
    m1: Measure = None
    m2: Measure = None
    c1: Measure = None
    c2: Measure = None
    k1: Measure = 0.0
    k2: Measure = 0.0
    error_amplitudes: tuple[Measure, ...] = ()
    error_phases: tuple[Measure, ...] = ()
    chi1: float | None = None
    chi2: float | None = None
    contact_ratio: float | None = None
    stiffness_amplitudes: tuple[Measure, ...] = ()
    stiffness_phases: tuple[Measure, ...] = ()

    def __post_init__(self) -> None:
        for name in ("n1", "n2"):
            self._set(name, units.teeth(name, getattr(self, name)))
        for name, (quantity, rule) in _MEASURES.items():
            if name not in _OPTIONAL or getattr(self, name) is not None:
                self._set(name, units.measure(name, getattr(self, name), quantity, rule))
        for name, quantity in _LISTS.items():
            self._set(name, units.measures(name, getattr(self, name), quantity))
        if self.M20 is None:
            self._set("M20", units.measure("M20", self.M10 * self.R2 / self.R1, *_MEASURES["M20"]))
        self._check_ratio()
        self._check_supports()
        self._check_waveforms()

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _check_ratio(self) -> None:
        teeth, radii = self.n1 / self.n2, self.R1 / self.R2
        if abs(radii / teeth - 1) > _RATIO_TOLERANCE:
            raise InputError(
                "R1/R2", f"must equal n1/n2 = {teeth:.6g} to 1 %", round(radii, 6),
                f"With R1 = {self.R1:g} m and these teeth R2 would be {self.R1 / teeth:.6g} m. "
                "R1 and R2 are base radii, m n cos(α)/2.",
            )

    def _check_supports(self) -> None:
        needed = ("c1", "c2", "m1", "m2")
        missing = [name for name in needed if getattr(self, name) is None]
        if missing and not self.rigid:
            raise InputError(
                missing[0], "must be given where the supports are elastic", None,
                "Give c1, c2, m1 and m2, or leave c1 and c2 out for rigid supports.",
            )
        for name in ("k1", "k2"):
            if self.rigid and (value := getattr(self, name)):
                rule = "must be left out where the supports are rigid"
                raise InputError(name, rule, value, "Or give c1, c2, m1 and m2.")

    def _check_waveforms(self) -> None:
        for name, value in self._levels().items():
            if self.stiffness_amplitudes:
                raise InputError(
                    name, "must be left out beside stiffness_amplitudes", value,
                    "The mesh stiffness is either two-level (2.16) or a series (2.7).",
                )
        for kind in ("error", "stiffness"):
            _check_phases(kind, getattr(self, f"{kind}_amplitudes"), getattr(self, f"{kind}_phases"))
        self._stiffness()

    @property
    def rigid(self) -> bool:
        """Whether the supports do not yield: neither c1 nor c2 is given."""
        return self.c1 is None and self.c2 is None

    @property
    def mass(self) -> float:
        """Equivalent mass of the pair along the line of action, (2.9), kg."""
        return self.I1 * self.I2 / (self.I1 * self.R2**2 + self.I2 * self.R1**2)

    @property
    def omega0(self) -> float:
        """Natural frequency of the closed mesh at the reference stiffness c0, (2.8), rad/s."""
        return math.sqrt(self.c0 / self.mass)

    @property
    def half_backlash(self) -> float:
        """Δ of (2.6), m."""
        return self.backlash / 2

    @property
    def mesh_frequency(self) -> float:
        """ω_z = n1 ω1, rad/s."""
        return self.n1 * self.speed

    @property
    def scales(self) -> Scales:
        """What one unit of each dimensionless quantity is in SI."""
        length, rate, force = self.half_backlash, self.omega0, self.c0 * self.half_backlash
        return Scales(
            length=length, time=1 / rate, velocity=length * rate, force=force, stiffness=self.c0,
            frequency=rate / (2 * math.pi), rate=rate, torque1=force * self.R1, torque2=force * self.R2,
        )

    def to_model(self, kind: str | None = None) -> MeshModel:
        """The dimensionless model by (2.11).

        Parameters
        ----------
        kind : {"full", "torsional", "single"}, optional
            Left out, ``full`` for elastic supports and ``torsional`` for rigid ones. ``single``, (2.17), has
            no bearing friction.

        Raises
        ------
        InputError
            ``full`` without supports, ``single`` with bearing friction, or a value the model refuses.
        """
        if kind is None:
            kind = "torsional" if self.rigid else "full"
        if kind not in KINDS:
            raise unknown_name("kind", str(kind), KINDS)
        return MeshModel(
            kind=kind,  # type: ignore[arg-type]
            omega=self.mesh_frequency / self.omega0,
            zeta=self.k / (2 * self.mass * self.omega0),
            error=self._error(),
            stiffness=self._stiffness(),
        ).with_values({**self._wheel(1), **self._wheel(2), **(self._lateral() if kind == "full" else {})})

    def _wheel(self, n: int) -> dict[str, float]:
        """J_n, q_n and β_n of (2.11)."""
        inertia, radius, torque, friction = (getattr(self, f"{s}{n}{e}") for s, e in _WHEEL)
        return {
            f"J{n}": inertia / (self.mass * radius**2),
            f"q{n}": torque / (self.c0 * radius * self.half_backlash),
            f"beta{n}": friction / (2 * self.mass * self.omega0 * radius**2),
        }

    def _lateral(self) -> dict[str, float]:
        """μ_n, κ_n and ζ_n of (2.11)."""
        if self.rigid:
            raise InputError(
                "kind", "must be torsional or single where the supports are rigid", "full",
                "Give c1, c2, m1 and m2 for elastic supports.",
            )
        values = {}
        for n, m, c, k in ((1, self.m1, self.c1, self.k1), (2, self.m2, self.c2, self.k2)):
            values[f"mu{n}"] = m / self.mass
            values[f"kappa{n}"] = c / self.c0
            values[f"zeta_support{n}"] = k / (2 * m * self.omega0)
        return values

    def _error(self) -> TransmissionError:
        """ε_j = e_j/Δ of (2.11)."""
        return TransmissionError(
            tuple(e / self.half_backlash for e in self.error_amplitudes) or (0.0,), self.error_phases
        )

    def _stiffness(self) -> Stiffness:
        """χ(τ) = c(t)/c0, (2.16) or (2.7)."""
        if self.stiffness_amplitudes:
            ratios = tuple(c / self.c0 for c in self.stiffness_amplitudes)
            return HarmonicStiffness(ratios, self.stiffness_phases)
        return TwoLevelStiffness(**self._levels())

    def _levels(self) -> dict[str, float]:
        """The values of a two-level stiffness that are given."""
        names = [f.name for f in fields(TwoLevelStiffness)]
        return {name: value for name in names if (value := getattr(self, name)) is not None}


_WHEEL = (("I", ""), ("R", ""), ("M", "0"), ("b", ""))


def _check_phases(kind: str, amplitudes: tuple[float, ...], phases: tuple[float, ...]) -> None:
    if len(phases) > len(amplitudes):
        raise InputError(
            f"{kind}_phases", f"must not be longer than {kind}_amplitudes ({len(amplitudes)})", len(phases),
            "Give one phase per harmonic; missing ones are 0.",
        )


def physical(dataset: xr.Dataset, pair: GearPair) -> xr.Dataset:
    """A result of a study in physical units: µm, mm/s, N, ms, and Hz of mesh frequency.

    Parameters
    ----------
    dataset : Dataset
        What a study returned for the pair.
    pair : GearPair
        The pair whose scales apply.

    Returns
    -------
    Dataset
        The same dims and names; values and ``units`` scaled, x_n as arc lengths R_n φ_n. Labels, shares and
        ratios stay as they are, and so does ``attrs["model"]``. ``attrs["pair"]`` holds the pair as JSON.

    Raises
    ------
    InputError
        If the dataset is in physical units already, or an argument is something else.
    """
    _check_scalable(dataset, pair)
    coordinates, variables = scaled(dataset.coords, pair.scales), scaled(dataset.data_vars, pair.scales)
    return dataset.assign_coords(coordinates).assign(variables).assign_attrs(pair=json.dumps(asdict(pair)))


def _check_scalable(dataset: Any, pair: Any) -> None:
    if not hasattr(dataset, "data_vars"):
        advice = "Write physical(dataset, pair). Numbers of a verdict times those of pair.scales are in SI."
        raise InputError("dataset", "must be an xarray.Dataset", f"a {type(dataset).__name__}", advice)
    if not isinstance(pair, GearPair):
        raise InputError("pair", "must be a GearPair", f"a {type(pair).__name__}", "A MeshModel alone has no units.")
    if "pair" in dataset.attrs:
        raise InputError("dataset", "must be dimensionless", "physical units", "It has been scaled already.")


def unit_in(dataset: xr.Dataset, name: str) -> float:
    """What 1 is, of a dimensionless variable, in the units of a Dataset: 1 unless `physical` has scaled it."""
    if "pair" not in dataset.attrs:
        return 1.0
    unit = unit_of(name, _pair_from_json(dataset.attrs["pair"]).scales)
    return 1.0 if unit is None else unit[0]


def _pair_from_json(text: str) -> GearPair:
    try:
        return GearPair(**json.loads(text))
    except (RecursionError, TypeError, ValueError) as error:
        raise InputError("dataset", "must carry its gear pair as JSON in attrs['pair']", text,
                         f"gearchaos.physical writes it: scale the dimensionless result again. ({error})") from error


def as_model(model: Any) -> MeshModel:
    """The model of a study: a `MeshModel` itself, that of a `GearPair`; raises `InputError` for anything else."""
    if isinstance(model, GearPair):
        return model.to_model()
    if not isinstance(model, MeshModel):
        advice = "E.g. gearchaos.MeshModel.of(omega=1, eps1=0.1)."
        raise InputError("model", "must be a MeshModel or a GearPair", f"a {type(model).__name__}", advice)
    return model
