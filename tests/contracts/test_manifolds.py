"""`gearchaos.manifolds`: variables, bad input, pictures."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.event_curves import FULL, SINGLE, axes, manifolds


def test_manifolds_have_the_variables_that_their_docstring_names():
    ds = manifolds()
    assert ds["z"].dims == ds["z_dot"].dims == ds["manifold"].dims == ("point",)
    assert ds["manifold_stable"].dims == ds["manifold_saddle"].dims == ds["manifold_complete"].dims == ("number",)
    assert ds["saddle_multipliers_real"].dims == ("saddle_number", "exponent")
    periods = ds["saddle_period"].values
    assert ds.sizes["number"] == 4 * periods.sum(), "two branches of each kind at every point"
    assert (np.isfinite(ds["saddle_section_z"]).sum("cycle") == periods).all()


@pytest.mark.parametrize(("model", "options", "words"), [
    (FULL, {}, "must have two coordinates"),
    (SINGLE, {"period": 0}, "period"),
    (SINGLE, {"length": 0}, "greater than 0"),
    (SINGLE, {"spacing": 0}, "must lie in"),
    (SINGLE, {"region": {"x1": (0, 1)}}, "region"),
    (SINGLE, {"region": {"z": (1, 0)}}, "the smaller one first"),
])
def test_bad_input_of_manifolds(model, options, words):
    with pytest.raises(InputError, match=words):
        gc.manifolds(model, **options)


def test_without_saddles_there_are_no_manifolds(tmp_path):
    ds = gc.manifolds(gc.MeshModel.of(kind="single", omega=4.0, zeta=0.5, q0=0.5, eps1=0), period=1)
    assert ds.sizes["point"] == ds.sizes["number"] == ds.sizes["saddle_number"] == 0
    gc.save(ds, tmp_path / "none.nc")
    plot.manifolds(gc.load(tmp_path / "none.nc"), ax=axes())


def test_a_picture_of_manifolds_has_a_line_for_every_branch():
    ds = manifolds()
    stable = ds["manifold_stable"].values
    counts = [({}, stable.size), ({"unstable": False}, stable.sum()), ({"stable": False}, (~stable).sum())]
    for options, count in counts:
        ax = plot.manifolds(ds, ax=axes(), **options)
        drawn = [c for c in ax.collections if isinstance(c, LineCollection)]
        assert sum(len(c.get_segments()) for c in drawn) == count
    assert (ax.get_xlim(), ax.get_ylim()) == ((-4, 4), (-3, 3))
