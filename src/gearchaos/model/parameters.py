"""`MeshModel`: the parameters of the dimensionless equations (2.12)-(2.18) of Łuczko (2008) and their defaults.

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4),
2008, read with the corrections listed in ``docs/model.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cache, partial
from types import MappingProxyType
from typing import Any, Literal, Self

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.model.base import GearModel
from gearchaos.model.damping import DAMPING_LAWS, DEFAULT_LAW, SHARED_LAWS, Damped
from gearchaos.model.stiffness import STIFFNESS_KINDS, Stiffness, TwoLevelStiffness, default_stiffness
from gearchaos.model.waveforms import TransmissionError, harmonics, with_harmonics
from gearchaos.quantities import PARAMETER_PAIRS, PARAMETERS, find, parse, parse_harmonic
from gearchaos.validation import MAX_HARMONICS, to_float

Kind = Literal["single", "torsional", "full"]
KINDS: tuple[str, ...] = ("single", "torsional", "full")

_TORSION = ("x1", "x1_dot", "x2", "x2_dot")
COORDINATES: dict[str, tuple[str, ...]] = {
    "single": ("z", "z_dot"), "torsional": _TORSION, "full": (*_TORSION, "y1", "y1_dot", "y2", "y2_dot")}
"""The coordinates of each kind of model for which initial values and results are given, in this order."""

RELATIVE = COORDINATES["single"]  # initial values of the relative motion alone, which do not determine x1 and x2
STATE_NAMES = (*RELATIVE, *COORDINATES["full"])  # all names of initial values
SCALARS: tuple[str, ...] = tuple(q.name for q in PARAMETERS if not q.members)
"""Names of the scalar parameters, in the order of the fields of `MeshModel`."""

SUPPORTS = ("mu", "kappa", "zeta_support")  # the families of parameters of lateral motion


def state_names(kind: str) -> tuple[str, ...]:
    """The coordinates for which a model of this kind takes initial values."""
    return (*RELATIVE, *_TORSION) if kind == "single" else COORDINATES[kind]


def check_initial_consistent(names: Iterable[str]) -> None:
    """Raise `InputError` if initial values are given both for z and for the coordinates that determine z."""
    given = set(names)
    if given & set(RELATIVE) and given - set(RELATIVE):
        raise InputError("initial", "must give either z, z_dot or the x coordinates, not both", sorted(given))


def check_state_name(kind: str, name: str) -> None:
    """Raise `InputError` unless a model of this kind can have an initial value of this name."""
    if name not in state_names(kind):
        raise unknown_name(f"initial value of a {kind} model", name, state_names(kind))


def check_has_effect(name: str, kind: str) -> None:
    """Raise `InputError` if a parameter has no effect in a kind of model.

    Only the full model has parameters of lateral motion, and the single model has no bearing friction.
    """
    if not has_effect(name, kind):
        advice = "Use kind='full'." if parse(name).family in SUPPORTS else "Use kind='torsional'."
        raise InputError(name, f"must be a parameter of the {kind} model", name, advice)


def has_effect(name: str, kind: str) -> bool:
    """Whether a parameter has an effect in a kind of model."""
    family = parse(name).family
    return kind == "full" if family in SUPPORTS else not (family == "beta" and kind == "single")


def check_is_pair(model: GearModel, what: str) -> None:
    """Raise `InputError` for a train, where ``what`` is there for a pair alone."""
    if model.mesh_names:
        raise InputError("model", f"must be a single pair for {what}", "a train",
                         "Studies of motions take a train: regime, zones, bifurcation, basins, branch and others.")


@dataclass(frozen=True)
class MeshModel(Damped, GearModel):
    """A gear pair in dimensionless form, (2.12)-(2.18).

    Parameters
    ----------
    kind : {"torsional", "full", "single"}
        ``full`` is (2.12) with lateral motion of both wheels, ``torsional`` its first two rows (rigid supports),
        ``single`` the relative motion (2.17), which has no bearing friction.
    omega : float
        Mesh frequency over ω0 = sqrt(c0/m), (2.8), where c0 is the reference stiffness, i.e. the mesh stiffness where
        χ = 1. The time mean of a Fourier stiffness is c0, that of a two-level stiffness
        c0 (1 + (α − 1) χ1 − (2 − α) χ2), that of a stepped one c0 times the mean of its levels over time.
    zeta : float
        Mesh damping ratio k/(2 m ω0), with the same ω0.
    J1, J2 : float
        Moments of inertia I_n/(m R_n²); the paper's symmetric pair has 2 and 2.
    q1, q2 : float
        Static torques M_n0/(c0 R_n Δ). ``q1`` drives, ``q2`` resists.
    beta1, beta2 : float, optional
        Bearing friction b_n/(2 m ω0 R_n²); 0.01 unless the kind is ``single``, where it must be 0.
    mu1, mu2, kappa1, kappa2, zeta_support1, zeta_support2 : float
        Masses m_n/m, support stiffnesses c_n/c0 and support damping ratios k_n/(2 m_n ω0), used only by ``full``.
    error : TransmissionError
        Static transmission error ε(τ); "error" in names of this package, except those of exceptions.
    stiffness : TwoLevelStiffness, HarmonicStiffness, SteppedStiffness or ToothPairStiffness
        Mesh stiffness χ(τ), or tooth pairs that share the load.
    damping_law : {"always", "contact", "unilateral"}
        Where the mesh damping 2ζz' acts: ``always`` as in (2.5), across the open gap, too; or in ``contact`` alone, as
        in a Kelvin–Voigt element, which may pull before it opens; or ``unilateral``: in a contact that never pulls, and
        ends where the force does. Of a `GearPair` or `GearDesign` it is ``contact`` if left out.
    initial : mapping of str to float
        Initial values by name of coordinate; those left out are x1(0) = 1 and 0 for all others, as in the paper.

    Raises
    ------
    InputError
        For a value that breaks a rule. The message has the field, the rule, the value and what to do.

    Examples
    --------
    >>> MeshModel(omega=1.2, q1=0.1, q2=0.1).period
    5.235987755982989

    `MeshModel.of` also takes the names of pairs and harmonics:

    >>> MeshModel.of(omega=0.8, eps1=0.1, kind="single").error.amplitudes
    (0.1,)
    """

    kind: Kind = "torsional"
    omega: float = 1.0
    zeta: float = 0.025
    J1: float = 2.0
    J2: float = 2.0
    q1: float = 0.1
    q2: float = 0.1
    beta1: float | None = None
    beta2: float | None = None
    mu1: float = 4.0
    mu2: float = 4.0
    kappa1: float = 0.5
    kappa2: float = 0.5
    zeta_support1: float = 0.01
    zeta_support2: float = 0.01
    error: TransmissionError = field(default_factory=TransmissionError)
    stiffness: Stiffness = field(default_factory=TwoLevelStiffness)
    damping_law: str = DEFAULT_LAW
    initial: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown_name("kind", str(self.kind), KINDS)
        DAMPING_LAWS.check("damping_law", self.damping_law)
        for name in ("beta1", "beta2"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, 0.0 if self.kind == "single" else 0.01)
        for name in SCALARS:
            object.__setattr__(self, name, to_float(name, getattr(self, name)))
        if self.kind == "single" and (self.beta1 or self.beta2):
            raise InputError("beta", "must be 0 in the single model, (2.17)", self.beta1 or self.beta2,
                             "Leave beta out, or use kind='torsional'.")
        for name, (type_, rule, advice) in _PARTS.items():
            if not isinstance(value := getattr(self, name), type_):
                raise InputError(name, rule, value, advice)
        if self.stiffness.shared and self.law.releases:
            raise InputError("damping_law", f"must be {' or '.join(SHARED_LAWS)} where tooth pairs share the load",
                             self.damping_law, "The mesh has one damper; a pair that never pulls would need one of its "
                             "own.")
        initial = {}
        for name, value in self.initial.items():
            check_state_name(self.kind, name)
            initial[name] = to_float(f"initial.{name}", value)
        check_initial_consistent(initial)
        object.__setattr__(self, "initial", MappingProxyType(initial))

    def __hash__(self) -> int:
        values = sorted(self.parameters().items()), sorted(self.initial.items())
        return hash((self.kind, self.stiffness, self.damping_law, *map(tuple, values)))

    def __reduce__(self):
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return partial(type(self), **{**values, "initial": dict(self.initial)}), ()

    def __repr__(self) -> str:
        values = {f.name: getattr(self, f.name) for f in fields(MeshModel)[1:]} | {"initial": dict(self.initial)}
        shown = [f", {name}={value!r}" for name, value in values.items()
                 if value != getattr(_default(self.kind), name) and value != {}]
        return f"MeshModel(kind={self.kind!r}{''.join(shown)})"

    @classmethod
    def of(cls, kind: str = "torsional", **values: Any) -> MeshModel:
        """A model from values by name, e.g. ``MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.04)``.

        Names as in `with_values`. If one of them is ``c1``, ``alpha1``, ..., the stiffness is a Fourier series.
        """
        stiffness = default_stiffness(values.keys() - _PARTS.keys())
        return cls(kind=kind, stiffness=stiffness).with_values(values)  # type: ignore[arg-type]

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """This model with values replaced by name.

        Parameters
        ----------
        values : mapping
            Parameters (``omega``), pairs (``q0`` sets q1 and q2), harmonics (``eps3``), initial values (``x1_dot``),
            ``kind``, ``damping_law``, ``error`` (a `TransmissionError`), ``stiffness`` (an object of one of the three
            classes), or ``initial`` (a mapping). The levels of a `SteppedStiffness` have no names: it is replaced as a
            whole.

        Raises
        ------
        InputError
            For an unknown name or a value that breaks its rule.
        """
        friction = {k: v for k, v in values.items() if parse(k).family == "beta"}
        model = replace(self, **self.expand(friction)) if friction else self
        if "kind" in values:  # bearing friction that has its default value gets the default of the new kind
            if values["kind"] not in KINDS:
                raise unknown_name("kind", str(values["kind"]), KINDS)
            old, new = _default(model.kind), _default(values["kind"])
            beta = {name: getattr(new if getattr(model, name) == getattr(old, name) else model, name)
                    for name in ("beta1", "beta2")}
            model = replace(model, kind=values["kind"], **beta)
        model = replace(model, **{k: v for k, v in values.items() if k in _PARTS})
        flat = model.expand({k: v for k, v in values.items() if k != "kind" and k not in _PARTS})
        scalars = {k: v for k, v in flat.items() if k in SCALARS}
        initial = {k: v for k, v in flat.items() if k in STATE_NAMES}
        waves = {k: v for k, v in flat.items() if k not in scalars and k not in initial}
        kept = model.initial  # but a model has either z and z_dot or the others
        if initial:
            keep = set(RELATIVE) if initial.keys() & set(RELATIVE) else set(STATE_NAMES) - set(RELATIVE)
            kept = {k: v for k, v in kept.items() if k in keep}
        return replace(
            model, **scalars, error=with_harmonics(model.error, waves, "eps", "theta"),
            stiffness=model.stiffness.with_values(waves), initial={**kept, **initial})

    def expand(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values, numbers or arrays (P,), by the names of single parameters and initial values.

        Given are values by any name of `with_values`, without ``kind`` and whole parts such as ``stiffness``. Raises
        `InputError` for a name that the model does not have; the advice is the most similar known name.
        """
        flat: dict[str, Any] = {}
        for name, value in values.items():
            own = None if self.stiffness.accepts(name) or find(name) is None else next(
                (kind for kind in STIFFNESS_KINDS.loaded() if kind.accepts(name)), None)
            if own is not None:
                raise InputError(name, f"must be a parameter of {own.noun}", name, own.advice(name, self.stiffness))
            harmonic = parse_harmonic(name)
            if harmonic is not None and (harmonic.order or 0) > MAX_HARMONICS:
                raise InputError(name, f"must be a harmonic of order at most {MAX_HARMONICS}", harmonic.order)
            if harmonic is None and name not in self.known_names:
                raise unknown_name("parameter", name, self.known_names)
            for single in PARAMETER_PAIRS.get(name, (name,)):
                flat[single] = value
        return flat

    @property
    def known_names(self) -> tuple[str, ...]:
        pairs = (q.name for q in PARAMETERS if q.members)
        return (*SCALARS, *pairs, *self.stiffness.parameter_names(), "eps1", "theta1", *state_names(self.kind))

    def set_by(self, name: str) -> tuple[str, ...]:
        """The names of the single parameters and initial values that a name sets, two for a pair such as ``q0``."""
        return tuple(self.expand({name: None}))

    def value(self, name: str) -> float | None:
        """The value of a parameter by any of its names, 0 for a harmonic that is not given.

        None for a pair whose two members differ.
        """
        known = self.parameters()
        values = {known.get(single, 0.0) for single in self.set_by(name)}
        return values.pop() if len(values) == 1 else None

    def parameters(self) -> dict[str, float]:
        """The value of every parameter by name, without pairs, e.g. ``{"omega": 1.0, ..., "eps1": 0.1}``.

        The levels of a `SteppedStiffness` have no names, and are not among them.
        """
        scalars = {name: getattr(self, name) for name in SCALARS}
        return {**scalars, **harmonics(self.error, "eps", "theta"), **self.stiffness.parameters()}

    def record(self) -> dict[str, Any]:
        values = {f.name: getattr(self, f.name) for f in fields(MeshModel)}
        parts = {"error": asdict(self.error), "stiffness": self.stiffness.record(),
                 "stiffness_kind": self.stiffness.kind, "initial": dict(self.initial)}
        return values | parts

    @property
    def state_names(self) -> tuple[str, ...]:
        """The coordinates for which it takes initial values."""
        return state_names(self.kind)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The coordinates for which results are given."""
        return COORDINATES[self.kind]

    @property
    def period(self) -> float:
        """The mesh period T = 2π/ω in units of τ."""
        return 2 * math.pi / self.omega


*_SOME, _LAST = (f"a {kind.__name__}" for kind in STIFFNESS_KINDS.own.values())

_PARTS: dict[str, tuple[type, str, str]] = {
    "error": (TransmissionError, "must be a TransmissionError", "Or give eps1, theta1, ... by name."),
    "damping_law": (str, f"must be one of {', '.join(DAMPING_LAWS.own)}", "E.g. damping_law='contact'."),
    "stiffness": (
        Stiffness, f"must be {', '.join(_SOME)} or {_LAST}",
        f"Or give {', or '.join(filter(None, (kind.offered() for kind in STIFFNESS_KINDS.own.values())))} by name."),
    "initial": (Mapping, "must be a mapping of coordinates to values", "E.g. {'x1': 0.5}."),
}
"""The fields of a model that are not numbers: their types, and the rule and advice of the error for another type."""


@cache
def _default(kind: str) -> MeshModel:
    """The model of this kind with default values."""
    return MeshModel(kind=kind)  # type: ignore[arg-type]


def backlash(z: Any) -> Any:
    """The backlash function f(z) = z − clip(z, −1, 1), (2.6) and (2.13) corrected; z of any shape."""
    return z - np.clip(z, -1.0, 1.0)


def transmission_error(model: MeshModel, tau: Any, derivative: int = 0) -> np.ndarray:
    """ε(τ) of (2.15), or its derivative of order ``derivative`` with respect to τ; the shape of ``tau``."""
    tau = np.asarray(tau, dtype=float)
    total = np.zeros_like(tau)
    for j, (a, p) in enumerate(zip(model.error.amplitudes, model.error.phases, strict=True), start=1):
        total += a * (j * model.omega) ** derivative * np.cos(j * model.omega * tau - p + derivative * np.pi / 2)
    return total


def mesh_stiffness(model: MeshModel, tau: Any) -> np.ndarray:
    """χ(τ), (2.16), (2.7) or stepped: the mesh stiffness over the reference stiffness c0; the shape of ``tau``."""
    return model.stiffness.at(tau, model.omega)
