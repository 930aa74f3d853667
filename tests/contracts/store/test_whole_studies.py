"""Studies with a single work item, such as branches and curves: stores, records, study files, pictures of any study."""

import numpy as np
import pytest
from matplotlib.axes import Axes

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.store.objects import Objects
from gearchaos.store.record import from_record, to_record
from gearchaos.studies.core.registry import STUDIES
from gearchaos.studyfile import load_study
from tests.commands import ask

MODEL = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
MADE = {
    "branch": lambda: gc.Branch(MODEL, "omega=0.7:0.8", start={"z": 1.0, "z_dot": 0.0}, longest_step=0.1),
    "curve": lambda: gc.Curve(MODEL.with_values({"omega": 1.9}), "flip", "omega=1.7:2.1", "eps1=0:0.06", period=1),
    "manifolds": lambda: gc.Manifolds(MODEL, period=1, length=1.0, region={"z": (-3, 3)}),
    "edge_state": lambda: gc.EdgeTracking(MODEL, {"z": 0.0, "z_dot": 0.0}, {"z": 1.5, "z_dot": 0.0}),
    "skeleton": lambda: gc.Skeleton(
        gc.MeshModel.of(q0=0.1), "omega=1.7:2.3:8", "eps1=0.03:0.09:4", period=1, lines=[1, 1], starts=0)}


@pytest.mark.slow
@pytest.mark.parametrize("kind", MADE)
def test_a_store_holds_what_the_study_finds(kind, tmp_path):
    study = MADE[kind]()
    assert from_record(to_record(study)) == study
    assert gc.run(study, tmp_path / "s.zarr", threads=1).finished
    found = gc.load(tmp_path / "s.zarr")
    made = gc.run(study, threads=1)
    assert found.identical(made) and found.attrs["study"] == kind
    assert list(found.data_vars) == list(made.data_vars) and list(found.coords) == list(made.coords)
    assert gc.run(study, tmp_path / "s.zarr", threads=1).finished  # nothing is left to do


def test_a_study_whose_only_tile_is_not_computed_has_no_result(tmp_path):
    study = gc.Regime(MODEL, settings=Classification(longest_transient=200, doublings=1))
    assert gc.run(study, tmp_path / "s.zarr", threads=1).finished
    for folder in ("blocks", "finished"):  # as if it was lost, and the run killed that computed it again
        Objects(tmp_path / "s.zarr").delete([f"run/{folder}"])
    with pytest.warns(UserWarning, match="1 of 1 tiles"), pytest.raises(InputError, match="must hold its only tile"):
        gc.load(tmp_path / "s.zarr")
    assert gc.run(study, tmp_path / "s.zarr", threads=1).finished


def test_functions_cannot_be_kept_in_a_store(tmp_path):
    study = gc.Branch(MODEL, "omega=0.6:0.8", events={"peak": lambda orbit: orbit.state["z"] - 1})
    with pytest.raises(InputError, match="must have no functions and no other gears among its options"):
        gc.run(study, tmp_path / "s.zarr")
    assert not (tmp_path / "s.zarr").exists()


@pytest.mark.slow
def test_a_study_file_describes_a_branch(tmp_path):
    path = tmp_path / "b.toml"
    path.write_text('[model]\nomega = 1.0\nq0 = 0.1\n[model.error]\namplitudes = [0.206]\n'
                    '[study]\nkind = "branch"\naxis = "eps1=0.2:0.21"\nstart = { x1 = 1 }\n')
    study = load_study(path).study(STUDIES["branch"])
    assert (study.axis.name, study.axis.start, study.axis.stop) == ("eps1", 0.2, 0.21) and study.start == {"x1": 1}
    ask("branch", path, "--out", tmp_path / "b.nc", code=0)
    ask("run", path, "--out", tmp_path / "b.zarr", code=0)
    assert gc.load(tmp_path / "b.nc").identical(gc.load(tmp_path / "b.zarr"))


@pytest.mark.parametrize("shape", [("omega",), ("eps1", "omega")])
def test_a_study_without_a_picture_of_its_own_is_drawn_by_its_shape(shape):
    zones = gc.zones(MODEL, "omega=0.6:0.8:3", "eps1=0.02:0.05:2")
    found = zones[["v_rms"]].isel({dim: 0 for dim in zones.label.dims if dim not in shape}, drop=True)
    ax: Axes = gc.plot.result(found.assign_attrs(study="regime")).axes[0]
    assert "omega" in ax.get_xlabel()
    if len(shape) == 1:
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), found["v_rms"].values)
    else:
        np.testing.assert_array_equal(ax.collections[0].get_array(), found["v_rms"].values)
    assert "<svg" in gc.card(found.assign_attrs(study="regime")).html or len(shape) == 2
