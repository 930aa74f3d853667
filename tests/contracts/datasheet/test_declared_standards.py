"""A standard or a method is one file: a made-up one beside the others is seen everywhere, in a process of its own."""

import json
import subprocess
import sys

import pytest

from gearchaos.gears.dynamic_factor import standards
from gearchaos.plugins import declared

STANDARD = '''
from dataclasses import dataclass
from typing import ClassVar

from gearchaos.gears.dynamic_factor import Refused, Standard
from gearchaos.gears.io.fields import described


@dataclass(frozen=True, kw_only=True)
class Factor:
    reason: ClassVar[str] = ""
    value: float = described("K_v", "(6.1 + v)/6.1", "Barth")


def factor(design):
    v = design.load.velocity
    return Factor(value=(6.1 + v) / 6.1) if v <= 10 else Refused("It is too fast.")


STANDARD = Standard(name="Kv_Barth", label="Barth", words="Barth", result=Factor, compute=factor)
'''

METHOD = '''
import numpy as np

from gearchaos.gears.stiffness import StiffnessMethod, from_curve
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve

CURVE = PeriodicCurve(np.array([0.0, 0.5, 1.0]), np.array([2e8, 3e8]), np.array([2e8, 3e8]))
METHOD = StiffnessMethod(name="two steps", compute=lambda design: from_curve(CURVE, "two steps"))
'''

SCRIPT = '''
import json, sys
import matplotlib
matplotlib.use("Agg")
import gearchaos.gears.dynamic_factor, gearchaos.gears.stiffness
for folder in (gearchaos.gears.dynamic_factor, gearchaos.gears.stiffness):
    folder.__path__.append(sys.argv[1])
import gearchaos as gc
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.page import sheet_html
design = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque=100.0, speed=500.0,
    backlash={"value": "0.12 mm", "of": "line of action, total"}, stiffness="two steps",
    quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="none")
ds, answer = gc.dynamic_factor(design, "500:2000:2"), DesignAnswer.of(design)
drawn = [text.get_text() for text in gc.plot.dynamic_factor(ds).get_legend().get_texts()]
methods = [text.get_text() for text in gc.plot.mesh_stiffness(design).get_legend().get_texts()]
print(json.dumps({
    "values": ds.Kv_Barth.values.tolist(), "attrs": ds.Kv_Barth.attrs, "drawn": drawn, "methods": methods,
    "quantity": answer.document()["quantities"]["Kv_Barth"], "page": sheet_html([answer]).count("by Barth"),
    "mean": design.mesh_stiffness.reference}))
'''


def test_what_is_declared_is_found_in_the_order_of_the_modules():
    assert [*declared("gearchaos.gears.stiffness", "METHOD")] == ["ISO 6336-1", "potential energy"]
    assert declared("gearchaos.gears.dynamic_factor", "no such name") == {}
    names = [each.name for each in standards()]
    assert names[:2] == ["Kv_ISO_B", "Kv_ISO_C"] and names[2:] == sorted(names[2:])


@pytest.mark.slow
def test_a_standard_and_a_method_are_one_file_each(tmp_path):
    (tmp_path / "barth.py").write_text(STANDARD)
    (tmp_path / "two_steps.py").write_text(METHOD)
    out = subprocess.run([sys.executable, "-c", SCRIPT, str(tmp_path)], capture_output=True, text=True, check=True)
    found = json.loads(out.stdout.replace("NaN", "null"))
    assert found["values"] == [pytest.approx(1 + 0.075 * 500 * 3.141592653589793 / 30 / 6.1), None]
    assert found["attrs"] == {
        "long_name": "dynamic factor by Barth", "units": "1", "refused": "2000 to 2000 rpm: It is too fast."}
    assert "Barth, to 500 rpm" in found["drawn"] and found["page"] == 1
    assert found["quantity"]["value"] == found["values"][0] and found["quantity"]["source"] == "Barth"
    assert found["mean"] == 2.5e8 and len(found["methods"]) == 3 and found["methods"][0].startswith("two steps")
