"""Forged certificates are refused although their words and checksums are made anew; untouched ones are proved."""

import copy
import json
import re
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app

pytest.importorskip("flint", reason="python-flint is not installed", exc_type=ImportError)

from gearchaos.proof import verifier
from gearchaos.proof.families.chaos import prove_chaotic_set
from tests.oracles.certificates import sealed

SETS = (  # centre, unstable and stable half axis
    ((0.905758, 0.0284171), (-0.0868687, -0.0495362), (0.0635185, -0.077236)),
    ((0.772324, -0.0374745), (0.00819133, 0.00365648), (0.040367, -0.0328742)),
    ((1.09832, 0.154202), (-0.00755321, -0.00856628), (-0.02262, 0.0197114)),
    ((0.527357, -0.146068), (0.016877, 0.0087167), (0.0213831, -0.00498253)),
    ((0.709264, 0.235717), (0.0459938, 0.00668631), (0.00418812, -0.00417287)),
    ((0.990269, -0.0783368), (-0.0569349, -0.0120546), (-0.00282009, 0.00407712)),
)
FALSE_WORDS = "torsional model has a strange attractor of full measure"
LONG = "1" * 4001


@cache
def _orbit() -> str:
    return json.dumps(gc.prove(gc.MeshModel.of(kind="torsional", omega=1.0, q0=0.1, eps1=0.206)).document)


@cache
def _chaotic_set() -> str:
    sets = [(np.array(centre), np.array(axes).T) for centre, *axes in SETS]
    model = gc.MeshModel.of(omega=1.6, q0=0.1, eps1=0.12)
    return json.dumps(prove_chaotic_set(model, sets, [[0], [0, 1, 2, 3, 4, 5]], 128, {"eps1": "1e-6"}).document)


def orbit() -> dict:
    """A fresh copy of the certificate of a stable 8T with 14 contact switches."""
    return json.loads(_orbit())


def chaotic_set() -> dict:
    """A fresh copy of the certificate of a chaotic set of six parallelograms."""
    return json.loads(_chaotic_set())


def changed(document: dict, path: str, value: object) -> dict:
    """With another value at a path of keys and numbers, of which "!" at its end deletes, and "+" appends."""
    out = copy.deepcopy(document)
    *keys, last = path.rstrip("!+").split(".")
    holder = out
    for key in keys:
        holder = holder[int(key) if key.isdigit() else key]
    last = int(last) if last.isdigit() else last
    if path.endswith("!"):
        del holder[last]
    elif path.endswith("+"):
        holder[last].append(value)
    else:
        holder[last] = value
    return out


BOTH = [
    ("format", "gearchaos proof", "format"),
    ("format", "gearchaos event certificate", "format: there is no verifier of events"),
    ("format", "gearchaos box certificate", "format: there is no verifier of boxes"),
    ("format", None, "format"),
    ("format", ["gearchaos certificate"], "format"),
    ("format!", None, "format"),
    ("version", 2, "version"),
    ("version", True, "certificate.version"),
    ("version", 1.0, "certificate.version"),
    ("version", "1", "certificate.version"),
    ("comment", FALSE_WORDS, "certificate: 'comment' unknown"),
    ("Model", {}, "certificate: 'Model' unknown"),
    ("model", [], "certificate.model"),
    ("model", {}, "model.kind"),
    ("model.kind", FALSE_WORDS, "model.kind"),
    ("model.kind", "single", "model: a single model"),
    ("model.kind", "full", "model: "),
    ("model.kind", "Torsional", "model.kind"),
    ("model.kind", "torsional\n", "model.kind"),
    ("model.kind", True, "model.kind"),
    ("model.kind!", None, "model.kind"),
    ("model.gravity", "0", "model: 'gravity' unknown"),
    ("model.stiffness.form", "twolevel", "model.stiffness.form"),
    ("model.stiffness.form", "Fourier", "model.stiffness.form"),
    ("model.stiffness.form", "fourier", "model.stiffness: "),
    ("model.stiffness.form", "stepped", "model.stiffness: "),
    ("model.stiffness.form", "constant", "model.stiffness.form"),
    ("model.stiffness.form", ["two-level"], "model.stiffness.form"),
    ("model.stiffness.form!", None, "model.stiffness.form"),
    ("model.stiffness", {"form": "two-level"}, "model.stiffness: "),
    ("model.stiffness", {"form": "twolevel", "levels": ["9"], "starts": ["0"]}, "model.stiffness.form"),
    ("model.stiffness", {"form": "stepped", "levels": ["1"], "starts": ["-0.5"]}, "stiffness: levels and starts"),
    ("model.stiffness", {"form": "stepped", "levels": ["1"], "starts": ["1"]}, "stiffness: levels and starts"),
    ("model.stiffness", {"form": "stepped", "levels": ["1", "1"], "starts": ["0"]}, "stiffness: levels and starts"),
    ("model.stiffness.levels", ["1"], "model.stiffness: 'levels' unknown"),
    ("model.stiffness.chi1", 0.25, "model.stiffness.chi1"),
    ("model.stiffness.contact_ratio", "2.5", "stiffness.contact_ratio"),
    ("model.stiffness.contact_ratio", "0.5", "stiffness.contact_ratio"),
    ("model.omega", "nan", "model.omega"),
    ("model.omega", "inf", "model.omega"),
    ("model.omega", float("nan"), "cannot be evaluated"),
    ("model.omega", float("inf"), "cannot be evaluated"),
    ("model.omega", 1.6, "model.omega"),
    ("model.omega", " 1.6", "model.omega"),
    ("model.omega", "1.6\n", "model.omega"),
    ("model.omega", "1_6", "model.omega"),
    ("model.omega", "1/2", "model.omega"),
    ("model.omega", "+1.6", "model.omega"),
    ("model.omega", "0X1P+0", "model.omega"),
    ("model.omega", "١", "model.omega"),  # a digit in another script
    ("model.omega", "0", "model.omega: must be positive"),
    ("model.omega", "-1.6", "model.omega: must be positive"),
    ("model.omega", "1e9999", "model: motion too fast"),
    ("model.omega", "1e99999", "model.omega"),
    ("model.omega", LONG, "model.omega"),
    ("model.omega!", None, "model: 'omega' missing"),
    ("model.zeta", "-0.025", "model.zeta: must be positive"),
    ("model.J1", "-2", "model.J1: must be positive"),
    ("model.mu1", "4", "model: 'mu1' unknown"),
    ("model.beta1", "0.02", "coordinates"),
    ("model.eps", "0.12", "model.eps"),
    ("model.eps", [0.12], r"model.eps\[0\]"),
    ("model.eps", [["0.12"]], r"model.eps\[0\]"),
    ("model.eps", ["0"] * 65, "model: more than 64"),
    ("model.theta", ["0", "1"], "model: more than 64 harmonics, or more phases"),
    ("coordinates", ["z"], "coordinates"),
    ("coordinates", ["z_dot", "z"], "coordinates"),
    ("coordinates", ["z", "z_dot", "y"], "coordinates"),
    ("coordinates", ["z", "z_dot "], r"certificate.coordinates\[1\]"),
    ("coordinates", ["z", FALSE_WORDS], r"certificate.coordinates\[1\]"),
    ("coordinates", "z, z_dot", "certificate.coordinates"),
    ("bits", 31, "bits"),
    ("bits", 4097, "bits"),
    ("bits", -128, "bits"),
    ("bits", True, "certificate.bits"),
    ("bits", 128.0, "certificate.bits"),
    ("bits", "128", "certificate.bits"),
    ("bits", 10**400, "bits"),
    ("versions", {}, "certificate.versions: "),
    ("versions", ["0.1.0"], "certificate.versions"),
    ("versions.gearchaos", FALSE_WORDS, "certificate.versions.gearchaos"),
    ("versions.theorem", "1", "certificate.versions: 'theorem' unknown"),
    ("versions.python", 3.11, "certificate.versions.python"),
]
"""Path, value, and the beginning of the reason."""

OF_ORBITS = [
    ("model.eps.0", "0.2061", "existence|switches|contact"),
    ("model.stiffness.chi1", "0.2501", "existence|switches|contact"),
    ("tolerances", {"eps1": "1e-3"}, "certificate: 'tolerances' unknown"),
    ("phase", "-0.1", "phase must lie"),
    ("phase", "1", "phase must lie"),
    ("phase", "0.5", "existence|switches|contact"),
    ("phase", 0, "certificate.phase"),
    ("period", 0, "points, switches and Q"),
    ("period", 4, "points, switches and Q"),
    ("period", 16, "points, switches and Q"),
    ("period", -8, "points, switches and Q"),
    ("period", 8.0, "certificate.period"),
    ("period", "8", "certificate.period"),
    ("points", [], "points, switches and Q"),
    ("points.0", ["0"], "points or Q"),
    ("points.3.0", "0.5", "existence|switches|contact"),
    ("points.3.0", 0.5, r"certificate.points\[3\]\[0\]"),
    ("points.3.0", "1e300", "existence|switches|contact|cannot"),
    ("radius", "0", "phase must lie .* radius"),
    ("radius", "-1e-7", "phase must lie .* radius"),
    ("radius", "1e-3", "existence|switches|contact|period|margins"),
    ("radius", "1", "existence|switches|contact|period"),
    ("radius", "1e-7 of the attractor, which is global, and", "certificate.radius"),
    ("switches.0", [], "switches|contact|existence"),
    ("switches.0.0.time.1", "-1e-8", "contact state not proved"),
    ("switches.0.0.time.1", "0", "contact state not proved"),
    ("switches.0.0.time.1", "2", "switches"),
    ("switches.0.0.time", ["0.5"], "switches: time"),
    ("switches.0.0.flank", 0, "switches: time must be two numbers, flank"),
    ("switches.0.0.flank", 2, "switches: time must be two numbers, flank"),
    ("switches.0.0.flank", True, r"certificate.switches\[0\]\[0\].flank"),
    ("switches.0.0.into", "contact ", r"certificate.switches\[0\]\[0\].into"),
    ("switches.0.0.kind", "graze", r"certificate.switches\[0\]\[0\]: 'kind' unknown"),
    ("stability.inside", 1, "stability: Q_0 has other inertia"),
    ("stability.inside", 3, "stability: Q_0 has other inertia"),
    ("stability.outside", -2, "stability: Q_0 has other inertia"),
    ("stability.outside", False, "certificate.stability.outside"),
    ("stability.Q.0", [["1", "1"], ["0", "1"]], "stability.Q: not symmetric"),
    ("stability.Q.0", [["0", "0"], ["0", "0"]], "stability"),
    ("stability.Q.0", [["1e9", "0"], ["0", "1e9"]], "stability"),
    ("stability.Q.0", [["1"]], "points or Q"),
    ("stability.basin", "all", "certificate.stability: 'basin' unknown"),
    ("margins.existence", "1", "margins.existence"),
    ("margins.existence", "-1", "margins.existence"),
    ("margins.existence", None, "margins.existence"),
    ("margins.existence", 0.1, "certificate.margins.existence"),
    ("margins.separation", None, "margins.separation"),
    ("margins.global", "1", "certificate.margins: 'global' unknown"),
]

OF_CHAOTIC_SETS = [
    ("model.eps.0", "0.13", "sets: one does not cover"),
    ("model.omega", "1.7", "sets: one does not cover"),
    ("model.stiffness.chi1", "0.5", "sets: one does not cover"),
    ("model.stiffness", {"form": "fourier", "c": ["0"], "alpha": []}, "sets: one does not cover"),
    ("model.stiffness", {"form": "stepped", "levels": ["1"], "starts": ["0"]}, "sets: one does not cover"),
    ("period", 1, "certificate: 'period' unknown"),
    ("seconds", 1.0, "certificate: 'seconds' unknown"),
    ("tolerances", [], "certificate.tolerances"),
    ("tolerances", {"eps1": "1e-3"}, "sets: one does not cover"),
    ("tolerances", {"eps1": "-1e-6"}, "tolerances.eps1"),
    ("tolerances", {"eps1": "1"}, "tolerances.eps1"),
    ("tolerances", {"eps1": 1e-6}, "tolerances.eps1"),
    ("tolerances", {"omega": "1e-9"}, "tolerances: not of"),
    ("tolerances", {"eps0": "1e-9"}, "tolerances: not of"),
    ("tolerances", {"eps01": "1e-9"}, "tolerances: not of"),
    ("tolerances", {"eps65": "1e-9"}, "tolerances: not of"),
    ("tolerances", {"eps1 and everything else": "1e-9"}, "tolerances: not of"),
    ("sets", [], "transitions"),
    ("sets.2!", None, "transitions"),
    ("sets.2.centre.0", "1.2", "sets: one does not cover"),
    ("sets.2.centre", ["1"], "sets: not of two coordinates"),
    ("sets.2.centre", ["1", "0", "0"], "sets: not of two coordinates"),
    ("sets.2.centre.0", 1.0, r"certificate.sets\[2\].centre\[0\]"),
    ("sets.1.unstable", ["0.125", "0"], "transitions: two sets to which set 0 leads"),
    ("sets.3.unstable", ["0.125", "0"], "sets: one does not cover"),
    ("sets.0.unstable", ["0", "0"], "sets: one has no area"),
    ("sets.0.unstable", ["1e-9", "1e-9"], "sets: one does not cover"),
    ("sets.0.width", "1", r"certificate.sets\[0\]: 'width' unknown"),
    ("transitions", [], "transitions: no two closed paths"),
    ("transitions", [[0, 0]], "transitions: no two closed paths"),
    ("transitions", [[0, 0]] * 2, "transitions: two sets|entropy"),
    ("transitions+", [0, 0], "transitions: two sets to which set 0 leads"),
    ("transitions+", [1, 3], "sets: one does not cover"),
    ("transitions+", [1, 0], "transitions: two sets|sets: one"),
    ("transitions+", [0, 99], "transitions: one does not join"),
    ("transitions+", [0, -1], "transitions: one does not join"),
    ("transitions+", [0], "transitions: one does not join"),
    ("transitions+", [0, True], r"certificate.transitions\[7\]\[1\]"),
    ("transitions+", [0, 1.0], r"certificate.transitions\[7\]\[1\]"),
    ("transitions", [[0, 0]] * 1001, "transitions: work"),
    ("slack", "0.5", "slack: must be"),
    ("slack", "0.005", "slack: must be"),
    ("slack", "-0.01", "slack: must be"),
    ("slack", 0.01, "certificate.slack"),
    ("entropy", "0.26", "entropy"),
    ("entropy", "0", "entropy"),
    ("entropy", "-1", "entropy"),
    ("entropy", "infinity", "certificate.entropy"),
    ("entropy", 0.1, "certificate.entropy"),
    ("weights", [], "weights"),
    ("weights.1", "0", "weights"),
    ("weights.1", "-1", "weights"),
    ("weights.1", "1e-9", "entropy"),
    ("weights+", "1", "weights"),
]

FORGERIES = [(orbit, *row) for row in BOTH + OF_ORBITS] + [(chaotic_set, *row) for row in BOTH + OF_CHAOTIC_SETS]


@pytest.mark.slow
@pytest.mark.parametrize("made", [orbit, chaotic_set])
def test_untouched_certificates_are_proved(made):
    result = verifier.verify(made())
    assert result.proved, result.lines
    assert result.lines[0] == f"proved: {made()['theorem']}"


@pytest.mark.slow
@pytest.mark.parametrize(
    "made, path, value, reason", FORGERIES,
    ids=[f"{f.__name__} {path} {str(value)[:24]!a}" for f, path, value, _ in FORGERIES])
def test_forgeries_are_refused(made, path, value, reason):
    result = verifier.verify(sealed(changed(made(), path, value)))
    assert not result.proved, result.lines
    assert re.match(f"refused: (?:{reason})", result.lines[0]), result.lines


@pytest.mark.parametrize("made", [orbit, chaotic_set])
@pytest.mark.parametrize("old, new", [
    ("torsional model", FALSE_WORDS), ("in these coordinates", "in all coordinates"), ("need not attract", "attracts"),
    ("within 1e-7", "within 1e-9"), ("at least 0.2", "at least 0.9"), ("parameters below", "parameters below or above"),
])
def test_other_words_are_refused(made, old, new):
    """Only the checksum is made anew."""
    document = made()
    if old in document["theorem"]:
        forged = sealed(document | {"theorem": document["theorem"].replace(old, new)}, words=False)
        assert verifier.verify(forged).lines == ["refused: theorem: other words than those of the numbers in the file"]
    for forged in (document | {"theorem": 7}, {key: document[key] for key in document if key != "theorem"}):
        assert re.match("refused: certificate.*theorem", verifier.verify(sealed(forged, words=False)).lines[0])


@pytest.mark.parametrize("made", [orbit, chaotic_set])
@pytest.mark.parametrize("again", ['"bits": 128', '"format": "gearchaos certificate"', '"theorem": "all is proved"'])
def test_a_key_that_is_there_twice_is_refused(made, again, tmp_path):
    path, text = tmp_path / "c.json", json.dumps(made())
    for forged in (f"{text[:-1]}, {again}}}", f"{{{again}, {text[1:]}"):
        path.write_text(forged)
        assert not verifier.verify_file(path).proved


@pytest.mark.slow
def test_changes_that_leave_the_statement_true_are_proved_in_their_own_words():
    """A tenth of the tolerance and a smaller entropy; a torsional model without friction in its bearings as single."""
    c = sealed(changed(chaotic_set(), "tolerances", {"eps1": "1e-7"}) | {"entropy": "0.25"})
    line = verifier.verify(c).lines[0]
    assert "for every eps1 within 1e-7 of its value" in line and "at least 0.25 (" in line
    free = gc.prove(gc.MeshModel.of(kind="torsional", omega=2.3, q0=0.1, eps1=0.05, beta=0.0)).document
    assert "For the single model" in verifier.verify(sealed(changed(free, "model.kind", "single"))).lines[0]


def test_words_have_no_text_of_the_file_but_numbers():
    c = changed(orbit(), "radius", "0x0.00001p-0")
    assert "within 1/1048576 of" not in verifier.sealed(c)["theorem"]
    assert "within 9.5367431640625e-7 of" in verifier.sealed(c)["theorem"]
    third = changed(orbit(), "radius", "0x0.000012345678901234567890p+0")
    assert re.search(r"within \d+/\d+ of", verifier.sealed(third)["theorem"])


@pytest.mark.slow
def test_script_checks_certificates_without_gearchaos(tmp_path):
    script = tmp_path / "check.py"
    result = CliRunner().invoke(app, ["verify", "--script", str(script)], catch_exceptions=False)
    assert (result.exit_code, result.stdout) == (0, "")
    for name, document in (("orbit", orbit()), ("set", chaotic_set())):
        (tmp_path / f"{name}.json").write_text(json.dumps(document))
        (tmp_path / f"forged {name}.json").write_text(json.dumps(sealed(changed(document, "model.kind", "single"))))
    for files, code in ((["orbit.json", "set.json"], 0), (["orbit.json", "forged orbit.json", "forged set.json"], 1)):
        run = subprocess.run([sys.executable, "-I", script, *files], cwd=tmp_path, capture_output=True, text=True,
                             check=False)
        assert (run.returncode, run.stderr) == (code, "")
        assert run.stdout.count("proved: ") == sum("forged" not in name for name in files)
        assert run.stdout.count("refused: model: a single model") == sum("forged" in name for name in files)


def test_verify_needs_certificates_or_a_script():
    result = CliRunner().invoke(app, ["verify"])
    assert result.exit_code == 2
    result = CliRunner().invoke(app, ["verify", "--script", "/nowhere/check.json"])
    assert result.exit_code == 2
