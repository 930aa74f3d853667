"""Taylor polynomials of the linear motion on one piece, many lanes side by side.

With s in [0, 1] the share of the piece done, w(s) = Σ_k coef[k] s^k solves w' = h (A w + f(τ) − b χ(τ) (w[0] − σ)).
"""

from __future__ import annotations

from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER


@kernel
def waves(p, harmonics, n):
    """Taylor coefficients of cos jωτ and sin jωτ from their values at the start, ``cos[0]`` and ``sin[0]``."""
    for k in range(ORDER):
        for j in range(harmonics):
            rate = (j + 1) / (k + 1)
            for l in range(n):
                p.cos[k + 1, j, l] = -rate * p.angle[l] * p.sin[k, j, l]
            for l in range(n):
                p.sin[k + 1, j, l] = rate * p.angle[l] * p.cos[k, j, l]


@kernel
def stiffness(p, n):
    """Taylor coefficients of χ(τ), (2.7) or one level of (2.16); zero in free flight, where the level is 0."""
    for l in range(n):
        p.chi[0, l] = p.level[l]
    for j in range(p.chi_cos.shape[0]):
        for k in range(ORDER + 1):
            if k > 0 and j == 0:
                for l in range(n):
                    p.chi[k, l] = 0.0
            for l in range(n):
                wave = fma(p.chi_cos[j, l], p.cos[k, j, l], p.chi_sin[j, l] * p.sin[k, j, l])
                p.chi[k, l] += wave if p.level[l] != 0.0 else 0.0


@kernel
def spring(p, k, shift, n):
    """Coefficient k of χ(τ) (z − shift·σ), by the product rule of power series."""
    for l in range(n):
        p.force[k, l] = p.chi[0, l] * p.coef[k, 0, l]
    if k == 0:
        for l in range(n):
            p.force[k, l] = p.chi[0, l] * (p.coef[0, 0, l] - shift * p.sigma[l])
    if p.chi_cos.shape[0] > 0:
        for i in range(1, k):
            for l in range(n):
                p.force[k, l] = fma(p.chi[i, l], p.coef[k - i, 0, l], p.force[k, l])
        if k > 0:
            for l in range(n):
                p.force[k, l] = fma(p.chi[k, l], p.coef[0, 0, l] - shift * p.sigma[l], p.force[k, l])


@kernel
def _linear(dims, p, k, i, n):
    """Row i of A w − b χ (w[0] − σ), coefficient k, times h / (k + 1)."""
    d = len(dims)
    scale = 1.0 / (k + 1)
    for l in range(n):
        total = -p.b[i, l] * p.force[k, l]
        for j in range(d):
            total = fma(p.A[i * d + j, l], p.coef[k, j, l], total)
        p.coef[k + 1, i, l] = total * (p.h[l] * scale)


@kernel
def _forcing(dims, p, k, i, n):
    """Add row i of f(τ), coefficient k, times h / (k + 1)."""
    d = len(dims)
    scale = 1.0 / (k + 1)
    if k == 0:
        for l in range(n):
            p.coef[1, i, l] = fma(p.f0[i, l], p.h[l], p.coef[1, i, l])
    for j in range(p.f_cos.shape[0] // d):
        for l in range(n):
            wave = fma(p.f_cos[j * d + i, l], p.cos[k, j, l], p.f_sin[j * d + i, l] * p.sin[k, j, l])
            p.coef[k + 1, i, l] = fma(wave, p.h[l] * scale, p.coef[k + 1, i, l])


@kernel
def expand(dims, p, forced, n):
    """Taylor coefficients of the motion from ``start``; with ``forced`` 0 of a tangent vector (no forcing, no shift).

    ``cos``, ``sin`` and ``chi`` must hold their coefficients already.
    """
    d = len(dims)
    for i in range(d):
        for l in range(n):
            p.coef[0, i, l] = p.start[i, l]
    for k in range(ORDER):
        spring(p, k, forced, n)
        for i in range(d):
            _linear(dims, p, k, i, n)
            if forced != 0.0:
                _forcing(dims, p, k, i, n)


@kernel
def evaluate(dims, p, s, out, n):
    """The state at share s (n,) of the piece, into out (d, n)."""
    for i in range(len(dims)):
        for l in range(n):
            total = p.coef[ORDER, i, l]
            for k in range(ORDER - 1, -1, -1):
                total = fma(total, s[l], p.coef[k, i, l])
            out[i, l] = total


@kernel
def advance_waves(p, s, harmonics, n):
    """Move the start of cos jωτ and sin jωτ on by the share s (n,) of the piece."""
    for j in range(harmonics):
        for l in range(n):
            c = p.cos[ORDER, j, l]
            q = p.sin[ORDER, j, l]
            for k in range(ORDER - 1, -1, -1):
                c = fma(c, s[l], p.cos[k, j, l])
                q = fma(q, s[l], p.sin[k, j, l])
            p.cos[0, j, l] = c
            p.sin[0, j, l] = q
