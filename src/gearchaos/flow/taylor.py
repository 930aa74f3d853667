"""Taylor polynomials of the linear motion on one piece, a chunk of lanes side by side.

With s in [0, 1] the share of the piece done, w(s) = Σ_k coef[k] s^k solves w' = h (A w + f(τ) − b χ(τ) (w[0] − σ)).
"""

from __future__ import annotations

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import ORDER, WIDTH, rows
from gearchaos.flow.simd import load, splat, store, vfma


@kernel
def horner(series, first, stride, s):
    """Σ_k c[k] s^k with c[k] at row first + k * stride."""
    total = load(series, first + ORDER * stride)
    for k in range(ORDER - 1, -1, -1):
        total = vfma(total, s, load(series, first + k * stride))
    return total


@kernel
def horner3(series, first, stride, s, t, u):
    """The same at three places side by side, in little more time than at one."""
    x = y = z = load(series, first + ORDER * stride)
    for k in range(ORDER - 1, -1, -1):
        c = load(series, first + k * stride)
        x, y, z = vfma(x, s, c), vfma(y, t, c), vfma(z, u, c)
    return x, y, z


@kernel
def set_gains(phys, points, cos, sin, sign, ws, gain):
    """Factors of a cosine and a sine from two columns of the parameters, the second times ``sign``."""
    for l in range(WIDTH):
        ws[gain * WIDTH + l] = phys[points[l], cos]
        ws[(gain + 1) * WIDTH + l] = sign * phys[points[l], sin]


@kernel
def add_wave(ws, series, a, b, phase, angle, fresh):
    """Add the Taylor coefficients of a cos(φ + angle s) + b sin(φ + angle s) to a series, or begin it if ``fresh``.

    cos φ and sin φ stand at row ``phase``.
    """
    cos, sin = load(ws, phase), load(ws, phase + 1)
    value, quarter = vfma(a, cos, b * sin), vfma(b, cos, splat(-1.0) * a * sin)
    for k in range(ORDER + 1):
        store(ws, series + k, value if fresh else load(ws, series + k) + value)
        step = angle * splat(1.0 / (k + 1))
        value, quarter = step * quarter, splat(-1.0) * step * value


@kernel
def drive(dims, h, k, ws):
    """Series of the forcing and, where a lane is in contact, of the stiffness, on pieces that are filled.

    The stiffness at the start joins A, as what acts on z − σ; how it varies is left to `expand`.
    """
    at = rows(len(dims))
    angle, most = load(ws, at.h) * load(ws, at.omega), max(h, k)
    touching = load(ws, at.sigma) * load(ws, at.sigma)
    if h == 0:
        for m in range(ORDER + 1):
            store(ws, at.forcing + m, splat(0.0))
    for j in range(h):
        gain, phase = at.phase + 2 * (most + j), at.phase + 2 * j
        add_wave(ws, at.forcing, load(ws, gain), load(ws, gain + 1), phase, angle * splat(j + 1.0), j == 0)
    store(ws, at.chi, touching * load(ws, at.level))
    if k > 0:
        for m in range(1, ORDER + 1):
            store(ws, at.chi + m, splat(0.0))
    for j in range(k):
        gain, phase = at.phase + 2 * (most + h + j), at.phase + 2 * j
        a, b = touching * load(ws, gain), touching * load(ws, gain + 1)
        add_wave(ws, at.chi, a, b, phase, angle * splat(j + 1.0), False)
    chi, sigma = load(ws, at.chi), load(ws, at.sigma)
    for i in range(1, len(dims)):
        own = load(ws, i * len(dims))
        store(ws, at.pull + i, vfma(load(ws, at.minus_b + i), chi, own))
        store(ws, at.push + i, vfma(own, sigma, load(ws, at.f0 + i)))


@kernel
def turn_waves(dims, h, k, ws):
    """Move cos jωτ and sin jωτ on by the share done of the piece; the angle is one step's at most."""
    at = rows(len(dims))
    done = load(ws, at.h) * load(ws, at.omega) * load(ws, at.share)
    for j in range(max(h, k)):
        angle = done * splat(j + 1.0)
        square = splat(-1.0) * angle * angle
        c = s = splat(1.0)
        for m in range(ORDER, 0, -2):
            c = vfma(square * splat(1.0 / (m * (m - 1))), c, splat(1.0))
            s = vfma(square * splat(1.0 / (m * (m + 1))), s, splat(1.0))
        s = s * angle
        cos, sin = load(ws, at.phase + 2 * j), load(ws, at.phase + 2 * j + 1)
        store(ws, at.phase + 2 * j, vfma(cos, c, splat(-1.0) * sin * s))
        store(ws, at.phase + 2 * j + 1, vfma(sin, c, cos * s))


@kernel
def stretch(ws, at, d, k, shift):
    """Coefficient k of z − shift."""
    z = load(ws, at.coef + k * d)
    return z - shift if k == 0 else z


@kernel
def variation(ws, at, d, k, shift):
    """Coefficient k of (χ(τ) − χ at the start of the piece) (z − shift), by the product rule."""
    total = splat(0.0)
    for i in range(1, k + 1):
        total = vfma(load(ws, at.chi + i), stretch(ws, at, d, k - i, shift), total)
    return total


@kernel
def expand(dims, ws, forced, varying):
    """Taylor coefficients of the motion from the start; without ``forced`` of a tangent vector.

    ``varying`` says that the stiffness has harmonics. The first coordinate is z, the second its derivative. The spring
    acts on z − σ, taken first, so that nothing cancels where contact begins.
    """
    d = len(dims)
    at = rows(d)
    h = load(ws, at.h)
    shift = load(ws, at.sigma) * splat(1.0 if forced else 0.0)
    for i in range(d):
        store(ws, at.coef + i, load(ws, at.start + i))
    for k in range(ORDER):
        scale = h * splat(1.0 / (k + 1))
        store(ws, at.coef + (k + 1) * d, load(ws, at.coef + k * d + 1) * scale)
        z = stretch(ws, at, d, k, shift)
        for i in range(1, d):
            total = load(ws, at.forcing + k) if forced and i == 1 else splat(0.0)
            if forced and k == 0:
                total = total + load(ws, at.push + i)
            total = vfma(load(ws, at.pull + i), z, total)
            if varying:
                total = vfma(load(ws, at.minus_b + i), variation(ws, at, d, k, shift), total)
            for j in range(1, d):
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
