"""`MeshModel`: the parameters of the dimensionless equations (2.12)-(2.18) of Łuczko (2008) and their defaults.

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4),
2008, read with the corrections listed in ``docs/model.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from types import MappingProxyType
from typing import Any, Self, TypeVar

import numpy as np

from gearchaos.display import HasCard
from gearchaos.errors import InputError, unknown_name
from gearchaos.model.names import (
    KINDS,
    RELATIVE,
    SCALARS,
    STATE_NAMES,
    Kind,
    check_initial_consistent,
    check_state_name,
    expand_pairs,
)
from gearchaos.model.stiffness import STIFFNESS_KINDS, Stiffness, TwoLevelStiffness, default_stiffness
from gearchaos.model.waveforms import TransmissionError, harmonics, with_harmonics
from gearchaos.quantities import parse
from gearchaos.validation import to_float


@dataclass(frozen=True)
class MeshModel(HasCard):
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
    stiffness : TwoLevelStiffness, HarmonicStiffness or SteppedStiffness
        Mesh stiffness χ(τ).
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
    initial: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown_name("kind", str(self.kind), KINDS)
        for name in ("beta1", "beta2"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, 0.0 if self.kind == "single" else 0.01)
        for name in SCALARS:
            object.__setattr__(self, name, to_float(name, getattr(self, name)))
        self._check_single()
        self._check_parts()
        object.__setattr__(self, "initial", MappingProxyType(self._checked_initial()))

    def _check_single(self) -> None:
        """Raise `InputError` if a single model has bearing friction."""
        if self.kind == "single" and (self.beta1 or self.beta2):
            raise InputError(
                "beta", "must be 0 in the single model, (2.17)", self.beta1 or self.beta2,
                "Leave beta out, or use kind='torsional'.",
            )

    def _check_parts(self) -> None:
        """Raise `InputError` unless the fields that are not numbers have the right types."""
        for name, (kinds, rule, advice) in _PARTS.items():
            if not isinstance(value := getattr(self, name), kinds):
                raise InputError(name, rule, value, advice)

    def _checked_initial(self) -> dict[str, float]:
        """The initial values as floats; raises `InputError` for a wrong name or value, or values for z and x."""
        given = {}
        for name, value in self.initial.items():
            check_state_name(self.kind, name)
            given[name] = to_float(f"initial.{name}", value)
        check_initial_consistent(given)
        return given

    def __hash__(self) -> int:
        return hash((self.kind, self.stiffness, *sorted(self.parameters().items()), *sorted(self.initial.items())))

    def __reduce__(self):
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return _rebuild, (type(self), {**values, "initial": dict(self.initial)})

    def __repr__(self) -> str:
        shown = []
        for f in fields(MeshModel):
            value = getattr(self, f.name)
            if f.name == "initial":
                value = dict(value)
            if value != getattr(_default(self.kind), f.name) and value != {}:
                shown.append(f"{f.name}={value!r}")
        return f"MeshModel(kind={self.kind!r}{''.join(', ' + s for s in shown if not s.startswith('kind='))})"

    @classmethod
    def of(cls, kind: str = "torsional", **values: Any) -> MeshModel:
        """A model from values by name, e.g. ``MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.04)``.

        Names as in `with_values`. If one of them is ``c1``, ``alpha1``, ..., the stiffness is a Fourier series.
        """
        return cls(kind=kind, stiffness=default_stiffness(values)).with_values(values)  # type: ignore[arg-type]

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """This model with values replaced by name.

        Parameters
        ----------
        values : mapping
            Parameters (``omega``), pairs (``q0`` sets q1 and q2), harmonics (``eps3``), initial values (``x1_dot``),
            ``kind``, ``error`` (a `TransmissionError`), ``stiffness`` (an object of one of the three classes), or
            ``initial`` (a mapping). The levels of a `SteppedStiffness` have no names: it is replaced as a whole.

        Raises
        ------
        InputError
            For an unknown name or a value that breaks its rule.
        """
        friction = {k: v for k, v in values.items() if parse(k).family == "beta"}
        model = replace(self, **expand_pairs(friction, self)) if friction else self
        model = _with_kind(model, values["kind"]) if "kind" in values else model
        model = replace(model, **{k: v for k, v in values.items() if k in _PARTS})
        flat = model.expand({k: v for k, v in values.items() if k != "kind" and k not in _PARTS})
        scalars = {k: v for k, v in flat.items() if k in SCALARS}
        initial = {k: v for k, v in flat.items() if k in STATE_NAMES}
        waves = {k: v for k, v in flat.items() if k not in scalars and k not in initial}
        return replace(
            model,
            **scalars,
            error=with_harmonics(model.error, waves, "eps", "theta"),
            stiffness=model.stiffness.with_values(waves),
            initial={**_kept_initial(model.initial, initial), **initial},
        )

    def expand(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values of single parameters and initial values, from values by any name that the model accepts.

        Parameters
        ----------
        values : mapping of str to float or (P,)
            Names as in `with_values`, without ``kind`` and whole parts such as ``stiffness``.

        Raises
        ------
        InputError
            For a name that the model does not have.
        """
        return expand_pairs(values, self)

    def set_by(self, name: str) -> tuple[str, ...]:
        """The names of the single parameters and initial values that a name sets, two for a pair such as ``q0``."""
        return tuple(expand_pairs({name: None}, self))

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

    @property
    def period(self) -> float:
        """The mesh period T = 2π/ω in units of τ."""
        return 2 * math.pi / self.omega


Model = TypeVar("Model", bound=MeshModel)

*_SOME, _LAST = (f"a {kind.__name__}" for kind in STIFFNESS_KINDS.values())

_PARTS: dict[str, tuple[type, str, str]] = {
    "error": (TransmissionError, "must be a TransmissionError", "Or give eps1, theta1, ... by name."),
    "stiffness": (
        Stiffness, f"must be {', '.join(_SOME)} or {_LAST}",
        f"Or give {', or '.join(filter(None, (kind.offered() for kind in STIFFNESS_KINDS.values())))} by name.",
    ),
    "initial": (Mapping, "must be a mapping of coordinates to values", "E.g. {'x1': 0.5}."),
}
"""The fields of a model that are not numbers: their types, and the rule and advice of the error for another type."""


def _rebuild(kind: type[MeshModel], values: dict[str, Any]) -> MeshModel:
    """The model of this class with these fields; pickle calls it."""
    return kind(**values)


@cache
def _default(kind: str) -> MeshModel:
    """The model of this kind with default values."""
    return MeshModel(kind=kind)  # type: ignore[arg-type]


def _with_kind(model: Model, kind: Any) -> Model:
    """The model as another kind; bearing friction that has its default value gets the default of the new kind."""
    if kind not in KINDS:
        raise unknown_name("kind", str(kind), KINDS)
    old, new = _default(model.kind), _default(kind)
    beta = {
        name: getattr(new if getattr(model, name) == getattr(old, name) else model, name)
        for name in ("beta1", "beta2")
    }
    return replace(model, kind=kind, **beta)


def _kept_initial(old: Mapping[str, float], new: Mapping[str, Any]) -> dict[str, float]:
    """The old initial values that may be kept with the new ones: a model has either z and z_dot or the others."""
    if not new:
        return dict(old)
    keep = set(RELATIVE) if new.keys() & set(RELATIVE) else set(STATE_NAMES) - set(RELATIVE)
    return {k: v for k, v in old.items() if k in keep}


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
