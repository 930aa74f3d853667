"""The proof of a periodic orbit: from approximate points at the sections to a certificate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from gearchaos.errors import InputError, whole_number
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import LEAST_BITS, MOST_BITS, precision, to_fraction, to_text
from gearchaos.proof.candidate import Candidate
from gearchaos.proof.certificate import FORMAT, VERSION, Certificate, Unproved, used_versions
from gearchaos.proof.coordinates import lifted
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations, equations_at
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.stability import Stability, stability
from gearchaos.proof.tube import Tube, Window, period_tube
from gearchaos.proof.verifier import sealed

_PRECISIONS = (128, 192, 256, 384, 512, 768)
"""Precisions in bits that are tried after the first one."""

_FIRST_SPREAD = 1e-3
"""The first radius tried is about this over the norm of the inverse of the linearised system."""

_STEPS = (0, 1, 2, 4, 6, 9, 13, 18, 24, 32, 42, 56, 76, 96, 126, 166, 216, 276, 356, 456, 596, 796, 996, 1196)
"""Steps from the first exponent, until a radius is proved; the largest one is then found by bisection."""

_LEAST_CONTRACTION = 0.1
"""Least margin of Krawczyk's operator."""

_CELLS_PER_POWER = 24
"""Cells of the mesh period for which the radius of a certificate is made smaller by a power of 10."""

_CLAIMED_SHARE = 0.1
"""Share of the margins found that a certificate claims, so that other methods can confirm them."""

_SHARE_OF_BITS = 0.55
"""The least radius tried is 2^(-_SHARE_OF_BITS bits)."""

_RADII_COMPARED = 3
"""Number of radii, one after the other, that must fail by the same margin before the search is given up."""

_FINE = 1e-9
"""A proof that fails by less than this at the least radius may succeed at a smaller one, with a higher precision."""

_DEPEND_ON_RADIUS = ("section on the contact boundary", "tangency undecided", "windows overlap")
"""The reasons for failure that a smaller radius may remove."""


@dataclass(frozen=True)
class _Proof:
    """All that is proved at the radius 10^-exponent."""

    exponent: int
    candidate: Candidate
    tubes: list[Tube]
    stability: Stability
    existence: float
    separation: float | None


def prove_orbit(
    model: MeshModel, points: np.ndarray, bits: int = 128, phase: float = 0.0, *, max_bits: int = 512
) -> Certificate | Unproved:
    """Prove that there is a periodic orbit near given points, the only one there, and count its multipliers.

    Parameters
    ----------
    model : MeshModel
        Its parameters are taken as exactly the floats they are. Initial values have no effect.
    points : (n, d)
        Approximate states w at τ = (k + phase) T, k = 0, ..., n - 1, for the minimal period n, in the coordinates of
        ``docs/model.md``.
    bits : int
        First precision, 53 to 800.
    phase : float
        In [0, 1).
    max_bits : int
        Largest precision, tried where rounding errors may be the cause of a failure.

    Returns
    -------
    Certificate or Unproved

    Raises
    ------
    InputError
        If an argument has a wrong shape or is out of range.
    """
    points = _checked_points(points)
    whole_number("bits", bits, LEAST_BITS, MOST_BITS)
    whole_number("max_bits", max_bits, LEAST_BITS, MOST_BITS)
    if not 0 <= phase < 1:
        raise InputError("phase", "must be in [0, 1)", phase, "It is a share of the mesh period.")
    parameters = exact_parameters(model)
    for tried in (bits, *(b for b in _PRECISIONS if bits < b <= max_bits)):
        try:
            equations, working = equations_at(parameters, Fraction(phase), tried)
        except UndecidedError as failure:
            return Unproved(failure.reason, failure.margin, tried)
        with precision(working):
            try:
                return _attempt(_candidate(equations, points))
            except UndecidedError as failure:
                unproved = Unproved(failure.reason, failure.margin, tried)
        if not _rounding_may_be_the_cause(unproved):
            break
    return unproved


def _rounding_may_be_the_cause(result: Unproved) -> bool:
    """Whether a proof failed by so little that it may succeed at a higher precision."""
    fine = abs(result.margin) < _FINE and result.reason in _DEPEND_ON_RADIUS
    return fine or result.reason == "bits exhausted"


def _checked_points(points: Any) -> np.ndarray:
    """The points as a finite array (n, d); raises `InputError` for anything else."""
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or not array.size:
        raise InputError("points", "must be an array (n, d)", array.shape, "One row for each mesh period of the orbit.")
    if not np.isfinite(array).all():
        raise InputError("points", "must be finite", array)
    return array


def _candidate(equations: MeshEquations, points: np.ndarray) -> Candidate:
    """The candidate with points (n, d) in the coordinates of the equations.

    Coordinates that the points lack obey linear equations: one step of Newton's method finds them.
    """
    candidate = Candidate.at(equations, lifted(points, equations))
    return candidate if points.shape[1] == equations.dimension else candidate.corrected()


def _attempt(candidate: Candidate) -> Certificate:
    """The certificate of an orbit at one precision, for a radius by `_room` smaller than the largest 10^-k proved.

    Raises `UndecidedError` if no radius is.
    """
    failed, failures = 0, list[UndecidedError]()
    for exponent in _exponents(candidate):
        try:
            proof = _proof(candidate, exponent)
        except UndecidedError as failure:
            failed = exponent
            failures.append(failure)
            if _does_not_depend_on_radius(failures):
                break
            continue
        largest = _enlarged(proof, failed)
        return _certificate(_proof(largest.candidate, largest.exponent + _room(candidate.equations)))
    raise failures[-1]


def _room(equations: MeshEquations) -> int:
    """Powers of 10 between the largest radius proved and that of the certificate.

    They leave room for other methods, whose slopes have wider balls the more steps a mesh period needs.
    """
    return 1 + len(equations.cells) // _CELLS_PER_POWER


def _exponents(candidate: Candidate) -> Iterator[int]:
    """The exponents k of the radii 10^-k to try."""
    most = int(_SHARE_OF_BITS * candidate.equations.bits * math.log10(2))
    norm = min(candidate.system.norm, 1e300)
    first = min(max(2, round(math.log10(norm / _FIRST_SPREAD))), most)
    return (first + step for step in _STEPS if first + step <= most)


def _does_not_depend_on_radius(failures: list[UndecidedError]) -> bool:
    """Whether the last three radii failed by the same margin, so that smaller ones fail too."""
    if len(failures) < _RADII_COMPARED:
        return False
    last = failures[-1]
    return all(f.reason == last.reason and abs(f.margin - last.margin) <= 0.01 * abs(last.margin)
               for f in failures[-_RADII_COMPARED:])


def _enlarged(proof: _Proof, failed: int) -> _Proof:
    """The proof with the largest radius, from one that succeeded and a larger radius, 10^-failed, that did not.

    If no radius has failed (``failed`` is 0), larger ones are tried one by one.
    """
    while proof.exponent - failed > 1:
        trial = (proof.exponent + failed) // 2 if failed else proof.exponent - 1
        try:
            proof = _proof(proof.candidate, trial)
        except UndecidedError:
            failed = trial
    return proof


def _proof(candidate: Candidate, exponent: int) -> _Proof:
    """The proof at a radius 10^-exponent; raises `UndecidedError` if it fails."""
    radius = Fraction(1, 10**exponent)
    candidate = candidate.refined(1e-3 * float(radius))
    separation = _separation(candidate, radius)
    tubes = [period_tube(candidate.equations, candidate.box(k, radius), candidate.trajectories[k])
             for k in range(candidate.period)]
    slopes = [tube.slopes for tube in tubes]
    existence = candidate.system.margin(slopes, candidate.defects, float(radius) * (1 - 1e-15))
    if not existence > _LEAST_CONTRACTION:
        raise UndecidedError("Krawczyk not contracting", existence)
    found = stability(slopes, [t.derivative for t in candidate.trajectories])
    return _Proof(exponent, candidate, tubes, found, existence, separation)


def _separation(candidate: Candidate, radius: Fraction) -> float | None:
    """The least distance of the first cube and that of a proper divisor of the period, over the radius.

    It is None for period 1. Raises `UndecidedError` if two cubes may overlap.
    """
    n, first = candidate.period, candidate.points[0]
    gaps = [max(abs(a - b) for a, b in zip(first, candidate.points[k], strict=True)) - 2 * radius
            for k in range(1, n) if n % k == 0]
    if not gaps:
        return None
    if min(gaps) <= 0:
        raise UndecidedError("period not minimal", float(min(gaps)))
    return float(min(gaps) / radius)


def _certificate(proof: _Proof) -> Certificate:
    """The certificate of a proof."""
    candidate, stable = proof.candidate, proof.stability
    equations = candidate.equations
    margins = {
        "existence": proof.existence, "separation": proof.separation,
        "contact": min(min(t.margins.values()) for t in proof.tubes), "stability": stable.margin,
    }
    matrices = [[[to_text(Fraction(v)) for v in row] for row in q] for q in stable.matrices.tolist()]
    return Certificate(sealed({
        "format": FORMAT, "version": VERSION, "model": dict(equations.parameters), "coordinates": list(equations.names),
        "phase": to_text(equations.phase), "period": len(candidate.points),
        "points": [[to_text(v) for v in point] for point in candidate.points],
        "radius": f"1e-{proof.exponent}", "bits": equations.bits,
        "switches": [[_switch(window) for window in tube.windows] for tube in proof.tubes],
        "stability": {"inside": stable.inside, "outside": stable.outside, "Q": matrices},
        "margins": {name: None if v is None else f"{_CLAIMED_SHARE * v:.3e}" for name, v in margins.items()},
        "versions": used_versions(),
    }))


def _switch(window: Window) -> dict[str, Any]:
    """A window as it stands in a certificate."""
    low, high = to_fraction(window.low), to_fraction(window.high)
    return {"time": [to_text((low + high) / 2), to_text((high - low) / 2)], "flank": window.flank,
            "into": "contact" if window.into_contact else "free"}
