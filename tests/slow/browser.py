"""The explorer's server and a visitor's browser, for the tests that need them."""

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from functools import cache

import pytest

from gearchaos.explorer.core import bounds, worker
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.text import from_query
from gearchaos.studyfile import load_study
from tests import ONE_SPRING

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
NEEDED = pytest.mark.skipif(CHROMIUM is None, reason="make test installs chromium")
FEW_CELLS = (80, 60)
"""Columns and rows of the maps of `served` with ``few``: a twenty-fifth of the usual cells, which takes less time."""

_MAIN = f"""
import os, signal
import {bounds.__name__} as bounds, {worker.__name__} as worker
if "FEW_CELLS" in os.environ:
    bounds.MAP_CELLS = {FEW_CELLS}
worker._NICENESS = 0  # other tests keep all cores busy
from gearchaos.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
main()
"""
COMMAND = (sys.executable, "-c", _MAIN, "explore", "--no-open", "--port", "0")
DESIGN = str(ONE_SPRING)
SIZES = {"laptop": (1366, 768), "desk": (1920, 1080), "phone": (390, 844)}
MAP = "x=omega=0.2:3.0&y=eps1=0.0:0.3"
CALM = "x=omega=0.9:1.1&y=eps1=0.0:0.02"
"""A plane of one periodic motion, whose map is soon complete, for tests that look at other parts of the page."""

START = presets()["2"].view
FIRST = view_of(load_study(DESIGN).model)
"""What a page of `DESIGN` shows first."""

WAIT = 180_000  # ms; a final map takes long where other tests keep all cores busy


@contextmanager
def served(*arguments, few=False):
    """The address of a server, and what it says on stderr; its maps have `FEW_CELLS` if ``few``."""
    environment = {**os.environ, "FEW_CELLS": "1"} if few else None
    with subprocess.Popen((*COMMAND, *arguments), stderr=subprocess.PIPE, text=True, env=environment) as process:
        said = []
        for line in process.stderr:
            said.append(line)
            if found := re.search(r"http://[^/\s]+/", line):
                break
        assert said and found, said
        try:
            yield found[0], said
        finally:
            process.send_signal(signal.SIGINT)
            try:
                _, rest = process.communicate(timeout=60)
            finally:
                process.kill()
            assert "Traceback" not in rest and sys.prefix not in rest, rest


@contextmanager
def visits(chromium, address, **options):
    """A function that opens pages of a server with a query; whatever goes wrong on one of them fails the test."""
    opened = []

    def begin(query="", size="laptop"):
        opened.append(Visit(chromium, address + query, size, **options))
        return opened[-1]

    yield begin
    for one in opened:
        one.close()


@cache
def context(chromium, size):
    """What all pages of a size share: the window, and the scripts that the browser has compiled."""
    width, height = SIZES[size]
    found = chromium.new_context(viewport={"width": width, "height": height}, accept_downloads=True)
    found.grant_permissions(["clipboard-read", "clipboard-write"])
    return found


class Visit:
    """A page, what went wrong on it, and what it asked for elsewhere."""

    def __init__(self, chromium, url, size="laptop", first=START):
        self.first = first  # what the server shows first; its gears are those of the page
        self.page, self.wrong = context(chromium, size).new_page(), []
        self.page.set_default_timeout(WAIT)
        self.page.on("pageerror", lambda e: self.wrong.append(str(e)))
        self.page.on("console", lambda m: (
            self.wrong.append(m.text) if m.type == "error" or "initial ranges" in m.text else None))
        home = re.match(r"http://[^/]+", url)[0]
        own = (home, home.replace("http", "ws"), "data:", "blob:")
        self.page.on("request", lambda r: None if r.url.startswith(own) else self.wrong.append(r.url))
        self.page.goto(url)
        self.settled()

    def settled(self):
        """The final verdict of the point."""
        return self.page.wait_for_selector(".verdict[data-final='1'][data-stage='complete']")

    @property
    def view(self):
        return from_query(self.page.evaluate("location.search"), self.first)

    def after(self, act):
        """Act, and return the view that the address bar then shows."""
        before = self.page.evaluate("location.search")
        act()
        self.page.wait_for_function("before => location.search !== before", arg=before)
        return self.view

    def label(self):
        """The verdict on show, once it is that of the point in the address bar."""
        model = self.view
        words = ", ".join(f"= {v:g}" for v in model.at)
        for part in words.split(", "):
            self.page.wait_for_selector(f".verdict[data-final='1'] .label span:has-text('{part}')")
        return self.settled().get_attribute("data-label")

    def spot(self, across, up):
        """A place on the screen by its shares of the map's frame."""
        figure = self.page.locator("#map-figure")
        figure.scroll_into_view_if_needed()
        box = figure.bounding_box()
        return (box["x"] + 70 + across * (box["width"] - 120), box["y"] + 36 + (1 - up) * (box["height"] - 91))

    def type(self, name, text):
        field = self.page.locator(f".field-{name} input[type=text]")
        field.fill(text)
        field.press("Enter")

    def choose(self, name, label):
        self.page.locator(f"select[name=select-{name}]").select_option(label=label)

    def export(self, words):
        self.page.click("#export summary")
        self.page.click(f"#export button:has-text('{words}')")

    def message(self):
        return self.page.wait_for_selector(".error").inner_text()

    def copied(self, language):
        self.export(f"copy as {language}")
        self.page.wait_for_selector(f"#note:has-text('{language}')")
        return self.page.evaluate("navigator.clipboard.readText()")

    def saved(self, words, folder):
        with self.page.expect_download() as waiting:
            self.export(words)
        waiting.value.save_as(path := folder / waiting.value.suggested_filename)
        return path

    def is_as_wide_as_the_screen(self):
        return self.page.evaluate("document.documentElement.scrollWidth <= innerWidth")

    def close(self):
        assert self.wrong == []
        self.page.close()
