"""The dimensionless gear mesh: equations (2.12)-(2.18) of Łuczko (2008), their parameters and defaults.

Equation numbers refer to J. Łuczko, *Chaotic vibrations in gear mesh systems*, J. Theor. Appl. Mech. 46(4),
2008, read with the corrections listed in ``docs/model.md``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.model.rules import MAX_HARMONICS, check, number_of, numbers_of, refuse_first

Kind = Literal["single", "torsional", "full"]
KINDS: tuple[str, ...] = ("single", "torsional", "full")

_TORSION = ("x1", "x1_dot", "x2", "x2_dot")
_LATERAL = ("y1", "y1_dot", "y2", "y2_dot")
COORDINATES: dict[str, tuple[str, ...]] = {
    "single": ("z", "z_dot"),
    "torsional": _TORSION,
    "full": _TORSION + _LATERAL,
}
"""The physical coordinates of each kind of model, in the order used for states."""

PAIRS: dict[str, tuple[str, str]] = {
    "q0": ("q1", "q2"),
    "J": ("J1", "J2"),
    "beta": ("beta1", "beta2"),
    "mu": ("mu1", "mu2"),
    "kappa": ("kappa1", "kappa2"),
    "zeta_support": ("zeta_support1", "zeta_support2"),
    "chi0": ("chi1", "chi2"),
}
"""Short names that set both values of a pair."""

_STATE_NAMES = ("z", "z_dot", *_TORSION, *_LATERAL)
_HARMONIC = re.compile(r"(eps|theta|c|alpha)([1-9]\d*)")
_FOURIER = re.compile(r"(c|alpha)[1-9]\d*")
_LEVELS: tuple[str, ...] = ("chi1", "chi2", "chi0", "contact_ratio")

def _set_series(series: Any, kind: str) -> None:
    """Check and complete the amplitudes and phases of a frozen Fourier series; missing phases are 0."""
    amplitudes = numbers_of(f"{kind}.amplitudes", series.amplitudes)
    phases = numbers_of(f"{kind}.phases", series.phases)
    if len(phases) > len(amplitudes):
        raise InputError(
            f"{kind}.phases", f"must not be longer than amplitudes ({len(amplitudes)})", len(phases),
            "Give one phase per harmonic; missing ones are 0.",
        )
    object.__setattr__(series, "amplitudes", amplitudes)
    object.__setattr__(series, "phases", phases + (0.0,) * (len(amplitudes) - len(phases)))


@dataclass(frozen=True)
class TransmissionError:
    """Static transmission error ε(τ) = Σ a_j cos(jωτ − θ_j), (2.15); amplitudes over the half backlash Δ."""

    amplitudes: tuple[float, ...] = (0.0,)
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _set_series(self, "error")


@dataclass(frozen=True)
class TwoLevelStiffness:
    """Mesh stiffness of alternating tooth contact, (2.16): 1 + χ1 for (α − 1)T, then 1 − χ2.

    Its time mean is 1 + (α − 1) χ1 − (2 − α) χ2, and 1 only where the two parts balance.
    """

    chi1: float = 0.25
    chi2: float = 0.25
    contact_ratio: float = 1.5

    def __post_init__(self) -> None:
        for f in fields(self):
            object.__setattr__(self, f.name, number_of(f.name, getattr(self, f.name)))


@dataclass(frozen=True)
class HarmonicStiffness:
    """Mesh stiffness as a Fourier series, (2.7): χ(τ) = 1 + Σ c_j cos(jωτ − α_j)."""

    amplitudes: tuple[float, ...] = (0.0,)
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _set_series(self, "stiffness")
        check_stiffness(np.array(self.amplitudes)[:, None], np.array(self.phases)[:, None])


def check_stiffness(amplitudes: np.ndarray, phases: np.ndarray) -> None:
    """Raise unless 1 + Σ c_j cos(jθ − α_j) stays positive; arrays (harmonics, points)."""
    if np.all(np.abs(amplitudes).sum(axis=0) < 1):
        return
    lowest = _series_minimum(amplitudes, phases)
    refuse_first(
        "stiffness.amplitudes", lowest, lowest > 0, "must keep the mesh stiffness above 0 (its least value is given)",
        "Lower the amplitudes.",
    )


def _series_minimum(amplitudes: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """A lower estimate of the least value: the sampled one less what a bounded curvature allows between samples."""
    order = np.arange(1, len(amplitudes) + 1)
    theta = np.linspace(0, 2 * np.pi, 256 * len(amplitudes), endpoint=False)
    lowest = np.full(amplitudes.shape[1], np.inf)
    for t in theta:
        lowest = np.minimum(lowest, 1 + (amplitudes * np.cos(order[:, None] * t - phases)).sum(axis=0))
    curvature = (np.abs(amplitudes) * order[:, None] ** 2).sum(axis=0)
    return lowest - curvature * (theta[1] - theta[0]) ** 2 / 8


Stiffness = TwoLevelStiffness | HarmonicStiffness


@dataclass(frozen=True)
class MeshModel:
    """A gear pair in dimensionless form, (2.12)-(2.18).

    Parameters
    ----------
    kind : {"torsional", "full", "single"}
        ``full`` is (2.12) with lateral motion of both wheels, ``torsional`` its first two rows (rigid supports),
        ``single`` the relative motion (2.17), which has no bearing friction.
    omega : float
        Mesh frequency over ω0 = sqrt(c0/m), (2.8), where c0 is the reference stiffness, χ = 1.
    zeta : float
        Mesh damping ratio k/(2 m ω0), of the same ω0.
    J1, J2 : float
        Moments of inertia I_n/(m R_n²); the paper's symmetric pair has 2 and 2.
    q1, q2 : float
        Static torques M_n0/(c0 R_n Δ). ``q1`` drives, ``q2`` resists.
    beta1, beta2 : float, optional
        Bearing friction b_n/(2 m ω0 R_n²); 0.01 unless the kind is ``single``, where it must be 0.
    mu1, mu2, kappa1, kappa2, zeta_support1, zeta_support2 : float
        Masses, support stiffnesses and support damping ratios, used by ``full`` alone.
    error : TransmissionError
        Static transmission error ε(τ).
    stiffness : TwoLevelStiffness or HarmonicStiffness
        Mesh stiffness χ(τ).
    initial : mapping of str to float
        Initial values by coordinate name; those not given are the paper's: x1(0) = 1, the rest 0.

    Raises
    ------
    InputError
        Naming the field, the rule, the value and what to do.

    Examples
    --------
    >>> MeshModel(omega=1.2, q1=0.1, q2=0.1).period
    5.235987755982989

    `MeshModel.of` takes short names:

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
            object.__setattr__(self, name, number_of(name, getattr(self, name)))
        self._check_single()
        self._check_parts()
        object.__setattr__(self, "initial", MappingProxyType(self._checked_initial()))

    def _check_single(self) -> None:
        if self.kind == "single" and (self.beta1 or self.beta2):
            raise InputError(
                "beta", "must be 0 in the single model, (2.17)", self.beta1 or self.beta2,
                "Leave beta out, or use kind='torsional'.",
            )

    def _check_parts(self) -> None:
        for name, (kinds, rule, advice) in _PARTS.items():
            if not isinstance(value := getattr(self, name), kinds):
                raise InputError(name, rule, value, advice)

    def _checked_initial(self) -> dict[str, float]:
        given = {}
        for name, value in self.initial.items():
            check_state_name(self.kind, name)
            given[name] = number_of(f"initial.{name}", value)
        check_one_description(given)
        return given

    def __hash__(self) -> int:
        return hash((self.kind, *sorted(self.parameters().items()), *sorted(self.initial.items())))

    def __reduce__(self):
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return _rebuild, ({**values, "initial": dict(self.initial)},)

    def __repr__(self) -> str:
        shown = []
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name == "initial":
                value = dict(value)
            if value != getattr(_default(self.kind), f.name) and value != {}:
                shown.append(f"{f.name}={value!r}")
        return f"MeshModel(kind={self.kind!r}{''.join(', ' + s for s in shown if not s.startswith('kind='))})"

    @classmethod
    def of(cls, kind: str = "torsional", **values: Any) -> MeshModel:
        """A model from short names: ``MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.04)``.

        Names as in `with_values`. With amplitudes or phases ``c1``, ``alpha1``, ... the stiffness is a Fourier series.
        """
        return cls(kind=kind, stiffness=default_stiffness(values)).with_values(values)  # type: ignore[arg-type]

    def with_values(self, values: Mapping[str, Any]) -> MeshModel:
        """This model with values replaced by name: parameters, pairs, harmonics, initial values, or a whole ``error``,
        ``stiffness`` or ``initial``."""
        friction = {k: v for k, v in values.items() if k.startswith("beta")}
        model = replace(self, **expand(friction, self)) if friction else self
        model = _with_kind(model, values["kind"]) if "kind" in values else model
        model = replace(model, **{k: v for k, v in values.items() if k in _PARTS})
        flat = expand({k: v for k, v in values.items() if k != "kind" and k not in _PARTS}, model)
        scalars = {k: v for k, v in flat.items() if k in SCALARS}
        initial = {k: v for k, v in flat.items() if k in _STATE_NAMES}
        waves = {k: v for k, v in flat.items() if k not in scalars and k not in initial}
        return replace(
            model,
            **scalars,
            error=_with_harmonics(model.error, waves, "eps", "theta"),
            stiffness=_with_stiffness(model.stiffness, waves),
            initial={**_compatible(model.initial, initial), **initial},
        )

    def parameters(self) -> dict[str, float]:
        """Every parameter by its canonical single name (no pairs), e.g. ``{"omega": 1.0, ..., "eps1": 0.1}``."""
        flat = {name: getattr(self, name) for name in SCALARS}
        flat.update(_harmonics(self.error, "eps", "theta"))
        if isinstance(self.stiffness, TwoLevelStiffness):
            flat.update({f.name: getattr(self.stiffness, f.name) for f in fields(self.stiffness)})
        else:
            flat.update(_harmonics(self.stiffness, "c", "alpha"))
        return flat

    @property
    def period(self) -> float:
        """The mesh period T = 2π/ω in units of τ."""
        return 2 * math.pi / self.omega


_PARTS: dict[str, tuple[tuple[type, ...], str, str]] = {
    "error": ((TransmissionError,), "must be a TransmissionError", "Or give eps1, theta1, ... by name."),
    "stiffness": (
        (TwoLevelStiffness, HarmonicStiffness), "must be a TwoLevelStiffness or a HarmonicStiffness",
        "Or give chi1, chi2, contact_ratio, or c1, alpha1, ... by name.",
    ),
    "initial": ((Mapping,), "must be a mapping of coordinates to values", "E.g. {'x1': 0.5}."),
}
"""Fields that are no numbers: their types, the rule in words, what to do."""

SCALARS: tuple[str, ...] = tuple(
    f.name for f in fields(MeshModel) if f.name not in ("kind", "error", "stiffness", "initial")
)


def _rebuild(values: dict[str, Any]) -> MeshModel:
    return MeshModel(**values)


@cache
def _default(kind: str) -> MeshModel:
    return MeshModel(kind=kind)  # type: ignore[arg-type]


def _with_kind(model: MeshModel, kind: Any) -> MeshModel:
    """The same pair seen by another kind of model; the default bearing friction follows the kind."""
    if kind not in KINDS:
        raise unknown_name("kind", str(kind), KINDS)
    old, new = _default(model.kind), _default(kind)
    beta = {
        name: getattr(new if getattr(model, name) == getattr(old, name) else model, name)
        for name in ("beta1", "beta2")
    }
    return replace(model, kind=kind, **beta)


def _harmonics(series: TransmissionError | HarmonicStiffness, amplitude: str, phase: str) -> dict[str, float]:
    flat = {}
    for j, (a, p) in enumerate(zip(series.amplitudes, series.phases, strict=True), start=1):
        flat[f"{amplitude}{j}"], flat[f"{phase}{j}"] = a, p
    return flat


def _with_harmonics(series: Any, values: Mapping[str, Any], amplitude: str, phase: str) -> Any:
    flat = {**_harmonics(series, amplitude, phase), **values}
    orders = [int(m[2]) for m in map(_HARMONIC.fullmatch, flat) if m and m[1] in (amplitude, phase)]
    n = max(orders, default=0)
    return type(series)(
        tuple(flat.get(f"{amplitude}{j}", 0.0) for j in range(1, n + 1)),
        tuple(flat.get(f"{phase}{j}", 0.0) for j in range(1, n + 1)),
    )


def _with_stiffness(stiffness: Stiffness, values: Mapping[str, Any]) -> Stiffness:
    if isinstance(stiffness, HarmonicStiffness):
        return _with_harmonics(stiffness, values, "c", "alpha")
    return replace(stiffness, **{k: v for k, v in values.items() if k in ("chi1", "chi2", "contact_ratio")})


def _compatible(old: Mapping[str, float], new: Mapping[str, Any]) -> dict[str, float]:
    """The old initial values, less those that a switch between z and x coordinates makes meaningless."""
    if not new:
        return dict(old)
    relative = {"z", "z_dot"}
    keep = relative if new.keys() & relative else set(_STATE_NAMES) - relative
    return {k: v for k, v in old.items() if k in keep}


def known_names(model: MeshModel) -> tuple[str, ...]:
    """All names that a value of this model can be set by."""
    stiffness = _LEVELS
    if isinstance(model.stiffness, HarmonicStiffness):
        stiffness = ("c1", "alpha1")
    pairs = tuple(p for p in PAIRS if p != "chi0")
    return (*SCALARS, *pairs, *stiffness, "eps1", "theta1", *state_names(model.kind))


def state_names(kind: str) -> tuple[str, ...]:
    """The coordinates that initial values of this kind may be given in."""
    return ("z", "z_dot", *_TORSION) if kind == "single" else COORDINATES[kind]


def check_one_description(names: Iterable[str]) -> None:
    """Raise if a start is given both in z and in the coordinates that z follows from."""
    given = set(names)
    if given & {"z", "z_dot"} and given - {"z", "z_dot"}:
        raise InputError("initial", "must give either z, z_dot or the x coordinates, not both", sorted(given))


def check_state_name(kind: str, name: str) -> None:
    """Raise unless ``name`` is a coordinate that a model of this kind can start from."""
    if name not in state_names(kind):
        raise unknown_name(f"initial value of a {kind} model", name, state_names(kind))


def expand(values: Mapping[str, Any], model: MeshModel) -> dict[str, Any]:
    """Values by canonical names: pairs split, unknown names refused with the nearest known one as advice."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        _check_name(name, model)
        for single in PAIRS.get(name, (name,)):
            flat[single] = value
    return flat


def default_stiffness(names: Iterable[str]) -> Stiffness:
    """Where nobody says which stiffness: a Fourier series if there are names of one, else the paper's two levels."""
    series = any(_FOURIER.fullmatch(name) for name in names)
    return HarmonicStiffness() if series else TwoLevelStiffness()


def _check_name(name: str, model: MeshModel) -> None:
    match = _HARMONIC.fullmatch(name)
    harmonic_stiffness = isinstance(model.stiffness, HarmonicStiffness)
    if match and (match[1] in ("eps", "theta") or harmonic_stiffness):
        if int(match[2]) > MAX_HARMONICS:
            raise InputError(name, f"must be a harmonic of order at most {MAX_HARMONICS}", int(match[2]))
        return
    if name in known_names(model):
        return
    if name in _LEVELS:
        raise InputError(name, "must be a parameter of a two-level stiffness, (2.16)", name,
                         "This model's is a Fourier series: set c1, alpha1, ..., or stiffness=TwoLevelStiffness().")
    if _FOURIER.fullmatch(name):
        raise InputError(name, "must be a parameter of a Fourier stiffness, (2.7)", name,
                         f"This model's has two levels. Begin with MeshModel.of({name}=...) or "
                         "stiffness=HarmonicStiffness(...), a study file with kind = 'harmonics' in [model.stiffness].")
    raise unknown_name("parameter", name, known_names(model))


@dataclass(frozen=True)
class Batch:
    """A model with some values replaced by arrays of one common length: one parameter point per element.

    ``values`` holds canonical parameter names and initial values, shape (points,).
    """

    model: MeshModel
    values: Mapping[str, np.ndarray]
    size: int

    def __getitem__(self, name: str) -> np.ndarray | float:
        """The values of one canonical parameter, an array (points,) where it varies."""
        if name in self.values:
            return self.values[name]
        if name in self._alike:
            return self._alike[name]
        if _HARMONIC.fullmatch(name):
            return 0.0
        raise KeyError(name)

    @cached_property
    def _alike(self) -> dict[str, float]:
        """The values that all points share, unless they are replaced."""
        return self.model.parameters()

    def harmonics(self, amplitude: str, phase: str) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes and phases of a series over the batch, each (orders, points); zero orders if there is none."""
        names = {**self._alike, **self.values}
        orders = [int(m[2]) for m in map(_HARMONIC.fullmatch, names) if m and m[1] in (amplitude, phase)]
        n = max(orders, default=0)
        rows = [[np.broadcast_to(self[f"{k}{j}"], self.size) for j in range(1, n + 1)] for k in (amplitude, phase)]
        a, p = (np.array(r, dtype=float).reshape(n, self.size) for r in rows)
        return a, p

    def take(self, index: np.ndarray) -> Batch:
        """The batch of the chosen points, in that order."""
        return Batch(self.model, {k: v[index] for k, v in self.values.items()}, len(index))


def vary(model: MeshModel, values: Mapping[str, Any]) -> Batch:
    """A batch: ``model`` with parameters or initial values by name as arrays (points,), checked like scalars."""
    flat = {k: np.atleast_1d(np.asarray(v, dtype=float)) for k, v in expand(values, model).items()}
    sizes = {v.shape for v in flat.values()} or {(1,)}
    if len(sizes) > 1 or any(len(s) != 1 for s in sizes):
        raise InputError("values", "must be one-dimensional arrays of one common length", sorted(sizes))
    for name, value in flat.items():
        check(name, value)
        _check_matters(model, name)
    check_one_description(n for n in {**model.initial, **flat} if n in _STATE_NAMES)
    batch = Batch(model, MappingProxyType(flat), next(iter(sizes))[0])
    check_stiffness(*batch.harmonics("c", "alpha"))
    return batch


def _check_matters(model: MeshModel, name: str) -> None:
    lateral = name.startswith(("mu", "kappa", "zeta_support"))
    if (lateral and model.kind != "full") or (name.startswith("beta") and model.kind == "single"):
        raise InputError(name, f"must be a parameter of the {model.kind} model", name, "Use kind='full'."
                         if lateral else "Use kind='torsional'.")


def backlash(z: Any) -> Any:
    """The backlash function f(z) = z − clamp(z, −1, 1), (2.6) and (2.13) corrected; any shape."""
    return z - np.clip(z, -1.0, 1.0)


def transmission_error(model: MeshModel, tau: Any, derivative: int = 0) -> np.ndarray:
    """ε(τ) of (2.15) or its derivative with respect to τ; the shape of ``tau``."""
    tau = np.asarray(tau, dtype=float)
    total = np.zeros_like(tau)
    for j, (a, p) in enumerate(zip(model.error.amplitudes, model.error.phases, strict=True), start=1):
        total += a * (j * model.omega) ** derivative * np.cos(j * model.omega * tau - p + derivative * np.pi / 2)
    return total


def mesh_stiffness(model: MeshModel, tau: Any) -> np.ndarray:
    """χ(τ) of (2.16) or (2.7); the shape of ``tau``."""
    tau = np.asarray(tau, dtype=float)
    s = model.stiffness
    if isinstance(s, TwoLevelStiffness):
        return np.where(np.mod(tau / model.period, 1.0) < s.contact_ratio - 1, 1 + s.chi1, 1 - s.chi2)
    chi = np.ones_like(tau)
    for j, (a, p) in enumerate(zip(s.amplitudes, s.phases, strict=True), start=1):
        chi += a * np.cos(j * model.omega * tau - p)
    return chi
