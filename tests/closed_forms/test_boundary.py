"""Basin entropy, uncertainty exponent and smallest perturbations of planes whose values can be counted by hand."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.studies.motion import basins as boundary


def test_entropy_of_boxes_counted_by_hand():
    """Four boxes of 5 × 5 cells and a rim that is left out: shares 1; 3/5, 2/5; 1; 1/25, 24/25."""
    plane = np.zeros((12, 13), dtype=int)
    plane[:5, 8:10] = 1
    plane[5:10, :5] = 2
    plane[9, 9] = -1
    plane[10:, :], plane[:, 10:] = 5, 7
    two = -(0.6 * np.log(0.6) + 0.4 * np.log(0.4))
    one = -(0.04 * np.log(0.04) + 0.96 * np.log(0.96))
    assert boundary.entropy(plane) == pytest.approx(((two + one) / 4, (two + one) / 2), rel=1e-14)


def test_entropy_of_one_attractor_is_none():
    whole, mixed = boundary.entropy(np.full((10, 10), 3))
    assert whole == 0 and np.isnan(mixed)
    assert np.isnan(boundary.entropy(np.zeros((4, 20), dtype=int))).all()


@pytest.mark.parametrize("turn", range(4))
def test_a_straight_boundary_has_exponent_one_whichever_way_it_runs(turn):
    """Of 100 cells a side k columns of 100 − k see another attractor at a distance k: α is 1 for ever larger planes."""
    plane, k = np.zeros((100, 100), dtype=int), np.array([1, 2, 4, 8, 16])
    plane[:, 40:] = 1
    slope = np.polyfit(np.log(k), np.log(0.5 * k / (100 - k)), 1)[0]
    assert boundary.uncertainty_exponent(np.rot90(plane, turn)) == pytest.approx(slope, rel=1e-12)
    assert slope == pytest.approx(1, abs=0.06)


def test_the_uncertainty_exponent_is_the_slope_of_the_shares():
    """Stripes of 20 cells: a share 2k/20 of the cells differs at a distance k along one of the two ways, up to k = 16
    with 80 cells a side."""
    plane, steps = np.tile(np.repeat([0, 1], 20), 8)[:320] * np.ones((80, 1), dtype=int), (1, 2, 4, 8, 16)
    slope = np.polyfit(np.log(steps), np.log([0.5 * np.mean(plane[:, k:] != plane[:, :-k]) for k in steps]), 1)[0]
    for each in (plane, plane.T):
        assert boundary.uncertainty_exponent(each) == pytest.approx(slope, rel=1e-12)


def test_a_plane_below_64_cells_a_side_has_no_uncertainty_exponent():
    plane = np.zeros((100, 100), dtype=int)
    plane[:, 30:] = 1
    assert np.isfinite(boundary.uncertainty_exponent(plane[:64, :64]))
    for small in (plane[:63], plane[:, :63]):
        assert np.isnan(boundary.uncertainty_exponent(small))


def test_perturbations_are_measured_in_the_units_of_the_plane():
    """Cells twice as high as wide: straight across 0.5, up 0.8; from the edge, too."""
    plane = np.zeros((21, 41), dtype=int)
    plane[:, 30:] = 1
    plane[18:, :] = 2
    x, y = np.linspace(0, 2, 41), np.linspace(-1, 1, 21)
    points = {0.5: [1.0, -1.0], 0.3: [0.0, 0.5], 0.8: [0.2, 0.0]}
    for size, point in points.items():
        others = [np.array([[1.75, -0.5]]), np.array([[1.0, 0.9]])]
        found = boundary.smallest_perturbations(plane, x, y, [np.array([point]), *others])
        np.testing.assert_allclose(found, [size, 0.3, 0.2], atol=1e-9)
    corners = [np.array([corner]) for corner in ((0.0, -1.0), (2.0, -1.0), (2.0, 1.0))]
    np.testing.assert_allclose(boundary.smallest_perturbations(plane, x, y, corners), [1.5, 0.55, 0.3], atol=1e-9)


def test_perturbations_need_a_point_on_the_plane_in_its_own_basin():
    plane = np.zeros((20, 20), dtype=int)
    plane[:, 10:] = 1
    x = y = np.linspace(0.0, 1.9, 20)
    strange = np.array([[0.2, 0.5]])
    for last, size in ([0.5, 2.6], np.nan), ([0.7, 0.5], 0.3):
        found = boundary.smallest_perturbations(plane, x, y, [np.array([[-0.5, 0.5], last]), strange])
        np.testing.assert_allclose(found, [size, np.nan], rtol=1e-6)


def test_a_basin_plane_of_a_single_row_has_no_smallest_perturbation():
    data = gc.basins(gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05), gc.Axis("z", -3, 3, 30),
                     gc.Axis("z_dot", 0.0, 1.0, 1))
    assert data.sizes["number"] > 1 and np.isnan(data.attractor_kick).all()
    assert float(data.attractor_fraction.sum()) == pytest.approx(np.mean(data.attractor >= 0))
