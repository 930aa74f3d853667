"""HTML of pages without scripts that load nothing: their templates, and pictures as SVG within them."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

import jinja2
import matplotlib
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos.datasheet.assessment import sentence
from gearchaos.errors import InputError

# width of a picture in inches: its letters are of the size of the page's on a telephone, and a little larger beside
# another picture
WIDTH = 4.6
# letters as paths, since the page must not load fonts; identifiers that do not differ between runs
_SETTINGS: Any = {"svg.fonttype": "path", "svg.hashsalt": "gearchaos", "font.size": 9.5}
_NAMESPACES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def template(name: str) -> str:
    """The text of a template or of a style sheet."""
    return files("gearchaos.datasheet").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def environment() -> jinja2.Environment:
    """The environment of the template, with its filters.

    They make HTML with what follows an underscore as a subscript: ``maths`` of a formula, ``sentence`` of a text, in
    which only symbols of one letter have indices and other names keep their underscores, ``said`` of words for one.
    """
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(template), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True)
    index, symbol = re.compile(r"()_([A-Za-z0-9α-ω]+)"), re.compile(r"(?<!\w)([^\W\d_])_([A-Za-z0-9α-ω]+)")
    for name, pattern in (("maths", index), ("sentence", symbol)):
        environment.filters[name] = lambda text, pattern=pattern: Markup(
            pattern.sub(r"\1<sub>\2</sub>", str(escape(text))))
    environment.filters["said"] = lambda words: environment.filters["sentence"](sentence(words))
    return environment


def picture(name: str, title: str, caption: str, height: float, draw: Callable[[Axes], Axes],
            width: float = WIDTH) -> dict[str, Any]:
    """What the template shows of a picture: an SVG element, its identifiers with the name, or why there is none."""
    shown, content = {"name": name, "title": title, "caption": caption, "reason": ""}, io.StringIO()
    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=(width, height), layout="constrained")
        try:
            draw(figure.subplots())
        except InputError as error:
            return {**shown, "reason": str(error)}
        figure.savefig(content, format="svg", metadata={"Date": None})
    text = content.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg"):], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", text)
    label = f'role="img" aria-label="{escape(title)}"'
    svg = re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', rf"<svg {_NAMESPACES} \1 {label}>", text, count=1)
    return {**shown, "svg": Markup(svg)}
