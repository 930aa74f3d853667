"""Fixtures that several folders share."""

import signal
import sys

import pytest


@pytest.fixture(autouse=True)
def figures_closed():
    """No test leaves figures to the next ones: pyplot keeps them, and warns of more than 20."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def small(monkeypatch):
    """A view of the explorer with few cells, all of them 1T."""
    from dataclasses import replace

    import gearchaos as gc
    from gearchaos.explorer.view import models
    from gearchaos.explorer.view.presets import presets

    monkeypatch.setattr(models, "MAP_CELLS", (56, 40))
    x, y = gc.Axis("omega", 0.9, 1.1, 56), gc.Axis("eps1", 0.0, 0.02, 40)
    return replace(presets()["2"].view, x=x, y=y, at=(1.0, 0.01))


@pytest.fixture
def no_waiting():
    """A time limit of 20 seconds, for tests whose subject would wait without end if it were wrong."""
    def end(*_):
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
