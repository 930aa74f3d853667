"""A card: a title, rows of names and values, and a small picture, in colours that suit any page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

_BOX = ("display:flex;flex-wrap:wrap;gap:8px 18px;align-items:flex-start;box-sizing:border-box;width:fit-content;"
        "max-width:100%;border:1px solid rgba(128,128,128,.45);border-radius:6px;padding:8px 12px;margin:2px 0;"
        "font:13px/1.45 system-ui,sans-serif;color:inherit;background:transparent")
_TITLE = "font-weight:600;font-size:14px;margin-bottom:3px;overflow-wrap:anywhere"
_ROWS = "display:grid;grid-template-columns:max-content minmax(0,1fr);gap:0 12px"
_NAME = "opacity:.72"
_VALUE = "overflow-wrap:anywhere"
_SWATCH = ("display:inline-block;width:.75em;height:.75em;margin-right:.45em;border:1px solid rgba(128,128,128,.8);"
           "border-radius:2px;vertical-align:-.05em")


@dataclass(frozen=True)
class Card:
    """What a notebook shows of a value.

    Texts and lines have the colour of the page around them, so that the card can be read on light and dark pages. It
    loads nothing and needs no script.

    Attributes
    ----------
    title : str
        What it is.
    rows : sequence of (str, str)
        Names and values; all texts are escaped.
    picture : str
        A drawing as SVG, made by `gearchaos.cards.drawing`; may be empty.
    colour : str
        Colour of a square before the title; may be empty.
    """

    title: str
    rows: Sequence[tuple[str, str]] = ()
    picture: str = ""
    colour: str = ""

    @property
    def html(self) -> str:
        """The card as HTML."""
        swatch = f'<span style="{_SWATCH};background:{escape(self.colour)}"></span>' if self.colour else ""
        rows = "".join(f'<div style="{_NAME}">{escape(name)}</div><div style="{_VALUE}">{escape(value)}</div>'
                       for name, value in self.rows)
        return (f'<div class="gearchaos-card" style="{_BOX}"><div style="flex:1 1 200px;min-width:0">'
                f'<div style="{_TITLE}">{swatch}{escape(self.title)}</div><div style="{_ROWS}">{rows}</div></div>'
                f"{self.picture}</div>")

    def _repr_html_(self) -> str:
        return self.html

    def __repr__(self) -> str:
        return "\n".join([self.title, *(f"  {name}: {value}" for name, value in self.rows)])
