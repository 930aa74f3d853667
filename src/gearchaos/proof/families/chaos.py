"""A chaotic set as a theorem (d = 2): sets of which each covers others, and what follows.

The sets and the transitions form a graph. If the sets to which one set leads are disjoint, two motions that follow
different paths from the same set are in disjoint sets at some time. So the topological entropy of P is at least log ρ,
with ρ the spectral radius of the matrix A of the graph (A_ij = 1 for a transition from i to j). For any positive vector
v, ρ is at least the least (A v)_i / v_i (Collatz and Wielandt).
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import ball, from_text, precision, to_fraction, to_text
from gearchaos.proof.certificate import Theorem, Unproved, used_versions
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.covering import Parallelogram, prove_covering
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.verifier import growth, sealed

FORMAT, VERSION = "gearchaos chaotic set", 1

SLACK = "0.01"
"""The slack of each covering relation."""

_DIGITS = 6
"""Decimal digits of the bound of the entropy."""


@dataclass(frozen=True, eq=False)
class ChaoticSet(Theorem):
    """A proved chaotic set.

    Attributes
    ----------
    document : dict
        The theorem with the sets and transitions, in the form in which it is written, see ``docs/proofs.md``.
    seconds : float
        How long the proof took, without the search for the sets.
    """

    seconds: float

    @property
    def entropy(self) -> float:
        """A lower bound of the topological entropy of P: natural logarithm, per mesh period."""
        return float(self.document["entropy"])

    @property
    def loops(self) -> list[list[int]]:
        """The closed paths from set 0 that pass it once, as numbers of sets: every other set leads to one set."""
        transitions, out = self.document["transitions"], []
        after = {first: second for first, second in transitions if first}
        for start in (second for first, second in transitions if not first):
            loop = [0]
            while start:
                loop.append(start)
                start = after[start]
            out.append(loop)
        return out

    @property
    def slack(self) -> float:
        """The slack of every covering relation."""
        return float(self.document["slack"])

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; all is in ``document``."""
        return self.selected("theorem", entropy=self.entropy, sets=len(self.document["sets"]),
                             loops=[len(loop) for loop in self.loops], slack=self.slack, bits=self.bits,
                             seconds=self.seconds)

    def __repr__(self) -> str:
        return f"ChaoticSet(entropy >= {self.document['entropy']}, {len(self.document['sets'])} sets)"


def prove_chaotic_set(
    model: MeshModel, sets: Sequence[tuple[np.ndarray, np.ndarray]], loops: Sequence[Sequence[int]], bits: int = 128,
    tolerances: Mapping[str, str] | None = None,
) -> ChaoticSet | Unproved:
    """Prove the covering relations along loops of sets, and what follows of those that are proved.

    Parameters
    ----------
    model : MeshModel
        d = 2. Its parameters are taken as exactly the floats they are. Initial values have no effect.
    sets : sequence of ((2,), (2, 2))
        Centre of each parallelogram, and its unstable and stable half axis as columns.
    loops : sequence of sequence of int
        Numbers of the sets of each loop, from set 0; the last one covers set 0. The first loop is that of the saddle.
    bits : int
        The precision.
    tolerances : mapping of str to str, optional
        Numbers as in a certificate, by the names ``eps1``, ... of amplitudes of the transmission error: the theorem is
        to hold for all values that differ by at most this from those of the model.
    """
    start, tolerances = time.perf_counter(), dict(tolerances or {})
    parallelograms = []
    for centre, axes in sets:
        (x, y), (p, q) = centre.tolist(), axes.T.tolist()
        parallelograms.append(Parallelogram(*((Fraction(v), Fraction(w)) for v, w in ((x, y), p, q))))
    parameters = exact_parameters(model)
    with precision(bits):
        equations = MeshEquations(parameters, bits=bits)
        change = equations.forcing_change(
            {harmonic(name): from_text(size) for name, size in tolerances.items()})
        proved, failures = [], []
        for loop in loops:
            try:
                for first, second in _steps(loop):
                    prove_covering(equations, parallelograms[first], parallelograms[second], Fraction(SLACK), change)
                proved.append(list(loop))
            except UndecidedError as failure:
                failures.append(failure)
        kept = list[list[int]]()  # each leads from set 0 to a set that is disjoint from those of the loops before it
        for loop in proved:
            following = parallelograms[_steps(loop)[0][1]]
            if all(following.is_apart_from(parallelograms[_steps(other)[0][1]]) for other in kept):
                kept.append(loop)
        if len(kept) < 2:
            return Unproved("covering not proved", max((f.margin for f in failures), default=0.0), bits)
        used = sorted({number for loop in kept for number in loop})
        places = {number: place for place, number in enumerate(used)}
        transitions = [[places[a], places[b]] for loop in kept for a, b in _steps(loop)]
        texts = [{name: [to_text(value) for value in getattr(parallelograms[k], name)]
                  for name in ("centre", "unstable", "stable")} for k in used]
        document = {
            "format": FORMAT, "version": VERSION, "model": parameters,
            "tolerances": tolerances,
            "coordinates": list(equations.names), "sets": texts,
            "transitions": transitions, "slack": SLACK, "bits": bits, **_entropy_bound(transitions),
        }
    seconds = round(time.perf_counter() - start, 3)
    return ChaoticSet(sealed({**document, "versions": used_versions()}), seconds)


def harmonic(name: str) -> int:
    """The number j of ``epsj``; raises `ValueError` for any other name."""
    number = int(name.removeprefix("eps"))
    if number < 1 or name != f"eps{number}":
        raise ValueError(f"no amplitude of the transmission error: {name!r}")
    return number


def _steps(loop: Sequence[int]) -> list[tuple[int, int]]:
    """The transitions of a closed path."""
    return list(zip(loop, [*loop[1:], loop[0]], strict=True))


def _entropy_bound(transitions: list[list[int]]) -> dict[str, Any]:
    """The bound of the entropy, rounded down, and the vector v by which it is proved."""
    count = 1 + max(max(pair) for pair in transitions)
    matrix = np.zeros((count, count))
    for first, second in transitions:
        matrix[first, second] += 1
    values, vectors = np.linalg.eig(matrix)
    weights = np.abs(vectors[:, np.argmax(values.real)].real)
    weights = [Fraction(float(w)) for w in weights / weights.max()]
    scaled = ball(growth(transitions, weights)).log() * 10**_DIGITS
    entropy = Fraction(to_fraction(scaled.lower()).__floor__(), 10**_DIGITS)
    return {"entropy": f"{float(entropy):.{_DIGITS}f}", "weights": [to_text(w) for w in weights]}
