"""How values show themselves in notebooks: as small cards of HTML, of whose making they know nothing."""

from __future__ import annotations

from collections.abc import Callable


def _no_card(value: HasCard) -> str:
    raise NotImplementedError(f"nothing makes cards of {type(value).__name__}")


class HasCard:
    """A value that notebooks show as a card; `gearchaos.card` says what is on it."""

    _make_html: Callable[[HasCard], str] = staticmethod(_no_card)
    """What makes the HTML of a value, from its public attributes; given by `make_cards_by`."""

    def _repr_html_(self) -> str:
        return self._make_html(self)


def make_cards_by(make: Callable[[HasCard], str]) -> None:
    """Let ``make`` give the HTML of all values; the package itself, which is above all layers, does so."""
    HasCard._make_html = staticmethod(make)
