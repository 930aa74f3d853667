"""The scheme of a train, and the list of its parts."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from markupsafe import Markup, escape

from gearchaos import plot
from gearchaos.cards.card import card
from gearchaos.datasheet.html import picture
from gearchaos.gears.train.train import Train

_HEIGHT = 3.6  # of the picture, in inches


class Scheme(NamedTuple):
    """A train as a picture, an SVG element, and its parts, each with its kind."""

    picture: Markup
    parts: list[tuple[str, str]]


@lru_cache(maxsize=16)
def scheme(train: Train) -> Scheme:
    """The picture of `gearchaos.plot.train`, and the rows of the card."""
    drawn = picture("scheme", "The train", "", _HEIGHT, lambda ax: plot.train(train, ax))
    return Scheme(drawn.get("svg") or escape(drawn["reason"]), list(card(train).rows))
