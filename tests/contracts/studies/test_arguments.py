"""Arguments of the studies in every form that is obvious, and in words what is not."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.errors import InputError
from tests.branches import PAIR

MODEL = PAIR.to_model()
QUICK = gc.Classification(transient_lengths=(80,), exponent_run=80, doublings=0, longest_transient=0,
                          averaging_periods=8)
X, Y, START, RATE = "omega=0.9:1.1:2", "q0=0.1:0.2:2", "x1=-1:1:2", "x1_dot=-1:1:2"

# study -> (arguments after the model, options)
STUDIES = {
    "simulate": ((4,), {}), "regime": ((), {"settings": QUICK}),
    "bifurcation": (("eps1=0:0.3:3",), {"points": 4, "settings": QUICK}), "zones": ((X, Y), {"settings": QUICK}),
    "basins": ((START, RATE), {"settings": QUICK}),
    "attractors": ((4,), {"sweep": "omega=0.5:1.5:2", "settings": QUICK}),
}


def _axis(value):
    if not isinstance(value, str):
        return value
    name, numbers = value.split("=")
    start, stop, count = numbers.split(":")
    return gc.Axis(name, float(start), float(stop), int(count))


@pytest.mark.parametrize("name", [*STUDIES, "steady"])
def test_a_pair_and_texts_do_for_a_model_and_axes_and_studies_are_silent_unless_asked(name, capfd):
    """The result of a study of the pair is that of its model, but for the pair that a Dataset carries besides."""
    arguments, options = STUDIES.get(name) or ((gc.regime(MODEL),), {})
    study = getattr(gc, name)
    plain = study(MODEL, *map(_axis, arguments), **{n: _axis(v) for n, v in options.items()})
    found = study(PAIR, *arguments, **options)
    assert capfd.readouterr() == ("", "")
    if name == "regime":
        assert found == plain
        return
    assert json.loads(found.attrs.pop("gears")) == {"pair": json.loads(json.dumps(asdict(PAIR)))}
    assert found.identical(plain)


@pytest.mark.parametrize("name", [*STUDIES, "steady"])
@pytest.mark.parametrize("model", [None, 1.0, "paper", {"omega": 1.0}, gc.MeshModel, xr.Dataset()], ids=str)
def test_what_is_no_model_is_refused_in_words(name, model):
    arguments, options = STUDIES.get(name, ((None,), {}))
    rule = "must be a MeshModel, a GearPair, a GearDesign or a Train"
    with pytest.raises(InputError, match=f"^model {rule}; got ") as error:
        getattr(gc, name)(model, *arguments, **options)
    assert "MeshModel.of" in error.value.advice and len(str(error.value)) < 300


@pytest.mark.parametrize(("name", "place", "field"), [
    ("bifurcation", 0, "axis"), ("zones", 0, "x"), ("zones", 1, "y"), ("basins", 0, "x"), ("basins", 1, "y"),
    ("attractors", "sweep", "sweep")])
@pytest.mark.parametrize(("axis", "message"), [
    (3, "must be an Axis or a text"), (np.linspace(0, 1, 5), "must be an Axis or a text"),
    ("eps1", "must read name=start:stop:count"), ("eps1=0:0.3", "must read name=start:stop:count")], ids=str)
def test_what_is_no_axis_is_refused_in_words(name, place, field, axis, message):
    arguments, options = list(STUDIES[name][0]), {}
    (options if place == "sweep" else arguments)[place] = axis
    with pytest.raises(InputError, match=f"^{field} {message}") as error:
        getattr(gc, name)(MODEL, *arguments, **options)
    assert "eps1=0:0.3:400" in error.value.advice


@pytest.mark.parametrize(("arguments", "message"), [
    ((3, 0, 1, 4), "axis name must be a text"), (("omega", None, 1, 4), "axis omega start must be a number"),
    (("omega", 1, np.array([1.0, 2.0]), 4), "axis omega stop must be a number"),
    (("omega", 1, 2, 3.0), "axis omega count must be a whole number"),
])
def test_values_of_an_axis_of_another_type_are_refused(arguments, message):
    with pytest.raises(InputError, match=f"^{message}"):
        gc.Axis(*arguments)


@pytest.mark.parametrize(("option", "value"), [("threads", 0), ("threads", "2"), ("processes", 0), ("jobs", 0)])
def test_a_number_of_workers_that_is_no_positive_whole_number_is_refused(option, value, tmp_path):
    study, slurm = gc.Zones(MODEL, "omega=1:2:2", "eps1=0:0.1:2"), {"cluster": "slurm"} if option == "jobs" else {}
    with pytest.raises(InputError, match=f"^{option} must be a whole number of at least 1"):
        gc.run(study, out=tmp_path / "s.zarr", **{option: value}, **slurm)
    for call in (lambda: study.run(threads=value), lambda: study.compute(np.arange(study.count), threads=0)):
        with pytest.raises(InputError, match=r"^threads must be a whole number of at least 1"):
            call()


@pytest.mark.parametrize(("name", "why"), [("a\0b", "null"), ("a" * 300, "too long"), ("a" * 300 + "/b", "too long")])
def test_a_store_with_an_impossible_name_is_refused(name, why, tmp_path):
    study = gc.Zones(MODEL, "omega=1:2:2", "eps1=0:0.1:2")
    with pytest.raises(InputError, match=f"^out must be a possible path of a folder; .*{why}"):
        gc.run(study, out=f"{tmp_path}/{name}")


@pytest.mark.parametrize("name", [n for n in STUDIES if n != "simulate"])
def test_what_is_no_budget_is_refused_in_words(name):
    arguments, options = STUDIES[name]
    with pytest.raises(InputError, match=r"^settings must be a Classification"):
        getattr(gc, name)(MODEL, *arguments, **{**options, "settings": {"longest_transient": 100}})


def test_what_is_no_verdict_is_refused_in_words():
    with pytest.raises(InputError, match=r"^verdict must be a Verdict"):
        gc.steady(MODEL, "1T")
    with pytest.raises(InputError, match=r"^verdict must be of a motion that stays bounded"):
        gc.steady(MODEL, gc.regime(gc.MeshModel.of(kind="single", zeta=0.0, q0=1e7, chi0=0.5)))


def test_physical_says_what_to_pass():
    ds = gc.simulate(MODEL, 2)
    for arguments, field in (((PAIR, ds), "dataset"), ((ds, MODEL), "pair"), (("x.nc", PAIR), "dataset")):
        with pytest.raises(InputError, match=f"^{field} must be"):
            gc.physical(*arguments)


def test_save_refuses_names_of_other_formats_and_what_is_no_dataset(tmp_path):
    ds = gc.simulate(MODEL, 2)
    for name in ("x.xlsx", "x.zarr", "x.mat", "x.png"):
        with pytest.raises(InputError, match=r"^path must end in \.nc, \.nc4, \.netcdf, \.h5, \.hdf5, \.csv") as error:
            gc.save(ds, tmp_path / name)
        assert ".csv for tables" in error.value.advice
    assert list(tmp_path.iterdir()) == []
    for value in (MODEL, None):
        with pytest.raises(InputError, match=r"^dataset must be an xarray.Dataset"):
            gc.save(value, tmp_path / "x.nc")
    for name in ("x.nc", "x.NC4", "x", "x.h5"):
        gc.save(ds, tmp_path / name)
        assert gc.load(tmp_path / name).identical(ds)


@pytest.mark.parametrize(("options", "words"), [
    ({"tile": 0}, "tile must be a whole number of at least 1; got 0"),
    ({"tile": 2.5}, "tile must be a whole number of at least 1; got 2.5"),
    ({"tile": "4"}, "tile must be a whole number of at least 1; got '4'"),
    ({"shard": (1, 2)}, "shard must be a text; got (1, 2)"), ({"out": 3}, "out must be a path; got 3"),
    ({"out": None, "tile": 3}, "tile needs out, the folder of a store; got 3"),
])
def test_a_run_refuses_bad_options_before_it_makes_anything(tmp_path, options, words):
    study = gc.Zones(MODEL, X, Y, settings=QUICK)
    with pytest.raises(gc.InputError) as error:
        gc.run(study, **{"out": tmp_path / "s.zarr", **options})
    assert words in str(error.value) and list(tmp_path.iterdir()) == []


def test_only_studies_are_run_and_those_of_a_registered_kind_into_a_store(tmp_path):
    """The record of another kind would be that of another study."""
    with pytest.raises(gc.InputError, match="study must be a study; got 'a MeshModel'"):
        gc.run(MODEL)

    class Other(gc.Zones):
        pass

    with pytest.raises(gc.InputError, match=r"must be of a kind that gearchaos or an installed package offers"):
        gc.run(Other(MODEL, X, Y, settings=QUICK), tmp_path / "s.zarr")
    assert list(tmp_path.iterdir()) == []
