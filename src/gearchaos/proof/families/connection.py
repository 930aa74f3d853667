"""Proof that the orbits at both ends of an interval of a parameter are connected by orbits for all values between."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from gearchaos.model import SCALARS
from gearchaos.proof.balls import fractions, from_text, precision, texts
from gearchaos.proof.candidate import converged
from gearchaos.proof.certificate import Certificate
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.boxes import BoxSystem
from gearchaos.proof.families.coefficients import LEVELS, shifted

_EXPONENTS = (3, 4, 5, 6, 7, 8, 9, 10, 11, 12)
"""Radii 10^-k that are tried."""


def connection(below: Certificate, above: Certificate, bits: int, start: Certificate | None = None) -> dict[str, Any]:
    """The proof for the straight line of parameters between two models.

    Parameters
    ----------
    below, above : Certificate
        Of orbits of one period, at one phase of the section.
    bits : int
    start : Certificate, optional
        That of the two from which the line begins, if orbits along it may graze a contact boundary: the one whose teeth
        switch contact more often. By default it begins in the middle.

    Returns
    -------
    dict
        ``points``, ``derivative``, ``radius``, ``margin`` and ``ends``, the values of u at ``below`` and ``above``: for
        each u between them there is exactly one orbit within ``radius`` of the points plus u times the derivative, no
        multiplier is 1, no contact switch is at a section, and those at the ends are the orbits of the certificates.

    Raises
    ------
    UndecidedError
        If that is not proved.
    """
    share = Fraction(1, 2) if start is None else Fraction(int(start is above))
    reach = max(share, 1 - share)
    ends = [-share / reach, (1 - share) / reach]
    changes = line(below.document["model"], above.document["model"])
    parameters = shifted(below.document["model"], {name: share * change for name, change in changes.items()})
    with precision(bits):
        equations = MeshEquations(parameters, from_text(below.document["phase"]), bits)
        check_coordinates(equations, below, above)
        candidate = converged(equations, fractions((start or below).document["points"]))
        if candidate is None:
            raise UndecidedError("orbit not found", 0.0)
        widths = [{name: reach * change for name, change in changes.items()}]
        system, failure = BoxSystem(candidate, widths, start is not None), UndecidedError("orbit not found", 0.0)
        for exponent in _EXPONENTS:
            try:
                margin = system.continued(10.0**-exponent)
                for u, end in zip(ends, (below, above), strict=True):
                    _check_same(system, u, end, Fraction(10.0**-exponent))
                derivative = [[float(v).hex() for v in point] for point in system.drift[:, :, 0].tolist()]
                return {"ends": list(map(int, ends)), "points": texts(candidate.points), "derivative": derivative,
                        "radius": f"1e-{exponent}", "margin": f"{margin:.3e}"}
            except UndecidedError as error:
                failure = error
    raise failure


def check_coordinates(equations: MeshEquations, *found: Certificate) -> None:
    """Raise `UndecidedError` if the equations have other coordinates than the orbits of certificates."""
    if any(list(equations.names) != orbit.document["coordinates"] for orbit in found):
        raise UndecidedError("coordinates not the same", 0.0)


def line(first: Mapping[str, Any], last: Mapping[str, Any]) -> dict[str, Fraction]:
    """The differences of the parameters of two models, of those that a box can vary."""
    def numbers(parameters: Mapping[str, Any]) -> dict[str, Fraction]:
        texts = {name: text for table, names in ((parameters, SCALARS), (parameters["stiffness"], LEVELS))
                 for name, text in table.items() if name in names}
        texts |= {f"eps{j}": text for j, text in enumerate(parameters["eps"], start=1)}
        return {name: from_text(text) for name, text in texts.items()}

    ours, theirs = numbers(first), numbers(last)
    return {name: theirs[name] - ours[name] for name in ours if ours[name] != theirs[name]}


def _check_same(system: BoxSystem, u: Fraction, end: Certificate, radius: Fraction) -> None:
    """Raise `UndecidedError` unless the orbit of an end is the one on the line.

    Of the two boxes in each of which there is exactly one orbit, one has to lie in the other.
    """
    own, points = Fraction(end.document["radius"]), fractions(end.document["points"])
    for point, centre, drift in zip(points, system.candidate.points, system.drift[:, :, 0].tolist(), strict=True):
        for x, c, derivative in zip(point, centre, drift, strict=True):
            gap = abs(radius - own) - abs(x - c - u * Fraction(derivative))
            if gap <= 0:
                raise UndecidedError("orbit not found", float(gap))
