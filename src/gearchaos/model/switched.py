"""One model at many parameter points (`Batch`), and as a switched affine system, the form that the flow integrates.

The coordinates w of every model begin with z and z', the relative displacement along the line of action and its
velocity, so that the contact state follows from w[0] alone:

    w' = A w + f(τ) − b (χ(τ) (w[0] − σ) + D w[1]) [σ ≠ 0],   σ = 0 free, +1 front flank (z > 1), −1 back flank (z < −1)

The forcing f(τ) is constant, f0, but for its second row, z'': it also has the terms of the transmission
error, Σ_j (f_cos[j] cos jωτ + f_sin[j] sin jωτ). With the damping law ``always`` the mesh damping 2ζz' acts in every
contact state, as in (2.12): it is a part of A, and D = 0. With the laws ``contact`` and ``unilateral`` it acts in
contact alone, and D = 2ζ; with the latter σ = 0 also where the force would pull.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, singledispatch
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.contacts import MeshContacts, wrapped
from gearchaos.model.damping import DampingLaw
from gearchaos.model.parameters import COORDINATES, STATE_NAMES, check_has_effect, check_initial_consistent
from gearchaos.model.stiffness import ToothPairStiffness
from gearchaos.quantities import parse_harmonic
from gearchaos.validation import check


@dataclass(frozen=True)
class Batch:
    """A model with some of its values replaced by arrays of one length P: P parameter points."""

    model: Any  # `MeshModel` or `TrainModel`: has the values that all points share
    values: Mapping[str, np.ndarray]  # (P,), by the names of parameters (no pairs such as ``q0``) and initial values
    size: int  # P

    def __getitem__(self, name: str) -> np.ndarray | float:
        """The value of a parameter: an array (P,) if it varies, else a float; 0 for a harmonic that is not given.

        Raises KeyError for a name that is not a parameter.
        """
        if name in self.values:
            return self.values[name]
        if name in self._shared:
            return self._shared[name]
        if parse_harmonic(name):
            return 0.0
        raise KeyError(name)

    @cached_property
    def _shared(self) -> dict[str, float]:
        """The parameters of the model by name; those in ``values`` replace them."""
        return self.model.parameters()

    def harmonics(self, amplitude: str, phase: str) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes and phases of a Fourier series by their families, (H, P) for harmonics 1 to H; H may be 0."""
        found = map(parse_harmonic, {**self._shared, **self.values})
        n = max((p.order or 0 for p in found if p and p.family in (amplitude, phase)), default=0)
        rows = [[np.broadcast_to(self[f"{k}{j}"], self.size) for j in range(1, n + 1)] for k in (amplitude, phase)]
        a, p = (np.array(r, dtype=float).reshape(n, self.size) for r in rows)
        return a, p

    def take(self, index: np.ndarray) -> Self:
        """The batch of the points with these indices (N,), in that order."""
        return replace(self, values={k: v[index] for k, v in self.values.items()}, size=len(index))


@singledispatch
def vary(model: Any, values: Mapping[str, Any]) -> Batch:
    """A batch: a model with arrays (P,) for some of its parameters or initial values, checked like single values.

    Names are those of `MeshModel.with_values`; a scalar is an array of length 1. Raises `InputError` also for arrays of
    several lengths or shapes, and for a parameter that has no effect in this kind of model.
    """
    flat = {k: np.atleast_1d(np.asarray(v, dtype=float)) for k, v in model.expand(values).items()}
    sizes = {v.shape for v in flat.values()} or {(1,)}
    if len(sizes) > 1 or any(len(s) != 1 for s in sizes):
        raise InputError("values", "must be one-dimensional arrays of one common length", sorted(sizes))
    for name, value in flat.items():
        check(name, value)
        check_has_effect(name, model.kind)
    check_initial_consistent(n for n in {**model.initial, **flat} if n in STATE_NAMES)
    batch = Batch(model, MappingProxyType(flat), next(iter(sizes))[0])
    model.stiffness.check(flat, *batch.harmonics("c", "alpha"))
    return batch


@dataclass(frozen=True)
class SwitchedAffine:
    """A batch of switched affine systems; P points, d coordinates, H harmonics of the forcing, N levels and K harmonics
    of the stiffness. Its arrays are those of `flow.SwitchedSystem`, and some in addition.
    """

    names: tuple[str, ...]  # the coordinates, ("z", "z_dot", ...)
    omega: np.ndarray  # (P,)
    A: np.ndarray  # (P, d, d), damping and supports, without the mesh spring
    b: np.ndarray  # (P, d)
    f0: np.ndarray  # (P, d)
    f_cos: np.ndarray  # (P, H)
    f_sin: np.ndarray
    levels: np.ndarray  # (P, N), stiffness χ without its harmonics, in the N parts of the period
    starts: np.ndarray  # (P, N), e.g. 0 and α − 1 of (2.16)
    same_starts: bool
    chi_cos: np.ndarray  # (P, K), coefficients of the harmonics of χ, which are added to the level, (2.7)
    chi_sin: np.ndarray
    velocity: np.ndarray  # (P, d), coefficients of the velocity x1' (z' in the single model)
    velocity0: np.ndarray  # (P,)
    velocity_cos: np.ndarray  # (P, H)
    velocity_sin: np.ndarray
    mean_velocity: np.ndarray  # (P,), mean of x1' over a steady motion; 0 without bearing friction
    rotation_decay: np.ndarray  # (P,), rate at which friction leads to that velocity; 0 if it is not in the state
    damping: np.ndarray  # (P,), 2ζ, the factor of z' in the mesh force
    law: DampingLaw  # where that acts
    static_force: np.ndarray  # (P, K), mean of the force of each mesh, 2ζz' + χ f(z), over a steady motion
    contacts: MeshContacts | None = None  # in the place of the one spring: of tooth pairs, or of several meshes

    @property
    def points(self) -> int:
        return len(self.omega)

    @property
    def dimension(self) -> int:
        return len(self.names)

    @property
    def period(self) -> np.ndarray:
        """The mesh period, shape (P,), in units of τ."""
        return 2 * np.pi / self.omega

    @property
    def trace(self) -> np.ndarray:
        """Trace of A, (P,): the sum of the Lyapunov exponents of any motion, less what contact adds to it."""
        return np.trace(self.A, axis1=1, axis2=2)

    @property
    def contact_trace(self) -> np.ndarray:
        """What contact of each mesh adds to the trace while it lasts, (P, K)."""
        if (several := self.contacts) is not None:
            return -np.einsum("pki,ki->pk", several.pushes, several.rates) * several.damping * several.in_contact
        return (-self.b[:, 1] * self.damping * self.law.in_contact)[:, None]

    def take(self, index: np.ndarray) -> SwitchedAffine:
        """The systems of the points with these indices (N,), in that order."""
        contacts = None if self.contacts is None else self.contacts.take(index)
        arrays = {k: v[index] for k, v in self.__dict__.items() if isinstance(v, np.ndarray)}
        return replace(self, contacts=contacts, **arrays)


def reversed_in_time(system: SwitchedAffine) -> SwitchedAffine:
    """The equations in reversed time, −τ, of the same motions with the signs of all velocities reversed.

    The flow of the result over a mesh period is the inverse of the stroboscopic map, but for these signs
    (`velocity_signs`). The fields that describe x1' and the mean rotation are kept as they are.
    """
    sign = velocity_signs(system.names)
    return replace(
        system, damping=-system.damping if system.law.in_contact else system.damping,
        A=-sign[:, None] * system.A * sign, b=-sign * system.b, f0=-sign * system.f0, f_sin=-system.f_sin,
        chi_sin=-system.chi_sin, levels=np.ascontiguousarray(system.levels[:, ::-1]),
        starts=np.hstack([np.zeros((system.points, 1)), 1.0 - system.starts[:, :0:-1]]),
        contacts=None if system.contacts is None else system.contacts.reversed_in_time(sign),
    )


def begun_at(system: SwitchedAffine, phase: np.ndarray) -> SwitchedAffine:
    """The equations with the phases (P,) of the mesh period as their instant 0.

    The flow of the result over a mesh period is the map of the states at these phases.
    """
    def turned(cosine: np.ndarray, sine: np.ndarray, orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = 2 * np.pi * phase[:, None] * orders
        c, s = (f(angle).reshape(angle.shape + (1,) * (cosine.ndim - 2)) for f in (np.cos, np.sin))
        return c * cosine + s * sine, c * sine - s * cosine

    pieces = system.starts.shape[1]
    first = (system.starts <= phase[:, None]).sum(axis=1) - 1  # the piece in which each phase lies
    order = (first[:, None] + np.arange(pieces + 1)) % pieces
    starts = wrapped(np.take_along_axis(system.starts, order, axis=1) - phase[:, None])
    out: dict[str, Any] = {"starts": starts, "levels": np.take_along_axis(system.levels, order, axis=1)}
    for cosine, sine in (("f_cos", "f_sin"), ("chi_cos", "chi_sin"), ("velocity_cos", "velocity_sin")):
        a, b = getattr(system, cosine), getattr(system, sine)
        out[cosine], out[sine] = turned(a, b, np.arange(1, a.shape[1] + 1))
    contacts = system.contacts
    if contacts is not None:
        f_cos, f_sin = turned(contacts.f_cos, contacts.f_sin, contacts.orders)
        contacts = contacts.begun_at(phase)._replace(f_cos=f_cos, f_sin=f_sin)
    return replace(system, same_starts=False, contacts=contacts, **out)


def velocity_signs(names: tuple[str, ...]) -> np.ndarray:
    """−1 for the coordinates that are velocities, 1 for the others, (d,)."""
    return np.array([-1.0 if name.endswith("_dot") else 1.0 for name in names])


@singledispatch
def coordinates(batch: Any) -> tuple[str, ...]:
    """The names of the d coordinates of the dynamic state.

    If both wheels have the same β/J at all points, the mean rotation has no effect on z and is left out. If both
    supports have the same κ/μ and ζ, the mean lateral motion is left out. d is from 2 to 7.
    """
    names = ["z", "z_dot"]
    if batch.model.kind == "single":
        return tuple(names)
    if not np.all(equal_ratios(batch, "beta", "J")):
        names.append("x2_dot")
    if batch.model.kind == "full":
        alike = np.all(equal_ratios(batch, "kappa", "mu")) and np.all(batch["zeta_support1"] == batch["zeta_support2"])
        names += ["y", "y_dot"] if alike else list(COORDINATES["full"][4:])
    return tuple(names)


def equal_ratios(batch: Batch, over: str, under: str) -> np.ndarray:
    """Whether over1/under1 equals over2/under2, such as β/J, to rounding; bool, broadcastable to (P,)."""
    left, right = (np.asarray(batch[f"{over}{n}"]) / np.asarray(batch[f"{under}{n}"]) for n in (1, 2))
    return np.abs(left - right) <= 4e-16 * np.abs(left)


def rotation_decay(batch: Batch) -> np.ndarray:
    """Damping rate of the mean rotation by the bearings, 2(β1 + β2)/(J1 + J2), (P,)."""
    friction, inertia = (np.asarray(batch[f"{n}1"]) + np.asarray(batch[f"{n}2"]) for n in ("beta", "J"))
    return np.broadcast_to(2 * friction / inertia, batch.size)


@singledispatch
def switched_system(batch: Any, names: tuple[str, ...] | None = None) -> SwitchedAffine:
    """The switched affine system of a batch, by default in the smallest set of `coordinates`.

    If the last of the given ones is "x2", after "x2_dot", it is integrated with the others and has no effect on them.
    """
    names = names or coordinates(batch)
    rows = _Rows(batch, names)
    _fill_in(rows)
    # The mean mesh force of a steady motion follows from the balance of torques with bearing friction, without it from
    # equal mean accelerations of both wheels.
    b1, b2, J1, J2 = rows["beta1"], rows["beta2"], rows["J1"], rows["J2"]
    left, right = np.where(b1 + b2 > 0, b2, J2), np.where(b1 + b2 > 0, b1, J1)
    static_force = ((rows["q1"] * left + rows["q2"] * right) / (left + right))[:, None]
    # A stiffness without parts has the level 1 in both halves of the period: with another division the steps would be
    # others, and results would differ in their last bits.
    stiffness = batch.model.stiffness
    numbers = {**stiffness.numbers(), **batch.values}
    parts = [*stiffness.parts(numbers)] or [(0.0, 1.0), (0.5, 1.0)]
    if np.any(parts[0][0] > 0):  # until then the last level of the period before lasts on
        parts.insert(0, (0.0, parts[-1][1]))
    starts, levels = (np.stack([np.broadcast_to(v, batch.size) for v in row], axis=1).astype(float)
                      for row in zip(*parts, strict=True))
    a, p = batch.harmonics("c", "alpha")
    contacts = None
    if isinstance(stiffness, ToothPairStiffness):  # with flanks at z = ±1 where tooth pairs have no gap
        pairs, unit = stiffness.contacts(numbers, batch.size), np.eye(len(names))
        harmonics = np.zeros((2, *rows.f_cos.shape, len(names)))
        harmonics[0, :, :, 1], harmonics[1, :, :, 1] = rows.f_cos, rows.f_sin
        contacts = MeshContacts(
            names=(), front=np.ones(1), rows=unit[None, 0], rates=unit[None, 1], pushes=rows.b[:, None],
            damping=rows.damping[:, None], in_contact=np.array([batch.model.law.in_contact]),
            releases=np.zeros(1, bool),
            meshes=np.zeros(len(pairs.sides), np.int64), sides=pairs.sides, edges=pairs.edges,
            stiffness=pairs.stiffness, offset=pairs.gap + np.array([1.0, 0.0, 0.0]), orders=rows.order,
            f_cos=harmonics[0], f_sin=harmonics[1])
    return SwitchedAffine(
        names=names, omega=rows.omega, A=rows.A, b=rows.b, f0=rows.f0, f_cos=rows.f_cos, f_sin=rows.f_sin,
        levels=levels, starts=starts, same_starts=all(np.ndim(start) == 0 for start, _ in parts),
        chi_cos=(a * np.cos(p)).T, chi_sin=(a * np.sin(p)).T, damping=rows.damping, static_force=static_force,
        law=batch.model.kernel_law, **_velocity(rows), contacts=contacts)


class _Rows:
    """The arrays of a `SwitchedAffine` while its equations are assembled; ``rows[name]`` is a parameter as (P,)."""

    def __init__(self, batch: Batch, names: tuple[str, ...]) -> None:
        self.batch, self.names, self.kind = batch, names, batch.model.kind
        self.omega = self["omega"]
        a, p = batch.harmonics("eps", "theta")
        self.order = np.arange(1, len(a) + 1)
        self.e_cos, self.e_sin = (a * np.cos(p)).T, (a * np.sin(p)).T
        n, d, h = batch.size, len(names), len(a)
        self.A, self.b, self.f0 = np.zeros((n, d, d)), np.zeros((n, d)), np.zeros((n, d))
        self.f_cos, self.f_sin = np.zeros((n, h)), np.zeros((n, h))

    def __getitem__(self, name: str) -> np.ndarray:
        values = np.empty(self.batch.size)
        values[:] = self.batch[name]
        return values

    @property
    def damping(self) -> np.ndarray:
        """The factor of z' in the mesh force, (P,): 2ζ, of a law of another package with its coefficient."""
        return 2 * self["zeta"] * self.batch.model.law.coefficient(self.omega)

    def error_harmonics(self, derivative: int) -> tuple[np.ndarray, np.ndarray]:
        """Cosine and sine coefficients (P, H) of ε or its first or second derivative."""
        w = self.order * self.omega[:, None]
        c, s = self.e_cos, self.e_sin
        return [(c, s), (w * s, -w * c), (-(w**2) * c, -(w**2) * s)][derivative]

    def add_error(self, derivative: int, factor: np.ndarray | float) -> None:
        """Add a derivative of ε times a factor to the right side of the row z'' = …, the only one that ε is in."""
        c, s = self.error_harmonics(derivative)
        factor = np.broadcast_to(factor, self.batch.size)[:, None]
        self.f_cos += factor * c
        self.f_sin += factor * s

    def add_force(self, row: int, factor: np.ndarray | float) -> None:
        """Add the mesh force S = 2ζz' + χ f(z), (2.5), times a factor to the right side of one row."""
        if not self.batch.model.law.in_contact:
            self.A[:, row, 1] += self.damping * factor
        self.b[:, row] -= factor


def _fill_in(rows: _Rows) -> None:
    """Fill in (2.12): (x1 − x2)'' − ε'' in the row of z'', the row of x2'', if any, and those of the supports, or their
    difference if the state has only y = y1 − y2."""
    J1, J2 = rows["J1"], rows["J2"]
    b1, b2 = rows["beta1"] / J1, rows["beta2"] / J2
    rows.A[:, 0, 1] = 1.0
    rows.f0[:, 1] = rows["q1"] / J1 + rows["q2"] / J2
    rows.add_force(1, -(1 / J1 + 1 / J2))
    rows.add_error(2, -1.0)
    rows.A[:, 1, 1] += -2 * b1  # −2 β1/J1 times x1' − x2' = z' + ε' − (y1 − y2)'
    rows.add_error(1, -2 * b1)
    for name, sign in _lateral(rows):
        rows.A[:, 1, rows.names.index(name) + 1] -= sign * (-2 * b1)
    if "x2" in rows.names:
        rows.A[:, rows.names.index("x2"), rows.names.index("x2_dot")] = 1.0
    if "x2_dot" in rows.names:
        v = rows.names.index("x2_dot")
        rows.A[:, 1, v] = -2 * (b1 - b2)
        rows.A[:, v, v] = -2 * b2
        rows.f0[:, v] = -rows["q2"] / J2
        rows.add_force(v, 1 / J2)
    for name, sign in _lateral(rows):
        n = "1" if name in ("y", "y1") else "2"
        y, mu = rows.names.index(name), rows[f"mu{n}"]
        share = 1 / mu if name != "y" else 1 / rows["mu1"] + 1 / rows["mu2"]
        rows.A[:, y, y + 1] = 1.0
        for row, factor in ((y + 1, 1.0), (1, sign)):
            rows.A[:, row, y] -= factor * rows[f"kappa{n}"] / mu
            rows.A[:, row, y + 1] -= factor * 2 * rows[f"zeta_support{n}"]
        rows.add_force(y + 1, -sign * share)
        rows.add_force(1, -share)


def _lateral(rows: _Rows) -> list[tuple[str, float]]:
    """The lateral coordinates of the state, with the signs with which they add up to y1 − y2."""
    if "y" in rows.names:
        return [("y", 1.0)]
    return [("y1", 1.0), ("y2", -1.0)] if "y1" in rows.names else []


def _velocity(rows: _Rows) -> dict[str, Any]:
    """The fields of a `SwitchedAffine` that give x1' from w.

    If the mean rotation is not in the state, its velocity is taken to be the steady one. Without bearing friction there
    is no steady velocity, and it is taken to be 0.
    """
    n, d = rows.b.shape
    row, zero = np.zeros((n, d)), np.zeros(n)
    if rows.kind == "single":
        row[:, 1] = 1.0
        flat = np.zeros_like(rows.e_cos)
        return {"velocity": row, "velocity0": zero, "velocity_cos": flat, "velocity_sin": flat,
                "mean_velocity": zero, "rotation_decay": zero}
    J1, J2, friction = rows["J1"], rows["J2"], rows["beta1"] + rows["beta2"]
    excess = rows["q1"] - rows["q2"]
    mean = np.divide(excess, 2 * friction, out=np.zeros(n), where=friction > 0)
    steady = ("x2_dot" in rows.names) & (friction > 0)  # x2' is in the state and has a steady mean
    share = np.where(steady, 1.0, J2 / (J1 + J2))
    row[:, 1] = share
    for name, sign in _lateral(rows):
        row[:, rows.names.index(name) + 1] = -sign * share
    if "x2_dot" in rows.names:
        row[:, rows.names.index("x2_dot")] = steady
    c, s = rows.error_harmonics(1)
    return {"velocity": row, "velocity0": np.where(steady, 0.0, mean), "velocity_cos": share[:, None] * c,
            "velocity_sin": share[:, None] * s, "mean_velocity": mean,
            "rotation_decay": np.where(steady, rotation_decay(rows.batch), 0.0)}
