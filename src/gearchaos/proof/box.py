"""The theorem of a periodic orbit for every model in a box of parameters.

For |u_j| <= 1 the unknowns are ξ_k with x_k = c_k + C_k u + ξ_k; C_k is about the derivative of the orbit by u. With
the tubes of `box_tube`, P(c_k + C_k u + ξ; p(u)) = P(c_k; p0) + A_k ξ + B_k u, so that the equations at ξ = 0 are
P(c_k; p0) - c_(k+1) + (B_k - C_(k+1)) u, where the second term is small. Krawczyk's operator is that of `krawczyk`, for
all u at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.errors import InputError
from gearchaos.proof.balls import from_text, to_text
from gearchaos.proof.box_pieces import BoxBounds, UnitBox
from gearchaos.proof.box_tube import BoxTube, box_tube
from gearchaos.proof.candidate import Candidate, column
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.krawczyk import CyclicSystem, float_midpoint
from gearchaos.proof.parameter_box import LEVELS, coefficients
from gearchaos.proof.stability import Stability, stability
from gearchaos.proof.trajectory import Trajectory, trajectory

_LEAST_CONTRACTION = 0.1
_DIFFERENCE = Fraction(1, 2**40)
"""Step, in half-widths of the box, of the differences from which C and the shifts of the switches are computed."""

_RADII = (1.3, 2.0, 4.0, 10.0)
"""Radii that are tried, over the smallest one that is possible to first order."""


@dataclass(frozen=True)
class BoxProof:
    """A periodic orbit that is proved for a box of parameters.

    Attributes
    ----------
    scale : float
        The half-widths proved, over those that were asked for.
    radius : float
        r, the same for all points.
    reach : (n, d)
        \\|C_k\\| summed over u, plus r: all orbits of the box lie this near to c_k.
    stability : Stability
    existence, separation : float or None
        Margins, as in certificates.
    switches : list of int
        Number of contact switches in each mesh period.
    """

    scale: float
    radius: float
    reach: np.ndarray
    stability: Stability
    existence: float
    separation: float | None
    switches: list[int]


class BoxSystem:
    """An orbit at the centre of a box of parameters, with its derivatives by u.

    Parameters
    ----------
    candidate : Candidate
        The orbit, converged to rounding errors.
    widths : list of dict
        For each u_j the parameters that it changes, with their half-widths.
    grazing : bool
        Orbits of the box may graze a contact boundary: their switches are not the same.

    Raises
    ------
    InputError
        If an amplitude of the transmission error that varies is 0 at the centre.
    UndecidedError
        If the motions of the box need other coordinates than those at its centre.
    """

    def __init__(self, candidate: Candidate, widths: list[dict[str, Fraction]], grazing: bool = False) -> None:
        self.candidate, self.widths, self.grazing = candidate, widths, grazing
        self.equations, self.count = candidate.equations, len(widths)
        self._check_amplitudes()
        self._check_coordinates()
        centre = coefficients(self.equations.parameters, self._derivatives(Fraction(1)), at_centre=True)
        self.unit = UnitBox(self.equations, centre, self.count)
        moved = [self._moved(together) for together in widths]
        motions = candidate.trajectories
        changes = [[a.image - b.image for a, b in zip(m, motions, strict=True)] for m in moved]
        steps = [candidate.system.newton_step(change) for change in changes]
        self.drift: np.ndarray = np.stack(steps, axis=2) / float(_DIFFERENCE)
        self.delays = self._delays(moved)

    def bounds(self, scale: Fraction) -> BoxBounds:
        """The bounds of the coefficients in the box with its half-widths times ``scale``."""
        parameters, widths = self.equations.parameters, self._derivatives(scale)
        box, centre = coefficients(parameters, widths), coefficients(parameters, widths, at_centre=True)
        return BoxBounds(self.unit, box, centre, scale)

    def _check_amplitudes(self) -> None:
        """Raise `InputError` if an amplitude varies about 0: the equations at the centre leave its harmonic out."""
        varied = {name for together in self.widths for name in together}
        present = {f"eps{j}" for j in self.equations.harmonics}
        for name in sorted(name for name in varied - present if name.startswith("eps")):
            raise InputError(name, "must not be 0 at the centre of the box", 0.0,
                             "Another width or value moves the centre of the interval of an event.")

    def _check_coordinates(self) -> None:
        """Raise `UndecidedError` if the motions of the box need other coordinates than those at its centre."""
        if coefficients(self.equations.parameters, self._derivatives(Fraction(1))).names != self.equations.names:
            raise UndecidedError("coordinates not the same", 0.0)

    def _derivatives(self, scale: Fraction) -> dict[str, list[Fraction]]:
        """The derivatives of each parameter by u in the box with its half-widths times ``scale``."""
        names = dict.fromkeys(name for together in self.widths for name in together)
        return {name: [together.get(name, Fraction(0)) * scale for together in self.widths] for name in names}

    def _moved(self, together: Mapping[str, Fraction]) -> list[Trajectory]:
        """The motions over a mesh period from the points with parameters moved by a small part of their half-widths."""
        parameters = dict(self.equations.parameters)
        for name, width in together.items():
            parameters = shifted(parameters, name, width * _DIFFERENCE)
        equations = MeshEquations(parameters, self.equations.phase, self.equations.bits)
        return [trajectory(equations, column(point)) for point in self.candidate.points]

    def _delays(self, moved: list[list[Trajectory]]) -> list[np.ndarray]:
        """About the derivatives (S, m) of the times of the switches of each mesh period by u, from the same states."""
        out = []
        for k, motion in enumerate(self.candidate.trajectories):
            rows = np.zeros((len(motion.switches), self.count))
            for j in range(self.count):
                others = moved[j][k].switches
                if len(others) == len(rows):
                    for s, (other, switch) in enumerate(zip(others, motion.switches, strict=True)):
                        rows[s, j] = float((other.time - switch.time).mid()) / float(_DIFFERENCE)
            out.append(rows)
        return out

    @cached_property
    def shifts(self) -> list[np.ndarray]:
        """About the derivatives (S, m) of the times of the switches of each mesh period by u, from c_k + C_k u."""
        return [rows - np.array([float_midpoint(switch.slopes)[0] @ drift / float(switch.rate.mid())
                                 for switch in motion.switches]).reshape(rows.shape)
                for rows, drift, motion in zip(self.delays, self.drift, self.candidate.trajectories, strict=True)]

    def prove(self, scale: Fraction) -> BoxProof:
        """The proof for the box with its half-widths times ``scale``; raises `UndecidedError` if it fails."""
        bounds = self.bounds(scale)
        size = float(scale)
        least = self._residual(self._tubes(bounds, size, 0.0), size)
        failure = UndecidedError("Krawczyk not contracting", 0.0)
        for factor in _RADII:
            try:
                return self._attempt(bounds, size, factor * least + 1e-30)
            except UndecidedError as error:
                failure = error
        raise failure

    def continued(self, radius: float) -> float:
        """Prove that there is exactly one orbit with |ξ_k| <= ``radius`` for every u, without its stability.

        Krawczyk's operator proves too that the derivative of the equations is regular: no multiplier is 1.

        Returns
        -------
        float
            The margin of Krawczyk's operator. Raises `UndecidedError` if it is not positive.
        """
        tubes = self._tubes(self.bounds(Fraction(1)), 1.0, radius)
        defects = self._defects(tubes, 1.0)
        existence = self.candidate.system.margin([t.slopes for t in tubes], defects, radius * (1 - 1e-15))
        if not existence > _LEAST_CONTRACTION:
            raise UndecidedError("Krawczyk not contracting", existence)
        return existence

    def _tubes(self, bounds: BoxBounds, size: float, radius: float) -> list[BoxTube]:
        """The tubes of all mesh periods."""
        d = self.equations.dimension
        return [box_tube(bounds, motion, arb_mat(d, self.count, (size * self.drift[k]).ravel().tolist()), radius,
                         size * self.shifts[k], self.grazing)
                for k, motion in enumerate(self.candidate.trajectories)]

    def _defects(self, tubes: list[BoxTube], size: float) -> list[arb_mat]:
        """The equations at ξ = 0 for all u, each (d, 1)."""
        d, n = self.equations.dimension, self.candidate.period
        unit = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        following = [arb_mat(d, self.count, (size * self.drift[(k + 1) % n]).ravel().tolist()) for k in range(n)]
        return [defect + (tube.by_parameters - after) * unit
                for defect, tube, after in zip(self.candidate.defects, tubes, following, strict=True)]

    def _residual(self, tubes: list[BoxTube], size: float) -> float:
        """About the smallest radius that is possible, from the equations at ξ = 0."""
        defects = [float(v.abs_upper()) for d in self._defects(tubes, size) for v in d.entries()]
        return float((np.abs(self.candidate.system.inverse) @ np.array(defects)).max())

    def _attempt(self, bounds: BoxBounds, size: float, radius: float) -> BoxProof:
        """The proof with a radius."""
        separation = self._separation(size, radius)
        tubes = self._tubes(bounds, size, radius)
        slopes = [tube.slopes for tube in tubes]
        system: CyclicSystem = self.candidate.system
        existence = system.margin(slopes, self._defects(tubes, size), radius * (1 - 1e-15))
        if not existence > _LEAST_CONTRACTION:
            raise UndecidedError("Krawczyk not contracting", existence)
        found = stability(slopes, [t.derivative for t in self.candidate.trajectories])
        return BoxProof(size, radius, self._reach(size, radius), found, existence, separation,
                        [tube.switches for tube in tubes])

    def _reach(self, size: float, radius: float) -> np.ndarray:
        """The largest distances (n, d) of the points of orbits in the box from those at its centre."""
        return (np.abs(self.drift).sum(axis=2) * size + radius) * (1 + 1e-12)

    def _separation(self, size: float, radius: float) -> float | None:
        """The least distance of the first box and that of a proper divisor of the period, over the radius."""
        n, points, reach = self.candidate.period, self.candidate.points, self._reach(size, radius)
        gaps = [max(float(abs(a - b)) * (1 - 1e-12) - reach[0, i] - reach[k, i]
                    for i, (a, b) in enumerate(zip(points[0], points[k], strict=True)))
                for k in range(1, n) if n % k == 0]
        if gaps and min(gaps) <= 0:
            raise UndecidedError("period not minimal", min(gaps))
        return min(gaps) / radius if gaps else None


def shifted(parameters: Mapping[str, Any], name: str, change: Fraction) -> dict[str, Any]:
    """The parameters of a certificate with one changed; ``epsj`` is an amplitude of the transmission error."""
    out = dict(parameters)
    if name in LEVELS:
        out["stiffness"] = {**out["stiffness"], name: to_text(from_text(out["stiffness"][name]) + change)}
    elif name.startswith("eps"):
        amplitudes = list(out["eps"])
        amplitudes[int(name[3:]) - 1] = to_text(from_text(amplitudes[int(name[3:]) - 1]) + change)
        out["eps"] = amplitudes
    else:
        out[name] = to_text(from_text(out[name]) + change)
    return out


def largest_box(system: BoxSystem, most: Fraction, halvings: int = 30, refinements: int = 6) -> BoxProof:
    """The proof for the largest scale up to ``most`` that bisection finds; raises `UndecidedError` if none is."""
    scale, failure = most, UndecidedError("Krawczyk not contracting", 0.0)
    for _ in range(halvings):
        try:
            proof = system.prove(scale)
            break
        except UndecidedError as error:
            failure, scale = error, scale / 2
    else:
        raise failure
    if scale == most:
        return proof
    low, high = scale, 2 * scale
    for _ in range(refinements):
        middle = (low + high) / 2
        try:
            proof, low = system.prove(middle), middle
        except UndecidedError:
            high = middle
    return proof


