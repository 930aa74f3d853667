"""Which tests a change reaches, for `make quick`."""

from functools import cache

import grimp
import pytest

from tests.reach import distances

build_graph = cache(grimp.build_graph)


@pytest.fixture(autouse=True)
def one_graph(monkeypatch):
    monkeypatch.setattr(grimp, "build_graph", build_graph)


@pytest.mark.parametrize(("changed", "near", "far", "apart"), [
    ("src/gearchaos/gears/io/units.py", "gears/io/test_units", "studies/test_assess", "store/test_objects"),
    # reached as gc.assess
    ("src/gearchaos/studies/speeds/assess.py", "studies/test_assess", "cli/test_gear", "gears/io/test_units"),
    ("src/gearchaos/explorer/web/templates/page.html", "explorer/test_state", "cli/test_cli", "plot/test_shape"),
    ("tests/contracts/store/conftest.py", "store/test_damage", "store/test_objects", "plot/test_shape"),
    ("tests/contracts/store/stores.py", "store/test_damage", "store/test_layout", "store/test_objects"),
])
def test_a_change_reaches_the_tests_that_import_it(changed, near, far, apart):
    steps = distances([changed])
    near, far, apart = (steps.get(f"tests/contracts/{name}.py") for name in (near, far, apart))
    assert near <= far and apart is None


def test_documents_and_examples_are_read_by_tests():
    assert set(distances(["docs/gears.md"])) == {"tests/pinned/test_docs.py"}
    assert "tests/contracts/cli/test_cli.py" in distances(["examples/spur_50_50.toml"])
