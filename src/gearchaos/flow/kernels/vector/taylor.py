"""Taylor polynomials of the linear motion on one segment between contact switches, for the lanes of a pack; and filling
the workspace with the parameters and step data from which they are computed.

With s in [0, 1] the fraction of the segment, w(s) = Σ_k c_k s^k solves

    dw/ds = h (A w + f(τ) − b (χ(τ) (w[0] − σ) + D w[1])),

with h the duration of the segment; χ and D are 0 in free flight, and D is 0 unless the mesh damping acts in contact
alone, otherwise it is a part of A. Coefficient k of coordinate i is row ``at.state + k * d + i`` of the workspace;
``at`` stands for ``rows(dims)``.
"""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.vector.arrays import COS_SIN, LENGTH, LEVEL, damps_in_contact, releases, rows
from gearchaos.flow.kernels.vector.constants import ORDER, TWO_PI, WIDTH
from gearchaos.flow.kernels.vector.simd import broadcast, load, load_scalar, select, store, store_scalar, vabs, vfma


@inlined
def _copy(values, first, count, ws, row, position):
    """Copy ``count`` floats of an array, from index ``first`` on, to one position of ``count`` rows from ``row`` on."""
    for i in range(count):
        store_scalar(ws, (row + i) * WIDTH + position, load_scalar(values, first + i))


@subroutine
def fill_point(dims, parameters, harmonics, points, measuring, ws):
    """Write the workspace rows that depend only on the lanes' points.

    ``parameters`` is the array (P, total) of all points, ``points`` (WIDTH,) the index of each lane's point. Rows
    that only the measures use are written if ``measuring``.
    """
    d, h, k = len(dims), harmonics.forcing, harmonics.stiffness
    at, column, row = rows(dims), harmonics.columns, harmonics.rows
    for l in range(WIDTH):
        offset = points[l] * column.total
        _copy(parameters, offset + column.A + d, d * d - d, ws, at.A + d, l)  # the first row of A is not used
        for i in range(1, d):
            store_scalar(ws, (at.minus_b + i) * WIDTH + l, -load_scalar(parameters, offset + column.b + i))
        _copy(parameters, offset + column.f0, d, ws, at.f0, l)
        _copy(parameters, offset + column.omega, 1, ws, at.omega, l)
        if damps_in_contact(dims):
            _copy(parameters, offset + column.damping, 1, ws, at.contact_damping, l)
        for j in range(h):
            _copy(parameters, offset + column.f_cos + j, 1, ws, row.forcing_amplitudes + 2 * j, l)
            _copy(parameters, offset + column.f_sin + j, 1, ws, row.forcing_amplitudes + 2 * j + 1, l)
        for j in range(k):
            _copy(parameters, offset + column.chi_cos + j, 1, ws, row.stiffness_amplitudes + 2 * j, l)
            _copy(parameters, offset + column.chi_sin + j, 1, ws, row.stiffness_amplitudes + 2 * j + 1, l)
        if measuring:
            _copy(parameters, offset + column.damping, 1, ws, row.damping, l)
            _copy(parameters, offset + column.velocity, d, ws, row.velocity, l)
            _copy(parameters, offset + column.velocity0, 1, ws, row.velocity0, l)
            _copy(parameters, offset + column.velocity_cos, h, ws, row.velocity_cos, l)
            _copy(parameters, offset + column.velocity_sin, h, ws, row.velocity_sin, l)


@inlined
def fill_level(dims, parameters, harmonics, values, points, steps, ws):
    """Write the stiffness level on each lane's step. The arguments are those of `fill_point` and `fill_step`."""
    row = rows(dims).level * WIDTH
    for l in range(WIDTH):
        level = harmonics.columns.levels + int(load_scalar(values, steps[l] * values.shape[1] + LEVEL))
        store_scalar(ws, row + l, load_scalar(parameters, points[l] * harmonics.columns.total + level))


@subroutine
def fill_step(dims, harmonics, values, steps, ws):
    """Write the workspace rows that depend on the lanes' steps, except the stiffness level; `fill_point` must have been
    called before.

    ``values`` is `Steps.values`, ``steps`` (WIDTH,) the index in it of each lane's step.
    """
    at, width = rows(dims), values.shape[1]
    for l in range(WIDTH):
        offset = steps[l] * width
        store_scalar(ws, at.duration * WIDTH + l, load_scalar(values, offset + LENGTH))
        _copy(values, offset + COS_SIN, 2 * harmonics.highest, ws, harmonics.rows.cos_sin, l)
    store(ws, at.duration, broadcast(TWO_PI) * load(ws, at.duration) / load(ws, at.omega))


@inlined
def save_point_rows(dims, harmonics, ws, saved, slot):
    """Copy the rows that `fill_point` has written to the slot's part of ``saved``, `Lanes.point_rows`."""
    at, amplitudes = rows(dims), harmonics.rows.forcing_amplitudes
    count = harmonics.point_rows
    for i in range(at.state):
        store(saved, slot * count + i, load(ws, i))
    for i in range(count - at.state):
        store(saved, slot * count + at.state + i, load(ws, amplitudes + i))


@inlined
def restore_point_rows(dims, harmonics, saved, slot, ws):
    """Copy the rows that `save_point_rows` has saved for a slot back to the workspace."""
    at, amplitudes = rows(dims), harmonics.rows.forcing_amplitudes
    count = harmonics.point_rows
    for i in range(at.state):
        store(ws, i, load(saved, slot * count + i))
    for i in range(count - at.state):
        store(ws, amplitudes + i, load(saved, slot * count + at.state + i))


@subroutine
def horner(ws, first, stride, s):
    """The polynomial Σ_k c_k s^k, whose coefficient k is row ``first + k * stride``, at a vector s."""
    total = load(ws, first + ORDER * stride)
    for k in range(ORDER - 1, -1, -1):
        total = vfma(total, s, load(ws, first + k * stride))
    return total


@subroutine
def horner3(ws, first, stride, s, t, u):
    """The same polynomial at three vectors, which takes little more time than at one."""
    x = y = z = load(ws, first + ORDER * stride)
    for k in range(ORDER - 1, -1, -1):
        c = load(ws, first + k * stride)
        x, y, z = vfma(x, s, c), vfma(y, t, c), vfma(z, u, c)
    return x, y, z


@subroutine
def set_amplitudes(parameters, points, cos, sin, sign, ws, row):
    """Write two columns of the parameters (P, total), for the lanes' ``points`` (WIDTH,), to rows ``row`` and ``row +
    1``, the second times ``sign``."""
    for l in range(WIDTH):
        ws[row * WIDTH + l] = parameters[points[l], cos]
        ws[(row + 1) * WIDTH + l] = sign * parameters[points[l], sin]


@subroutine
def add_sinusoid(ws, first, a, b, phase, angle, fresh):
    """Add the Taylor polynomial of a cos(φ + angle s) + b sin(φ + angle s) to the one in rows ``first`` to
    ``first + ORDER``, or write it there if ``fresh``. cos φ and sin φ are rows ``phase`` and ``phase + 1``; a, b and
    ``angle`` are vectors.
    """
    cos, sin = load(ws, phase), load(ws, phase + 1)
    # coefficient 0 of the sinusoid, and of its derivative with respect to φ
    value, derivative = vfma(a, cos, b * sin), vfma(b, cos, broadcast(-1.0) * a * sin)
    for k in range(ORDER + 1):
        store(ws, first + k, value if fresh else load(ws, first + k) + value)
        step = angle * broadcast(1.0 / (k + 1))
        value, derivative = step * derivative, broadcast(-1.0) * step * value


@subroutine
def in_contact(dims, sigma):
    """1 where a contact state is contact, else 0; 0 also for a released flank, ±1/2."""
    if releases(dims):
        return select(vabs(sigma) < broadcast(0.75), broadcast(0.0), broadcast(1.0))
    return sigma * sigma


@subroutine
def excitation_series(dims, harmonics, ws):
    """Compute the polynomials of the forcing and, for lanes in contact, of the stiffness on the segment.

    Also computes rows ``stiffness_column``, the factor of z − σ: the first column of A less b times the stiffness at
    the start of the segment, and ``constant``. The variation of the stiffness is added in `state_series`.
    """
    at, cos_sin, row = rows(dims), harmonics.rows.cos_sin, harmonics.rows
    angle = load(ws, at.duration) * load(ws, at.omega)
    contact = in_contact(dims, load(ws, at.sigma))
    if harmonics.forcing == 0:
        for m in range(ORDER + 1):
            store(ws, at.forcing + m, broadcast(0.0))
    for j in range(harmonics.forcing):
        a, b = load(ws, row.forcing_amplitudes + 2 * j), load(ws, row.forcing_amplitudes + 2 * j + 1)
        add_sinusoid(ws, at.forcing, a, b, cos_sin + 2 * j, angle * broadcast(j + 1.0), j == 0)
    store(ws, at.stiffness, contact * load(ws, at.level))
    if harmonics.stiffness > 0:
        for m in range(1, ORDER + 1):
            store(ws, at.stiffness + m, broadcast(0.0))
    for j in range(harmonics.stiffness):
        a = contact * load(ws, row.stiffness_amplitudes + 2 * j)
        b = contact * load(ws, row.stiffness_amplitudes + 2 * j + 1)
        add_sinusoid(ws, at.stiffness, a, b, cos_sin + 2 * j, angle * broadcast(j + 1.0), False)
    chi, sigma = load(ws, at.stiffness), load(ws, at.sigma)
    for i in range(1, len(dims)):
        first_column = load(ws, at.A + i * len(dims))
        store(ws, at.stiffness_column + i, vfma(load(ws, at.minus_b + i), chi, first_column))
        store(ws, at.constant + i, vfma(first_column, sigma, load(ws, at.f0 + i)))
        if damps_in_contact(dims):
            damping = contact * load(ws, at.contact_damping)
            second_column = load(ws, at.A + i * len(dims) + 1)
            store(ws, at.velocity_column + i, vfma(load(ws, at.minus_b + i), damping, second_column))


@subroutine
def advance_phases(dims, harmonics, ws):
    """Advance cos jωτ and sin jωτ from the start of the segment to ``end_fraction``, by Taylor polynomials, which are
    accurate since the angle is at most `system.STEP_ANGLE`."""
    at, cos_sin = rows(dims), harmonics.rows.cos_sin
    elapsed_angle = load(ws, at.duration) * load(ws, at.omega) * load(ws, at.end_fraction)
    for j in range(harmonics.highest):
        angle = elapsed_angle * broadcast(j + 1.0)
        square = broadcast(-1.0) * angle * angle
        c = s = broadcast(1.0)
        for m in range(ORDER, 0, -2):
            c = vfma(square * broadcast(1.0 / (m * (m - 1))), c, broadcast(1.0))
            s = vfma(square * broadcast(1.0 / (m * (m + 1))), s, broadcast(1.0))
        s = s * angle
        cos, sin = load(ws, cos_sin + 2 * j), load(ws, cos_sin + 2 * j + 1)
        store(ws, cos_sin + 2 * j, vfma(cos, c, broadcast(-1.0) * sin * s))
        store(ws, cos_sin + 2 * j + 1, vfma(sin, c, cos * s))


@subroutine
def spring_extension(ws, at, d, k, sigma):
    """Coefficient k of z − σ."""
    z = load(ws, at.state + k * d)
    return z - sigma if k == 0 else z


@subroutine
def stiffness_variation(ws, at, d, k, sigma):
    """Coefficient k of (χ(τ) − χ at the start of the segment) (z − σ), by the product rule."""
    total = broadcast(0.0)
    for i in range(1, k + 1):
        total = vfma(load(ws, at.stiffness + i), spring_extension(ws, at, d, k - i, sigma), total)
    return total


@subroutine
def state_series(dims, ws, forced, varying):
    """Polynomials of the coordinates, from the start rows; if not ``forced``, those of a tangent vector.

    ``varying`` says that the stiffness has harmonics. The first coordinate is z, the second its derivative. The spring
    acts on z − σ, formed before the product with the stiffness, to avoid cancellation where contact begins.
    """
    d = len(dims)
    at = rows(dims)
    h = load(ws, at.duration)
    sigma = load(ws, at.sigma) * broadcast(1.0 if forced else 0.0)
    for i in range(d):
        store(ws, at.state + i, load(ws, at.start + i))
    for k in range(ORDER):
        scale = h * broadcast(1.0 / (k + 1))
        store(ws, at.state + (k + 1) * d, load(ws, at.state + k * d + 1) * scale)
        z = spring_extension(ws, at, d, k, sigma)
        for i in range(1, d):
            total = load(ws, at.forcing + k) if forced and i == 1 else broadcast(0.0)
            if forced and k == 0:
                total = total + load(ws, at.constant + i)
            total = vfma(load(ws, at.stiffness_column + i), z, total)
            if varying:
                total = vfma(load(ws, at.minus_b + i), stiffness_variation(ws, at, d, k, sigma), total)
            for j in range(1, d):
                factor = at.velocity_column + i if damps_in_contact(dims) and j == 1 else at.A + i * d + j
                total = vfma(load(ws, factor), load(ws, at.state + k * d + j), total)
            store(ws, at.state + (k + 1) * d + i, total * scale)


@subroutine
def end_state(dims, ws):
    """Evaluate the coordinates at ``end_fraction``, into the end rows."""
    d = len(dims)
    at = rows(dims)
    s = load(ws, at.end_fraction)
    for i in range(d):
        store(ws, at.end + i, horner(ws, at.state + i, d, s))
