"""Verdicts against the pinned table of brute force: 2000 random cells of the paper's maps."""

from __future__ import annotations

import numpy as np
import pytest

from gearchaos.dynamics import Label, classify, motion_name
from tests.pinned import brute_force

ROWS = brute_force.read()


@pytest.fixture(scope="module")
def labels():
    """(labels by brute force, label found, row of the table) for every cell."""
    out = []
    for figure in brute_force.FIGURES:
        rows = [row for row in ROWS if int(row["figure"]) == figure]
        found = classify(*brute_force.flow_of(figure, brute_force.cells(figure)[2]), response=False)
        pairs = zip(found.label, found.period, strict=True)
        given = [motion_name(Label(int(label)), int(period)) for label, period in pairs]
        out += list(zip([row["labels"].split("|") for row in rows], given, rows, strict=True))
    return out


def test_the_table_is_of_these_cells():
    for figure in brute_force.FIGURES:
        rows = [row for row in ROWS if int(row["figure"]) == figure]
        x, y = brute_force.cells(figure)[2].values()
        np.testing.assert_array_equal([float(row["x"]) for row in rows], x)
        np.testing.assert_array_equal([float(row["y"]) for row in rows], y)


@pytest.mark.slow
def test_disagreements_are_few_and_of_known_kinds(labels):
    """Chaotic transients that outlast the patience, and chaos too weak to be sure of."""
    wrong = [(wanted, found, row) for wanted, found, row in labels if found not in wanted]
    assert len(wrong) <= 0.003 * len(labels), wrong
    for wanted, found, row in wrong:
        assert found in ("chaotic", "undecided") or "chaotic" in wanted, (wanted, found, row)


def test_hardly_anything_is_undecided(labels):
    for figure in brute_force.FIGURES:
        mine = [found for _, found, row in labels if int(row["figure"]) == figure]
        assert mine.count("undecided") <= 0.005 * len(mine)
