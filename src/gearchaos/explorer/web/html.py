"""HTML from the templates of this package; all values are escaped."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader

from gearchaos.explorer.panels.labels import motion_hint


def render(name: str, **values: Any) -> str:
    """The template ``name`` filled with values."""
    return _environment().get_template(name).render(values)


def template_text(name: str) -> str:
    """The source of a template."""
    return _text("templates", name)


def static_text(name: str) -> str:
    """The page's style sheet or script."""
    return _text("static", name)


def _text(folder: str, name: str) -> str:
    return files("gearchaos.explorer.web").joinpath(folder, name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    made = Environment(loader=FunctionLoader(template_text), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    made.filters["motion_hint"] = motion_hint
    return made
