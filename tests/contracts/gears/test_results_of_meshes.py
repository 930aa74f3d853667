"""Results of trains as those of one of their meshes."""

from __future__ import annotations

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.summaries import map_document, print_map
from gearchaos.datasets import of_mesh
from gearchaos.errors import InputError
from gearchaos.studies.beside_factors import words_beside


@pytest.fixture(scope="module")
def found():
    values = {"stiffness": 2e8, "damping": 60.0, "backlash": 1e-4}
    train = gc.Train(speed=800.0, bodies=[
        gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300.0}]),
        gc.Body(name="one", inertia=5e-4, torque=-0.3), gc.Body(name="other", inertia=5e-4, torque=-0.08)], meshes=[
        gc.Mesh(between=("driver", name), teeth=(20, 30), base_radii=(0.03, 0.045), **values)
        for name in ("one", "other")])
    return gc.zones(train, "speed=790:800:2", "one.torque=-0.3:-0.29:2")


@pytest.mark.slow
def test_the_measures_are_those_of_the_mesh(found):
    first, second = (of_mesh(found, name) for name in ("driver/one", "driver/other"))
    assert not first.contact.any() and second.contact.values.all()
    assert np.array_equal(second.contact, found.contact)
    assert np.array_equal(second.dynamic_factor, found.mesh_dynamic_factor.sel(mesh="driver/other"))
    assert "v_rms" not in second and "v_rms" in found


def test_what_is_drawn_and_printed_says_of_which_mesh_it_is(found, capsys):
    one = of_mesh(found, "driver/one")
    legends = [gc.plot.level(ds, "contact").get_legend() for ds in (found, one)]
    titles = [legend.get_title().get_text().replace("\n", " ") for legend in legends]
    assert titles[0].endswith("of the worst mesh") and titles[1].endswith("of driver/one")
    assert words_beside(found, "z_rms") == ["of driver/one"] and words_beside(found, "switches") == ["of all meshes"]
    document = map_document(found)
    assert document["largest"]["mesh"] == "driver/other" and document["contact"] == {"two-sided": 4}
    print_map(document, found)
    assert capsys.readouterr().out.startswith("worst mesh, one motion each: hit both flanks 100 % of the cells\n")


def test_a_mesh_that_is_not_there_is_refused(found):
    with pytest.raises(InputError, match="must be one of driver/one, driver/other"):
        of_mesh(found, "third")
    with pytest.raises(InputError, match="must be left out for a result without meshes"):
        of_mesh(gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1:2", "eps1=0:0.1:2"), "third")
