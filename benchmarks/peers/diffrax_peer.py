"""diffrax: Dormand-Prince 8 in JAX, all trajectories at once by vmap, double precision, on the processor."""

from __future__ import annotations

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from gearchaos.model.switched import SwitchedAffine

jax.config.update("jax_enable_x64", True)


class Diffrax:
    """Half a period at a time, so that no step spans a jump of the stiffness."""

    def __init__(self, system: SwitchedAffine, tolerance: float) -> None:
        s = system
        self.points = s.A, s.b, s.f0, s.f_cos[:, 0], s.f_sin[:, 0], s.omega, s.levels
        control = diffrax.PIDController(rtol=tolerance, atol=tolerance)

        def slope(t, w, args):
            (A, b, f0, f_cos, f_sin, omega, _), chi = args
            out = A @ w + f0 - b * chi * (w[0] - jnp.clip(w[0], -1.0, 1.0))
            return out.at[1].add(f_cos * jnp.cos(omega * t) + f_sin * jnp.sin(omega * t))

        def half(k, w, point):
            omega, chi = point[5], point[6][k % 2]
            begin, end = k * jnp.pi / omega, (k + 1) * jnp.pi / omega
            return diffrax.diffeqsolve(
                diffrax.ODETerm(slope), diffrax.Dopri8(), begin, end, None, w, (point, chi),
                stepsize_controller=control, max_steps=100_000,
            ).ys[0]

        def one(w, point, periods):
            return jax.lax.fori_loop(0, 2 * periods, lambda k, w: half(k, w, point), w)

        self.run = jax.jit(jax.vmap(one, in_axes=(1, 0, None), out_axes=1))

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        return np.asarray(self.run(w, self.points, periods))
