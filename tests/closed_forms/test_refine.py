"""Refined maps of made-up planes, against what the refinement promises of every cell."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from gearchaos.dynamics import Reason
from gearchaos.studies.refine import SIDE, refined

ROW, COLUMN = np.mgrid[:200, :240]
PLANES = {
    "disc": np.where((ROW - 100) ** 2 + (COLUMN - 90) ** 2 < 70**2, 1, 3),
    "stripes": np.select([COLUMN < 70, COLUMN < 150], [1, 2], default=3),
    "layers": np.select([ROW < 70, ROW < 150], [1, 2], default=3),
    "slope": np.where(ROW + COLUMN / 3 < 130, 1, 3),
    "tongue": np.where(np.abs(ROW - 16 - COLUMN / 2) < 1 + COLUMN / 100, 1, 3),
    "noise": np.random.default_rng(0).integers(1, 4, ROW.shape),
}


def refine(label, coarse=16, period=None):
    """What is found of a plane of labels, as planes by name, and how often each cell was computed."""
    counts, period = np.zeros(label.size, dtype=int), np.full(label.shape, 7) if period is None else period

    def compute(cells):
        np.add.at(counts, cells, 1)
        return {
            "label": label.ravel()[cells].astype(np.int8), "period": period.ravel()[cells].astype(np.int32),
            "reason": np.full(len(cells), Reason.ORBIT, np.int8), "v_rms": 0.5 + cells,
        }

    found = refined(compute, np.arange(label.size), label.shape[1], coarse)
    return {n: v.reshape(label.shape) for n, v in found.items()}, counts.reshape(label.shape)


def nearest_other(label):
    """The distance of every cell from the nearest of another label."""
    return np.sum([distance_transform_edt(label == kind) for kind in np.unique(label)], axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANES)
def test_no_cell_is_inferred_beside_a_computed_one_of_another_kind(name):
    """Beside: four cells away along a row or a column, and within that circle across."""
    found, _ = refine(PLANES[name])
    inferred = found["inferred"] == 1
    assert inferred.any() == (name != "noise")
    for row, column in np.argwhere(inferred):
        part = np.s_[max(row - 4, 0) : row + 5, max(column - 4, 0) : column + 5]
        away = np.hypot(ROW[part] - row, COLUMN[part] - column)
        near = ~inferred[part] & (away <= 4)
        assert np.all(found["label"][part][near] == found["label"][row, column])


@pytest.mark.parametrize("name", PLANES)
def test_a_cell_is_computed_once_or_inferred_and_says_which(name):
    found, counts = refine(PLANES[name])
    np.testing.assert_array_equal(counts + found["inferred"], 1)
    np.testing.assert_array_equal(found["reason"] == Reason.INFERRED, found["inferred"] == 1)
    np.testing.assert_array_equal(np.isnan(found["v_rms"]), found["inferred"] == 1)
    computed = found["inferred"] == 0
    np.testing.assert_array_equal(found["v_rms"][computed], 0.5 + np.flatnonzero(computed))
    np.testing.assert_array_equal(found["label"][computed], PLANES[name][computed])


@pytest.mark.parametrize("coarse", [2, 8, 16])
@pytest.mark.parametrize("name", ["disc", "stripes", "layers", "slope", "tongue"])
def test_boundaries_that_the_lattice_meets_come_out_as_they_are(name, coarse):
    found, _ = refine(PLANES[name], coarse)
    np.testing.assert_array_equal(found["label"], PLANES[name])
    assert np.all(found["period"] == 7)


@pytest.mark.parametrize("name", ["disc", "stripes", "layers", "slope"])
def test_cells_off_the_lattice_are_computed_only_where_a_boundary_is_near(name):
    """A cell of the lattice of step s/2 alone is asked for if its block of side s is mixed, or is doubted."""
    label = PLANES[name]
    _, counts = refine(label)
    near = nearest_other(label)
    for step in (2, 4, 8):
        finer = (ROW % step > 0) | (COLUMN % step > 0)
        asked = (counts == 1) & finer & (label.shape[0] - 1 > ROW) & (label.shape[1] - 1 > COLUMN)
        assert near[asked].max() <= max(step * np.sqrt(2), 5)


def test_a_plane_of_one_kind_costs_its_lattice():
    found, counts = refine(np.full((200, 240), 3))
    on_lattice = ((ROW % 16 == 0) | (ROW == 199)) & ((COLUMN % 16 == 0) | (COLUMN == 239))
    np.testing.assert_array_equal(counts, on_lattice)
    assert np.all(found["label"] == 3)


def test_another_period_is_another_kind():
    period = np.where(COLUMN < 117, 1, 2)
    found, _ = refine(np.ones_like(period), period=period)
    np.testing.assert_array_equal(found["period"], period)


@pytest.mark.parametrize("shape", [(1, 300), (300, 1)])
def test_a_line_is_computed_whole(shape):
    found, counts = refine(np.ones(shape, dtype=int))
    assert np.all(counts == 1) and not found["inferred"].any()


def test_parts_have_their_own_lattices():
    """Whatever the neighbours: a part of SIDE rows and columns begins one of its own."""
    _, counts = refine(np.full((SIDE + 20, SIDE + 20), 3))
    row, column = np.mgrid[: SIDE + 20, : SIDE + 20] % SIDE
    ends = np.isin(np.arange(SIDE + 20), (SIDE - 1, SIDE + 19))
    lattice = (ends[:, None] | (row % 16 == 0)) & (ends | (column % 16 == 0))
    np.testing.assert_array_equal(counts, lattice)
