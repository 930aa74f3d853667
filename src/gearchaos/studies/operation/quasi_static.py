"""The quasi-static ratio: what the mesh force reaches at no speed where the stiffness jumps."""

from __future__ import annotations

import math

import numpy as np

from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import ToothPairStiffness, vary
from gearchaos.model.static import static_jumps
from gearchaos.model.switched import SwitchedAffine, switched_system

_STEP = 0.01
"""Distance of the instants at which the force after a jump is first sampled, over the time constant of the fastest
mode."""

_LONGEST = 7.0
"""Time for which it is sampled, over the time constant of the slowest mode: the overshoot is over by then."""

_MOST_INSTANTS = 200_000
_NEWTON_STEPS = 4


def quasi_static_ratio(model: AnyModel) -> float:
    """The peak of the mesh force over the static one as the speed goes to 0: more than 1 where the stiffness jumps.

    A dynamic factor is to be divided by it before it is compared with K_v of a standard, in which the load passes from
    pair to pair without a jump. The speed of the model, which has a static load, has no effect.

    At no speed the transmission error accelerates nothing, and on each part of the mesh period the deflection comes to
    rest at F/c, where F is the static mesh force. Where the stiffness jumps from c_a to c_b, the deflection stays and
    the force becomes F c_b/c_a. It then approaches F as a free damped vibration, at any speed: a rise of the stiffness
    has its peak at the jump, a fall overshoots by F (1 − c_b/c_a) exp(−2ζ arccos ζ/√(1 − ζ²)), where ζ is the damping
    ratio at c_b, if only the relative rotation vibrates. The ratio is the largest of these peaks over F, 1 without a
    jump. With two levels it is c_max/c_min. With tooth pairs that share the load the deflection at rest is that with
    their gaps; where a relief lets each pair begin and end without load, nothing jumps. NaN for a train,
    whose meshes have no common one.
    """
    model = as_model(model)
    if model.mesh_names:
        return math.nan
    system = switched_system(vary(model, {}))
    static, level = float(system.static_force[0, 0]), system.levels[0]
    phase = 2 * np.pi * system.starts[0][:, None] * np.arange(1, system.chi_cos.shape[1] + 1)
    smooth = np.cos(phase) @ system.chi_cos[0] + np.sin(phase) @ system.chi_sin[0]
    if isinstance(model.stiffness, ToothPairStiffness):
        found = static_jumps(model.stiffness, static)
        peaks = [force for *_, force in found]  # at the jump; then as one spring with the same jump overshoots
        peaks += [_peak_after(system, static / (static / level + z - after), level) for z, after, level, _ in found]
        return max([1.0, *(peak / static for peak in peaks)])
    jumps = zip((np.roll(level, 1) + smooth).tolist(), (level + smooth).tolist(), strict=True)
    peaks = [_peak_after(system, before, after) for before, after in jumps if before != after]
    return max([1.0, *(peak / static for peak in peaks)])


def ratio_in_words(ratio: float) -> str:
    """A quasi-static ratio to three digits; empty where it is 1, or not known, NaN: nothing is to be divided by it."""
    return "" if math.isnan(ratio) or (words := measured(ratio, 3)) == "1" else words


def _peak_after(system: SwitchedAffine, before: float, after: float) -> float:
    """The largest mesh force after a jump of the stiffness, from rest at the stiffness ``before``."""
    damping = system.damping[0] * system.b[0, 1] / (2 * math.sqrt(after * system.b[0, 1]))
    if system.dimension == 2 and damping < 1 and -system.A[0, 1, 1] in (0.0, system.damping[0] * system.b[0, 1]):
        static = float(system.static_force[0, 0])  # one free damped vibration: see `quasi_static_ratio`
        overshoot = math.exp(-2 * damping * math.acos(damping) / math.sqrt(1 - damping**2))
        return static * (after / before if after > before else 1 + (1 - after / before) * overshoot)
    (e0, e1), b, f0 = np.eye(system.dimension)[:2], system.b[0], system.f0[0]
    A = system.A[0] - system.law.in_contact * system.damping[0] * np.outer(b, e1)  # in contact
    start, rest = (np.linalg.solve(A - c * np.outer(b, e0), -f0 - c * b) for c in (before, after))
    rates, modes = np.linalg.eig(A - after * np.outer(b, e0))
    force = after * e0 + system.damping[0] * e1  # the row that gives the mesh force
    shares = (force @ modes) * np.linalg.solve(modes, start - rest)

    def derivative(order: int, t: np.ndarray) -> np.ndarray:
        each = np.exp(np.multiply.outer(t, rates))
        return np.einsum("tm,m->t", each, shares * rates**order).real  # for so few columns threads of BLAS cost more

    end, step = _LONGEST / np.abs(rates.real).min(), _STEP / np.abs(rates).max()
    count = min(_MOST_INSTANTS, int(end / step) + 2)
    step, stride = end / (count - 1), math.isqrt(count) + 1  # instants in strides: exp(r (t + s)) = exp(r t) exp(r s)
    starts, within = (np.exp(np.multiply.outer(each, rates)) for each in (
        stride * step * np.arange(-(-count // stride)), step * np.arange(stride)))
    values = np.einsum("tm,sm->ts", starts * shares, within).real.ravel()[:count]
    best = np.array([step * int(np.argmax(values))])
    if best[0] > 0:
        for _ in range(_NEWTON_STEPS):
            best = best - derivative(1, best) / derivative(2, best)
    return float(after * (rest[0] - 1) + derivative(0, best)[0])
