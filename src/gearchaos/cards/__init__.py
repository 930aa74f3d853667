"""Cards: what a notebook shows of models, designs, verdicts, studies and results, as HTML that loads nothing."""

from gearchaos.cards.card import Card
from gearchaos.cards.make import card

__all__ = ["Card", "card"]
