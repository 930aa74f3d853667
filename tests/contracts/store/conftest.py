"""Fixtures of the tests of stores."""

import pytest

from gearchaos.store.run import run
from tests.contracts.store.stores import MAP, use_instant_results


@pytest.fixture
def instant(monkeypatch):
    use_instant_results(monkeypatch)


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """A finished store of three blocks, which no test changes."""
    with pytest.MonkeyPatch.context() as patch:
        use_instant_results(patch)
        run(MAP, path := tmp_path_factory.mktemp("made") / "map.zarr", tile=8)
    return path
