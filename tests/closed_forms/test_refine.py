"""Refined maps of made-up planes, against what the refinement promises of every cell."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from gearchaos.dynamics import Reason
from gearchaos.studies.maps.refine import SIDE, refined

ROW, COLUMN = np.mgrid[:200, :240]
PLANES = {
    "disc": np.where((ROW - 100) ** 2 + (COLUMN - 90) ** 2 < 70**2, 1, 3),
    "stripes": np.select([COLUMN < 70, COLUMN < 150], [1, 2], default=3),
    "layers": np.select([ROW < 70, ROW < 150], [1, 2], default=3),
    "slope": np.where(ROW + COLUMN / 3 < 130, 1, 3),
    "tongue": np.where(np.abs(ROW - 16 - COLUMN / 2) < 1 + COLUMN / 100, 1, 3),
    "noise": np.random.default_rng(0).integers(1, 4, ROW.shape)}


def refine(label, coarse=16, period=None):
    """What is found of a plane of labels, as planes by name, and how often each cell was computed."""
    counts, period = np.zeros(label.size, dtype=int), np.full(label.shape, 7) if period is None else period

    def compute(cells):
        np.add.at(counts, cells, 1)
        return {
            "label": label.ravel()[cells].astype(np.int8), "period": period.ravel()[cells].astype(np.int32),
            "reason": np.full(len(cells), Reason.ORBIT, np.int8), "v_rms": 0.5 + cells}

    found = refined(compute, np.arange(label.size), label.shape[1], coarse)
    return {n: v.reshape(label.shape) for n, v in found.items()}, counts.reshape(label.shape)


@pytest.mark.parametrize("name", PLANES)
def test_no_cell_is_inferred_beside_a_computed_one_of_another_kind(name):
    """Beside: four cells away along a row or a column, and within that circle across."""
    found, _ = refine(PLANES[name])
    inferred, label = found["inferred"] == 1, found["label"]
    assert inferred.any() == (name != "noise")
    rows, columns = label.shape
    for down in range(-4, 5):
        for right in range(-4, 5):
            if np.hypot(down, right) <= 4:
                here = np.s_[max(-down, 0) : rows - max(down, 0), max(-right, 0) : columns - max(right, 0)]
                there = np.s_[max(down, 0) : rows + min(down, 0), max(right, 0) : columns + min(right, 0)]
                beside = inferred[here] & ~inferred[there]
                assert np.all(label[here][beside] == label[there][beside])


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
    near = np.sum([distance_transform_edt(label == kind) for kind in np.unique(label)], axis=0)  # another label
    for step in (2, 4, 8):
        finer = (ROW % step > 0) | (COLUMN % step > 0)
        asked = (counts == 1) & finer & (label.shape[0] - 1 > ROW) & (label.shape[1] - 1 > COLUMN)
        assert near[asked].max() <= max(step * np.sqrt(2), 5)


def test_another_period_is_another_kind_and_a_line_is_computed_whole():
    period = np.where(COLUMN < 117, 1, 2)
    np.testing.assert_array_equal(refine(np.ones_like(period), period=period)[0]["period"], period)
    for shape in ((1, 300), (300, 1)):
        found, counts = refine(np.ones(shape, dtype=int))
        assert np.all(counts == 1) and not found["inferred"].any()


@pytest.mark.parametrize(("rows", "columns"), [(200, 240), (SIDE + 20, SIDE + 20)])
def test_a_plane_of_one_kind_costs_the_lattices_of_its_parts(rows, columns):
    """Whatever the neighbours: a part of SIDE rows and columns begins one of its own."""
    found, counts = refine(np.full((rows, columns), 3))
    down, across = (np.isin(np.arange(n) % SIDE, range(0, SIDE, 16)) | np.isin(np.arange(n), (SIDE - 1, n - 1))
                    for n in (rows, columns))
    np.testing.assert_array_equal(counts, down[:, None] & across)
    assert np.all(found["label"] == 3)
