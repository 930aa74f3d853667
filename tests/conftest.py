"""What several files of tests share: one server of the explorer, one browser, and no endless waiting."""

import signal

import pytest


@pytest.fixture(scope="session")
def kernels():
    """Those of the models that the pages show, else some page would wait for them."""
    from gearchaos.studies.warmup import warmup

    list(warmup((2, 4, 6)))


@pytest.fixture(scope="session")
def server(kernels):
    from browser import served

    with served() as (url, _):
        yield url


@pytest.fixture(scope="session")
def chromium():
    from browser import CHROMIUM

    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def visit(chromium, server):
    """Opens pages with a query and of a size; whatever goes wrong on them fails the test."""
    from browser import Visit

    visits = []

    def begin(query="", size="laptop"):
        visits.append(Visit(chromium, server + query, size))
        return visits[-1]

    yield begin
    for one in visits:
        one.close()


@pytest.fixture
def small(monkeypatch):
    """A view of few cells, all of them 1T."""
    from dataclasses import replace

    import gearchaos as gc
    from gearchaos.explorer.view import state
    from gearchaos.explorer.view.presets import presets

    monkeypatch.setattr(state, "CELLS", (56, 40))
    x, y = gc.Axis("omega", 0.9, 1.1, 56), gc.Axis("eps1", 0.0, 0.02, 40)
    return replace(presets()["2"].view, x=x, y=y, at=(1.0, 0.01))


@pytest.fixture
def no_waiting():
    """Ends what waits for a pipe that nobody writes to."""
    def end(*_):
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
