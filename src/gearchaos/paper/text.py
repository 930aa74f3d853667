"""Plain text for the report: symbols of parameters, shares in percent."""

from __future__ import annotations

_SYMBOLS = {"omega": "ω", "eps1": "ε1", "q0": "q0", "kappa": "κ", "beta": "β", "z": "z(0)", "z_dot": "z'(0)"}


def symbol(name: str) -> str:
    """The paper's symbol of a parameter or initial value in plain text."""
    return _SYMBOLS.get(name, name)


def percent(share: float) -> str:
    """A share in percent with one digit after the point below 10 %."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.1f} %" if share >= 0.001 else "below 0.1 %"
