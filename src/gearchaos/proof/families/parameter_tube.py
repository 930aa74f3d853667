"""One mesh period of all motions from a box of states, for all models of a box of parameters.

The motions start at c + C u + ξ with |ξ_i| <= r and |u_j| <= 1, where u sets the parameters p(u). Their difference
from the motion at the centre (state c, parameters p0) is A ξ + B u. On a piece i of the mesh period A becomes Φ A and B
becomes Φ B + γ (see `pieces`), with Φ and γ known up to bounds ΔΦ_i and Δγ_i. By the telescoping sum the errors of
A and B after piece N are at most

    Σ_i |Φ_N ... Φ_(i+1)| ΔΦ_i (|A_i| + ΔA_i)  and  Σ_i |Φ_N ... Φ_(i+1)| (ΔΦ_i (|B_i| + ΔB_i) + Δγ_i),

with the products of the precise matrices at the centre. So bounds are not multiplied by bounds from piece to piece, and
errors do not grow faster than the motions do.

Where motions of the box graze a contact boundary, some touch it twice and others not at all. The windows of the two
switches are then taken as one, before and after which all motions are in the same contact state. Within it a motion may
switch any number of times, since κ is anything from 0 to χ.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import block, interval, magnitude, unit
from gearchaos.proof.crossing import Displacement, clearance
from gearchaos.proof.families.coefficients import balls_of
from gearchaos.proof.families.pieces import UP, BoxBounds
from gearchaos.proof.trajectory import Trajectory
from gearchaos.proof.tube import Tube, Window, largest_rate, slopes_through, speed_at

_WIDENING = 2
"""Width of a window relative to the spread of the switches to first order."""


class ParameterTube(Tube):
    """The motions over one mesh period from the section on.

    Parameters
    ----------
    bounds : BoxBounds
    centre : Trajectory
        The motion from c at the centre of the box of parameters.
    drift : (d, m)
        C.
    radius : float
        r.
    shifts : (S, m)
        About the derivatives by u of the times of the switches, for the starts c + C u: they set the widths of the
        windows.
    grazing : bool
        Take overlapping windows of two switches on one flank as one.

    Attributes
    ----------
    slopes : arb_mat
        A, (d, d): contains S with P(x; p) - P(y; p) = S (x - y) for all states of the box and all p.
    by_parameters : arb_mat
        B, (d, m).
    switches : int
        Number of windows: where none is that of a graze, the number of contact switches of every motion.

    Raises
    ------
    UndecidedError
        With the reason and margin of what could not be proved.
    """

    def __init__(
        self, bounds: BoxBounds, centre: Trajectory, drift: np.ndarray, radius: float, shifts: np.ndarray,
        grazing: bool = False,
    ) -> None:
        super().__init__(bounds.equations, centre)
        self.coefficients = self.bounds = bounds
        d, self.count = self.dimension, bounds.count
        self.start = arb_mat(d, 1, [arb(0, radius)] * d)
        self.every_u = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        self.factor, self.drift = unit(d), arb_mat(d, self.count, drift.ravel().tolist())
        self.factor_error, self.drift_error = np.zeros((d, d)), np.zeros((d, self.count))
        self.products: list[arb_mat] = []
        self.weights: list[np.ndarray] = []
        windows = []
        for number, (switch, shift) in enumerate(zip(centre.switches, shifts, strict=True)):
            speed, row = speed_at(switch), block(switch.slopes, 1, range(d))
            spread = magnitude((row * self.start)[0, 0]) / speed + float(np.abs(shift).sum())
            windows.append(self._window(number, _WIDENING * spread + 2.0 ** (24 - self.equations.bits), 12))
        windows = united(windows) if grazing else windows
        self.follow(windows)
        self.slopes, self.by_parameters = self._enclosed()
        self.switches = len(windows)

    def _enclosed(self) -> tuple[arb_mat, arb_mat]:
        """A and B with their errors."""
        return _widened(self.factor, self.factor_error), _widened(self.drift, self.drift_error)

    def _difference(self) -> arb_mat:
        """Contains the difference from the motion at the centre of all motions, (d, 1)."""
        slopes, by_parameters = self._enclosed()
        return slopes * self.start + by_parameters * self.every_u

    def _piece(self, part: int, index: int, first: arb, last: arb) -> None:
        cell, d, contact = self.equations.cells[index], self.dimension, self.centre.contacts[part]
        flow, frozen = self.equations.flow(index, contact), self.centre.starts[part, index]
        forward, onward = flow.at(first), flow.at(last)
        entry, leaving, before = forward * frozen, onward * frozen, self._difference()
        length, whole = magnitude(cell.span * (last - first)), magnitude(cell.span)
        state = block(entry, d, range(1))
        slack = self.bounds.slack(cell, contact, length, _magnitudes(state)[:, 0] + _magnitudes(before)[:, 0])
        inverse = block(forward, d, range(d)).inv()
        gamma = self.bounds.drift_at_centre(cell, contact, first, last, state)
        pulled = block(frozen, d, range(1)) + inverse * before
        path = Displacement(flow.polynomial(arb_mat(d + 1, 1, [*pulled.entries(), 1])), tuple(arb(0, v * UP) for v in (
            slack.moved[0], slack.moved_rate[0] * whole, slack.moved_curvature * whole**2)))
        self._advance(block(onward, d, range(d)) * inverse, slack.flow, gamma, slack.drift)
        self.leaving = block(leaving, d, range(1)) + self._difference()
        # proves too that z is on its side of the boundaries at both ends, i.e. before and after a window
        clearance(path, contact, first, last, entry[0, 0] + before[0, 0], self.leaving[0, 0])

    def _advance(self, flow: arb_mat, flow_error: np.ndarray, gamma: arb_mat, gamma_error: np.ndarray) -> None:
        """Apply the flow of a piece, and bound the errors after it by the telescoping sum."""
        flow_error = flow_error + _magnitudes(flow - flow.mid())
        gamma_error = gamma_error + _magnitudes(gamma - gamma.mid())
        flow, gamma, d = flow.mid(), gamma.mid(), self.dimension
        both = np.hstack([_magnitudes(self.factor) + self.factor_error, _magnitudes(self.drift) + self.drift_error])
        weight = flow_error @ both
        weight[:, d:] += gamma_error
        self.products = [flow * product for product in self.products] + [unit(d)]
        self.weights.append(weight * UP)
        self.factor, self.drift = flow * self.factor, flow * self.drift + gamma
        error = sum(_magnitudes(p) @ w for p, w in zip(self.products, self.weights, strict=True)) * UP
        self.factor_error, self.drift_error = error[:, :d], error[:, d:]

    def _through(self, window: Window) -> None:
        """Follow the motions through a window.

        γ of a window is the integral of dR/du_j along the motion at the centre, followed by the flow. This differs
        from the unit matrix by at most e^(ηN) - 1.
        """
        duration, d, box = window.high - window.low, self.dimension, self.bounds.box
        states = self._states_in(window, self.leaving)
        growth = (duration * largest_rate(self.bounds)).expm1()
        force, columns = interval(0, states[0, 0] - window.flank), []
        for j in range(self.count):
            rates = (arb_mat(d, d, balls_of(box.matrix, j)) * states).entries()
            wave = arb(0, self.bounds.slopes[j].wave)
            bend = max((magnitude(level.slopes[j]) for level in box.levels), default=0.0)
            for i in range(d):
                push = box.spring[i].slopes[j] * self.bounds.stiffness + box.spring[i].value * arb(0, bend)
                rates[i] += box.constant[i].slopes[j] + (wave if i == 1 else 0) - push * force
            error = arb(0, magnitude(growth) * max(map(magnitude, rates)))
            columns.append([duration * (rate + error) for rate in rates])
        gamma = arb_mat(d, self.count, [columns[j][i] for i in range(d) for j in range(self.count)])
        flow = slopes_through(self.bounds, duration)
        self._advance(flow, np.zeros((d, d)), gamma, np.zeros((d, self.count)))


def united(windows: list[Window]) -> list[Window]:
    """The windows, those of two switches on one flank that overlap as one."""
    out = list[Window]()
    for window in windows:
        before = out[-1] if out else window
        if (before.first == before.last == window.first - 1 and before.flank == window.flank
                and not before.high < window.low):
            out[-1] = replace(before, low=before.low.min(window.low), high=before.high.max(window.high),
                              last=window.last)
        else:
            out.append(window)
    return out


def _magnitudes(matrix: arb_mat) -> np.ndarray:
    """Upper bounds of the absolute values of the entries of a matrix."""
    return np.array([[magnitude(v) for v in row] for row in matrix.tolist()])


def _widened(matrix: arb_mat, error: np.ndarray) -> arb_mat:
    """A matrix with errors added to its radii."""
    rows = zip(matrix.tolist(), error.tolist(), strict=True)
    return arb_mat([[v + arb(0, e) for v, e in zip(row, errors, strict=True)] for row, errors in rows])
