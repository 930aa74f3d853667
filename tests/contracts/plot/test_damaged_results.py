"""Results that somebody changed or cut down: pictures and units refuse them by name, and nothing else happens."""

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.branches import PAIR
from tests.contracts.plot.figures import result


def replaced(name: str, dtype: object, value: object = None):
    def change(ds: xr.Dataset) -> xr.Dataset:
        array = ds[name].astype(dtype)
        if value is not None:
            array.values[...] = value
        return ds.assign({name: array.variable}) if name in ds.data_vars else ds.assign_coords({name: array.variable})
    return change


def unnamed(name: str):
    def change(ds: xr.Dataset) -> xr.Dataset:
        out = ds.copy()
        out[name].attrs = {}
        return out
    return change


DAMAGE = [
    *(("simulate", lambda ds, v=v: ds.assign_attrs(pair=v), r"attrs\['pair'\]")
      for v in ("{bad", "[]", "null", 7, None, b"\xff", '{"n1": 1}', "[" * 10**5)),
    *(("simulate", lambda ds, v=v: ds.assign_attrs(model=v), r"attrs\['model'\]")
      for v in ("{}", "[]", "null", 7, None, b"\xff", '{"stiffness_kind": "harmonics"}', "{bad", "[" * 10**5)),
    *(("simulate", lambda ds, n=n: ds.isel(tau=slice(0, n)), "dataset must have|without values") for n in (0, 1)),
    ("simulate", lambda ds: ds.isel(period=slice(0, 0)), "section_|must be greater|at least"),
    ("simulate", lambda ds: ds.drop_vars("section_z"), "section|x must be one of"),
    ("simulate", lambda ds: ds.drop_vars(["section_z", "z"]), "must be one of"),
    ("simulate", replaced("section_z", str), "must be one of"), ("simulate", replaced("z", complex), "must be one of"),
    ("simulate", replaced("tau", float, np.nan), "tau"), ("simulate", replaced("tau", str), "tau"),
    *((study, change, words) for study in ("zones", "bifurcation") for change, words in [
        *((replaced("label", kind), "label of type") for kind in (str, float, complex, object)),
        *((replaced("period", kind), "period of type") for kind in (str, float)),
        *((replaced("eps1", kind), "eps1 of type") for kind in (str, complex)),
        *((replaced("eps1", float, value), "eps1") for value in (np.nan, np.inf, 0.1)),
        (unnamed("label"), "label whose codes are not named"),
        (lambda ds: ds.isel(eps1=slice(0, 0)), "without values")]),
    ("zones", lambda ds: ds.assign(period=ds["period"].transpose()), "period over other dims"),
    ("bifurcation", lambda ds: replaced("section_z", str)(ds.drop_vars("section_x1")), "must be one of"),
    ("bifurcation", lambda ds: ds.drop_vars(["section_z", "section_x1"]), "must be one of"),
    ("basins", replaced("attractor", str), "attractor of type"),
    ("basins", lambda ds: ds.drop_vars("attractor_period"), "attractor_period"),
    ("basins", lambda ds: ds.drop_vars("attractor_fraction"), "attractor_fraction"),
    ("basins", unnamed("attractor_label"), "attractor_label whose codes"),
    ("attractors", lambda ds: ds.drop_vars("attractor_section_z"), "attractor_section_z"),
    ("attractors", replaced("attractor_section_z", str), "attractor_section_z of type"),
    ("attractors", unnamed("attractor_label"), "attractor_label whose codes")]


@pytest.mark.parametrize(("study", "change", "message"), DAMAGE, ids=[f"{i}-{d[0]}" for i, d in enumerate(DAMAGE)])
def test_a_damaged_result_is_refused_by_name(study, change, message):
    changed = change(result(study)[0])
    with pytest.raises(InputError, match=message):
        plot.result(changed)


def test_exponents_and_colours_of_a_damaged_result_are_refused():
    with pytest.raises(InputError, match="lyapunov of type"):
        plot.lyapunov(replaced("lyapunov", str)(result("bifurcation")[0]))
    with pytest.raises(InputError, match="colour must be one of"):
        plot.result(replaced("v_rms", str)(result("zones")[0]), "v_rms")


def test_odd_names_of_units_are_drawn_as_text():
    changed = result("zones")[0].copy()
    changed["v_rms"].attrs = {"units": 7, "long_name": 7}
    plot.level(changed)


@pytest.mark.parametrize("kind", [str, complex, object])
def test_units_of_what_is_no_number_are_refused(kind):
    with pytest.raises(InputError, match="dataset must hold real numbers in v_rms"):
        gc.physical(replaced("v_rms", kind)(result("zones")[0]), PAIR)


@pytest.mark.parametrize(("study", "draw", "name", "value"), [
    *(("simulate", plot.spectrum, "orders", v) for v in (0, np.nan, np.inf, 1e9, "6", None)),
    *(("simulate", plot.history, "periods", v) for v in (0, np.nan, np.inf, "6", 10**400)),
    *(("simulate", plot.phase, "linewidth", v) for v in (-1, 0, np.nan, "thin")),
    *(("simulate", plot.portrait, "size", v) for v in (0, "small")),
    *(("bifurcation", plot.bifurcation, "rows", v) for v in (0, 2.5, 10**9)),
    *(("zones", plot.level, "clip", v) for v in (-1, 101, np.nan, "1")),
    ("zones", plot.level, "cmap", "no such map"),
    *((None, plot.stiffness, "periods", v) for v in (0, 10**12)),
    *((None, plot.backlash, "reach", v) for v in (1, -3, np.nan))])
def test_sizes_that_cannot_be_drawn_are_refused(study, draw, name, value):
    with pytest.raises(InputError, match=f"^{name} must be"):
        draw(*([result(study)[0]] if study else []), **{name: value})
