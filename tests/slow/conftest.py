"""The ``slow`` marker for every test of this folder, what runs share, and the explorer's server and browser."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if FOLDER in item.path.parents:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def nursery():
    """Processes of the command with maps that take no time."""
    from tests.slow.instant import Nursery

    with Nursery() as opened:
        yield opened


@pytest.fixture(scope="session")
def whole(nursery, tmp_path_factory):
    """A finished store of an undisturbed run of an instant map."""
    path = tmp_path_factory.mktemp("whole") / "map.zarr"
    nursery.run(path, "--threads", 2).wait()
    return path


@pytest.fixture
def instant(monkeypatch, tmp_path):
    """Maps take no time in this process either; returns the file that names the tiles that are computed."""
    from tests.slow.instant import install

    install(monkeypatch.setattr)
    monkeypatch.setenv("INSTANT_LOG", str(tmp_path / "tiles.log"))
    return tmp_path / "tiles.log"


@pytest.fixture(scope="session")
def kernels():
    """Compiled kernels for most models of the explorer, so that no page has to wait for the compiler."""
    from gearchaos.studies.core.warmup import warmup

    list(warmup((2, 4)))


@pytest.fixture(scope="session")
def server(kernels):
    """The address of a running explorer, with maps of few cells."""
    from tests.slow.browser import served

    with served(few=True) as (url, _):
        yield url


@pytest.fixture(scope="session")
def design_server(kernels):
    """The address of a running explorer of a gear design that other machines can reach, with maps of few cells."""
    from tests.slow.browser import DESIGN, served

    with served(DESIGN, "--host", "0.0.0.0", few=True) as (url, said):
        assert any(line.startswith("warning: ") for line in said)
        yield url.replace("0.0.0.0", "127.0.0.1")


@pytest.fixture(scope="session")
def chromium():
    from tests.slow.browser import CHROMIUM

    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def one(chromium, request):
    """A page that the tests of a file share: of a server with a query, its ``PAGE``; those that need another motion or
    map choose one."""
    from tests.slow.browser import FIRST, START, visits

    server, query = request.module.PAGE
    first = FIRST if server == "design_server" else START
    with visits(chromium, request.getfixturevalue(server), first=first) as begin:
        yield begin(query)


@pytest.fixture
def visit(chromium, server):
    """A function that opens a page with a query and of a size; an error on a page it opened fails the test."""
    from tests.slow.browser import visits

    with visits(chromium, server) as begin:
        yield begin


@pytest.fixture
def visit_design(chromium, design_server):
    from tests.slow.browser import FIRST, visits

    with visits(chromium, design_server, first=FIRST) as begin:
        yield begin
