"""Proof that the orbits at both ends of an interval of a parameter are connected by orbits for all values between."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from gearchaos.proof.balls import from_text, precision, to_text
from gearchaos.proof.box import BoxSystem
from gearchaos.proof.certificate import Certificate
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.parameter_box import LEVELS, SCALARS
from gearchaos.proof.search import converged

_EXPONENTS = (3, 4, 5, 6, 7, 8, 9, 10)
"""Radii 10^-k that are tried."""


def connection(below: Certificate, above: Certificate, bits: int) -> dict[str, Any] | None:
    """The proof for the straight line of parameters between two models.

    Returns
    -------
    dict or None
        ``points``, ``derivative``, ``radius`` and ``margin``: for each u from -1 (``below``) to 1 (``above``) there is
        exactly one orbit within ``radius`` of the points plus u times the derivative, no multiplier is 1, and those of
        both certificates are the ones at u = -1 and 1. None if a parameter differs that a box cannot vary.

    Raises
    ------
    UndecidedError
        If that is not proved.
    """
    line = _line(below.document["model"], above.document["model"])
    if line is None:
        return None
    middle, widths = line
    with precision(bits):
        equations = MeshEquations(middle, bits=bits)
        candidate = converged(equations, _points(below))
        if candidate is None:
            raise UndecidedError("orbit not found", 0.0)
        system, failure = BoxSystem(candidate, [widths]), UndecidedError("Krawczyk not contracting", 0.0)
        for exponent in _EXPONENTS:
            try:
                margin = system.continued(10.0**-exponent)
                for sign, end in ((-1, below), (1, above)):
                    _check_same(system, sign, end, Fraction(10.0**-exponent))
                return _document(system, exponent, margin)
            except UndecidedError as error:
                failure = error
    raise failure


def _line(first: Mapping[str, Any], last: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Fraction]] | None:
    """The parameters in the middle of two models, and half their differences; None if a box cannot vary those."""
    middle, widths = dict(first), dict[str, Fraction]()
    for name in first:
        if first[name] == last[name]:
            continue
        if name in SCALARS:
            middle[name], widths[name] = _half_way(first[name], last[name])
        elif name == "eps" and len(first[name]) == len(last[name]):
            pairs = [_half_way(a, b) for a, b in zip(first[name], last[name], strict=True)]
            if any(width and not from_text(value) for value, width in pairs):
                return None
            middle[name] = [value for value, _ in pairs]
            widths |= {f"eps{j}": width for j, (_, width) in enumerate(pairs, start=1) if width}
        elif name == "stiffness" and {k for k in first[name] if first[name][k] != last[name].get(k)} <= set(LEVELS):
            changed = {k: _half_way(first[name][k], last[name][k]) for k in LEVELS}
            middle[name] = {**first[name], **{k: value for k, (value, _) in changed.items()}}
            widths |= {k: width for k, (_, width) in changed.items() if width}
        else:
            return None
    fourier = middle["stiffness"]["form"] == "fourier"
    return None if fourier or not widths else (middle, widths)


def _half_way(first: str, last: str) -> tuple[str, Fraction]:
    """The middle of two numbers, and half their difference."""
    a, b = from_text(first), from_text(last)
    return to_text((a + b) / 2), (b - a) / 2


def _points(found: Certificate) -> list[list[Fraction]]:
    """The points of a certificate."""
    return [[from_text(text) for text in point] for point in found.document["points"]]


def _check_same(system: BoxSystem, sign: int, end: Certificate, radius: Fraction) -> None:
    """Raise `UndecidedError` unless the orbit of an end is the one on the line.

    Of the two boxes in each of which there is exactly one orbit, one has to lie in the other.
    """
    own = Fraction(end.document["radius"])
    for point, centre, drift in zip(_points(end), system.candidate.points, system.drift[:, :, 0].tolist(), strict=True):
        for x, c, derivative in zip(point, centre, drift, strict=True):
            gap = abs(radius - own) - abs(x - c - sign * Fraction(derivative))
            if gap <= 0:
                raise UndecidedError("orbit not found", float(gap))


def _document(system: BoxSystem, exponent: int, margin: float) -> dict[str, Any]:
    """The connection as it stands in a certificate."""
    return {"points": [[float(v).hex() for v in point] for point in system.candidate.points],
            "derivative": [[float(v).hex() for v in point] for point in system.drift[:, :, 0].tolist()],
            "radius": f"1e-{exponent}", "margin": f"{margin:.3e}"}
