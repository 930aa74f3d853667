"""Forged certificates are refused although their words and checksums are made anew; untouched ones are proved."""

import copy
import json
import re
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

import gearchaos as gc
from tests.commands import ask

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
    ((0.990269, -0.0783368), (-0.0569349, -0.0120546), (-0.00282009, 0.00407712)))
FALSE_WORDS = "torsional model has a strange attractor of full measure"


@cache
def orbit() -> dict:
    """The certificate of a stable 8T with 14 contact switches, as read from its file."""
    return json.loads(json.dumps(gc.prove(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)).document))


@cache
def chaotic_set() -> dict:
    """That of a chaotic set of six parallelograms."""
    sets = [(np.array(centre), np.array(axes).T) for centre, *axes in SETS]
    model = gc.MeshModel.of(omega=1.6, q0=0.1, eps1=0.12)
    found = prove_chaotic_set(model, sets, [[0], [0, 1, 2, 3, 4, 5]], 128, {"eps1": "1e-6"})
    return json.loads(json.dumps(found.document))


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


STEPPED = {"form": "stepped", "levels": ["1"], "starts": ["0"]}
BOTH = [
    ("format", "format", "gearchaos proof", ["gearchaos certificate"]),
    ("format", "format: there is no verifier of events", "gearchaos event certificate"),
    ("format", "format: there is no verifier of boxes", "gearchaos box certificate"), ("format!", "format", None),
    ("version", "version", 2), ("version", "certificate.version", True, 1.0),
    ("comment", "certificate: 'comment' unknown", FALSE_WORDS), ("model", "certificate.model", []),
    ("model", "model.kind", {}), ("model.kind", "model.kind", "torsional\n", True),
    ("model.kind", "model: a single model", "single"), ("model.kind", "model: ", "full"),
    ("model.gravity", "model: 'gravity' unknown", "0"), ("model.mu1", "model: 'mu1' unknown", "4"),
    ("model.stiffness.form", "model.stiffness.form", "twolevel", ["two-level"]),
    ("model.stiffness.form", "model.stiffness: ", "fourier"), ("model.stiffness.form!", "model.stiffness.form", None),
    ("model.stiffness", "model.stiffness: ", {"form": "two-level"}),
    ("model.stiffness", "stiffness: levels and starts", STEPPED | {"starts": ["-0.5"]}, STEPPED | {"starts": ["1"]},
     STEPPED | {"levels": ["1", "1"]}, STEPPED | {"levels": [], "starts": []},
     STEPPED | {"levels": ["1", "1"], "starts": ["0.5", "0.5"]}), ("model.stiffness!", "model.stiffness", None),
    ("model.stiffness.contact_ratio", "stiffness.contact_ratio", "2.5", "0.5"),
    ("model.omega", "model.omega", "nan", 1.6, " 1.6", "1.6\n", "1_6", "1/2", "0X1P+0", "١", "1e99999", "1" * 4001),
    ("model.omega", "cannot be evaluated", float("nan"), float("inf")),
    ("model.omega", "model.omega: must be positive", "0"), ("model.omega", "model: motion too fast", "1e9999", "1e-9"),
    ("model.zeta", "model: motion too fast", "1e300"), ("model.eps", "", ["1e9999"]),
    ("model.omega!", "model: 'omega' missing", None), ("model.zeta", "model.zeta: must be positive", "-0.025"),
    ("model.J1", "model.J1: must be positive", "-2"), ("model.beta1", "coordinates", "0.02"),
    ("model.eps", "model.eps", "0.12"), ("model.eps", r"model.eps\[0\]", [0.12]),
    ("model.eps", "model: more than 64", ["0"] * 65),
    ("model.theta", "model: more than 64 harmonics, or more phases", ["0", "1"]),
    ("coordinates", "coordinates", ["z_dot", "z"], ["z", "z_dot", "y"]),
    ("coordinates", r"certificate.coordinates\[1\]", ["z", "z_dot "]),
    ("coordinates", "certificate.coordinates", "z, z_dot"), ("bits", "bits", 31, 4097, 10**400),
    ("bits", "certificate.bits", True, 128.0), ("versions", "certificate.versions: ", {}),
    ("versions.gearchaos", "certificate.versions.gearchaos", FALSE_WORDS),
    ("versions.python", "certificate.versions.python", 3.11)]
"""Path, the beginning of the reason, and the values that are refused for it."""

OF_ORBITS = [
    ("tolerances", "certificate: 'tolerances' unknown", {"eps1": "1e-3"}), ("phase", "phase must lie", "-0.1", "1"),
    ("phase", "existence|switches|contact", "0.5"), ("period", "points, switches and Q", 0, 4, 5000),
    ("period", "certificate.period", 8.0), ("points", "points, switches and Q", []), ("points.0", "points or Q", ["0"]),
    ("points.3.0", "existence|switches|contact|cannot", "0.5", "1e300"),
    ("radius", "phase must lie .* radius", "0", "-1e-7"),
    ("radius", "existence|switches|contact|period|margins", "1e-3"),
    ("radius", "certificate.radius", "1e-7 of the attractor, which is global, and"),
    ("switches.0", "switches|contact|existence", []), ("switches.0.0.time.1", "contact state not proved", "-1e-8", "0"),
    ("switches.0.0.time.1", "switches", "2"), ("switches.0.0.time", "switches: time", ["0.5"]),
    ("switches.0.0.flank", "switches: time must be two numbers, flank", 0, 2),
    ("switches.0.0.flank", r"certificate.switches\[0\]\[0\].flank", True),
    ("switches.0.0.into", r"certificate.switches\[0\]\[0\].into", "contact "),
    ("stability.inside", "stability: Q_0 has other inertia", 1, 3),
    ("stability.outside", "stability: Q_0 has other inertia", -2),
    ("stability.Q.0", "stability.Q: not symmetric", [["1", "1"], ["0", "1"]]),
    ("stability.Q.0", "stability", [["0", "0"], ["0", "0"]], [["1e9", "0"], ["0", "1e9"]]),
    ("stability.Q.0", "points or Q", [["1"]]), ("margins.existence", "margins.existence", "1", "-1", None),
    ("margins.separation", "margins.separation", None)]

OF_CHAOTIC_SETS = [
    ("model.eps.0", "sets: one does not cover", "0.13"),
    ("model.stiffness", "sets: one does not cover", {"form": "fourier", "c": ["0"], "alpha": []}, STEPPED),
    ("period", "certificate: 'period' unknown", 1), ("tolerances", "certificate.tolerances", []),
    ("tolerances", "sets: one does not cover", {"eps1": "1e-3"}),
    ("tolerances", "tolerances.eps1", {"eps1": "-1e-6"}, {"eps1": "1"}),
    ("tolerances", "tolerances: not of", *({name: "1e-9"} for name in ("omega", "eps0", "eps01", "eps65", "eps1 and"))),
    ("sets", "transitions", []), ("sets.2!", "transitions", None),
    ("sets.2.centre.0", "sets: one does not cover", "1.2"),
    ("sets.2.centre", "sets: not of two coordinates", ["1"], ["1", "0", "0"]),
    ("sets.1.unstable", "transitions: two sets to which set 0 leads", ["0.125", "0"]),
    ("sets.0.unstable", "sets: one has no area", ["0", "0"]),
    ("transitions", "transitions: no two closed paths", [], [[0, 0]]),
    ("transitions", "transitions: two sets|entropy", [[0, 0]] * 2),
    ("transitions", "transitions: work", [[0, 0]] * 1001),
    ("transitions+", "transitions: two sets to which set 0 leads", [0, 0]),
    ("transitions+", "sets: one does not cover", [1, 3]),
    ("transitions+", "transitions: one does not join", [0, 99], [0, -1], [0]),
    ("transitions+", r"certificate.transitions\[7\]\[1\]", [0, True]), ("slack", "slack: must be", "0.5", "0.005"),
    ("entropy", "entropy", "0.26", "0"), ("entropy", "certificate.entropy", "infinity"), ("weights", "weights", []),
    ("weights.1", "weights", "0", "-1"), ("weights.1", "entropy", "1e-9"), ("weights+", "weights", "1")]

FORGERIES = [(made, path, reason, value) for made, rows in ((orbit, BOTH + OF_ORBITS), (
    chaotic_set, BOTH + OF_CHAOTIC_SETS)) for path, reason, *values in rows for value in values]


@pytest.mark.slow
@pytest.mark.parametrize("made", [orbit, chaotic_set])
def test_untouched_certificates_are_proved(made):
    result = verifier.verify(made())
    assert result.proved, result.lines
    assert result.lines[0] == f"proved: {made()['theorem']}"


@pytest.mark.slow
@pytest.mark.parametrize(
    "made, path, reason, value", FORGERIES,
    ids=[f"{f.__name__} {path} {str(value)[:24]!a}" for f, path, _, value in FORGERIES])
def test_forgeries_are_refused(made, path, reason, value):
    result = verifier.verify(sealed(changed(made(), path, value)))
    assert not result.proved, result.lines
    assert re.match(f"refused: (?:{reason})", result.lines[0]), result.lines


@pytest.mark.parametrize("made", [orbit, chaotic_set])
@pytest.mark.parametrize("old, new", [
    ("torsional model", FALSE_WORDS), ("need not attract", "attracts"), ("within 1e-7", "within 1e-9"),
    ("at least 0.2", "at least 0.9")])
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
    assert ask("verify", "--script", script, code=0).stdout == ""
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
    for arguments in ((), ("--script", "/nowhere/check.json")):
        ask("verify", *arguments, code=2)
