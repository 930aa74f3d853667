"""Cards: what a notebook shows of models, designs, verdicts, studies and results, as HTML that loads nothing."""

from gearchaos.cards import inputs, results  # noqa: F401 -- they register their cards
from gearchaos.cards.card import Card, card

__all__ = ["Card", "card"]
