"""The Bokeh application: what happens for every visitor, and when the server ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.core.templates import get_env

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.export import FILES
from gearchaos.explorer.jobs.worker import Workers
from gearchaos.explorer.view.address import from_query
from gearchaos.explorer.view.bounds import SKELETON_PERIOD, SKELETON_PERIODS
from gearchaos.explorer.view.state import View
from gearchaos.explorer.web.events import Events
from gearchaos.explorer.web.html import static_text, template_text
from gearchaos.explorer.web.session import Session


def application(view: View, workers: Workers) -> Application:
    """The application with the explorer's page.

    Parameters
    ----------
    view : View
        What a page without a query shows; its gears are those of all pages.
    workers : Workers
        They are stopped when the server ends.
    """
    return Application(_Handler(_page_maker(view, workers), workers))


class _Handler(FunctionHandler):
    """Fills the document of every visitor, and stops the workers when the server ends."""

    def __init__(self, fill: Callable[[Any], None], workers: Workers) -> None:
        super().__init__(fill)
        self._workers = workers

    def on_server_unloaded(self, server_context: Any) -> None:
        """Stop the workers; called by Bokeh."""
        for worker in self._workers:
            worker.stop()


def _page_maker(view: View, workers: Workers) -> Callable[[Any], None]:
    """A function that fills the document of a new visitor."""
    template, css = get_env().from_string(template_text("page.html.j2")), static_text("page.css")

    def fill(document: Any) -> None:
        message = ""
        try:
            first = from_query(document.session_context.request.query, view)
        except InputError as error:
            first, message = view, f"The address cannot be shown: {error}"
        session = Session(first, workers, document, view)
        Events(session)
        session.page.show_message(message)
        document.on_session_destroyed(lambda _: session.close())
        session.page.messages.attach(document, session.page.map.figure)
        document.add_next_tick_callback(session.start)
        document.title, document.template = "gearchaos explore", template
        document.template_variables.update(
            css=css, files=FILES, gears=view.gears is not None, periods=SKELETON_PERIODS,
            period=SKELETON_PERIOD)
        with document.models.freeze():  # otherwise Bokeh walks through all models again for every root
            for name, model in session.page.roots().items():
                model.name = name
                document.add_root(model)

    return fill
