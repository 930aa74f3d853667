"""A result is the same, bit for bit, whatever else is computed beside it: cells, order, tiles, threads."""

from dataclasses import fields

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification, classify
from gearchaos.dynamics.response import MOTION
from gearchaos.execute import tiles
from gearchaos.studies.maps.refine import refined
from tests.flows import flow_of, unit_vectors

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)

KINDS = {
    "torsional": ("torsional", {}),
    "contact ratio": ("torsional", {"contact_ratio": (1.1, 1.9)}),
    "full": ("full", {}),
    "unequal": ("full", {"beta1": (0.01, 0.02), "kappa1": (0.3, 1.0)})}


def random_points(count, ranges):
    rng = np.random.default_rng(5)
    ranges = {"omega": (0.3, 3.0), "eps1": (0.0, 0.3), "q0": (0.0, 0.2), **ranges}
    return {name: rng.uniform(*ends, count) for name, ends in ranges.items()}


def verdicts(kind, values, chosen):
    """Everything `classify` says of the chosen points, arrays (L, ...) by name."""
    flow, w = flow_of(gc.MeshModel.of(kind=kind), {n: v[chosen] for n, v in values.items()})
    found = classify(flow, w, settings=SHORT)
    return {n: np.moveaxis(found[n], c.dims.index(MOTION), 0) for n, c in found.declared().items()}


@pytest.mark.slow
@pytest.mark.parametrize("case", KINDS)
def test_a_verdict_does_not_depend_on_the_lanes_beside_it(case):
    kind, ranges = KINDS[case]
    values = random_points(120, ranges)
    whole = verdicts(kind, values, np.arange(120))
    assert len(np.unique(whole["label"])) > 1
    order = np.random.default_rng(6).permutation(120)
    for chosen in (order[:1], order[1:8], order[8:50], order[50:]):
        for name, value in verdicts(kind, values, chosen).items():
            np.testing.assert_array_equal(value, whole[name][chosen], err_msg=name)


@pytest.mark.parametrize(("kind", "ranges", "law"), [
    *((*case, "always") for case in KINDS.values()), *(("torsional", {"zeta": (0.0, 0.5), "q0": (-0.1, 0.2)}, law)
                                                       for law in ("contact", "unilateral"))])
def test_a_run_does_not_depend_on_whose_slots_it_shares(kind, ranges, law):
    """More lanes than there are slots for, of many step counts, that leave one after the other."""
    flow, w = flow_of(gc.MeshModel.of(kind=kind, damping_law=law), random_points(150, ranges))
    rng = np.random.default_rng(7)
    assert len(np.unique(flow.step_count)) > 10
    points, periods = rng.integers(0, 150, 500), rng.integers(0, 12, 500)
    w = w[:, points] + rng.normal(0.0, 0.3, (len(w), 500))
    frame = unit_vectors(w)
    options = {"growth": True, "sections": 4, "measured": True}
    whole = flow.advance(w, periods, points=points, tangent=frame, **options)
    for i in rng.permutation(500)[:40]:
        alone = flow.advance(w[:, [i]], periods[i], points=points[[i]], tangent=frame[..., [i]], **options)
        for field in fields(whole):
            mine, its = getattr(whole, field.name)[..., i], getattr(alone, field.name)[..., 0]
            if field.name == "growth":  # as long as that of the longest run
                assert not mine[len(its) :].any()
                mine = mine[: len(its)]
            if field.name == "sections":
                assert np.isnan(mine[: len(mine) - len(its)]).all()
                mine = mine[len(mine) - len(its) :]
            np.testing.assert_array_equal(mine, its, err_msg=field.name)


@pytest.mark.parametrize("law", ["always", "contact", "unilateral"])
def test_suspects_that_are_resolved_side_by_side_share_nothing(law):
    """All lanes in one grid and near a boundary at once, so that several packs of suspects are resolved in a tick."""
    flow, w = flow_of(gc.MeshModel.of(damping_law=law, zeta=0.05), random_points(60, {"omega": (0.9, 0.92)}))
    w += np.random.default_rng(8).normal(0.0, 0.3, w.shape)
    for frame in (None, unit_vectors(w)):
        whole = flow.advance(w, 12, tangent=frame)
        assert np.ptp(whole.w[0]) > 0.1
        for i in range(60):
            own = None if frame is None else frame[..., [i]]
            alone = flow.advance(w[:, [i]], 12, points=np.array([i]), tangent=own)
            np.testing.assert_array_equal(whole.w[:, i], alone.w[:, 0])
            np.testing.assert_array_equal(whole.tangent[..., i], alone.tangent[..., 0])


def test_a_map_does_not_depend_on_its_tiles_threads_and_neighbours(monkeypatch):
    model, x, y = gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.4, 1.2, 14), gc.Axis("eps1", 0.0, 0.3, 8)
    whole = gc.zones(model, x, y, settings=SHORT)
    split = tiles.split
    for size, threads in ((7, 1), (50, 2)):
        monkeypatch.setattr(tiles, "split", lambda count, largest=0, threads=0, size=size: split(count, size))
        xr.testing.assert_identical(gc.zones(model, x, y, settings=SHORT, threads=threads), whole)
    turned = gc.zones(model, y, x, settings=SHORT).transpose("eps1", "omega")
    xr.testing.assert_equal(turned, whole)


def test_a_diagram_does_not_depend_on_threads():
    model, axis = gc.MeshModel.of(q0=0.1, eps1=0.1), gc.Axis("omega", 0.8, 1.1, 31)
    one, three = (gc.bifurcation(model, axis, points=16, settings=SHORT, threads=n) for n in (1, 3))
    xr.testing.assert_identical(one, three)


@pytest.mark.slow
def test_refining_spends_cells_on_boundaries_alone_and_says_what_it_inferred():
    model, x, y = gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.4, 1.2, 50), gc.Axis("eps1", 0.0, 0.2, 34)
    whole, coarse = (gc.zones(model, x, y, settings=SHORT, refine=refine) for refine in (1, 8))
    inferred = coarse["inferred"].values == 1
    assert 0.1 < inferred.mean() < 0.9
    for name in whole.data_vars:
        np.testing.assert_array_equal(coarse[name].values[~inferred], whole[name].values[~inferred])
    alike = (coarse["label"] == whole["label"]) & (coarse["period"] == whole["period"])
    assert float(alike.mean()) > 0.97
    assert np.isnan(coarse["v_rms"].values[inferred]).all() and (coarse["contact"].values[inferred] == -1).all()
    meanings = coarse["reason"].attrs["flag_meanings"].split()
    (code,) = np.unique(coarse["reason"].values[inferred])
    assert meanings[list(coarse["reason"].attrs["flag_values"]).index(code)] == "inferred"


def test_parts_of_a_map_refined_in_step_are_as_each_by_itself():
    row, column = np.mgrid[:300, :280]
    label, number = np.where((row - 130) ** 2 + (column - 250) ** 2 < 90**2, 1, 3).ravel(), np.arange(300 * 280)

    def compute(cells):
        return {"label": label[cells], "period": np.ones_like(cells), "reason": np.ones_like(cells)}

    together = refined(compute, number, 280, 16)
    for part in (number // 280 < 256) * 2 + (number % 280 < 256) == np.arange(4)[:, None]:
        for name, values in refined(compute, number[part], 280, 16).items():
            np.testing.assert_array_equal(together[name][part], values)


@pytest.mark.parametrize("refine", [0, 3, 512, True, 2.0])
def test_a_refinement_that_is_no_power_of_two_is_refused(refine):
    with pytest.raises(gc.InputError, match="refine must be a"):
        gc.zones(gc.MeshModel.of(), gc.Axis("omega", 0.4, 1.2, 4), gc.Axis("eps1", 0.0, 0.2, 4), refine=refine)


@pytest.mark.parametrize(("most", "threads", "expected"), [
    (1, 2, [3, 2] * 8), (2, 2, [5] * 8), (9, 2, [5] * 8), (9, 1, [10] * 4), (3, 1, [8, 7, 8, 7, 8, 2]),
    (9, 8, [3, 2] * 8)])
def test_tiles_have_whole_points_at_most_so_many_and_four_for_each_thread(most, threads, expected):
    points = np.repeat(np.arange(16) % 7, [3, 2] * 8)
    found = tiles.split_points(points, most, threads=threads)
    assert [each.stop - each.start for each in found] == expected
    assert [each.start for each in found] == [0, *np.cumsum(expected)[:-1]]
    assert tiles.split_points(points[:0], most, threads=threads) == []
    small = [each.stop - each.start for each in tiles.split_points(points, most, 2, threads)]
    assert max(small) == 2 and sum(small) == 40


@pytest.mark.parametrize(("points", "threads", "expected"), [(1, 2, [5, 5]), (1, 1, [10]), (2, 8, [3, 3, 3, 1] * 2)])
def test_motions_of_fewer_points_than_threads_are_for_all_threads(points, threads, expected):
    found = tiles.split_points(np.repeat(np.arange(points), 10), 9, threads=threads)
    assert [each.stop - each.start for each in found] == expected
