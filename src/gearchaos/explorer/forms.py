"""What a visitor sets, as HTML: fields, lists to choose from, buttons. The page's script tells who touches them."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from gearchaos.explorer.bounds import span
from gearchaos.explorer.figures.style import plain
from gearchaos.plot._axes import symbol

_STEPS = 400
_WORDS = {
    "omega": "mesh frequency", "q": "torque", "zeta": "mesh damping", "chi": "stiffness step",
    "contact_ratio": "contact ratio", "eps": "error amplitude", "theta": "error phase", "c": "stiffness amplitude",
    "alpha": "stiffness phase", "J": "inertia", "beta": "bearing friction", "mu": "wheel mass",
    "kappa": "support stiffness", "zeta_support": "support damping",
}


def words_for(name: str) -> str:
    """A parameter in words."""
    return _WORDS.get(name.rstrip("0123456789"), _WORDS.get(name, ""))


def field(name: str) -> str:
    """One value as a slider and a number."""
    low, high, _, _ = span(name)
    words = f"{words_for(name) or 'start'} <b>{escape(plain(symbol(name)))}</b>"
    return (
        f'<label class="field field-{name}" title="{name}"><span>{words}</span>'
        f'<input type="range" data-set="{name}" min="{low}" max="{high}" step="{(high - low) / _STEPS:.6g}"'
        f' aria-label="{name}">'
        f'<input type="text" data-set="{name}" inputmode="decimal" autocomplete="off" aria-label="{name}"></label>'
    )


def choice(name: str, title: str, options: Iterable[tuple[str, str]]) -> str:
    """One of some options, each a value and its words."""
    listed = "".join(f'<option value="{escape(value)}">{escape(words)}</option>' for value, words in options)
    select = f'<select name="select-{name}" data-set="{name}">{listed}</select>'
    return f'<label class="choose">{escape(title)}{select}</label>'


def button(name: str, title: str, toggled: bool = False) -> str:
    """Something to press; a button that is ``toggled`` stays so until it is pressed again."""
    state = f' data-show="{name}"' if toggled else ""
    return f'<button class="press" data-press="{name}"{state}>{escape(title)}</button>'


def heading(title: str) -> str:
    """The name of a group of fields."""
    return f"<h3>{escape(title)}</h3>"
