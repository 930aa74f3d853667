"""One mesh period of all motions from a box of states, for all models of a box of parameters.

The motions start at c + C u + ξ with |ξ_i| <= r and |u_j| <= 1, where u sets the parameters p(u). Their difference
from the motion at the centre (state c, parameters p0) is A ξ + B u. On a piece i of the mesh period A becomes Φ A and B
becomes Φ B + γ (see `box_pieces`), with Φ and γ known up to bounds ΔΦ_i and Δγ_i. By the telescoping sum the errors of
A and B after piece N are at most

    Σ_i |Φ_N ... Φ_(i+1)| ΔΦ_i (|A_i| + ΔA_i)  and  Σ_i |Φ_N ... Φ_(i+1)| (ΔΦ_i (|B_i| + ΔB_i) + Δγ_i),

with the products of the precise matrices at the centre. So bounds are not multiplied by bounds from piece to piece, and
errors do not grow faster than the motions do.

Where motions of the box graze a contact boundary, some touch it twice and others not at all. The windows of the two
switches are then taken as one, before and after which all motions are in the same contact state. Within it a motion may
switch any number of times, since κ is anything from 0 to χ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat, arb_poly

from gearchaos.proof.balls import ball, block, interval, least, magnitude, norm, rounded
from gearchaos.proof.box_pieces import UP, BoxBounds, Slack, window_balls
from gearchaos.proof.crossing import UndecidedError, clearance
from gearchaos.proof.parameter_box import magnitudes
from gearchaos.proof.trajectory import Switch, Trajectory

_WIDENING = 2
_ENCLOSURES = 8


@dataclass(frozen=True)
class BoxTube:
    """What is proved of a mesh period.

    Attributes
    ----------
    slopes : arb_mat
        A, (d, d): contains S with P(x; p) - P(y; p) = S (x - y) for all states of the box and all p.
    by_parameters : arb_mat
        B, (d, m).
    switches : int
        Number of windows: where none is that of a graze, the number of contact switches of every motion.
    """

    slopes: arb_mat
    by_parameters: arb_mat
    switches: int


class _Window(NamedTuple):
    """A time window of contact switches on one flank, with the numbers of the first and the last one of the centre."""

    low: arb
    high: arb
    first: int
    last: int


class _Path:
    """z of all motions on a piece as a function of the share of its cell: that at p0, and bounds of the rest."""

    def __init__(self, polynomial: arb_poly, slack: Slack, length: float) -> None:
        self.polynomial, self.slope = polynomial, polynomial.derivative()
        self.bend = self.slope.derivative()
        self.errors = [arb(0, v * UP) for v in (
            slack.moved[0], slack.moved_rate[0] * length, slack.moved_curvature * length**2)]

    def z(self, u: arb) -> arb:
        return self.polynomial(u) + self.errors[0]

    def first(self, u: arb) -> arb:
        return self.slope(u) + self.errors[1]

    def second(self, u: arb) -> arb:
        return self.bend(u) + self.errors[2]


def box_tube(
    bounds: BoxBounds, centre: Trajectory, drift: arb_mat, radius: float, shifts: np.ndarray,
    grazing: bool = False,
) -> BoxTube:
    """The motions over one mesh period from the section on.

    Parameters
    ----------
    bounds : BoxBounds
    centre : Trajectory
        The motion from c at the centre of the box of parameters.
    drift : arb_mat
        C, (d, m).
    radius : float
        r.
    shifts : (S, m)
        About the derivatives by u of the times of the switches, for the starts c + C u: they set the widths of the
        windows.
    grazing : bool
        Take overlapping windows of two switches on one flank as one.

    Raises
    ------
    UndecidedError
        With the reason and margin of what could not be proved.
    """
    return _BoxTube(bounds, centre, drift, radius).result(shifts, grazing)


class _BoxTube:
    """The differences from the motion at the centre, while they are followed through a mesh period."""

    def __init__(self, bounds: BoxBounds, centre: Trajectory, drift: arb_mat, radius: float) -> None:
        self.bounds, self.centre, self.equations = bounds, centre, bounds.equations
        d = self.equations.dimension
        self.dimension, self.count = d, bounds.count
        self.state = arb_mat(d, 1, [arb(0, radius)] * d)
        self.unit = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        self.slopes = arb_mat(d, d, [int(i == j) for i in range(d) for j in range(d)])
        self.drift = drift
        self.slope_error, self.drift_error = np.zeros((d, d)), np.zeros((d, self.count))
        self.products: list[arb_mat] = []
        self.weights: list[np.ndarray] = []

    def result(self, shifts: np.ndarray, grazing: bool) -> BoxTube:
        """Follow the motions from section to section."""
        windows = [self._window(number, switch, shift)
                   for number, (switch, shift) in enumerate(zip(self.centre.switches, shifts, strict=True))]
        if grazing:
            windows = self._united(windows)
        self._check_order(windows)
        segment, time = 0, arb(0)
        for window in windows:
            self._between(segment, time, window.low)
            self._through(window)
            segment, time = window.last + 1, window.high
        self._between(segment, time, arb(1))
        return BoxTube(_widened(self.slopes, self.slope_error), _widened(self.drift, self.drift_error), len(windows))

    def difference(self) -> arb_mat:
        """Contains the difference from the motion at the centre of all motions, (d, 1)."""
        return (_widened(self.slopes, self.slope_error) * self.state
                + _widened(self.drift, self.drift_error) * self.unit)

    def _window(self, number: int, switch: Switch, shift: np.ndarray) -> _Window:
        """The window of a switch: the spread of its times to first order, widened."""
        if not (switch.rate > 0 or switch.rate < 0):
            raise UndecidedError("tangency undecided", least(abs(switch.rate)))
        row = block(switch.slopes, 1, range(self.dimension))
        spread = magnitude((row * self.state)[0, 0]) / magnitude(switch.rate) + float(np.abs(shift).sum())
        half = _WIDENING * spread + 2.0 ** (24 - self.equations.bits)
        digits = 12 - math.floor(math.log2(half))
        low, high = (ball(rounded(switch.time + side * half, digits)) for side in (-1, 1))
        return _Window(low, high, number, number)

    def _united(self, windows: list[_Window]) -> list[_Window]:
        """The windows, those of two switches on one flank that overlap as one."""
        flanks, out = [switch.flank for switch in self.centre.switches], list[_Window]()
        for window in windows:
            before = out[-1] if out else window
            if (before.first == before.last == window.first - 1 and flanks[before.first] == flanks[window.first]
                    and not before.high < window.low):
                low, high = before.low.min(window.low), before.high.max(window.high)
                out[-1] = _Window(low, high, before.first, window.last)
            else:
                out.append(window)
        return out

    def _check_order(self, windows: list[_Window]) -> None:
        """Raise `UndecidedError` unless the windows follow each other within the period."""
        for before, after in pairwise(windows):
            if not before.high < after.low:
                raise UndecidedError("windows overlap", least(after.low - before.high))
        if windows and not (windows[0].low > 0 and windows[-1].high < 1):
            raise UndecidedError("section on the contact boundary", 0.0)

    def _between(self, segment: int, low: arb, high: arb) -> None:
        """Follow the motions from one window to the next."""
        contact = self.centre.contacts[segment]
        for index, cell in enumerate(self.equations.cells):
            start, length = ball(cell.start), ball(cell.length)
            if not start + length > low or not start < high:
                continue
            first = (low - start) / length if low > start else arb(0)
            last = (high - start) / length if high < start + length else arb(1)
            self._piece(segment, index, contact, first, last)

    def _piece(self, segment: int, index: int, contact: int, first: arb, last: arb) -> None:
        """Follow the motions from the share ``first`` to the share ``last`` of a cell."""
        equations, cell = self.equations, self.equations.cells[index]
        flow, frozen = equations.flow(index, contact), self.centre.starts[segment, index]
        d = self.dimension
        entry = flow.at(first) * frozen
        before = self.difference()
        length = magnitude(ball(cell.length) * (last - first))
        at_start = magnitudes(block(entry, d, range(1)).entries()) + magnitudes(before.entries())
        slack = self.bounds.slack(cell, contact, length, at_start)
        forward, onward = flow.at(first), flow.at(last)
        inverse = _linear(forward, d).inv()
        exact = _linear(onward, d) * inverse
        gamma = self.bounds.drift_at_centre(cell, contact, first, last, block(entry, d, range(1)))
        pulled = block(frozen, d, range(1)) + inverse * before
        path = _Path(flow.polynomial(arb_mat(d + 1, 1, [*pulled.entries(), 1])), slack, magnitude(ball(cell.length)))
        z_before = (entry[0, 0] + before[0, 0])
        self._advance(exact, slack.flow, gamma, slack.drift)
        leaving = onward * frozen
        # proves too that z is on its side of the boundaries at both ends, i.e. before and after a window
        clearance(path, contact, first, last, z_before, leaving[0, 0] + self.difference()[0, 0])  # type: ignore[arg-type]

    def _advance(self, flow: arb_mat, flow_error: np.ndarray, gamma: arb_mat, gamma_error: np.ndarray) -> None:
        """Apply the flow of a piece, and bound the errors after it by the telescoping sum."""
        flow_error = flow_error + _radii(flow)
        gamma_error = gamma_error + _radii(gamma)
        flow, gamma = flow.mid(), gamma.mid()
        both = np.hstack([magnitudes(self.slopes.tolist()) + self.slope_error,
                          magnitudes(self.drift.tolist()) + self.drift_error])
        weight = flow_error @ both
        weight[:, self.dimension:] += gamma_error
        self.products = [flow * product for product in self.products] + [_identity(self.dimension)]
        self.weights.append(weight * UP)
        self.slopes, self.drift = flow * self.slopes, flow * self.drift + gamma
        error = sum(magnitudes(p.tolist()) @ w for p, w in zip(self.products, self.weights, strict=True)) * UP
        self.slope_error, self.drift_error = error[:, :self.dimension], error[:, self.dimension:]

    def _through(self, window: _Window) -> None:
        """Follow the motions through a window, in which κ is anything from 0 to χ."""
        low, high, d = window.low, window.high, self.dimension
        switch, duration = self.centre.switches[window.first], high - low
        matrix, spring, chi = window_balls(self.bounds)
        entry = self._centre_at(window.first, low)
        states = self._enclosure(switch, entry + self.difference(), low, high)
        speed = (switch.flank if switch.into_contact else -switch.flank) * states[1, 0]
        if window.first == window.last and not speed > 0:
            raise UndecidedError("tangency undecided", least(speed))
        flow = _window_flow(matrix, spring, chi, duration)
        bound = norm(matrix) + norm(spring) * magnitude(chi)
        gamma = self._window_drift(switch, states, duration, bound)
        self._advance(flow, np.zeros((d, d)), gamma, np.zeros((d, self.count)))

    def _centre_at(self, segment: int, time: arb) -> arb_mat:
        """The state (d, 1) of the motion at the centre at a time of a part between switches."""
        cells = self.equations.cells
        index = max(i for i, c in enumerate(cells) if ball(c.start) <= time)
        share = (time - ball(cells[index].start)) / ball(cells[index].length)
        contact = self.centre.contacts[segment]
        there = self.equations.flow(index, contact).at(share) * self.centre.starts[segment, index]
        return block(there, self.dimension, range(1))

    def _enclosure(self, switch: Switch, states: arb_mat, low: arb, high: arb) -> arb_mat:
        """States (d, 1) that no motion leaves during a window: a box that the equations map into itself."""
        matrix, spring, chi = window_balls(self.bounds)
        span, forcing = interval(0, high - low), self._forcing(low, high)

        def later(box: arb_mat) -> arb_mat:
            return states + span * (matrix * box + forcing - chi * (box[0, 0] - switch.flank) * spring)

        trial = later(later(states))
        for _ in range(_ENCLOSURES):
            wide = trial + (trial - trial.mid()) * arb(0, 0.1)
            trial = later(wide)
            if wide.contains(trial):
                return trial
        raise UndecidedError("tangency undecided", -magnitude(high - low))

    def _forcing(self, low: arb, high: arb) -> arb_mat:
        """T f(τ) over a window and the box of parameters, (d, 1)."""
        box = self.bounds.box
        out = [c.value for c in box.constant]
        time = interval(low, high) + ball(self.equations.phase)
        for j, (cosine, sine) in zip(self.equations.harmonics, box.harmonics, strict=True):
            s, c = (2 * j * time).sin_cos_pi()
            out[1] += cosine.value * c + sine.value * s
        return arb_mat(self.dimension, 1, out)

    def _window_drift(self, switch: Switch, states: arb_mat, duration: arb, bound: float) -> arb_mat:
        """γ (d, m) of a window: the integral of dR/du_j along the motion at the centre, followed by the flow."""
        box, d, columns = self.bounds.box, self.dimension, []
        force = interval(0, states[0, 0] - switch.flank)
        top = arb(self.bounds.top)
        for j in range(self.count):
            matrix = arb_mat(d, d, [v.slopes[j] for row in box.matrix for v in row])
            wave = arb(0, self.bounds.wave_slopes[j])
            bend = max((magnitude(level.slopes[j]) for level in box.levels), default=0.0)
            rates = (matrix * states).entries()
            for i in range(d):
                push = box.spring[i].slopes[j] * interval(0, top) + box.spring[i].value * arb(0, bend)
                rates[i] += box.constant[i].slopes[j] + (wave if i == 1 else 0) - push * force
            size = max(map(magnitude, rates))
            growth = arb(0, magnitude((duration * bound).expm1()) * size)
            columns.append([duration * (rate + growth) for rate in rates])
        return arb_mat(d, self.count, [columns[j][i] for i in range(d) for j in range(self.count)])


def _window_flow(matrix: arb_mat, spring: arb_mat, chi: arb, duration: arb) -> arb_mat:
    """Contains the flow (d, d) of A - κ b e1ᵀ through a window for any κ(t) from 0 to χ; as in `tube`."""
    d = matrix.nrows()
    bound = norm(matrix) + norm(spring) * magnitude(chi)
    change = arb(0, magnitude((duration * bound).expm1()))
    size = magnitude((duration * norm(matrix)).expm1()) * norm(spring)
    pushed = spring + interval(0, duration) * (matrix * (spring + arb_mat(d, 1, [arb(0, size)] * d)))
    row = arb_mat(1, d, [int(j == 0) + change for j in range(d)]) * (chi * duration)
    return (matrix * duration).exp() - pushed * row


def _linear(flow: arb_mat, d: int) -> arb_mat:
    """The linear part (d, d) of a flow on (w, 1)."""
    return block(flow, d, range(d))


def _identity(d: int) -> arb_mat:
    return arb_mat(d, d, [int(i == j) for i in range(d) for j in range(d)])


def _radii(matrix: arb_mat) -> np.ndarray:
    """Upper bounds of the radii of the entries of a matrix."""
    return magnitudes([[v - v.mid() for v in row] for row in matrix.tolist()])


def _widened(matrix: arb_mat, error: np.ndarray) -> arb_mat:
    """A matrix with errors added to its radii."""
    rows = zip(matrix.tolist(), error.tolist(), strict=True)
    return arb_mat([[v + arb(0, e) for v, e in zip(row, errors, strict=True)] for row, errors in rows])


