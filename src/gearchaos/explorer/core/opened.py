"""What a page opens with: the gears of the server, or those that its address names."""

from __future__ import annotations

import base64
import binascii
import tomllib
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import parse_qsl, urlencode

from gearchaos.errors import InputError, unknown_name
from gearchaos.explorer.core.drawing import EXAMPLE, Drawing
from gearchaos.explorer.core.form_inputs import inputs
from gearchaos.explorer.core.models import as_operating_axis, own_kind, own_model, value_on
from gearchaos.explorer.core.state import View, view_of
from gearchaos.explorer.core.text import as_toml
from gearchaos.files import examples
from gearchaos.gears.operation.operating import OperatingModel
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.uncertainty.distributions import as_text
from gearchaos.studyfile import LoadedStudy, load_study

KEPT = "kept."  # before the keys of the drawing that is kept beside the one on show
DRAWING, EXAMPLE_FILE, STUDY = "drawing", "example", "study"
"""Names in an address: a page with an empty form; a study file of the examples; a study file itself, packed."""

_MOST_BYTES = 30_000  # of a study file in an address


@dataclass(frozen=True)
class Opened:
    """The first view of a page, whose gears are those of the page, and the part of the address that names them; a page
    with a form has a drawing, and perhaps another one that is kept beside it."""

    start: View
    named: tuple[tuple[str, str], ...] = ()
    drawing: Drawing | None = None
    kept: Drawing | None = None

    def drawn(self, drawing: Drawing, kept: Drawing | None = None) -> Opened:
        """The same page with another drawing, and the view of the last one that could run."""
        return Opened(drawing.reading.view or self.start, _named(drawing, kept), drawing, kept)

    @property
    def has_gears(self) -> tuple[bool, bool]:
        """Whether it is about gears, and about a pair of them."""
        return self.start.gears is not None, isinstance(self.start.model, OperatingModel)

    @property
    def is_complete(self) -> bool:
        """Whether the first view is that of the drawing, if there is one."""
        return self.drawing is None or self.drawing.reading.view is not None

    @property
    def query(self) -> str:
        """The part of the address that names the gears, with an ampersand at its end."""
        return f"{_query(self.named)}&" if self.named else ""

    def toml(self, view: View) -> str:
        """A study file of the page: of a drawing in its own words, unless the gears were changed apart from it."""
        if self.drawing is None:
            return as_toml(view)
        design = self.drawing.reading.design
        if design is None or not self.is_complete:
            return self.drawing.toml(design)
        model: Any = view.point
        gears = design.at(**{n: view.point.value(n) for n in ("speed", "torque")})
        own = model == replace(own_model(gears, own_kind(gears)), gears=model.gears) and view.gears == gears
        return self.drawing.toml(design, view) if own else as_toml(view)


def address_of(drawing: Drawing, kept: Drawing | None = None) -> str:
    """The query of a page with a drawing, and with another one that is kept beside it."""
    return _query(_named(drawing, kept))


def _named(drawing: Drawing, kept: Drawing | None) -> tuple[tuple[str, str], ...]:
    return ((DRAWING, ""), *drawing.texts, *((KEPT + key, text) for key, text in (kept.texts if kept else ())))


def _query(named: tuple[tuple[str, str], ...]) -> str:
    return urlencode(named, safe=";/*")


def opened(query: str, default: Opened) -> tuple[Opened, str]:
    """What the query of an address opens, by default the server's own, and the rest of it, which is about the view.

    Raises `InputError` for a file that cannot be read, and a drawing that no form has.
    """
    given = dict(parse_qsl(query.removeprefix("?"), keep_blank_values=True))
    kept = {key: text for key, text in given.items() if key.removeprefix(KEPT) in inputs() and key.startswith(KEPT)}
    drawn = {key: text for key, text in given.items() if key in inputs()}
    names = {*kept, *drawn, DRAWING, EXAMPLE_FILE, STUDY} & given.keys()
    rest = urlencode({name: value for name, value in given.items() if name not in names}, safe=":,=")
    if DRAWING in given:
        drawing = Drawing.of(drawn.items())
        other = Drawing.of((key.removeprefix(KEPT), text) for key, text in kept.items()) if kept else None
        return Opened(example_drawing()).drawn(drawing, other), rest
    if EXAMPLE_FILE in given:
        return Opened(_example(given[EXAMPLE_FILE]), ((EXAMPLE_FILE, given[EXAMPLE_FILE]),)), rest
    if STUDY in given:
        view, of_file = _unpacked(given[STUDY])
        found = Opened(view, ((STUDY, given[STUDY]),))
        return (found if of_file is None else found.drawn(of_file)), rest
    return default, rest


@lru_cache
def example_drawing() -> View:
    """The view of the example of a drawing, which stands behind a form that is not complete."""
    view = Drawing.of(EXAMPLE.items()).reading.view
    assert view is not None
    return view


def redrawn(view: View, before: Opened, after: Opened) -> View:
    """A view of the gears of one drawing with those of another: at the same point and over the same part of the map,
    unless the other drawing has another operating point or ranges."""
    first, start = before.start, after.start

    def axis(which: str) -> Axis:
        shown, own, new = (getattr(each, which) for each in (view, first, start))
        return new if shown == own or _differ(before, after, f"range.{new.name}") else shown

    x, y = axis("x"), axis("y")
    moved = _differ(before, after, "operation.speed", "operation.torque") or (x.name, y.name) != (
        view.x.name, view.y.name)
    at = (value_on(start.model, x), value_on(start.model, y)) if moved else view.at
    return replace(start, x=x, y=y, at=at, colour=view.colour, line=view.line, physical=view.physical,
                   change=view.change, run=start.run if view.run == first.run else view.run)


def _differ(before: Opened, after: Opened, *keys: str) -> bool:
    """Whether two drawings have other texts of these inputs."""
    one, other = before.drawing or Drawing(), after.drawing or Drawing()
    return any(one[key] != other[key] for key in keys)


def study_view(loaded: LoadedStudy, given: Sequence[Axis] = ()) -> View:
    """The first view of a study file: over these axes, otherwise those of its study. For gears the ranges of ω and q0
    are those of the speed and torque."""
    options = loaded.options_for("zones")
    of_study = [options[name] for name in ("x", "y") if name in options]
    if isinstance(loaded.model, OperatingModel):
        of_study = [as_operating_axis(loaded.model.gears, axis) for axis in of_study]
    vary = tuple(map(as_text, loaded.options_for("scatter").get("vary", ())))
    return view_of(loaded.model, *(given or of_study), vary=vary)


@lru_cache
def _example(name: str) -> View:
    """The view of a study file of the examples, by its name without suffix."""
    found = {path.stem: path for path in examples() if path.suffix == ".toml"}
    if name not in found:
        raise unknown_name(EXAMPLE_FILE, name[:40], found)
    return study_view(load_study(found[name]))


@lru_cache
def _unpacked(packed: str) -> tuple[View, Drawing | None]:
    """The view of a study file that an address holds, its text by zlib, in base64 for addresses; and its drawing."""
    try:
        unpack = zlib.decompressobj()
        content = unpack.decompress(base64.b64decode(f"{packed}{'=' * (-len(packed) % 4)}", b"-_", True), _MOST_BYTES)
        document = tomllib.loads(content.decode("utf-8-sig"))
    except (binascii.Error, zlib.error, ValueError, RecursionError) as error:
        raise InputError("study file", "must be valid TOML", packed[:20], f"{error}.") from None
    if unpack.unconsumed_tail:
        raise InputError("study file", f"must have at most {_MOST_BYTES:,} bytes here", packed[:20])
    for text in _texts(document):
        if any(path(text).is_absolute() or ".." in path(text).parts for path in (PurePosixPath, PureWindowsPath)):
            raise InputError("study file", "must name no other file on a page", text,
                             "Start the explorer with it: gearchaos explore FILE.")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_bytes(content)
        return study_view(load_study(path)), Drawing.of_study(document)


def _texts(value: Any) -> Iterator[str]:
    """All texts in a document."""
    if isinstance(value, str):
        yield value
    for each in value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ():
        yield from _texts(each)
