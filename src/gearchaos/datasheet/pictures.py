"""The pictures of a datasheet, as SVG to be put into a page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign

if TYPE_CHECKING:
    from gearchaos.studies.speeds_to_avoid import SpeedsToAvoid

_WIDTH = 4.6
"""Width of a picture in inches: its letters are of the size of the page's on a telephone, and a little larger beside
another picture."""

_SETTINGS: Any = {"svg.fonttype": "path", "svg.hashsalt": "gearchaos", "font.size": 9.5}
"""Letters as paths, since the page must not load fonts; identifiers that do not differ between runs."""


@dataclass(frozen=True)
class Picture:
    """A picture of a datasheet.

    Attributes
    ----------
    name, title, caption : str
        Identifier, heading and explanation.
    svg : Markup
        The picture; empty if it cannot be drawn.
    reason : str
        Why it cannot be drawn; empty if it can.
    """

    name: str
    title: str
    caption: str
    svg: Markup
    reason: str


def pictures(design: GearDesign) -> Iterator[Picture]:
    """The drawing of a pair, its stiffness and its transmission error."""
    yield _picture(
        "pair", "Transverse section", "Both wheels to scale. Contact begins at A and ends at E; C is the pitch point, "
        "and dots are points of contact. Wheel 1 drives.", 5.4, lambda ax: plot.gear_pair(design, ax))
    yield _picture(
        "stiffness", "Mesh stiffness", "Along the line of action, over the whole face width; thin lines are the means. "
        "Accepted methods differ, and none is validated by measurements here.", 4.0,
        lambda ax: plot.mesh_stiffness(design, ax))
    yield _picture(
        "error", "Transmission error", "Of the unloaded gears; positive where wheel 2 lags behind.", 3.3,
        lambda ax: plot.transmission_error(design, ax))


def factor_picture(speeds: SpeedsToAvoid) -> Picture:
    """The dynamic factor along the speed."""
    return _picture(
        f"factors-{speeds.torque:g}", "Dynamic factor along the speed", "Largest mesh force of the computed motions "
        "over the static one, beside the factors of the standards, which end where these give no value.", 4.3,
        lambda ax: plot.dynamic_factor(speeds.dataset, ax))


def _picture(name: str, title: str, caption: str, height: float, draw: Callable[[Axes], Axes]) -> Picture:
    """A picture, or the reason why there is none."""
    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=(_WIDTH, height), layout="constrained")
        try:
            draw(figure.subplots())
        except InputError as error:
            return Picture(name, title, caption, Markup(""), str(error))
        return Picture(name, title, caption, _svg(figure, name, title), "")


def _svg(figure: Figure, name: str, title: str) -> Markup:
    """A figure as an SVG element whose identifiers begin with its name, so that several fit into one page."""
    content = io.StringIO()
    figure.savefig(content, format="svg", metadata={"Date": None})
    text = content.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg"):], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", text)
    label = f'role="img" aria-label="{escape(title)}"'
    return Markup(re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', rf"<svg {_NAMESPACES} \1 {label}>", text, count=1))


_NAMESPACES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
