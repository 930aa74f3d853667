"""`gearchaos.manifolds`: variables, bad input, pictures."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.event_curves import FULL, SINGLE, axes, manifolds


@pytest.mark.slow
def test_manifolds_have_the_variables_that_their_docstring_names():
    ds = manifolds()
    assert ds["z"].dims == ds["z_dot"].dims == ds["manifold"].dims == ("point",)
    assert ds["manifold_stable"].dims == ds["manifold_saddle"].dims == ds["manifold_complete"].dims == ("number",)
    assert ds["saddle_multipliers_real"].dims == ("saddle_number", "exponent")
    periods = ds["saddle_period"].values
    assert ds.sizes["number"] == 4 * periods.sum(), "two branches of each kind at every point"
    assert (np.isfinite(ds["saddle_section_z"]).sum("cycle") == periods).all()


@pytest.mark.parametrize(("model", "options", "words"), [
    (FULL, {}, "must have two coordinates"), (SINGLE, {"period": 0}, "period"),
    (SINGLE, {"length": 0}, "greater than 0"), (SINGLE, {"spacing": 0}, "must lie in"),
    (SINGLE, {"region": {"x1": (0, 1)}}, "region"), (SINGLE, {"region": {"z": (1, 0)}}, "the smaller one first"),
])
def test_bad_input_of_manifolds(model, options, words):
    with pytest.raises(InputError, match=words):
        gc.manifolds(model, **options)


def test_without_saddles_there_are_no_manifolds():
    ds = gc.manifolds(gc.MeshModel.of(kind="single", omega=4.0, zeta=0.5, q0=0.5, eps1=0), period=1)
    assert ds.sizes["point"] == ds.sizes["number"] == ds.sizes["saddle_number"] == 0
    plot.manifolds(ds, ax=axes())


def drawn(ax):
    return [c for c in ax.collections if isinstance(c, LineCollection)]


def test_a_picture_of_manifolds_has_a_line_for_every_branch():
    ds = manifolds()
    stable = ds["manifold_stable"].values
    counts = [({}, stable.size), ({"unstable": False}, stable.sum()), ({"stable": False}, (~stable).sum())]
    for options, count in counts:
        ax = plot.manifolds(ds, ax=axes(), **options)
        assert sum(len(c.get_segments()) for c in drawn(ax)) == count
    assert plot.result(ds).axes[0].lines and (ax.get_xlim(), ax.get_ylim()) == ((-4, 4), (-3, 3))


@pytest.mark.slow
def test_saddles_have_a_colour_each_and_can_be_chosen():
    ds = gc.manifolds(SINGLE.with_values({"omega": 2.3}), period=4, length=1, spacing=0.1)
    count, ax = ds.sizes["saddle_number"], plot.manifolds(ds, ax=axes())
    assert count > 1
    assert len({tuple(c.get_color()[0]) for c in drawn(ax)}) == count and len(drawn(ax)) == 2 * count
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[2:] == [f"saddle {i}, {n}T" for i, n in enumerate(ds["saddle_period"].values)]
    for chosen in (0, count - 1):
        ax = plot.manifolds(ds, ax=axes(), saddles=[chosen])
        assert sum(len(c.get_segments()) for c in drawn(ax)) == (ds["manifold_saddle"] == chosen).sum()
        np.testing.assert_array_equal(ax.lines[0].get_xdata(), ds["saddle_section_z"].values[chosen])
    for wrong in ([count], [-1], [], [0.5], 3, "0"):
        with pytest.raises(InputError, match="must be numbers of saddles"):
            plot.manifolds(ds, ax=axes(), saddles=wrong)
