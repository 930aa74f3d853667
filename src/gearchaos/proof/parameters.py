"""The parameters of a model as exact numbers, in the form that a certificate states them."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from gearchaos.model import SCALARS, STIFFNESS_FORMS, SUPPORTS, MeshModel
from gearchaos.proof.balls import from_text, to_text
from gearchaos.quantities import parse


def exact_parameters(model: MeshModel) -> dict[str, Any]:
    """The parameters of a model as they stand in a certificate: every number a string, exactly the float it had.

    Returns
    -------
    dict
        ``kind``; the parameters of `docs/model.md` by name, those of the supports for ``full`` alone; ``eps`` and
        ``theta``, lists from harmonic 1 on; ``stiffness``, a dict with its ``form`` and values.
    """
    names = [n for n in SCALARS if model.kind == "full" or parse(n).family not in SUPPORTS]
    return {
        "kind": model.kind,
        **{name: _text(getattr(model, name)) for name in names},
        "eps": _texts(model.error.amplitudes), "theta": _texts(model.error.phases),
        "stiffness": {"form": model.stiffness.form, **{
            name: _texts(value) if isinstance(value, tuple) else _text(value)
            for name, value in model.stiffness.numbers().items()}},
    }


def exact_parts(stiffness: Mapping[str, Any]) -> list[tuple[Fraction, Fraction]]:
    """(start, χ) of each part of a stiffness of a certificate in which it is constant; none for a Fourier stiffness."""
    numbers = {name: [*map(from_text, value)] if isinstance(value, list) else from_text(value)
               for name, value in stiffness.items() if name != "form"}
    return [(Fraction(start), level) for start, level in STIFFNESS_FORMS[stiffness["form"]].parts(numbers)]


def _text(value: float) -> str:
    """A float as an exact hexadecimal string."""
    return to_text(Fraction(value))


def _texts(values: tuple[float, ...]) -> list[str]:
    """Floats as exact hexadecimal strings."""
    return [_text(value) for value in values]
