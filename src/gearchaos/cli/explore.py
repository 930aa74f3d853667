"""The command that serves the explorer."""

from __future__ import annotations

import signal
import webbrowser
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import AxisTexts, Sets, StudyPath, app, load, parse_axes
from gearchaos.cli.process import collect_garbage
from gearchaos.errors import InputError

if TYPE_CHECKING:
    from gearchaos.explorer.core.state import View
    from gearchaos.studies.core.axis import Axis
    from gearchaos.studyfile import LoadedStudy


@app.command(rich_help_panel="Motions")
def explore(
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; by default only this machine can connect.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="N", help="Port; 0 for any that is free.")] = 5006,
    no_open: Annotated[bool, typer.Option("--no-open", help="Do not open a browser.")] = False,
) -> None:
    """Open a page in the browser with a map of motions, and the motion at the point that is clicked.

    Without a study file it opens with a choice: a drawing, a figure of the paper, a train, a file.
    """
    say("starting the explorer …")  # loading its packages takes seconds
    from gearchaos.explorer.web import LOCAL, START
    from gearchaos.explorer.web.server import address, check_installed, check_port, server

    check_installed()
    axes = parse_axes(axis)
    loaded = load(study, sets, axes=axes)
    plain = study is None and not sets and not axes
    view = _view(loaded, axes, plain)
    port = check_port(host, port)
    if host not in LOCAL:
        say(f"warning: anyone who can reach {host}:{port} can use this page, and this machine's time with it")
    collect_garbage(imported=False)
    running = server(view, host=host, port=port)
    collect_garbage(imported=True)
    running.start()
    page = address(host, port) + START * plain
    say(f"explorer at {page} (Ctrl-C ends it)")
    _serve(running, None if no_open else page)


def _view(loaded: LoadedStudy, given: list[Axis], no_arguments: bool) -> View:
    """The first view: axes of the command line, otherwise of the study file; without arguments the paper's figure 2."""
    from gearchaos.explorer.core.opened import study_view
    from gearchaos.explorer.core.presets import presets

    if len(given) not in (0, 2):
        raise InputError("--axis", "must be given twice or not at all", [axis.name for axis in given],
                         "E.g. --axis omega=0.2:3:400 --axis eps1=0:0.3:300.")
    if no_arguments and not given:
        return presets()["2"].view
    return study_view(loaded, given)


def _serve(running: Any, page: str | None) -> None:
    """Run a Bokeh server until Ctrl-C, and open a page of it in the browser, if one is given.

    Ctrl-C stops the loop instead of raising KeyboardInterrupt, which is lost where Python ignores exceptions, e.g. in
    callbacks of weak references.
    """
    loop = running.io_loop
    if page:
        loop.add_callback(webbrowser.open, page)
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # as in a background job
        signal.signal(signal.SIGINT, lambda *_: loop.asyncio_loop.call_soon_threadsafe(loop.stop))
    try:
        loop.start()
    finally:
        signal.signal(signal.SIGINT, before)
    running.stop()
