"""Taylor polynomials of the linear motion on one piece, a chunk of lanes side by side.

With s in [0, 1] the share of the piece done, w(s) = Σ_k coef[k] s^k solves w' = h (A w + f(τ) − b χ(τ) (w[0] − σ)).
"""

from __future__ import annotations

from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER, WIDTH, parameters, rows


@kernel
def expand_waves(wave, j, angle):
    """Taylor coefficients of cos jωτ and sin jωτ, j counted from 0, on a piece of ``angle`` = ωh; lanes differ."""
    cos, sin = wave[j, 0], wave[j, 1]
    for k in range(ORDER):
        rate = (j + 1) / (k + 1)
        for l in range(WIDTH):
            step = rate * angle[l]
            cos[(k + 1) * WIDTH + l] = -step * sin[k * WIDTH + l]
            sin[(k + 1) * WIDTH + l] = step * cos[k * WIDTH + l]


@kernel
def _add_series(ws, row, factor_cos, factor_sin, wave, j, l):
    """Add factor_cos cos jωτ + factor_sin sin jωτ to the series of lane l that begins at ``row``."""
    for k in range(ORDER + 1):
        i = k * WIDTH + l
        term = fma(factor_cos, wave[j, 0, i], factor_sin * wave[j, 1, i])
        ws[row * WIDTH + i] += term


@kernel
def drive(dims, phys, h, k, points, wave, ws):
    """Series of the forcing and, where a lane is in contact, of the stiffness; ``wave`` must be expanded."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    for i in range((ORDER + 1) * WIDTH):
        ws[at.forcing * WIDTH + i] = 0.0
    for l in range(WIDTH):
        for j in range(h):
            _add_series(
                ws, at.forcing, phys[points[l], par.f_cos + j], phys[points[l], par.f_sin + j], wave, j, l
            )
        if ws[at.sigma * WIDTH + l] != 0.0:
            for j in range(k):
                _add_series(
                    ws, at.chi, phys[points[l], par.chi_cos + j], phys[points[l], par.chi_sin + j], wave, j, l
                )


@kernel
def _spring(dims, ws, k, forced, varying):
    """Coefficient k of χ(τ) (z − σ), by the product rule; without ``forced`` of χ(τ) z."""
    d = len(dims)
    at = rows(d)
    for l in range(WIDTH):
        shift = forced * ws[at.sigma * WIDTH + l] if k == 0 else 0.0
        ws[(at.spring + k) * WIDTH + l] = ws[at.chi * WIDTH + l] * (ws[(at.coef + k * d) * WIDTH + l] - shift)
    if varying:
        for i in range(1, k + 1):
            for l in range(WIDTH):
                shift = forced * ws[at.sigma * WIDTH + l] if i == k else 0.0
                z = ws[(at.coef + (k - i) * d) * WIDTH + l] - shift
                here = (at.spring + k) * WIDTH + l
                ws[here] = fma(ws[(at.chi + i) * WIDTH + l], z, ws[here])


@kernel
def expand(dims, ws, forced, varying):
    """Taylor coefficients of the motion from the start; with ``forced`` 0.0 of a tangent vector.

    ``varying`` says that the stiffness has harmonics.
    """
    d = len(dims)
    at = rows(d)
    for i in range(d):
        for l in range(WIDTH):
            ws[(at.coef + i) * WIDTH + l] = ws[(at.start + i) * WIDTH + l]
    for k in range(ORDER):
        _spring(dims, ws, k, forced, varying)
        scale = 1.0 / (k + 1)
        for i in range(d):
            for l in range(WIDTH):
                total = -ws[(at.b + i) * WIDTH + l] * ws[(at.spring + k) * WIDTH + l]
                if i == 1:
                    total = fma(forced, ws[(at.forcing + k) * WIDTH + l], total)
                if k == 0:
                    total = fma(forced, ws[(at.f0 + i) * WIDTH + l], total)
                for j in range(d):
                    total = fma(ws[(i * d + j) * WIDTH + l], ws[(at.coef + k * d + j) * WIDTH + l], total)
                ws[(at.coef + (k + 1) * d + i) * WIDTH + l] = total * (ws[at.h * WIDTH + l] * scale)


@kernel
def finish(dims, ws):
    """The state at the share done of the piece, into the end rows."""
    d = len(dims)
    at = rows(d)
    for i in range(d):
        for l in range(WIDTH):
            s = ws[at.share * WIDTH + l]
            total = ws[(at.coef + ORDER * d + i) * WIDTH + l]
            for k in range(ORDER - 1, -1, -1):
                total = fma(total, s, ws[(at.coef + k * d + i) * WIDTH + l])
            ws[(at.end + i) * WIDTH + l] = total


@kernel
def finish_waves(wave, ws, share):
    """Move the start of cos jωτ and sin jωτ on by the share done of the piece."""
    for j in range(wave.shape[0]):
        for q in range(2):
            series = wave[j, q]
            for l in range(WIDTH):
                s = ws[share * WIDTH + l]
                total = series[ORDER * WIDTH + l]
                for k in range(ORDER - 1, -1, -1):
                    total = fma(total, s, series[k * WIDTH + l])
                series[l] = total
