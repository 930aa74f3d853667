"""Proofs: a periodic verdict, or an orbit of any stability, as a theorem."""

from __future__ import annotations

from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.continuation.orbit import Orbit
from gearchaos.dynamics.orbits import sections
from gearchaos.errors import InputError, missing_package, whole_number
from gearchaos.files import write_bytes
from gearchaos.gears.operating import AnyModel
from gearchaos.model import COORDINATES, MeshModel, vary
from gearchaos.model.coordinates import from_physical, transmission_error_at_start
from gearchaos.model.switched import coordinates
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.regime import regime
from gearchaos.studies.verdict import Verdict

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Certificate, Unproved

_LEAST_BITS, _MOST_BITS = 53, 800


def prove(subject: AnyModel | Verdict | Orbit, bits: int = 128) -> Certificate | Unproved:
    """Prove a periodic orbit in ball arithmetic.

    Parameters
    ----------
    subject : MeshModel, GearPair, GearDesign, Verdict or Orbit
        A model stands for the motion that `regime` finds. Orbits of `gearchaos.orbit` may be unstable.
    bits : int
        First precision, 53 to 800; up to 512 bits are tried where rounding errors are the cause of a failure.

    Returns
    -------
    Certificate or Unproved
        `Certificate` states what is proved (``theorem``); ``write`` saves it for ``gearchaos verify``. `Unproved` has
        the ``reason`` and the ``margin`` by which the proof failed; it does not say that the verdict is wrong.

    Raises
    ------
    InputError
        If python-flint is not installed, the precision is out of range, or the verdict is not periodic.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> certificate = gc.prove(model)
    >>> certificate.proved, certificate.period
    (True, 8)
    """
    check_installed()
    whole_number("bits", bits, _LEAST_BITS, _MOST_BITS)
    from gearchaos.proof.phases import prove_at_some_phase

    return prove_at_some_phase(*orbit_points(subject), bits)


def check_installed() -> None:
    """Raise `InputError` unless python-flint is installed."""
    if find_spec("flint") is None:
        raise missing_package("prove", "python-flint", "proof")


def write_verifier(path: Path) -> None:
    """Write the verifier of certificates, a program in one file that needs Python and python-flint alone."""
    write_bytes(path, files("gearchaos.proof").joinpath("verifier.py").read_bytes())


def orbit_points(subject: AnyModel | Verdict | Orbit) -> tuple[MeshModel, np.ndarray]:
    """The model of an orbit and its states w (n, d) at τ = k T."""
    if isinstance(subject, Orbit):
        return subject.model, _states(subject.model, subject.points)
    verdict = subject if isinstance(subject, Verdict) else regime(subject)
    if verdict.period is None:
        raise InputError(
            "prove", "must be given a periodic motion", verdict.label,
            "What is proved are periodic orbits; gearchaos.orbit finds unstable ones too.")
    flow = initial_value_problems(verdict.model).flow
    point = np.zeros(1, int)
    return verdict.model, sections(flow, verdict.verdicts.w[:, :1].copy(), point, np.array([verdict.period]))[0]


def _states(model: MeshModel, points: dict[str, np.ndarray]) -> np.ndarray:
    """The states w (n, d) of stroboscopic points that are given by the names of initial values."""
    batch = vary(model, {})
    names = coordinates(batch)
    if set(names) <= set(points):
        return np.stack([points[name] for name in names], axis=1)
    zero = np.zeros_like(next(iter(points.values())))
    known = {name: points.get(name, zero) for name in COORDINATES["full"]}
    return from_physical(names, known, *transmission_error_at_start(batch))
