"""Results that somebody changed or cut down: pictures and units refuse them by name, and nothing else happens."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError

PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"],
)
SINGLE = gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)


@pytest.fixture(scope="module")
def results() -> dict[str, xr.Dataset]:
    omega, eps1 = gc.Axis("omega", 0.6, 1.0, 3), gc.Axis("eps1", 0.0, 0.3, 4)
    return {
        "simulate": gc.simulate(SINGLE, 8, 8, samples=16),
        "zones": gc.zones(SINGLE, omega, eps1),
        "bifurcation": gc.bifurcation(SINGLE, eps1, points=8),
        "basins": gc.basins(SINGLE, gc.Axis("z", -3, 3, 4), gc.Axis("z_dot", -2, 2, 4)),
        "attractors": gc.attractors(SINGLE, 16),
    }


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def replaced(name: str, dtype: object, value: object = None):
    """A change that gives a variable another type, and a value."""
    def change(ds: xr.Dataset) -> xr.Dataset:
        array = ds[name].astype(dtype)
        if value is not None:
            array.values[...] = value
        return ds.assign({name: array.variable}) if name in ds.data_vars else ds.assign_coords({name: array.variable})
    return change


def unnamed(name: str):
    """A change that takes the names of its codes from a variable."""
    def change(ds: xr.Dataset) -> xr.Dataset:
        out = ds.copy()
        out[name].attrs = {}
        return out
    return change


def axis_at(name: str, value: float):
    return lambda ds: ds.assign_coords({name: np.full(ds.sizes[name], value)})


DAMAGE = [
    *(("simulate", lambda ds, v=v: ds.assign_attrs(pair=v), r"attrs\['pair'\]")
      for v in ("{bad", "[]", "null", "7", 7, None, b"\xff", '{"n1": 1}', '"abc"', "[" * 10**5)),
    *(("simulate", lambda ds, v=v: ds.assign_attrs(model=v), r"attrs\['model'\]")
      for v in ("{}", "[]", "7", "null", 7, None, b"\xff", '{"stiffness_kind": "harmonics"}', "{bad", "[" * 10**5)),
    *(("simulate", lambda ds, n=n: ds.isel(tau=slice(0, n)), "dataset must have|without values") for n in (0, 1)),
    ("simulate", lambda ds: ds.isel(period=slice(0, 0)), "section_|must be greater|at least"),
    ("simulate", lambda ds: ds.drop_vars("section_z"), "section|x must be one of"),
    ("simulate", lambda ds: ds.drop_vars(["section_z", "z"]), "must be one of"),
    ("simulate", replaced("section_z", str), "must be one of"),
    ("simulate", replaced("z", complex), "must be one of"),
    ("simulate", replaced("tau", float, np.nan), "tau"),
    ("simulate", replaced("tau", str), "tau"),
    *((study, replaced("label", kind), "label of type")
      for study in ("zones", "bifurcation") for kind in (str, float, complex, object)),
    *((study, replaced("period", kind), "period of type")
      for study in ("zones", "bifurcation") for kind in (str, float)),
    *((study, unnamed("label"), "label whose codes are not named") for study in ("zones", "bifurcation")),
    *((study, lambda ds: ds.isel(eps1=slice(0, 0)), "without values") for study in ("zones", "bifurcation")),
    *((study, axis_at("eps1", value), "eps1") for study in ("zones", "bifurcation") for value in (np.nan, np.inf, 0.1)),
    *((study, replaced("eps1", kind), "eps1 of type") for study in ("zones", "bifurcation") for kind in (str, complex)),
    ("zones", lambda ds: ds.assign(period=ds["period"].transpose()), "period over other dims"),
    ("bifurcation", replaced("section_z", str), "must be one of"),
    ("bifurcation", lambda ds: ds.drop_vars("section_z"), "must be one of"),
    ("basins", replaced("attractor", str), "attractor of type"),
    ("basins", lambda ds: ds.drop_vars("attractor_period"), "attractor_period"),
    ("basins", lambda ds: ds.drop_vars("attractor_fraction"), "attractor_fraction"),
    ("basins", unnamed("attractor_label"), "attractor_label whose codes"),
    ("attractors", lambda ds: ds.drop_vars("attractor_section_z"), "attractor_section_z"),
    ("attractors", replaced("attractor_section_z", str), "attractor_section_z of type"),
    ("attractors", unnamed("attractor_label"), "attractor_label whose codes"),
]


@pytest.mark.parametrize(("study", "change", "message"), DAMAGE, ids=[f"{i}-{d[0]}" for i, d in enumerate(DAMAGE)])
def test_a_damaged_result_is_refused_by_name(results, study, change, message):
    changed = change(results[study])
    with pytest.raises(InputError, match=message):
        plot.result(changed)


@pytest.mark.parametrize("study", ["simulate", "zones", "bifurcation", "basins", "attractors"])
def test_a_whole_result_is_drawn(results, study):
    plot.result(results[study])
    plot.result(gc.physical(results[study], PAIR))


def test_exponents_and_colours_of_a_damaged_result_are_refused(results):
    with pytest.raises(InputError, match="lyapunov of type"):
        plot.lyapunov(replaced("lyapunov", str)(results["bifurcation"]))
    with pytest.raises(InputError, match="colour must be one of"):
        plot.result(replaced("v_rms", str)(results["zones"]), "v_rms")


def test_odd_names_of_units_are_drawn_as_text(results):
    changed = results["zones"].copy()
    changed["v_rms"].attrs = {"units": 7, "long_name": 7}
    plot.level(changed)


@pytest.mark.parametrize("kind", [str, complex, object])
def test_units_of_what_is_no_number_are_refused(results, kind):
    with pytest.raises(InputError, match="dataset must hold real numbers in v_rms"):
        gc.physical(replaced("v_rms", kind)(results["zones"]), PAIR)


ARGUMENTS = [
    *(("simulate", plot.spectrum, "orders", v) for v in (-1, 0, np.nan, np.inf, 1e9, "6", None)),
    *(("simulate", plot.history, "periods", v) for v in (-1, 0, np.nan, np.inf, "6", 10**400)),
    *(("simulate", plot.phase, "linewidth", v) for v in (-1, 0, np.nan, "thin")),
    *(("simulate", plot.portrait, "size", v) for v in (-1, 0, "small")),
    *(("bifurcation", plot.bifurcation, "rows", v) for v in (-1, 0, 2.5, 10**9)),
    *(("zones", plot.level, "clip", v) for v in (-1, 101, np.nan, "1")),
    ("zones", plot.level, "cmap", "no such map"),
]


@pytest.mark.parametrize(("study", "draw", "name", "value"), ARGUMENTS)
def test_sizes_that_cannot_be_drawn_are_refused(results, study, draw, name, value):
    with pytest.raises(InputError, match=f"^{name} must be"):
        draw(results[study], **{name: value})


@pytest.mark.parametrize(("draw", "name", "value"), [
    (plot.stiffness, "periods", 0), (plot.stiffness, "periods", 10**12), (plot.backlash, "reach", 1),
    (plot.backlash, "reach", -3), (plot.backlash, "reach", np.nan),
])
def test_characteristics_of_no_extent_are_refused(draw, name, value):
    with pytest.raises(InputError, match=f"^{name} must be"):
        draw(**{name: value})
