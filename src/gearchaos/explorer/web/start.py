"""The page with which the explorer opens without a file: what to look at. It loads nothing else."""

from __future__ import annotations

from functools import cache

from tornado.web import RequestHandler

from gearchaos.explorer.core.drawing import EXAMPLE, Drawing
from gearchaos.explorer.core.opened import DRAWING, EXAMPLE_FILE, STUDY, address_of
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.text import to_query
from gearchaos.explorer.web.messages import asset, render
from gearchaos.files import examples


class Start(RequestHandler):
    """The page that offers a choice."""

    def get(self) -> None:
        """The page; called by Tornado."""
        self.write(_page())


@cache
def _page() -> str:
    return render(
        "web/templates/start.html.j2", css=asset("web/static/page.css"), drawing=f"./?{DRAWING}=", study=STUDY,
        example=f"./?{address_of(Drawing.of(EXAMPLE.items()))}",
        figures=[(f"./?{to_query(each.view)}", each.name) for each in presets().values()],
        trains=[(f"./?{EXAMPLE_FILE}={path.stem}", path.stem.replace("_", " ").removeprefix("train "))
                for path in examples() if path.suffix == ".toml" and "[train" in path.read_text(encoding="utf-8")])
