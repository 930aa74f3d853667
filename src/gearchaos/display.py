"""How values show themselves in notebooks: as small cards of HTML, made by `gearchaos.cards`."""

from __future__ import annotations

from importlib import import_module


class HasCard:
    """A value that notebooks show as a card; `gearchaos.card` says what is on it.

    The class knows nothing of cards: these are made above it, from its public attributes, and imported by name when a
    notebook asks for one.
    """

    def _repr_html_(self) -> str:
        return str(import_module("gearchaos.cards").card(self).html)
