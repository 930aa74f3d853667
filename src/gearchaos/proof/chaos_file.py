"""Check a file with a chaotic set: all covering relations and the bound of the entropy are proved anew from it alone.

The arithmetic is that of the proof (`segment`, `covering`); nothing else in the file is believed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from gearchaos.proof.balls import LEAST_BITS, MOST_BITS, ball, from_text, precision
from gearchaos.proof.certificate import checksum
from gearchaos.proof.chaos import FORMAT, SLACK, VERSION, growth, harmonic, theorem
from gearchaos.proof.covering import Parallelogram, Vector, prove_covering
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations

_MOST_SETS = 2000


class Result(NamedTuple):
    """What the check of a file found."""

    proved: bool
    lines: list[str]


class RefusedError(Exception):
    """A file that does not prove what it states, with the reason."""


def format_of(path: str | Path) -> Any:
    """What a file says that it holds; None if it is no JSON object."""
    try:
        document = json.loads(Path(path).read_bytes())
    except (ValueError, RecursionError):
        return None
    return document.get("format") if isinstance(document, dict) else None


def is_chaotic_set(path: str | Path) -> bool:
    """Whether a file says that it holds a chaotic set."""
    return bool(format_of(path) == FORMAT)


def verify_file(path: str | Path) -> Result:
    """Check a file; see `verify`."""
    try:
        document = json.loads(Path(path).read_bytes())
    except (ValueError, RecursionError) as error:
        return Result(False, [f"no JSON: {error}"])
    return verify(document)


def verify(document: Any) -> Result:
    """Check a chaotic set in the form in which it is written.

    Returns
    -------
    Result
        The theorem if it is proved, otherwise the reason for which it is refused.
    """
    try:
        return Result(True, _checked(document))
    except RefusedError as error:
        return Result(False, [str(error)])
    except UndecidedError as error:
        return Result(False, [f"{error.reason}: margin {error.margin:.3g}"])
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError, AttributeError, OverflowError) as error:
        return Result(False, [f"damaged: {type(error).__name__}: {error}"])


def _checked(document: Any) -> list[str]:
    """The lines of the result of a file that is proved; raises an error otherwise."""
    _require(isinstance(document, Mapping), "not a JSON object")
    _require(document.get("format") == FORMAT, f"the format is not {FORMAT!r}")
    _require(document.get("version") == VERSION, f"the version is not {VERSION}")
    _require(document.get("sha256") == checksum(dict(document)), "the checksum is wrong: the file was changed")
    bits = document["bits"]
    _require(type(bits) is int and LEAST_BITS <= bits <= MOST_BITS, "bits are out of range")
    slack = from_text(document["slack"])
    _require(Fraction(SLACK) <= slack < 1, f"the slack must be at least {SLACK} and less than 1")
    sets, transitions = [_parallelogram(s) for s in document["sets"]], document["transitions"]
    _check_graph(sets, transitions)
    with precision(bits):
        equations = MeshEquations(document["model"], bits=bits)
        names = tuple(document["coordinates"])
        _require(equations.names == ("z", "z_dot") == names, "the coordinates are not (z, z_dot)")
        _check_entropy(document, transitions)
        sizes = {harmonic(name): from_text(size) for name, size in document["tolerances"].items()}
        _require(all(size >= 0 for size in sizes.values()), "a tolerance is negative")
        change = equations.forcing_change(sizes)
        pieces = sum(prove_covering(equations, sets[i], sets[j], slack, change) for i, j in transitions)
    _require(document["theorem"] == theorem(document), "the theorem in words is not what is proved")
    return [document["theorem"], f"proved: {len(transitions)} covering relations, by {pieces} pieces, with {bits} bits"]


def _require(condition: bool, reason: str) -> None:
    """Raise `RefusedError` unless a condition holds."""
    if not condition:
        raise RefusedError(reason)


def _parallelogram(texts: Mapping[str, list[str]]) -> Parallelogram:
    """A parallelogram from its form in a file."""
    shape = Parallelogram(*(_vector(texts[name]) for name in ("centre", "unstable", "stable")))
    _require(shape.area != 0, "a set has no area")
    return shape


def _vector(texts: list[str]) -> Vector:
    """Two numbers."""
    x, y = map(from_text, texts)
    return x, y


def _check_graph(sets: list[Parallelogram], transitions: Any) -> None:
    """Raise `RefusedError` unless transitions join sets, and those from the same set lead to disjoint ones."""
    _require(0 < len(sets) <= _MOST_SETS and len(transitions) <= 2 * _MOST_SETS, "too many sets, or none")
    known = all(type(k) is int and 0 <= k < len(sets) for pair in transitions for k in pair)
    _require(known and all(len(pair) == 2 for pair in transitions), "a transition does not join two sets")
    for number, (first, second) in enumerate(transitions):
        for other_first, other_second in transitions[:number]:
            if first == other_first:
                apart = sets[second].is_apart_from(sets[other_second])
                _require(apart, f"sets {second} and {other_second} may overlap")


def _check_entropy(document: Mapping[str, Any], transitions: list[list[int]]) -> None:
    """Raise `RefusedError` unless the bound of the entropy follows from the transitions."""
    weights = [from_text(text) for text in document["weights"]]
    _require(len(weights) == len(document["sets"]) and min(weights) > 0, "the weights are not positive, one a set")
    entropy = from_text(document["entropy"])
    _require(entropy > 0, "the entropy is not positive")
    bound = ball(growth(transitions, weights)).log()
    _require(bool(bound >= ball(entropy)), f"the entropy is not proved: its bound is {bound.str(8)}")

