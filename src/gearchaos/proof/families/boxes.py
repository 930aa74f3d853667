"""The theorem of a periodic orbit for every model in a box of parameters.

A tube has the motions from c + C u + ξ with |ξ_i| <= r and |u_j| <= 1, where u sets the parameters p(u). Their
difference from the motion at the centre (state c, parameters p0) is A ξ + B u. On a piece i of the mesh period A
becomes Φ A and B becomes Φ B + γ, with Φ and γ known up to bounds ΔΦ_i and Δγ_i, see `coefficients`. By the telescoping
sum the errors of A and B after piece N are at most

    Σ_i |Φ_N ... Φ_(i+1)| ΔΦ_i (|A_i| + ΔA_i)  and  Σ_i |Φ_N ... Φ_(i+1)| (ΔΦ_i (|B_i| + ΔB_i) + Δγ_i),

with the products of the precise matrices at the centre. So bounds are not multiplied by bounds from piece to piece, and
errors do not grow faster than the motions do.

Where motions of the box graze a contact boundary, some touch it twice and others not at all. The windows of the two
switches are then taken as one, before and after which all motions are in the same contact state. Within it a motion may
switch any number of times, since κ is anything from 0 to χ.

The unknowns of an orbit are ξ_k with x_k = c_k + C_k u + ξ_k; C_k is about the derivative of the orbit by u. As
P(c_k + C_k u + ξ; p(u)) = P(c_k; p0) + A_k ξ + B_k u, the equations at ξ = 0 are P(c_k; p0) - c_(k+1) +
(B_k - C_(k+1)) u, where the second term is small. Krawczyk's operator is that of `candidate`, for all u at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import block, from_columns, interval, magnitude, precision, texts, unit
from gearchaos.proof.candidate import Candidate, column, converged, float_midpoint
from gearchaos.proof.certificate import Theorem, UndecidedError, Unproved, first_proved, with_checksum
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.coefficients import UP, BoxBounds, ParameterBox, balls_of, shifted
from gearchaos.proof.motion import Displacement, Trajectory, clearance, trajectory
from gearchaos.proof.parameters import exact_parameters, lifted
from gearchaos.proof.stability import Stability, stability
from gearchaos.proof.tube import WIDENING, Tube, Window, largest_rate, slopes_through, speed_at

FORMAT, VERSION = "gearchaos box certificate", 1

# Step, in half-widths of the box, of the differences from which C and the shifts of the switches are computed:
_DIFFERENCE = Fraction(1, 2**40)
_RADII = (1.3, 2.0, 4.0, 10.0)  # radii tried, over the smallest one that is possible to first order
# Most halvings of a box until one is proved, and steps of the bisection for the largest one after it:
_HALVINGS, _REFINEMENTS = 30, 6


class ParameterTube(Tube):
    """The motions over one mesh period from the section on.

    ``centre`` is the motion from c at the centre of the box of parameters, ``drift`` (d, m) is C, ``radius`` r.
    ``shifts`` (S, m) are about the derivatives by u of the times of the switches, for the starts c + C u: they set the
    widths of the windows. With ``grazing``, overlapping windows of two switches on one flank are taken as one.

    ``slopes`` (d, d) is A: it contains S with P(x; p) - P(y; p) = S (x - y) for all states of the box and all p.
    ``by_parameters`` (d, m) is B. ``switches`` is the number of windows: where none is that of a graze, the number of
    contact switches of every motion.
    """

    def __init__(self, bounds: BoxBounds, centre: Trajectory, drift: np.ndarray, radius: float, shifts: np.ndarray,
                 grazing: bool = False) -> None:
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
            windows.append(self._window(number, WIDENING * spread + 2.0 ** (24 - self.equations.bits), 12))
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
        self._advance(block(onward, d, range(d)) * inverse, gamma, slack.flow, slack.drift)
        self.leaving = block(leaving, d, range(1)) + self._difference()
        # proves too that z is on its side of the boundaries at both ends, i.e. before and after a window
        clearance(path, contact, first, last, entry[0, 0] + before[0, 0], self.leaving[0, 0])

    def _advance(self, flow: arb_mat, gamma: arb_mat, flow_error: np.ndarray | float = 0.0,
                 gamma_error: np.ndarray | float = 0.0) -> None:
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
        states, _ = self._states_in(window, self.leaving)
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
        self._advance(slopes_through(self.bounds, duration), from_columns(columns))


def united(windows: list[Window]) -> list[Window]:
    """The windows, those of two switches on one flank that overlap as one."""
    out = list[Window]()
    for w in windows:
        before = out[-1] if out else w
        if before.first == before.last == w.first - 1 and before.flank == w.flank and not before.high < w.low:
            out[-1] = replace(before, low=before.low.min(w.low), high=before.high.max(w.high), last=w.last)
        else:
            out.append(w)
    return out


def _magnitudes(matrix: arb_mat) -> np.ndarray:
    """Upper bounds of the absolute values of the entries of a matrix."""
    return np.array([[magnitude(v) for v in row] for row in matrix.tolist()])


def _widened(matrix: arb_mat, error: np.ndarray) -> arb_mat:
    """A matrix with errors added to its radii."""
    rows = zip(matrix.tolist(), error.tolist(), strict=True)
    return arb_mat([[v + arb(0, e) for v, e in zip(row, errors, strict=True)] for row, errors in rows])


@dataclass(frozen=True, eq=False)
class BoxCertificate(Theorem):
    """A periodic orbit that is proved for every model in a box of parameters."""

    scale = property(lambda self: self.document["scale"], doc="The half-widths of the box proved over those asked for.")
    period = property(lambda self: self.document["period"], doc="The minimal period in mesh periods.")
    reach = property(lambda self: np.array(self.document["reach"]),
                     doc="How far at most the orbits of the box lie from the points, (n, d).")
    widths = property(lambda self: {name: float.fromhex(text) for name, text in self.document["box"].items()},
                      doc="The half-widths of the box proved, by the names given.")
    points = property(lambda self: np.array([[float.fromhex(v) for v in point] for point in self.document["points"]]),
                      doc="The points (n, d) about which the orbits lie.")

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        return self.selected("theorem", "period", "box", "scale", "radius", "bits", "margins")

    def __repr__(self) -> str:
        return f"BoxCertificate({self.period}T, {self.widths})"


class BoxProof(NamedTuple):
    """A periodic orbit that is proved for a box of parameters; margins are those of certificates."""

    scale: float  # the half-widths proved, over those that were asked for
    radius: float  # r, the same for all points
    reach: np.ndarray  # (n, d), |C_k| summed over u, plus r: all orbits of the box lie this near to c_k
    stability: Stability
    existence: float
    separation: float | None
    switches: list[int]  # number of contact switches in each mesh period


class BoxSystem:
    """An orbit at the centre of a `ParameterBox`, with its derivatives by u.

    ``candidate`` is the orbit, converged to rounding errors. With ``grazing`` orbits of the box may graze a contact
    boundary: their switches are not the same. ``drift`` (n, d, m) are the C_k, ``delays`` for each mesh period about
    the derivatives (S, m) of the times of its switches by u, from the same states.
    """

    def __init__(self, candidate: Candidate, widths: list[dict[str, Fraction]], grazing: bool = False) -> None:
        self.candidate, self.widths, self.grazing = candidate, widths, grazing
        self.equations, self.count = candidate.equations, len(widths)
        self.unit = ParameterBox(self.equations, widths)
        motions = candidate.trajectories
        self.delays = [np.zeros((len(motion.switches), self.count)) for motion in motions]
        steps = []
        for j, together in enumerate(widths):
            changes = {name: width * _DIFFERENCE for name, width in together.items()}
            beside = MeshEquations(shifted(self.equations.parameters, changes), self.equations.phase,
                                   self.equations.bits)
            moved = [trajectory(beside, column(point)) for point in candidate.points]
            differences = [a.image - b.image for a, b in zip(moved, motions, strict=True)]
            steps.append(candidate.system.newton_step(differences))
            for rows, other, motion in zip(self.delays, moved, motions, strict=True):
                if len(other.switches) == len(rows):
                    rows[:, j] = [float((a.time - b.time).mid()) / float(_DIFFERENCE)
                                  for a, b in zip(other.switches, motion.switches, strict=True)]
        self.drift: np.ndarray = np.stack(steps, axis=2) / float(_DIFFERENCE)

    @cached_property
    def shifts(self) -> list[np.ndarray]:
        """About the derivatives (S, m) of the times of the switches of each mesh period by u, from c_k + C_k u."""
        return [rows - np.array([float_midpoint(switch.slopes)[0] @ drift / float(switch.rate.mid())
                                 for switch in motion.switches]).reshape(rows.shape)
                for rows, drift, motion in zip(self.delays, self.drift, self.candidate.trajectories, strict=True)]

    def bounds(self, scale: Fraction) -> BoxBounds:
        return BoxBounds(self.unit, scale)

    def prove(self, scale: Fraction) -> BoxProof:
        """The proof for the box with its half-widths times ``scale``; raises `UndecidedError` if it fails."""
        bounds, size = self.bounds(scale), float(scale)
        defects = [float(v.abs_upper()) for d in self._defects(self._tubes(bounds, size, 0.0), size)
                   for v in d.entries()]
        least = float((np.abs(self.candidate.system.inverse) @ np.array(defects)).max())  # to first order

        def at(factor: float) -> BoxProof:
            radius = factor * least + 1e-30
            reach = (np.abs(self.drift).sum(axis=2) * size + radius) * (1 + 1e-12)
            separation = self.candidate.separation(radius, reach)
            tubes, existence = self._existence(bounds, size, radius)
            found = stability([t.slopes for t in tubes], [t.derivative for t in self.candidate.trajectories])
            return BoxProof(size, radius, reach, found, existence, separation, [t.switches for t in tubes])

        return first_proved(at, _RADII, "Krawczyk not contracting")

    def continued(self, radius: float) -> float:
        """Prove that there is exactly one orbit with |ξ_k| <= ``radius`` for every u, without its stability.

        Krawczyk's operator proves too that the derivative of the equations is regular: no multiplier is 1. The result
        is its margin. Raises `UndecidedError` if that is not positive.
        """
        return self._existence(self.bounds(Fraction(1)), 1.0, radius)[1]

    def _existence(self, bounds: BoxBounds, size: float, radius: float) -> tuple[list[ParameterTube], float]:
        """The tubes of all mesh periods, and the margin of Krawczyk's operator, which is proved to be large enough."""
        tubes = self._tubes(bounds, size, radius)
        slopes = [t.slopes for t in tubes]
        return tubes, self.candidate.system.contraction(slopes, self._defects(tubes, size), radius)

    def _tubes(self, bounds: BoxBounds, size: float, radius: float) -> list[ParameterTube]:
        return [ParameterTube(bounds, motion, size * self.drift[k], radius, size * self.shifts[k], self.grazing)
                for k, motion in enumerate(self.candidate.trajectories)]

    def _defects(self, tubes: list[ParameterTube], size: float) -> list[arb_mat]:
        """The equations at ξ = 0 for all u, each (d, 1)."""
        d, n = self.equations.dimension, self.candidate.period
        unit = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        following = [arb_mat(d, self.count, (size * self.drift[(k + 1) % n]).ravel().tolist()) for k in range(n)]
        return [defect + (tube.by_parameters - after) * unit
                for defect, tube, after in zip(self.candidate.defects, tubes, following, strict=True)]


def prove_parameter_box(model: MeshModel, points: np.ndarray, widths: Mapping[str, dict[str, Fraction]],
                        bits: int) -> BoxCertificate | Unproved:
    """Prove a periodic orbit for all models in a box of parameters, the largest up to the one asked for.

    ``model`` is the centre of the box, ``points`` (n, d) are approximate states at τ = k T. ``widths`` has for each
    name the parameters that change together, with their half-widths.
    """
    with precision(bits):
        try:
            equations = MeshEquations(exact_parameters(model), bits=bits)
            candidate = converged(equations, lifted(points, equations.names))
            if candidate is None:
                return Unproved("Newton diverged", 0.0, bits)
            system = BoxSystem(candidate, list(widths.values()))
            scales = [Fraction(1, 2**k) for k in range(_HALVINGS)]
            low, proof = first_proved(lambda scale: (scale, system.prove(scale)), scales, "Krawczyk not contracting")
            high = 2 * low
            for _ in range(_REFINEMENTS if low < 1 else 0):
                middle = (low + high) / 2
                try:
                    proof, low = system.prove(middle), middle
                except UndecidedError:
                    high = middle
            return _certificate(system, list(widths), proof)
        except UndecidedError as failure:
            return failure.unproved(bits)


def _certificate(system: BoxSystem, names: list[str], proof: BoxProof) -> BoxCertificate:
    """The certificate of a proof for a box with these names of the u_j."""
    equations, candidate, sizes = system.equations, system.candidate, []
    for together in system.widths:  # rounded down, so that words say no more than what is proved
        size = next(iter(together.values())) * Fraction(proof.scale)
        sizes.append(float(size) if float(size) <= size else math.nextafter(float(size), -math.inf))
    n, outside, box = candidate.period, proof.stability.outside, ", ".join(
        f"{' and '.join(together)} by {'the same amount of ' if len(together) > 1 else ''}up to {size}"
        for together, size in zip(system.widths, sizes, strict=True))
    stable = f"It has {outside} multipliers outside the unit circle" if outside else "It is stable in its coordinates"
    theorem = " ".join((
        f"For every {equations.parameters['kind']} model whose parameters differ from those below in {box} there is",
        f"an orbit of period {n} mesh periods, and no fewer, whose states at tau = k T lie in the boxes listed: within",
        "'reach' of the points, and within 'radius' of the points displaced by the derivatives. It is the",
        f"only orbit of period {n} there.",
        f"{stable}, and its teeth switch contact {sum(proof.switches)} times.",
    ))
    return BoxCertificate(with_checksum({
        "format": FORMAT, "version": VERSION, "theorem": theorem,
        "model": dict(equations.parameters), "scale": proof.scale,
        "box": {name: size.hex() for name, size in zip(names, sizes, strict=True)},
        "together": [sorted(names) for names in system.widths], "coordinates": list(equations.names),
        "period": n, "points": texts(candidate.points),
        "derivatives": [[[float(v).hex() for v in row] for row in point] for point in proof.scale * system.drift],
        "radius": proof.radius, "reach": proof.reach.tolist(), "bits": equations.bits, "switches": proof.switches,
        "stability": proof.stability.document(),
        "margins": {"existence": proof.existence, "separation": proof.separation, "stability": proof.stability.margin},
    }))
