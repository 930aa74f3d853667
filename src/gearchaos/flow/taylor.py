"""Taylor polynomials of the linear motion on one piece, a chunk of lanes side by side.

With s in [0, 1] the share of the piece done, w(s) = Σ_k coef[k] s^k solves w' = h (A w + f(τ) − b χ(τ) (w[0] − σ)).
"""

from __future__ import annotations

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import ORDER, WIDTH, parameters, rows
from gearchaos.flow.simd import load, splat, store, vfma


@kernel
def horner(series, first, stride, s):
    """Σ_k c[k] s^k with c[k] at row first + k * stride."""
    total = load(series, first + ORDER * stride)
    for k in range(ORDER - 1, -1, -1):
        total = vfma(total, s, load(series, first + k * stride))
    return total


@kernel
def expand_waves(wave, j, angle):
    """Taylor coefficients of cos jωτ and sin jωτ, j counted from 0, on a piece of ``angle`` (WIDTH,) = ωh."""
    cos, sin = wave[j, 0], wave[j, 1]
    c, s, turn = load(cos, 0), load(sin, 0), load(angle, 0)
    for k in range(ORDER):
        step = turn * splat((j + 1) / (k + 1))
        c, s = splat(-1.0) * step * s, step * c
        store(cos, k + 1, c)
        store(sin, k + 1, s)


@kernel
def add_wave(ws, series, gain, cos, sin):
    """Add gain[0] cos jωτ + gain[1] sin jωτ to a series of the workspace."""
    a, b = load(ws, gain), load(ws, gain + 1)
    for k in range(ORDER + 1):
        term = vfma(a, load(cos, k), b * load(sin, k))
        store(ws, series + k, load(ws, series + k) + term)


@kernel
def set_gains(phys, points, cos, sin, sign, ws, gain):
    """Factors of a cosine and a sine from two columns of the parameters, the second times ``sign``."""
    for l in range(WIDTH):
        ws[gain * WIDTH + l] = phys[points[l], cos]
        ws[(gain + 1) * WIDTH + l] = sign * phys[points[l], sin]


@kernel
def drive(dims, phys, h, k, points, wave, ws):
    """Series of the forcing and, where a lane is in contact, of the stiffness; ``wave`` must be expanded."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    for m in range(ORDER + 1):
        store(ws, at.forcing + m, splat(0.0))
    for j in range(h):
        set_gains(phys, points, par.f_cos + j, par.f_sin + j, 1.0, ws, at.gain)
        add_wave(ws, at.forcing, at.gain, wave[j, 0], wave[j, 1])
    for j in range(k):
        set_gains(phys, points, par.chi_cos + j, par.chi_sin + j, 1.0, ws, at.gain)
        touching = load(ws, at.sigma) * load(ws, at.sigma)
        store(ws, at.gain, load(ws, at.gain) * touching)
        store(ws, at.gain + 1, load(ws, at.gain + 1) * touching)
        add_wave(ws, at.chi, at.gain, wave[j, 0], wave[j, 1])


@kernel
def _spring(ws, at, d, k, shift, varying):
    """Coefficient k of χ(τ) (z − shift), by the product rule."""
    z = load(ws, at.coef + k * d)
    total = load(ws, at.chi) * (z - shift if k == 0 else z)
    if varying:
        for i in range(1, k + 1):
            z = load(ws, at.coef + (k - i) * d)
            total = vfma(load(ws, at.chi + i), z - shift if i == k else z, total)
    return total


@kernel
def expand(dims, ws, forced, varying):
    """Taylor coefficients of the motion from the start; without ``forced`` of a tangent vector.

    ``varying`` says that the stiffness has harmonics.
    """
    d = len(dims)
    at = rows(d)
    h = load(ws, at.h)
    shift = load(ws, at.sigma) * splat(1.0 if forced else 0.0)
    for i in range(d):
        store(ws, at.coef + i, load(ws, at.start + i))
    for k in range(ORDER):
        force = _spring(ws, at, d, k, shift, varying)
        store(ws, at.spring + k, force)
        scale = h * splat(1.0 / (k + 1))
        for i in range(d):
            total = load(ws, at.minus_b + i) * force
            if forced and i == 1:
                total = total + load(ws, at.forcing + k)
            if forced and k == 0:
                total = total + load(ws, at.f0 + i)
            for j in range(d):
                total = vfma(load(ws, i * d + j), load(ws, at.coef + k * d + j), total)
            store(ws, at.coef + (k + 1) * d + i, total * scale)


@kernel
def finish(dims, ws):
    """The state at the share done of the piece, into the end rows."""
    d = len(dims)
    at = rows(d)
    s = load(ws, at.share)
    for i in range(d):
        store(ws, at.end + i, horner(ws, at.coef + i, d, s))


@kernel
def finish_waves(wave, ws, share):
    """Move the start of cos jωτ and sin jωτ on by the share done of the piece."""
    s = load(ws, share)
    for j in range(wave.shape[0]):
        for q in range(2):
            store(wave[j, q], 0, horner(wave[j, q], 0, 1, s))
