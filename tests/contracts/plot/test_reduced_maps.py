"""Pictures of maps with more cells than pixels, and of what is not computed."""

from functools import partial

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos.datasets import motions, variable
from gearchaos.plot import level, motion_class, response, zones
from gearchaos.plot import reduced as reducing
from gearchaos.plot.reduced import reduced
from gearchaos.store.run import run
from tests.commands import ask

mpl.use("Agg")


def unchanged(dataset):
    return dataset


def made_map(rows, columns, seed=0):
    """A map with random motions, of which a corner is not computed."""
    random = np.random.default_rng(seed)
    label = random.choice([0, -1, 1, 1, 1, 1, 3, 2, 5, 4], size=(rows, columns)).astype(np.int8)
    label[: rows // 3, : columns // 3] = -1
    period = np.where(label == 1, random.choice([1, 1, 1, 2, 3, 8, 9], size=label.shape), 0).astype(np.int32)
    values = {
        "label": label, "period": period, "contact": random.integers(0, 4, label.shape).astype(np.int8),
        "reason": np.where(label > 0, random.integers(1, 5, label.shape), -1).astype(np.int8),
        "v_rms": np.where((label > 0) & (label < 5), random.normal(size=label.shape), np.nan),
        "periods_spent": np.where(label > 0, random.integers(0, 500, label.shape), -1).astype(np.int32)}
    coords = {"eps1": np.linspace(0, 1, rows), "omega": np.linspace(1, 2, columns)}
    return xr.Dataset({n: variable(n, ("eps1", "omega"), v) for n, v in values.items()},
                      {n: variable(n, (n,), v) for n, v in coords.items()}, {"study": "zones"})


ROWS, COLUMNS, MOST = 57, 83, 10
BLOCKS = {"eps1": 5, "omega": 7}


def members(size, number):
    return [i for i in range(size) if i * MOST // size == number]


def cells_of(array, i, j):
    return np.asarray(array)[np.ix_(members(ROWS, i), members(COLUMNS, j))].ravel()


def assert_rarest(shown, classes):
    """Each block shows the class of its cells that is the rarest in the whole map, or that none is computed."""
    count = np.bincount(classes[classes >= 0])
    assert shown.shape == (MOST, MOST)
    for i, j in np.ndindex(MOST, MOST):
        here = [k for k in cells_of(classes, i, j) if k >= 0]
        assert shown[i, j] == (min(set(here), key=lambda k: count[k]) if here else -1)


def test_a_block_shows_the_rarest_of_its_classes_in_the_whole_map():
    plain = made_map(ROWS, COLUMNS)
    small, note = reduced(plain, BLOCKS, unchanged, most=MOST)
    shown = motion_class(small["label"], small["period"])
    assert_rarest(shown, motion_class(plain["label"], plain["period"]))
    assert "57" in note and "reduced from 83 × 57" in note and "rarest" in note
    for i, j in np.argwhere(shown >= 0):
        together = set(zip(*(cells_of(plain[n], i, j).tolist() for n in small.data_vars), strict=True))
        assert tuple(int(small[n][i, j]) for n in small.data_vars) in together
    assert small["label"].dtype == np.int8 and small["label"].attrs.keys() == plain["label"].attrs.keys()
    assert (shown == -1).any() and small.attrs == plain.attrs


@pytest.mark.parametrize("name", ["reason", "contact"])
def test_a_block_shows_the_rarest_code(name):
    def codes(found):
        known = np.where(found["label"] <= 0, -1, found[name].values)
        return np.where(found["label"] == 5, 4, known) if name == "contact" else known  # 4: diverged

    plain = made_map(ROWS, COLUMNS)
    assert_rarest(codes(reduced(plain, BLOCKS, unchanged, name, most=MOST)[0]), codes(plain))


@pytest.mark.parametrize("name", ["v_rms", "periods_spent"])
def test_a_block_shows_the_mean_of_the_known_values(name):
    plain = made_map(ROWS, COLUMNS)
    small, note = reduced(plain, BLOCKS, unchanged, name, most=MOST)
    values = np.where(plain["label"] > 0, plain[name].values, np.nan)
    for i, j in np.ndindex(MOST, MOST):
        here = cells_of(values, i, j)
        expected = np.nanmean(here) if np.isfinite(here).any() else np.nan
        np.testing.assert_allclose(float(small[name][i, j]), expected, rtol=1e-12)
    assert "the mean" in note and small[name].attrs == plain[name].attrs


def test_coordinates_are_the_centres_of_blocks_and_parts_do_not_matter():
    plain = made_map(ROWS, COLUMNS)
    found = [reduced(plain, block, unchanged, "v_rms", most=MOST)[0]
             for block in (BLOCKS, {"eps1": 57, "omega": 83}, {"eps1": 1, "omega": 13})]
    for one in found:
        xr.testing.assert_allclose(one, found[0])
        xr.testing.assert_identical(one[["label", "period"]], found[0][["label", "period"]])
    for j in range(MOST):
        at = plain["omega"].values[members(COLUMNS, j)]
        assert float(found[0]["omega"][j]) == pytest.approx((at[0] + at[-1]) / 2)


def test_a_large_map_is_reduced_and_a_thin_zone_stays_visible(tmp_path, monkeypatch):
    """A line of cells one cell wide is in every column of pixels, where drawing the map itself would lose cells."""
    side = 96

    def computed(self, items, **_):
        row, column = np.divmod(items, self.x.count)
        label = np.where(row == column, 3, 1).astype(np.int8)
        zeros = {n: np.zeros(len(items)) for n in ("v_rms", "multiplier")}
        return {"label": label, "period": (label == 1).astype(np.int32), **zeros}

    monkeypatch.setattr(gc.Zones, "compute", computed)
    run(gc.Zones(gc.MeshModel(), f"omega=0.5:1.1:{side}", f"eps1=0.05:0.3:{side}"), tmp_path / "map.zarr", tile=256)
    monkeypatch.setattr(reducing, "_MOST_CELLS", 64)
    monkeypatch.setattr(reducing, "reduced", partial(reduced, most=32))
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, dpi, **_: drawn.append((figure, dpi)))
    ask("plot", tmp_path / "map.zarr", code=0)
    (figure, dpi), = drawn
    image = figure.axes[0].get_images()[0].get_array()
    assert dpi == reducing.DPI and image.shape == (32, 32)
    np.testing.assert_array_equal(np.argwhere(image == 6), [[i, i] for i in range(32)])
    assert any("reduced from 96 × 96 cells" in text.get_text() for text in figure.texts)


def test_blocks_are_no_more_than_the_pixels_of_their_picture():
    plain = made_map(1200, 1100)
    plain["label"][:] = np.random.default_rng(0).choice([1, 2, 3, 4, 5], size=plain["label"].shape)
    figure = gc.plot.result(plain)
    figure.set_dpi(reducing.DPI)
    figure.draw_without_rendering()
    box = figure.axes[0].get_window_extent()
    assert min(box.width, box.height) >= reducing._MOST_BLOCKS


def test_minus_one_is_not_computed_in_names_and_pictures():
    plain = made_map(20, 30)
    missing = plain["label"].values <= 0
    assert [n == "not computed" for n in motions(plain["label"], plain["period"])] == missing.ravel().tolist()
    image = zones(plain).get_images()[0].get_array()
    np.testing.assert_array_equal(np.ma.getmaskarray(image), missing)
    for name in ("reason", "contact"):
        ax = level(plain, name)
        np.testing.assert_array_equal(np.ma.getmaskarray(ax.get_images()[0].get_array()), missing)
        assert ax.patch.get_hatch()
        assert "-1" not in [t.get_text() for t in ax.get_legend().get_texts()]
    drawn = level(plain, "periods_spent").get_images()[0]
    np.testing.assert_array_equal(np.ma.getmaskarray(drawn.get_array()), missing)
    assert drawn.norm.vmin == plain["periods_spent"].values[~missing].min() >= 0


def test_minus_one_is_no_count_among_counts():
    plain = made_map(20, 30)
    counts = np.where(plain["label"] > 0, plain["contact"].values + 1, -1).astype(np.int16)
    ax = level(plain.assign(attractors=variable("attractors", ("eps1", "omega"), counts)), "attractors")
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["1", "2", "3", "4", "not computed"]
    image = ax.get_images()[0]
    assert image.norm.vmax == 3.5 and image.get_array().max() == 3


def test_minus_one_is_not_computed_in_a_diagram():
    plain = made_map(20, 30).isel(eps1=0).assign_attrs(study="bifurcation")
    missing = plain["label"].values <= 0
    assert missing.any() and not missing.all()
    np.testing.assert_array_equal(np.isnan(response(plain, "periods_spent").lines[0].get_ydata()), missing)
