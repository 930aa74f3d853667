"""The theorem of a periodic orbit for every model in a box of parameters, as a certificate."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gearchaos.files import write_bytes
from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import precision, to_text
from gearchaos.proof.box import BoxProof, BoxSystem, largest_box
from gearchaos.proof.certificate import Unproved, checksum, used_versions
from gearchaos.proof.coordinates import lifted
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.search import converged

FORMAT, VERSION = "gearchaos box certificate", 1


@dataclass(frozen=True, eq=False)
class BoxCertificate:
    """A periodic orbit that is proved for every model in a box of parameters.

    Attributes
    ----------
    document : dict
        The certificate as it is written.
    """

    proved: ClassVar[bool] = True
    document: dict[str, Any]

    @property
    def theorem(self) -> str:
        """What is proved, in words."""
        return self.document["theorem"]

    @property
    def scale(self) -> float:
        """The half-widths of the box that is proved over those that were asked for."""
        return self.document["scale"]

    @property
    def widths(self) -> dict[str, float]:
        """The half-widths of the box that is proved, by the names that were given."""
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

    def in_words(self) -> str:
        """The theorem, with the precision of its proof."""
        return f"proved with {self.document['bits']} bits. {self.theorem}"

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; the whole certificate is ``document``."""
        names = ("theorem", "period", "box", "scale", "radius", "bits", "margins", "sha256")
        return {"proved": True, **{name: self.document[name] for name in names}}

    def write(self, path: str | Path) -> None:
        """Write the certificate to a JSON file."""
        write_bytes(Path(path), (json.dumps(self.document, indent=1) + "\n").encode())

    def __repr__(self) -> str:
        return f"BoxCertificate({self.period}T, {self.widths})"


def prove_parameter_box(
    model: MeshModel, points: np.ndarray, widths: Mapping[str, dict[str, Fraction]], bits: int
) -> BoxCertificate | Unproved:
    """Prove a periodic orbit for all models in a box of parameters, the largest up to the one asked for.

    Parameters
    ----------
    model : MeshModel
        The centre of the box.
    points : (n, d)
        Approximate states of the orbit at τ = k T.
    widths : mapping of str to dict
        For each name the parameters that change together, with their half-widths.
    bits : int
    """
    with precision(bits):
        equations = MeshEquations(exact_parameters(model), bits=bits)
        candidate = converged(equations, lifted(points, equations))
        if candidate is None:
            return Unproved("Newton diverged", 0.0, bits)
        try:
            system = BoxSystem(candidate, list(widths.values()))
            return _certificate(system, list(widths), largest_box(system, Fraction(1)))
        except UndecidedError as failure:
            return Unproved(failure.reason, failure.margin, bits)


def _certificate(system: BoxSystem, names: list[str], proof: BoxProof) -> BoxCertificate:
    """The certificate of a proof for a box with these names of the u_j."""
    equations, found = system.equations, proof.stability
    sizes = [_below(next(iter(together.values())) * Fraction(proof.scale)) for together in system.widths]
    document = {
        "format": FORMAT, "version": VERSION, "theorem": _in_words(system, proof, sizes),
        "model": dict(equations.parameters), "scale": proof.scale,
        "box": {name: size.hex() for name, size in zip(names, sizes, strict=True)},
        "together": [sorted(names) for names in system.widths], "coordinates": list(equations.names),
        "period": system.candidate.period,
        "points": [[to_text(v) for v in point] for point in system.candidate.points],
        "derivatives": [[[float(v).hex() for v in row] for row in point] for point in proof.scale * system.drift],
        "radius": proof.radius, "reach": proof.reach.tolist(), "bits": equations.bits, "switches": proof.switches,
        "stability": {"inside": found.inside, "outside": found.outside,
                      "Q": [[[to_text(Fraction(v)) for v in row] for row in q] for q in found.matrices.tolist()]},
        "margins": {"existence": proof.existence, "separation": proof.separation, "stability": found.margin},
        "versions": used_versions(),
    }
    return BoxCertificate({**document, "sha256": checksum(document)})


def _below(value: Fraction) -> float:
    """The largest float that a number is not below."""
    nearest = float(value)
    return nearest if nearest <= value else math.nextafter(nearest, -math.inf)


def _in_words(system: BoxSystem, proof: BoxProof, sizes: list[float]) -> str:
    """What is proved, in words."""
    n, found, kind = system.candidate.period, proof.stability, system.equations.parameters["kind"]
    box = ", ".join(f"{' and '.join(together)} by {'the same amount of ' if len(together) > 1 else ''}up to {size}"
                    for together, size in zip(system.widths, sizes, strict=True))
    outside = f"It has {found.outside} multipliers outside the unit circle"
    stable = "It is stable in its coordinates" if found.outside == 0 else outside
    return " ".join((
        f"For every {kind} model whose parameters differ from those below in {box} there is an orbit of",
        f"period {n} mesh periods, and no fewer, whose states at tau = k T lie in the boxes listed: within",
        "'reach' of the points, and within 'radius' of the points displaced by the derivatives. It is the",
        f"only orbit of period {n} there.",
        f"{stable}, and its teeth switch contact {sum(proof.switches)} times.",
    ))
