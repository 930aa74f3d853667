"""The theorem of a periodic orbit for every model in a box of parameters.

For |u_j| <= 1 the unknowns are ξ_k with x_k = c_k + C_k u + ξ_k; C_k is about the derivative of the orbit by u. With
the tubes of `parameter_tube`, P(c_k + C_k u + ξ; p(u)) = P(c_k; p0) + A_k ξ + B_k u, so that the equations at ξ = 0 are
P(c_k; p0) - c_(k+1) + (B_k - C_(k+1)) u, where the second term is small. Krawczyk's operator is that of `candidate`,
for all u at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import precision, texts
from gearchaos.proof.candidate import Candidate, column, converged, float_midpoint
from gearchaos.proof.certificate import Theorem, Unproved, with_checksum
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.coefficients import ParameterBox, shifted
from gearchaos.proof.families.parameter_tube import BoxBounds, ParameterTube
from gearchaos.proof.parameters import exact_parameters, lifted
from gearchaos.proof.stability import Stability, stability
from gearchaos.proof.tube import trajectory

FORMAT, VERSION = "gearchaos box certificate", 1

_DIFFERENCE = Fraction(1, 2**40)
"""Step, in half-widths of the box, of the differences from which C and the shifts of the switches are computed."""

_RADII = (1.3, 2.0, 4.0, 10.0)
"""Radii tried, over the smallest one that is possible to first order."""

_HALVINGS, _REFINEMENTS = 30, 6
"""Most halvings of a box until one is proved, and steps of the bisection for the largest one after it."""


@dataclass(frozen=True, eq=False)
class BoxCertificate(Theorem):
    """A periodic orbit that is proved for every model in a box of parameters."""

    @property
    def scale(self) -> float:
        """The half-widths of the box proved over those asked for."""
        return self.document["scale"]

    @property
    def widths(self) -> dict[str, float]:
        """The half-widths of the box proved, by the names given."""
        return {name: float.fromhex(text) for name, text in self.document["box"].items()}

    @property
    def period(self) -> int:
        """The minimal period in mesh periods."""
        return self.document["period"]

    @property
    def points(self) -> np.ndarray:
        """The points (n, d) about which the orbits lie."""
        return np.array([[float.fromhex(text) for text in point] for point in self.document["points"]])

    @property
    def reach(self) -> np.ndarray:
        """How far at most the orbits of the box lie from the points, (n, d)."""
        return np.array(self.document["reach"])

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        return self.selected("theorem", "period", "box", "scale", "radius", "bits", "margins")

    def __repr__(self) -> str:
        return f"BoxCertificate({self.period}T, {self.widths})"


@dataclass(frozen=True)
class BoxProof:
    """A periodic orbit that is proved for a box of parameters; margins are those of certificates."""

    scale: float  # the half-widths proved, over those that were asked for
    radius: float  # r, the same for all points
    reach: np.ndarray  # (n, d), |C_k| summed over u, plus r: all orbits of the box lie this near to c_k
    stability: Stability
    existence: float
    separation: float | None
    switches: list[int]  # number of contact switches in each mesh period


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

    Attributes
    ----------
    drift : (n, d, m)
        C_k.
    delays : list of (S, m)
        For each mesh period about the derivatives of the times of its switches by u, from the same states.

    Raises
    ------
    InputError, UndecidedError
        As for `ParameterBox`.
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
            steps.append(candidate.system.newton_step([a.image - b.image
                                                       for a, b in zip(moved, motions, strict=True)]))
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
        """The bounds of the coefficients in the box with its half-widths times ``scale``."""
        return BoxBounds(self.unit, scale)

    def prove(self, scale: Fraction) -> BoxProof:
        """The proof for the box with its half-widths times ``scale``; raises `UndecidedError` if it fails."""
        bounds, size = self.bounds(scale), float(scale)
        defects = [float(v.abs_upper()) for d in self._defects(self._tubes(bounds, size, 0.0), size)
                   for v in d.entries()]
        least = float((np.abs(self.candidate.system.inverse) @ np.array(defects)).max())  # to first order
        failure = UndecidedError("Krawczyk not contracting", 0.0)
        for factor in _RADII:
            radius = factor * least + 1e-30
            try:
                reach = (np.abs(self.drift).sum(axis=2) * size + radius) * (1 + 1e-12)
                separation = self._separation(reach, radius)
                tubes, existence = self._existence(bounds, size, radius)
                found = stability([t.slopes for t in tubes], [t.derivative for t in self.candidate.trajectories])
                return BoxProof(size, radius, reach, found, existence, separation, [t.switches for t in tubes])
            except UndecidedError as error:
                failure = error
        raise failure

    def continued(self, radius: float) -> float:
        """Prove that there is exactly one orbit with |ξ_k| <= ``radius`` for every u, without its stability.

        Krawczyk's operator proves too that the derivative of the equations is regular: no multiplier is 1. The result
        is its margin. Raises `UndecidedError` if that is not positive.
        """
        return self._existence(self.bounds(Fraction(1)), 1.0, radius)[1]

    def _existence(self, bounds: BoxBounds, size: float, radius: float) -> tuple[list[ParameterTube], float]:
        """The tubes of all mesh periods, and the margin of Krawczyk's operator, which is proved to be large enough."""
        tubes = self._tubes(bounds, size, radius)
        slopes, defects = [t.slopes for t in tubes], self._defects(tubes, size)
        return tubes, self.candidate.system.contraction(slopes, defects, radius)

    def _tubes(self, bounds: BoxBounds, size: float, radius: float) -> list[ParameterTube]:
        """The tubes of all mesh periods."""
        return [ParameterTube(bounds, motion, size * self.drift[k], radius, size * self.shifts[k], self.grazing)
                for k, motion in enumerate(self.candidate.trajectories)]

    def _defects(self, tubes: list[ParameterTube], size: float) -> list[arb_mat]:
        """The equations at ξ = 0 for all u, each (d, 1)."""
        d, n = self.equations.dimension, self.candidate.period
        unit = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        following = [arb_mat(d, self.count, (size * self.drift[(k + 1) % n]).ravel().tolist()) for k in range(n)]
        return [defect + (tube.by_parameters - after) * unit
                for defect, tube, after in zip(self.candidate.defects, tubes, following, strict=True)]

    def _separation(self, reach: np.ndarray, radius: float) -> float | None:
        """The least distance of the first box and that of a proper divisor of the period, over the radius."""
        n, points = self.candidate.period, self.candidate.points
        gaps = [max(float(abs(a - b)) * (1 - 1e-12) - reach[0, i] - reach[k, i]
                    for i, (a, b) in enumerate(zip(points[0], points[k], strict=True)))
                for k in range(1, n) if n % k == 0]
        if gaps and min(gaps) <= 0:
            raise UndecidedError("period not minimal", min(gaps))
        return min(gaps) / radius if gaps else None


def prove_parameter_box(
    model: MeshModel, points: np.ndarray, widths: Mapping[str, dict[str, Fraction]], bits: int
) -> BoxCertificate | Unproved:
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
            return _certificate(system, list(widths), _largest(system))
        except UndecidedError as failure:
            return Unproved(failure.reason, failure.margin, bits)


def _largest(system: BoxSystem) -> BoxProof:
    """The proof for the largest scale up to 1 that bisection finds; raises `UndecidedError` if none is."""
    scale, failure = Fraction(1), UndecidedError("Krawczyk not contracting", 0.0)
    for _ in range(_HALVINGS):
        try:
            proof = system.prove(scale)
            break
        except UndecidedError as error:
            failure, scale = error, scale / 2
    else:
        raise failure
    low, high = scale, 2 * scale
    for _ in range(_REFINEMENTS if scale < 1 else 0):
        middle = (low + high) / 2
        try:
            proof, low = system.prove(middle), middle
        except UndecidedError:
            high = middle
    return proof


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
