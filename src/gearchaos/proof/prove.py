"""The proof of a periodic orbit: from approximate points at the sections to a certificate."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb_mat

from gearchaos.errors import InputError, whole_number
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import LEAST_BITS, MOST_BITS, ball, precision, texts, to_fraction, to_text
from gearchaos.proof.candidate import Candidate, float_midpoint
from gearchaos.proof.certificate import FORMAT, VERSION, Certificate, UndecidedError, Unproved, used_versions
from gearchaos.proof.equations import MeshEquations, equations_at
from gearchaos.proof.motion import trajectory
from gearchaos.proof.parameters import exact_parameters, lifted
from gearchaos.proof.stability import Stability, stability
from gearchaos.proof.tube import StartTube, Window
from gearchaos.proof.verifier import sealed

_PRECISIONS = (128, 192, 256, 384, 512, 768)  # precisions in bits that are tried after the first one
_FIRST_SPREAD = 1e-3  # the first radius tried is about this over the norm of the inverse of the linearised system
# Steps from the first exponent, until a radius is proved; the largest one is then found by bisection:
_STEPS = (0, 1, 2, 4, 6, 9, 13, 18, 24, 32, 42, 56, 76, 96, 126, 166, 216, 276, 356, 456, 596, 796, 996, 1196)
_CELLS_PER_POWER = 24  # cells of the mesh period for which the radius of a certificate is made smaller by a power of 10
_CLAIMED_SHARE = 0.1  # share of the margins found that a certificate claims, so that other methods can confirm them
_SHARE_OF_BITS = 0.55  # the least radius tried is 2^(-_SHARE_OF_BITS bits)
# Number of radii, one after the other, that must fail by the same margin before the search is given up:
_RADII_COMPARED = 3
# A proof that fails by less than this at the least radius may succeed at a smaller one, with a higher precision:
_FINE = 1e-9
# The reasons for failure that a smaller radius may remove:
_DEPEND_ON_RADIUS = ("section on the contact boundary", "tangency undecided", "windows overlap")
_OTHER_PHASES = (0.375, 0.15625, 0.71875)  # phases of the section that are tried where teeth may just touch at τ = k T
_BITS_OF_PHASE = 128
# A point on a contact boundary is moved by this in its velocity direction; Newton's method corrects it:
_OFF_BOUNDARY = 1e-11


class _Proof(NamedTuple):
    """All that is proved at the radius 10^-exponent."""

    exponent: int
    candidate: Candidate
    tubes: list[StartTube]
    stability: Stability
    existence: float
    separation: float | None


def prove_orbit(model: MeshModel, points: np.ndarray, bits: int = 128, phase: float = 0.0, *,
                max_bits: int = 512) -> Certificate | Unproved:
    """Prove that there is a periodic orbit near given points, the only one there, and count its multipliers.

    The parameters of the model are taken as exactly the floats they are; its initial values have no effect. ``points``
    (n, d) are approximate states w at τ = (k + phase) T, k = 0, ..., n - 1, for the minimal period n, in the
    coordinates of ``docs/model.md``. ``bits`` is the first precision, ``max_bits`` the largest one, tried where
    rounding errors may be the cause of a failure.
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or not points.size:
        raise InputError("points", "must be an array (n, d)", points.shape,
                         "One row for each mesh period of the orbit.")
    if not np.isfinite(points).all():
        raise InputError("points", "must be finite", points)
    whole_number("bits", bits, LEAST_BITS, MOST_BITS)
    whole_number("max_bits", max_bits, LEAST_BITS, MOST_BITS)
    if not 0 <= phase < 1:
        raise InputError("phase", "must be in [0, 1)", phase, "It is a share of the mesh period.")
    parameters = exact_parameters(model)
    for tried in (bits, *(b for b in _PRECISIONS if bits < b <= max_bits)):
        try:
            equations, working = equations_at(parameters, Fraction(phase), tried)
        except UndecidedError as failure:
            return failure.unproved(tried)
        with precision(working):
            try:
                candidate = Candidate.at(equations, lifted(points, equations.names))
                if points.shape[1] != equations.dimension:  # missing coordinates obey linear equations: one step does
                    candidate = candidate.corrected()
                return _certificate(_with_largest_radius(candidate))
            except UndecidedError as failure:
                unproved = failure.unproved(tried)
        if unproved.reason != "bits exhausted" and not (
                abs(unproved.margin) < _FINE and unproved.reason in _DEPEND_ON_RADIUS):
            break
    return unproved


def prove_at_some_phase(model: MeshModel, points: np.ndarray, bits: int = 128) -> Certificate | Unproved:
    """As `prove_orbit`, from the states (n, d) at τ = k T, or where these are on a contact boundary at other times."""
    result = prove_orbit(model, points, bits)
    for phase in _OTHER_PHASES:
        if not isinstance(result, Unproved) or result.reason != "section on the contact boundary":
            break
        if (shifted := at_phase(model, points, phase)) is not None:
            result = prove_orbit(model, shifted, bits, phase)
    return result


def at_phase(model: MeshModel, points: np.ndarray, phase: float) -> np.ndarray | None:
    """Approximate states w (n, d) at τ = (k + phase) T from those at τ = k T; None if they cannot be computed."""
    with precision(_BITS_OF_PHASE):
        equations = MeshEquations(exact_parameters(model), bits=_BITS_OF_PHASE)
        time, out = Fraction(phase), []
        cell = max(i for i, c in enumerate(equations.cells) if c.start <= time)
        share = ball((time - equations.cells[cell].start) / equations.cells[cell].length)
        for point in lifted(points, equations.names):
            state = [ball(value) for value in point]
            state[0] += _OFF_BOUNDARY * (1 if state[1] > 0 else -1)
            try:
                motion = trajectory(equations, arb_mat(len(state), 1, state))
            except UndecidedError:
                return None
            part = sum(bool(switch.time < ball(time)) for switch in motion.switches)
            out.append(float_midpoint(motion.at(equations, part, cell, share))[:-1, 0])
    return np.array(out)


def _with_largest_radius(candidate: Candidate) -> _Proof:
    """The proof for a radius smaller than the largest 10^-k for which there is one, by powers of 10 that leave room.

    The room is for other methods, whose slopes have wider balls the more steps a mesh period needs. Raises
    `UndecidedError` if no radius is proved.
    """
    equations, failed, failures = candidate.equations, 0, list[UndecidedError]()
    most = int(_SHARE_OF_BITS * equations.bits * math.log10(2))
    norm = float(np.abs(candidate.system.inverse).sum(axis=1).max())  # of corrections over defects
    first = min(max(2, round(math.log10(min(norm, 1e300) / _FIRST_SPREAD))), most)
    for exponent in (first + step for step in _STEPS if first + step <= most):
        try:
            proof = _proof(candidate, exponent)
            break
        except UndecidedError as failure:
            failed = exponent
            failures.append(failure)
            last = failures[-_RADII_COMPARED:]
            if len(last) == _RADII_COMPARED and all(
                    f.reason == failure.reason and abs(f.margin - failure.margin) <= 0.01 * abs(failure.margin)
                    for f in last):
                raise
    else:
        raise failures[-1]
    while proof.exponent - failed > 1:  # while no radius has failed, larger ones are tried one by one
        trial = (proof.exponent + failed) // 2 if failed else proof.exponent - 1
        try:
            proof = _proof(proof.candidate, trial)
        except UndecidedError:
            failed = trial
    return _proof(proof.candidate, proof.exponent + 1 + len(equations.cells) // _CELLS_PER_POWER)


def _proof(candidate: Candidate, exponent: int) -> _Proof:
    """The proof at a radius 10^-exponent; raises `UndecidedError` if it fails."""
    radius = Fraction(1, 10**exponent)
    candidate = candidate.refined(1e-3 * float(radius))
    separation = candidate.separation(radius)
    tubes = [StartTube(candidate.equations, candidate.box(k, radius), candidate.trajectories[k])
             for k in range(candidate.period)]
    slopes = [tube.slopes for tube in tubes]
    existence = candidate.system.contraction(slopes, candidate.defects, float(radius))
    found = stability(slopes, [t.derivative for t in candidate.trajectories])
    return _Proof(exponent, candidate, tubes, found, existence, separation)


def _certificate(proof: _Proof) -> Certificate:
    """The certificate of a proof."""
    candidate, stable = proof.candidate, proof.stability
    equations = candidate.equations
    margins = {
        "existence": proof.existence, "separation": proof.separation,
        "contact": min(min(t.margins.values()) for t in proof.tubes), "stability": stable.margin,
    }

    def switch(window: Window) -> dict[str, Any]:
        low, high = to_fraction(window.low), to_fraction(window.high)
        return {"time": [to_text((low + high) / 2), to_text((high - low) / 2)], "flank": window.flank,
                "into": "contact" if window.into_contact else "free"}

    return Certificate(sealed({
        "format": FORMAT, "version": VERSION, "model": dict(equations.parameters), "coordinates": list(equations.names),
        "phase": to_text(equations.phase), "period": len(candidate.points), "points": texts(candidate.points),
        "radius": f"1e-{proof.exponent}", "bits": equations.bits,
        "switches": [[switch(window) for window in tube.windows] for tube in proof.tubes],
        "stability": stable.document(),
        "margins": {name: None if v is None else f"{_CLAIMED_SHARE * v:.3e}" for name, v in margins.items()},
        "versions": used_versions(),
    }))
