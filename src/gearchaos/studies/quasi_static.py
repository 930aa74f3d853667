"""The quasi-static ratio: the peak of the mesh force over the static one in the limit of no speed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import vary
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

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        With a static load; its speed has no effect.

    Returns
    -------
    float
        What a dynamic factor is to be divided by before it is compared with K_v of a standard, in which the load passes
        from pair to pair without a jump.

    Notes
    -----
    At no speed the transmission error accelerates nothing, and on each part of the mesh period the deflection comes to
    rest at F/c, where F is the static mesh force. Where the stiffness jumps from c_a to c_b, the deflection stays and
    the force becomes F c_b/c_a. It then approaches F as a free damped vibration, at any speed: a rise of the stiffness
    has its peak at the jump, a fall overshoots by F (1 − c_b/c_a) exp(−2ζ arccos ζ/√(1 − ζ²)), where ζ is the damping
    ratio at c_b, if only the relative rotation vibrates. The ratio is the largest of these peaks over F, 1 without a
    jump. With two levels it is c_max/c_min.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.quasi_static import quasi_static_ratio
    >>> round(quasi_static_ratio(gc.MeshModel.of(q0=0.1, chi1=0.4, chi2=0.2)), 12)
    1.75
    """
    system = switched_system(vary(as_model(model), {}))
    static, level = float(system.static_force[0]), system.levels[0]
    phase = 2 * np.pi * system.starts[0][:, None] * np.arange(1, system.chi_cos.shape[1] + 1)
    smooth = np.cos(phase) @ system.chi_cos[0] + np.sin(phase) @ system.chi_sin[0]
    jumps = zip((np.roll(level, 1) + smooth).tolist(), (level + smooth).tolist(), strict=True)
    peaks = [_peak_after(system, before, after) for before, after in jumps if before != after]
    return max([1.0, *(peak / static for peak in peaks)])


def _peak_after(system: SwitchedAffine, before: float, after: float) -> float:
    """The largest mesh force after a jump of the stiffness, from rest at the stiffness ``before``."""
    A, b, f0, e0 = system.A[0], system.b[0], system.f0[0], np.eye(system.dimension)[0]

    def at_rest(stiffness: float) -> np.ndarray:
        return np.linalg.solve(A - stiffness * np.outer(b, e0), -f0 - stiffness * b)

    rest = at_rest(after)
    rates, modes = np.linalg.eig(A - after * np.outer(b, e0))
    force = after * e0 + system.damping[0] * np.eye(system.dimension)[1]  # the row that gives the mesh force
    shares = (force @ modes) * np.linalg.solve(modes, at_rest(before) - rest)

    def derivative(order: int) -> Callable[[np.ndarray], np.ndarray]:
        return lambda t: (np.exp(np.multiply.outer(t, rates)) @ (shares * rates**order)).real

    value, slope, curvature = (derivative(order) for order in range(3))
    end, step = _LONGEST / np.abs(rates.real).min(), _STEP / np.abs(rates).max()
    t = np.linspace(0, end, min(_MOST_INSTANTS, int(end / step) + 2))
    best = t[[int(np.argmax(value(t)))]]
    if best[0] > 0:
        for _ in range(_NEWTON_STEPS):
            best = best - slope(best) / curvature(best)
    return float(after * (rest[0] - 1) + value(best)[0])
