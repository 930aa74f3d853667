"""Steps in which contact may change, from switch to switch, by Taylor polynomials.

A segment of motion leaves its contact state at the first root of the gap, never a later one. Method and proof are in
docs/method.md, "Resolving a step". Up to `find_exits` all arguments are vectors, except ``ws`` and row indices. s in
[0, 1] is the fraction of the segment; derivatives are with respect to s. The *gap* is the distance of z from the
boundary of its contact state, positive inside. The root search advances s by *increments*.
"""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.one_spring.measures import gather_measures, measure_segment, output_series, scatter_measures
from gearchaos.flow.kernels.vector.arrays import damps_in_contact, position_of, releases, rows, rows_per_slot, slot_of
from gearchaos.flow.kernels.vector.constants import CHATTER, MAX_SWITCHES, ORDER, PACKS, WIDTH
from gearchaos.flow.kernels.vector.simd import (
    any_true,
    broadcast,
    load,
    load_scalar,
    select,
    smaller,
    store,
    store_scalar,
    vabs,
    vfma,
    vsqrt,
)
from gearchaos.flow.kernels.vector.taylor import (
    add_sinusoid,
    advance_phases,
    end_state,
    excitation_series,
    fill_level,
    fill_point,
    fill_step,
    in_contact,
    state_series,
)

_EXACT = 1e-15  # largest error of an exit, as a fraction of the segment

_GRAZING_SPEED = 1e-8
"""Where the motion reaches the boundary with a smaller |dz/ds|, it touches it; whether it crosses is decided `_PROBE`
later."""

_PROBE = 1e-3
"""Distance beyond a touch at which the sign of the gap decides whether it was a crossing, as a fraction of the
segment."""

_SMALLEST_WINDOW = 1e-9  # smallest window of an increment, see `_next_window`, as a fraction of the segment

_MAX_INCREMENTS = 400
_BEYOND_END = NO_ROOT = 2.0  # a value of s beyond the end of every segment, which is at 1
_JUMPED = -1e-13  # a force less than this at the start of a segment has jumped with the stiffness
SEARCH_FAILED = 2.0  # value of ``next_sigma`` for a lane whose exit was not found within `_MAX_INCREMENTS` increments


@subroutine
def _safe_increment(gap, slope, second):
    """The smallest distance at which a gap with this derivative can vanish if its second derivative is at least
    ``second``.

    This increment never jumps over a root, and near a simple root increments converge quadratically. Where the parabola
    below the gap has no root, the gap has none either.
    """
    zero = broadcast(0.0)
    gap = select(gap < zero, zero, gap)
    square = vfma(slope, slope, broadcast(-2.0) * second * gap)
    root = vsqrt(select(square < zero, zero, square))
    closing = slope < zero
    increment = select(closing, gap + gap, slope + root) / select(closing, root - slope, zero - second)
    rootless = (closing & (square < zero)) | ((zero <= slope) & (zero <= second))
    return select(rootless, broadcast(_BEYOND_END), increment)


@subroutine
def _signs(sigma):
    """Derivatives with respect to z of the distances from the upper and from the lower boundary; both are that of its
    one gap for a lane in contact."""
    free = sigma == broadcast(0.0)
    return select(free, broadcast(-1.0), sigma), select(free, broadcast(1.0), sigma)


@subroutine
def _gaps(z, sigma):
    """Distances of z, within its contact state, from the upper and from the lower boundary."""
    one = broadcast(1.0)
    free = sigma == broadcast(0.0)
    contact = vfma(sigma, z, broadcast(-1.0))
    return select(free, one - z, contact), select(free, one + z, contact)


@subroutine
def _may_close(gap, slope, second, ahead):
    """Whether the parabola below a gap, made concave, reaches zero within the distance ``ahead``."""
    zero = broadcast(0.0)
    second = select(zero < second, zero, second)
    return (gap <= zero) | (vfma(ahead, vfma(broadcast(0.5) * second, ahead, slope), gap) <= zero)


@subroutine
def _next_increment(above, below, slope, second, change, ahead, sigma):
    """Safe increment to the nearest boundary, and the contact state beyond it.

    ``above`` and ``below`` are the gaps, ``slope`` and ``second`` the derivatives of z; ``change`` bounds how much the
    second one varies within the distance ``ahead``. Mostly at most one boundary can be reached, and one square root is
    computed.
    """
    one, free = broadcast(1.0), sigma == broadcast(0.0)
    up, down = _signs(sigma)
    high = _may_close(above, up * slope, up * second - change, ahead)
    side = select(high, up, down)
    increment = _safe_increment(select(high, above, below), side * slope, side * second - change)
    beyond = select(free, select(high, one, broadcast(-1.0)), broadcast(0.0))
    both = free & high & _may_close(below, down * slope, down * second - change, ahead)
    if any_true(both):
        falling = _safe_increment(below, down * slope, down * second - change)
        lower = both & (falling < increment)
        increment, beyond = select(lower, falling, increment), select(lower, broadcast(-1.0), beyond)
    return increment, beyond


@subroutine
def _displacement(ws, first, d, s):
    """z(s) − z(0) and the first two derivatives of z, from the polynomials that begin at row ``first``.

    The difference is formed without z(0), because a lane that starts on a boundary may move from it by less than the
    rounding of z.
    """
    quotient, slope, second = load(ws, first + ORDER * d), broadcast(0.0), broadcast(0.0)
    for k in range(ORDER - 1, 0, -1):
        second = vfma(second, s, slope)
        slope = vfma(slope, s, quotient)
        quotient = vfma(quotient, s, load(ws, first + k * d))
    second = vfma(second, s, slope)
    slope = vfma(slope, s, quotient)
    return quotient * s, slope, second + second


@subroutine
def _third_derivative_bound(ws, first, d):
    """An upper bound of |d³z/ds³| on the segment, from the polynomials that begin at row ``first``."""
    total = broadcast(0.0)
    for k in range(3, ORDER + 1):
        total = vfma(broadcast(k * (k - 1.0) * (k - 2.0)), vabs(load(ws, first + k * d)), total)
    return total


@subroutine
def _crosses(ws, first, d, s, above0, below0, sigma, beyond):
    """Whether a lane that touches its boundary at vanishing speed crosses it: whether the gap is negative at s."""
    moved, _, _ = _displacement(ws, first, d, s)
    up, down = _signs(sigma)
    return select(beyond < broadcast(0.0), vfma(down, moved, below0), vfma(up, moved, above0)) < broadcast(0.0)


@subroutine
def _next_window(error, speed, increment, ahead):
    """Upper bound of the distance from the end of this increment to the boundary crossing: the window of the next one.

    It is four times the error bound of the increment over the speed, which holds where the motion does not slow down
    much; `_BEYOND_END` if the increment was limited by the present window. The smaller the window, the sharper are the
    bounds within it. If the crossing is not in the window, the next increment ends at most at the end of the window.
    """
    far = broadcast(_BEYOND_END)
    window = broadcast(4.0) * error / speed
    smallest = broadcast(_SMALLEST_WINDOW)
    window = select(window < far, select(window < smallest, smallest, window), far)
    return select(increment <= ahead, window, far)


@subroutine
def _window_after(touch, s):
    """Half the distance from the last touch at vanishing speed, which limits the increments from there; `_BEYOND_END`
    if there was none."""
    return select(touch < broadcast(0.0), broadcast(_BEYOND_END), broadcast(0.5) * (s - touch))


@subroutine
def _gap_series(dims, harmonics, ws):
    """Polynomials of the two distances from the boundaries of the contact state where contact ends with the force.

    The first is 1 − z in free flight, in contact the force towards the flank, and for a released flank the negative of
    the force that it would have. The second is 1 + z in free flight, else the distance by which z is beyond its
    boundary; forward in time, contact ends before that is zero.
    """
    d, at, row = len(dims), rows(dims), harmonics.rows
    sigma, zero, one = load(ws, at.sigma), broadcast(0.0), broadcast(1.0)
    free, held = sigma == zero, zero < in_contact(dims, sigma)
    side = select(sigma < zero, broadcast(-1.0), one)
    angle = load(ws, at.duration) * load(ws, at.omega)
    store(ws, at.full_stiffness, load(ws, at.level))
    for m in range(1, ORDER + 1):
        store(ws, at.full_stiffness + m, zero)
    for j in range(harmonics.stiffness):
        a, b = load(ws, row.stiffness_amplitudes + 2 * j), load(ws, row.stiffness_amplitudes + 2 * j + 1)
        add_sinusoid(ws, at.full_stiffness, a, b, row.cos_sin + 2 * j, angle * broadcast(j + 1.0), False)
    for m in range(ORDER + 1):
        z, offset = load(ws, at.state + m * d), one if m == 0 else zero
        force = load(ws, at.contact_damping) * load(ws, at.state + m * d + 1)
        for i in range(m + 1 if harmonics.stiffness > 0 else 1):
            extension = load(ws, at.state + (m - i) * d)
            extension = extension - side if m == i else extension
            force = vfma(load(ws, at.full_stiffness + i), extension, force)
        force = side * force
        store(ws, at.first_gap + m, select(free, offset - z, select(held, force, zero - force)))
        store(ws, at.second_gap + m, select(free, offset + z, side * z - offset))


@subroutine
def _find_exits_with_force(dims, harmonics, ws):
    """`find_exits` where contact ends with the force. The gaps are polynomials of their own, see `_gap_series`.

    The force may jump with the stiffness: a lane whose gap is negative at the start leaves at once.
    """
    at, far = rows(dims), broadcast(_BEYOND_END)
    _gap_series(dims, harmonics, ws)
    sigma, zero, one = load(ws, at.sigma), broadcast(0.0), broadcast(1.0)
    side = select(sigma < zero, broadcast(-1.0), one)
    free, held = sigma == zero, zero < in_contact(dims, sigma)
    closed = select(load(ws, at.contact_damping) < zero, broadcast(0.5), one)  # in reversed time flanks are released
    to_first = select(free, closed, select(held, broadcast(0.5) * side, side))
    to_second = select(free, zero - closed, zero)
    first0, second0 = load(ws, at.first_gap), load(ws, at.second_gap)
    third1, third2 = _third_derivative_bound(ws, at.first_gap, 1), _third_derivative_bound(ws, at.second_gap, 1)
    exit_at, next_sigma, touch, probe = far, sigma, zero - far, broadcast(_PROBE)
    s = select(zero < load(ws, at.duration), zero, far)
    jumped = (s <= one) & (first0 < broadcast(_JUMPED)) & (zero < vabs(sigma))
    exit_at, next_sigma, s = select(jumped, zero, exit_at), select(jumped, to_first, next_sigma), select(jumped, far, s)
    searching, window_limit = s <= one, far
    for _ in range(_MAX_INCREMENTS):
        moved1, slope1, curve1 = _displacement(ws, at.first_gap, 1, s)
        moved2, slope2, curve2 = _displacement(ws, at.second_gap, 1, s)
        gap1, gap2 = first0 + moved1, second0 + moved2
        window = smaller(window_limit, _window_after(touch, s))
        ahead = smaller(window, one - s)
        increment1 = _safe_increment(gap1, slope1, curve1 - third1 * ahead)
        increment2 = _safe_increment(gap2, slope2, curve2 - third2 * ahead)
        second = increment2 < increment1
        increment, beyond = select(second, increment2, increment1), select(second, to_second, to_first)
        speed, change = vabs(select(second, slope2, slope1)), select(second, third2, third1) * ahead
        error = change * increment * increment
        exact = error <= broadcast(_EXACT) * speed
        leaving = searching & (broadcast(_GRAZING_SPEED) < speed) & exact & (increment <= ahead)
        near = (increment < broadcast(_PROBE)) & (select(second, gap2, gap1) <= broadcast(_EXACT))
        touching = searching & (speed <= broadcast(_GRAZING_SPEED)) & ((increment <= broadcast(_EXACT)) | near)
        root = s + increment
        window_limit = _next_window(error, speed, increment, ahead)
        increment = smaller(increment, window)
        if any_true(touching):
            later1, _, _ = _displacement(ws, at.first_gap, 1, s + probe)
            later2, _, _ = _displacement(ws, at.second_gap, 1, s + probe)
            through = touching & (select(second, second0 + later2, first0 + later1) < zero)
            other = select(second, increment1, increment2)
            # where the other gap closes before the probe, that one is followed
            passing = touching & (other < probe) & (zero <= select(second, second0 + later2, first0 + later1))
            slope = vabs(select(second, slope1, slope2))
            error = select(second, third1, third2) * ahead * other * other
            exact = (error <= broadcast(_EXACT) * slope) & (broadcast(_GRAZING_SPEED) < slope) & (other <= ahead)
            closing = passing & exact
            beyond = select(closing, select(second, to_first, to_second), beyond)
            leaving, root = leaving | through | closing, select(closing, s + other, select(through, s, root))
            passing = passing & (broadcast(_EXACT) < other)
            increment = select(touching, select(passing, smaller(other, ahead), probe), increment)
            touching = touching & (probe <= increment)
            touch, probe = select(touching, s, touch), select(touching, probe + probe, probe)
        exit_at, next_sigma = select(leaving, root, exit_at), select(leaving, beyond, next_sigma)
        increment = select(leaving, far, increment)
        s = select(searching, s + increment, s)
        searching = s <= one
        if not any_true(searching):
            break
    next_sigma = select(s <= one, broadcast(SEARCH_FAILED), next_sigma)
    store(ws, at.end_fraction, select(exit_at > one, one, exit_at))
    store(ws, at.next_sigma, next_sigma)


@subroutine
def begin_search(dims, ws):
    """Begin the search for the *exit* of each lane: the first contact switch in the rest of the step, at a root of its
    gap.

    A start on a boundary and a grazing contact are neither missed nor counted twice: whether a touch at vanishing speed
    is a crossing is decided by the sign of the gap a little later. From a touch on, increments are limited to windows
    proportional to the distance from it: where the gap grows like the cube of that distance, increments from a bound
    for the whole rest of the segment would only be proportional to its square.
    """
    d, far = len(dims), broadcast(_BEYOND_END)
    at = rows(dims)
    store(ws, at.third, _third_derivative_bound(ws, at.state, d))
    time_left = broadcast(0.0) < load(ws, at.duration)
    store(ws, at.searched, select(time_left, broadcast(0.0), far))
    store(ws, at.end_fraction, far)
    store(ws, at.next_sigma, load(ws, at.sigma))
    store(ws, at.touch, broadcast(-_BEYOND_END))
    store(ws, at.probe, broadcast(_PROBE))
    store(ws, at.window_limit, far)
    store(ws, at.moved, broadcast(0.0))
    store(ws, at.slope, load(ws, at.state + d))
    store(ws, at.second, broadcast(2.0) * load(ws, at.state + 2 * d))


@subroutine
def continue_search(dims, ws):
    """Advance the search by one increment; returns whether it goes on in any lane."""
    d = len(dims)
    at = rows(dims)
    sigma, third, s = load(ws, at.sigma), load(ws, at.third), load(ws, at.searched)
    touch, probe, slope = load(ws, at.touch), load(ws, at.probe), load(ws, at.slope)
    above0, below0 = _gaps(load(ws, at.state), sigma)
    up, down = _signs(sigma)
    moved, searching = load(ws, at.moved), s <= broadcast(1.0)
    above, below = vfma(up, moved, above0), vfma(down, moved, below0)
    window = smaller(load(ws, at.window_limit), _window_after(touch, s))
    ahead = smaller(window, broadcast(1.0) - s)
    change = third * ahead
    increment, beyond = _next_increment(above, below, slope, load(ws, at.second), change, ahead, sigma)
    speed = vabs(slope)
    error = change * increment * increment
    exact = error <= broadcast(_EXACT) * speed
    leaving = searching & (broadcast(_GRAZING_SPEED) < speed) & exact & (increment <= ahead)
    near = (increment < broadcast(_PROBE)) & (smaller(above, below) <= broadcast(_EXACT))
    touching = searching & (speed <= broadcast(_GRAZING_SPEED)) & ((increment <= broadcast(_EXACT)) | near)
    root = s + increment
    store(ws, at.window_limit, _next_window(error, speed, increment, ahead))
    increment = smaller(increment, window)
    if any_true(touching):
        through = touching & _crosses(ws, at.state, d, s + probe, above0, below0, sigma, beyond)
        leaving, root = leaving | through, select(through, s, root)
        increment = select(touching, probe, increment)
        store(ws, at.touch, select(touching, s, touch))
        store(ws, at.probe, select(touching, probe + probe, probe))
    store(ws, at.end_fraction, select(leaving, root, load(ws, at.end_fraction)))
    store(ws, at.next_sigma, select(leaving, beyond, load(ws, at.next_sigma)))
    ahead = s + increment  # of lanes that leave, too: so the polynomials need not wait for which these are
    s = select(searching, select(leaving, broadcast(_BEYOND_END), ahead), s)
    store(ws, at.searched, s)
    if not any_true(s <= broadcast(1.0)):
        return False
    moved, slope, second = _displacement(ws, at.state, d, ahead)
    store(ws, at.moved, moved)
    store(ws, at.slope, slope)
    store(ws, at.second, second)
    return True


@subroutine
def end_search(dims, ws):
    """Write s at the exit, or 1 if the lane stays in its contact state, to row ``end_fraction``, and the contact state
    after it to row ``next_sigma`` (`SEARCH_FAILED` if the search does not end)."""
    at, one, exit_at = rows(dims), broadcast(1.0), load(ws, rows(dims).end_fraction)
    failed = load(ws, at.searched) <= one
    store(ws, at.next_sigma, select(failed, broadcast(SEARCH_FAILED), load(ws, at.next_sigma)))
    store(ws, at.end_fraction, select(exit_at > one, one, exit_at))


@inlined
def find_exits(dims, harmonics, ws, size, packs):
    """Find the exits of those of `PACKS` packs whose bits are set in ``packs``; each has its ``size``
    floats of ``ws``.

    An increment waits for its roots and divisions. So the packs make theirs in turn, and the processor works on one
    while another waits.
    """
    if releases(dims):
        for p in range(PACKS):
            if packs >> p & 1:
                _find_exits_with_force(dims, harmonics, ws[p * size : (p + 1) * size])
        return
    for p in range(PACKS):
        if packs >> p & 1:
            begin_search(dims, ws[p * size : (p + 1) * size])
    searching = packs
    for _ in range(_MAX_INCREMENTS):
        for p in range(PACKS):
            if searching >> p & 1 and not continue_search(dims, ws[p * size : (p + 1) * size]):
                searching -= 1 << p
        if searching == 0:
            break
    for p in range(PACKS):
        if packs >> p & 1:
            end_search(dims, ws[p * size : (p + 1) * size])


@subroutine
def first_roots(ws, first, out, row):
    """Write the first root in [0, 1] of each of `WIDTH` gaps to row ``row`` of ``out``: `NO_ROOT` if there is none, a
    negative number if the search does not end.

    Their polynomials begin at row ``first``. The search is that of `find_exits`.
    """
    far, one, zero = broadcast(_BEYOND_END), broadcast(1.0), broadcast(0.0)
    gap0, slope0, third, curved = load(ws, first), load(ws, first + 1), _third_derivative_bound(ws, first, 1), zero
    for k in range(2, ORDER + 1):
        curved = curved + vabs(load(ws, first + k))
    rootless = (vabs(slope0) + curved < gap0) | ((curved < slope0) & (zero <= gap0))
    exit_at, touch, probe, window_limit = far, zero - far, broadcast(_PROBE), far
    s = select(rootless, far, zero)
    searching = s <= one
    for _ in range(_MAX_INCREMENTS):
        if not any_true(searching):
            break
        moved, slope, second = _displacement(ws, first, 1, s)
        gap = gap0 + moved
        window = smaller(window_limit, _window_after(touch, s))
        ahead = smaller(window, one - s)
        change = third * ahead
        increment, speed = _safe_increment(gap, slope, second - change), vabs(slope)
        error = change * increment * increment
        exact = error <= broadcast(_EXACT) * speed
        leaving = searching & (broadcast(_GRAZING_SPEED) < speed) & exact & (increment <= ahead)
        near = (increment < broadcast(_PROBE)) & (gap <= broadcast(_EXACT))
        touching = searching & (speed <= broadcast(_GRAZING_SPEED)) & ((increment <= broadcast(_EXACT)) | near)
        root = s + increment
        window_limit = _next_window(error, speed, increment, ahead)
        increment = smaller(increment, window)
        if any_true(touching):
            later, _, _ = _displacement(ws, first, 1, s + probe)
            through = touching & (gap0 + later < zero)
            leaving, root = leaving | through, select(through, s, root)
            increment = select(touching, probe, increment)
            touch, probe = select(touching, s, touch), select(touching, probe + probe, probe)
        exit_at = select(leaving & (root <= one), root, exit_at)
        s = select(searching, s + select(leaving, far, increment), s)
        searching = s <= one
    store(out, row, select(searching, broadcast(-1.0), exit_at))


@inlined
def _gather(dims, vectors, length, first, listed, count, ws):
    """Copy d vectors of the listed lanes, from ``first`` on of the ``length`` vectors of each slot, to the start rows;
    positions without a lane receive a copy of the first lane."""
    start = rows(dims).start * WIDTH
    for l in range(WIDTH):
        lane = load_scalar(listed, l if l < count else 0)
        index = (slot_of(lane) * length + first) * WIDTH + position_of(lane)
        for i in range(len(dims)):
            store_scalar(ws, start + i * WIDTH + l, load_scalar(vectors, index + i * WIDTH))


@inlined
def _scatter(dims, vectors, length, first, listed, count, ws, row):
    """The reverse of `_gather`, from the rows of the workspace from ``row`` on."""
    for l in range(count):
        lane = load_scalar(listed, l)
        index = (slot_of(lane) * length + first) * WIDTH + position_of(lane)
        for i in range(len(dims)):
            store_scalar(vectors, index + i * WIDTH, load_scalar(ws, (row + i) * WIDTH + l))


@subroutine
def saltate(dims, ws):
    """Change the end rows of a tangent vector v by the contact switch at the end of the segment, if there is one.

    The right-hand side jumps by −b D z' where contact begins and by b D z' where it ends, and the instant of the switch
    changes by −v[0]/z', so that v jumps by −b D v[0] or b D v[0] (R. I. Leine, H. Nijmeijer, *Dynamics and Bifurcations
    of Non-Smooth Mechanical Systems*, 2004, section 7.3). With damping that always acts nothing jumps.
    """
    at = rows(dims)
    sigma, beyond = load(ws, at.sigma), load(ws, at.next_sigma)
    beyond = select(beyond < broadcast(SEARCH_FAILED), beyond, sigma)
    change, zero = in_contact(dims, beyond) - in_contact(dims, sigma), broadcast(0.0)
    if releases(dims):  # nothing jumps where the force is zero
        change = select((sigma == zero) | (beyond == zero), change, zero)
    jump = change * load(ws, at.contact_damping) * load(ws, at.end)
    for i in range(1, len(dims)):
        store(ws, at.end + i, vfma(load(ws, at.minus_b + i), jump, load(ws, at.end + i)))


@subroutine
def _advance_tangents(dims, tangents, before, after, listed, count, ws, varying):
    """Advance the tangent vectors of the listed lanes over the segment, from parity ``before`` to parity ``after``.

    ``tangents`` is `Lanes.tangents`.
    """
    d, vectors = len(dims), tangents.shape[2]
    for c in range(vectors):
        _gather(dims, tangents, 2 * vectors * d, (before * vectors + c) * d, listed, count, ws)
        state_series(dims, ws, False, varying)
        end_state(dims, ws)
        if damps_in_contact(dims):
            saltate(dims, ws)
        _scatter(dims, tangents, 2 * vectors * d, (after * vectors + c) * d, listed, count, ws, rows(dims).end)


@subroutine
def switch_contact(dims, harmonics, ws):
    """Put switching lanes on the boundary in their new contact state, with the rest of the step as their next segment;
    the others get a segment of duration 0 and do not move. Returns whether any lane switches."""
    at, zero = rows(dims), broadcast(0.0)
    sigma, beyond = load(ws, at.sigma), load(ws, at.next_sigma)
    switching = ((sigma < beyond) | (beyond < sigma)) & (beyond < broadcast(SEARCH_FAILED))
    advance_phases(dims, harmonics, ws)
    rest = load(ws, at.duration) * (broadcast(1.0) - load(ws, at.end_fraction))
    store(ws, at.duration, select(switching, rest, zero))
    store(ws, at.sigma, select(switching, beyond, sigma))
    boundary, at_boundary = select(sigma == zero, beyond, sigma), switching
    if releases(dims):  # contact ends and begins again beyond the boundary
        boundary = select(zero < sigma + beyond, broadcast(1.0), broadcast(-1.0))
        at_boundary = switching & ((sigma == zero) | (beyond == zero))
    store(ws, at.start, select(at_boundary, boundary, load(ws, at.start)))
    return any_true(switching)


@inlined
def _mark_failed_searches(dims, lanes, listed, count, ws):
    """Give lanes whose exit was not found the status `CHATTER`."""
    row = rows(dims).next_sigma
    for l in range(count):
        if ws[row * WIDTH + l] == SEARCH_FAILED:
            lanes.status[listed[l]] = CHATTER


@inlined
def _run_segments(dims, points, lanes, work, first, total, packs, parity, begun, measuring):
    """Advance the ``packs``, one bit each, from their start rows to the next switch or the end of the step, into the
    start rows; returns those in which any lane switches.

    Their lanes are listed from ``first`` on, up to ``total``. ``parity`` is that of the tick, and ``begun`` says that
    this is not the first segment of the step. Stages are computed for one pack after the other, as in `find_exits`.
    """
    harmonics, size, switching = points.harmonics, points.harmonics.rows.total * WIDTH, 0
    for p in range(PACKS):
        if packs >> p & 1:
            excitation_series(dims, harmonics, work.rows[p * size : (p + 1) * size])
    for p in range(PACKS):
        if packs >> p & 1:
            state_series(dims, work.rows[p * size : (p + 1) * size], True, harmonics.stiffness > 0)
    find_exits(dims, harmonics, work.rows, size, packs)
    for p in range(PACKS):
        if packs >> p & 1:
            start, ws = first + p * WIDTH, work.rows[p * size : (p + 1) * size]
            listed, count = work.listed[start : start + WIDTH], min(WIDTH, total - start)
            _end_segment(dims, harmonics, lanes, listed, count, ws, work.measures, parity, begun, measuring)
            _mark_failed_searches(dims, lanes, listed, count, ws)
            if switch_contact(dims, harmonics, ws):
                switching += 1 << p
    return switching


@inlined
def _end_segment(dims, harmonics, lanes, listed, count, ws, measures, parity, begun, measuring):
    """Measure the segment, and advance the state and the tangent vectors of a pack to its end."""
    at = rows(dims)
    if measuring:
        output_series(dims, harmonics, ws)
        measure_segment(dims, ws, measures, 0)
    end_state(dims, ws)
    if lanes.tangents.shape[2] > 0:
        after, length = 1 - parity, rows_per_slot(lanes)
        before = after if begun else parity
        _scatter(dims, lanes.vectors, length, after * len(dims), listed, count, ws, at.end)
        _advance_tangents(dims, lanes.tangents, before, after, listed, count, ws, harmonics.stiffness > 0)
        _gather(dims, lanes.vectors, length, after * len(dims), listed, count, ws)
    else:
        for i in range(len(dims)):
            store(ws, at.start + i, load(ws, at.end + i))


@inlined
def _begin_step(dims, points, slots, lanes, listed, count, work, ws, tick, measuring):
    """Fill a workspace with the states and parameters of the listed lanes at the start of the step."""
    at, parity = rows(dims), tick & 1
    for l in range(WIDTH):
        lane = load_scalar(listed, l if l < count else 0)
        work.points[l] = load_scalar(lanes.point, lane)
        work.steps[l] = load_scalar(lanes.first_step, lane) + load_scalar(slots.step_minus_tick, slot_of(lane)) + tick
        ws[at.sigma * WIDTH + l] = load_scalar(lanes.sigma, lane)
        if measuring:
            gather_measures(work.measures, lanes.measures, lane, l)
    fill_point(dims, points.parameters, points.harmonics, work.points, measuring, ws)
    fill_level(dims, points.parameters, points.harmonics, points.steps.values, work.points, work.steps, ws)
    fill_step(dims, points.harmonics, points.steps.values, work.steps, ws)
    _gather(dims, lanes.vectors, rows_per_slot(lanes), parity * len(dims), listed, count, ws)


@inlined
def _end_step(dims, lanes, listed, count, work, ws, parity, switching, measuring):
    """Store the states of the listed lanes at the end of the step; those still ``switching`` get the status
    `CHATTER`."""
    at = rows(dims)
    _scatter(dims, lanes.vectors, rows_per_slot(lanes), (1 - parity) * len(dims), listed, count, ws, at.start)
    for l in range(count):
        lanes.sigma[listed[l]] = ws[at.sigma * WIDTH + l]
        if switching and ws[at.duration * WIDTH + l] > 0.0:
            lanes.status[listed[l]] = CHATTER
        if measuring:
            scatter_measures(work.measures, lanes.measures, listed[l], l)


@inlined
def resolve(dims, points, slots, lanes, work, total, tick, measuring):
    """Advance the first ``total`` lanes of ``work.listed`` over one step, with all contact switches in it:
    `PACKS` packs side by side, or one while it is measured, since the workspace has the measures of one."""
    size, parity, beside = points.harmonics.rows.total * WIDTH, tick & 1, 1 if measuring else PACKS
    for first in range(0, total, beside * WIDTH):
        last = min(first + beside * WIDTH, total)
        for start in range(first, last, WIDTH):
            p, listed = (start - first) // WIDTH, work.listed[start : start + WIDTH]
            ws = work.rows[p * size : (p + 1) * size]
            _begin_step(dims, points, slots, lanes, listed, min(WIDTH, total - start), work, ws, tick, measuring)
        packs, segments = (1 << (last - first + WIDTH - 1) // WIDTH) - 1, 0
        while packs > 0 and segments < MAX_SWITCHES:
            packs = _run_segments(dims, points, lanes, work, first, total, packs, parity, segments > 0, measuring)
            segments += 1
        for start in range(first, last, WIDTH):
            p, listed = (start - first) // WIDTH, work.listed[start : start + WIDTH]
            ws, count = work.rows[p * size : (p + 1) * size], min(WIDTH, total - start)
            _end_step(dims, lanes, listed, count, work, ws, parity, packs >> p & 1 == 1, measuring)
