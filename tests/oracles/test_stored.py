"""The stored results of the oracles are whole, and those of the sources as they are."""

from importlib import import_module

import pytest

from tests.oracles import stored

NAMES = sorted(file.stem for file in stored.RESULTS.glob("*.json"))


@pytest.fixture
def file(request):
    pytest.importorskip("heyoka" if "heyoka" in request.param else "scipy", exc_type=ImportError)
    import_module(f"tests.oracles.{request.param}")
    return stored.FILES[request.param]


@pytest.mark.parametrize("file", NAMES, indirect=True)
def test_no_digit_of_a_stored_result_is_changed(file):
    assert file.whole, f"{file.path.name} was edited: restore it, or write it anew with `make oracles`"


@pytest.mark.parametrize("file", NAMES, indirect=True)
def test_stored_results_are_those_of_the_sources(file):
    assert file.valid, f"the sources of {file.path.name} have changed: write it anew with `make oracles`"
