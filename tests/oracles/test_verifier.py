"""The verifier of certificates: true ones are proved, forged and damaged ones refused, its flow contains heyoka's."""

import ast
import copy
import json
import os
import re
import subprocess
import sys
from functools import cache, reduce
from itertools import combinations
from operator import getitem
from pathlib import Path

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import ExactFlow
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TwoLevelStiffness, vary
from gearchaos.model.switched import switched_system

flint = pytest.importorskip("flint", reason="python-flint is not installed", exc_type=ImportError)

from flint import arb, arb_mat, ctx, fmpq  # noqa: E402  (after the test of python-flint)

from gearchaos.proof import verifier  # noqa: E402
from tests.oracles.certificates import Flow, certificate, dyadic, model_fields, reduced, sealed, windows  # noqa: E402

STEPS = SteppedStiffness((1.3, 1.15, 0.8, 0.7, 0.9), (0.05, 0.3, 0.45, 0.7, 0.9))
ONE_LEVEL = TwoLevelStiffness(0.1, 0.2, 1.0)
FULL = {"kind": "full", "omega": 0.7, "eps1": 0.15, "kappa1": 0.7, "mu2": 5.0}
TORSIONAL = {"kind": "torsional", "omega": 1.0, "eps1": 0.206}
ORBITS = {
    "single 3T": ({"kind": "single", "omega": 0.7, "eps1": 0.1}, None, 2, 6),
    "torsional 8T": (TORSIONAL, None, 2, 14),
    "torsional 4T saddle": (TORSIONAL, 4, 2, 7),
    "torsional 1T saddle": (TORSIONAL, 1, 2, 2),
    "torsional, unlike, 2T": ({"kind": "torsional", "omega": 1.3, "eps1": 0.1, "beta1": 0.02, "J1": 1.5}, None, 3, 2),
    "full, alike, 6T": ({"kind": "full", "omega": 0.8, "eps1": 0.1}, None, 4, 12),
    "full, unlike bearings, 1T": (FULL | {"kappa1": 0.5, "mu2": 4.0, "beta1": 0.02}, None, 5, 2),
    "full, unlike supports, 1T": (FULL, None, 6, 2),
    "full, unlike, 1T": (FULL | {"beta1": 0.02, "eps2": 0.02, "theta2": 1.0}, None, 7, 2),
    "stepped 1T": ({"kind": "torsional", "omega": 0.9, "eps1": 0.1, "stiffness": STEPS}, None, 2, 2),
    "fourier 1T": ({"kind": "torsional", "omega": 0.9, "eps1": 0.1, "c1": 0.2, "c2": 0.05, "alpha2": 1.0}, None, 2, 2),
    "one level 1T": ({"kind": "single", "omega": 0.9, "eps1": 0.1, "stiffness": ONE_LEVEL}, None, 2, 2)}


@cache
def orbit(name: str):
    values, period, _, _ = ORBITS[name]
    return gc.orbit(MeshModel.of(**values), period=period)


@cache
def made(name: str, radius: str = "1e-10", phase: str = "0") -> str:
    return json.dumps(certificate(orbit(name).model, orbit(name).points, radius, phase=phase))


def proved(name: str, radius: str = "1e-10", phase: str = "0") -> dict:
    """A fresh copy of a true certificate."""
    return json.loads(made(name, radius, phase))


def refused(forged: dict, step: str) -> None:
    """The checksum is made anew, so that the mathematics has to find the forgery."""
    result = verifier.verify(sealed(forged))
    assert not result.proved
    assert re.match(f"refused: (?:{step})", result.lines[0]), result.lines


def moved(text: str, by: float) -> str:
    with ctx.workprec(256):
        return dyadic(arb(verifier.read(text, verifier.NUMBER, "number")) + arb(by), 200)


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.exhaustive] if ORBITS[name][2] in (5, 6) else []) for name in ORBITS])
def test_true_certificates_are_proved(name):
    c = proved(name)
    result = verifier.verify(c)
    assert result.proved, result.lines
    assert (len(c["coordinates"]), c["period"]) == (ORBITS[name][2], orbit(name).period)
    assert c["stability"]["outside"] == orbit(name).unstable
    assert sum(map(len, c["switches"])) == len(orbit(name).switches)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["torsional 8T", "stepped 1T", "fourier 1T", "full, unlike, 1T"])
def test_another_section_proves_the_same_orbit(name):
    c = proved(name, phase="0.3")
    assert verifier.verify(c).proved
    refused(c | {"phase": "0.30001"}, "existence|switches|contact")


@pytest.mark.slow
@pytest.mark.parametrize("shift, radius", [(1e-6, "1e-8"), (-1e-6, "1e-8"), (1e-10, "1e-11"), (-1e-10, "1e-11")])
@pytest.mark.parametrize("coordinate", [0, 1])
def test_a_moved_centre_is_refused(shift, radius, coordinate):
    c = proved("torsional 8T", radius)
    c["points"][3][coordinate] = moved(c["points"][3][coordinate], shift)
    refused(c, "existence|switches|contact")


def test_a_moved_orbit_is_refused():
    c = proved("torsional 8T", "1e-11")
    c["points"] = [[moved(x, 1e-10) for x in p] for p in c["points"]]
    refused(c, "existence|switches|contact")


def test_8t_is_not_4t_nor_16t():
    c = proved("torsional 8T")
    half = copy.deepcopy(c) | {"period": 4, "points": c["points"][:4], "switches": c["switches"][:4]}
    half["stability"]["Q"] = half["stability"]["Q"][:4]
    refused(half, "existence|switches")
    double = copy.deepcopy(c) | {"period": 16, "points": c["points"] * 2, "switches": c["switches"] * 2}
    double["stability"]["Q"] *= 2
    refused(double, "period")


@pytest.mark.parametrize("name", ["torsional 4T saddle", "torsional 1T saddle"])
def test_a_saddle_is_not_stable(name):
    c = proved(name)
    c["stability"].update(inside=2, outside=0)
    refused(c, "stability: .* inertia")
    stable = proved("torsional 8T")["stability"]["Q"]
    for Q in (stable[: c["period"]], [[["1", "0"], ["0", "1"]]] * c["period"]):
        refused(c | {"stability": c["stability"] | {"Q": Q}}, "stability: Q_. −")
    minus = {"Q": [[["-1", "0"], ["0", "-1"]]] * c["period"]}
    refused(c | {"stability": c["stability"] | minus}, "stability: .* inertia")


@pytest.mark.parametrize("inside, Q", [(1, [["1", "0"], ["0", "-1"]]), (2, [["1", "0"], ["0", "1"]])])
def test_8t_is_no_saddle_and_the_unit_matrix_no_stein_matrix_of_it(inside, Q):
    refused(proved("torsional 8T") | {"stability": {"inside": inside, "outside": 2 - inside, "Q": [Q] * 8}},
            "stability: Q_. −")


PARAMETERS = ["omega", "zeta", "beta", "beta1", "q1", "J1", "eps", "theta", "chi1", "chi2", "contact_ratio"]


@pytest.mark.parametrize("field", PARAMETERS)
def test_parameters_off_by_1e_7_are_refused(field):
    c = proved("torsional 8T", "1e-9")
    model = c["model"]
    for holder, key in {
        "beta": [(model, "beta1"), (model, "beta2")], "eps": [(model["eps"], 0)], "theta": [(model["theta"], 0)],
    }.get(field, [(model["stiffness"] if field in model["stiffness"] else model, field)]):
        if field == "theta":
            model["theta"] = model["theta"] or ["0"]
            holder = model["theta"]
        holder[key] = moved(holder[key], 1e-7)
    refused(c, "coordinates" if field in ("beta1", "J1") else "existence|switches|contact")


@pytest.mark.parametrize("name, within, key", [
    *(("stepped 1T", ("stiffness", key), 1) for key in ("levels", "starts")),
    *(("fourier 1T", ("stiffness", key), 1) for key in ("c", "alpha")),
    *(("full, unlike, 1T", (), key) for key in ("mu1", "kappa2", "zeta_support1")),
    *(("torsional, unlike, 2T", (), key) for key in ("J1", "beta1"))])
def test_stiffness_supports_and_wheels_off_by_1e_7_are_refused(name, within, key):
    c = proved(name)
    holder = reduce(getitem, within, c["model"])
    holder[key] = moved(holder[key], 1e-7)
    refused(c, "existence|switches|contact")


def test_forged_switches_are_refused():
    for change in (
        lambda w: w.pop(0),
        lambda w: w.clear(),
        lambda w: w[0].update(flank=-w[0]["flank"]),
        lambda w: w[0].update(into={"free": "contact", "contact": "free"}[w[0]["into"]]),
        lambda w: w[0]["time"].__setitem__(0, moved(w[0]["time"][0], 1e-7)),
        lambda w: w[0]["time"].__setitem__(0, moved(w[0]["time"][0], -1e-7)),
        lambda w: w[0]["time"].__setitem__(1, "0"),
        lambda w: w[0]["time"].__setitem__(1, "1e-14"),
        lambda w: w[0]["time"].__setitem__(1, "0.3"),
        lambda w: w.insert(1, copy.deepcopy(w[0])),
        lambda w: w.insert(0, {"time": ["1e-3", "1e-9"], "flank": w[0]["flank"], "into": w[0]["into"]}),
        lambda w: w.reverse()):
        c = proved("torsional 8T")
        change(next(windows for windows in c["switches"] if len(windows) >= 2))
        refused(c, "switches|contact")


@pytest.mark.parametrize("name", ["existence", "separation", "contact", "stability"])
@pytest.mark.parametrize("factor", [2.01, -1.0, 0.0])
def test_margins_that_are_not_proved_are_refused(name, factor):
    c = proved("torsional 8T")
    c["margins"][name] = (float.fromhex(c["margins"][name]) * factor).hex()
    refused(c, f"margins.{name}")


def test_any_digit_changed_is_refused(tmp_path):
    text, path = json.dumps(proved("torsional 1T saddle")), tmp_path / "c.json"
    path.write_text(text)
    assert verifier.verify_file(path).proved
    for i, digit in enumerate(text):
        if digit.isdigit():
            path.write_text(text[:i] + str((int(digit) + 1) % 10) + text[i + 1 :])
            result = verifier.verify_file(path)
            assert not result.proved
            assert re.match("refused: (sha256|format|no readable|certificate)", result.lines[0]), result.lines


def test_a_missing_field_is_named():
    for name in verifier.CERTIFICATE:
        c = proved("torsional 1T saddle")
        del c[name]
        if name != "sha256":
            c = sealed(c, words=False)
        assert verifier.verify(c).lines[0].startswith("refused")
    c = proved("torsional 1T saddle")
    del c["margins"]
    refused(c, "certificate: 'margins' missing")


def test_files_that_are_no_certificates_are_refused(tmp_path):
    text = json.dumps(proved("torsional 1T saddle"))
    for number, content in enumerate((
        "", text[:-1], text[: len(text) // 2], "[" * 100_000, "null", "[]", "7", '"text"', text.replace("lie", "liè"),
        text[:-1] + ', "bits": 128}', '{"format": NaN}', "1" * 5000)):
        (path := tmp_path / f"{number}.json").write_text(content)
        assert verifier.verify_file(path).lines[0].startswith("refused")
    assert not verifier.verify_file(tmp_path).proved
    assert not verifier.verify_file(tmp_path / "missing.json").proved


def test_it_runs_as_a_script_and_as_a_module(tmp_path):
    (good := tmp_path / "good.json").write_text(json.dumps(proved("torsional 8T")))
    (bad := tmp_path / "bad.json").write_text(json.dumps(proved("torsional 8T") | {"radius": "1e-9"}))
    for command in ([verifier.__file__], ["-m", "gearchaos.proof.verifier"]):
        for files, code in (([good], 0), ([good, bad], 1), ([], 1)):
            run = subprocess.run([sys.executable, *command, *files], capture_output=True, text=True, check=False)
            assert (run.returncode, run.stderr) == (code, "")
            assert ("exactly one orbit of period 8" in run.stdout) == bool(files)


def test_the_checksum_comes_before_any_number(monkeypatch):
    """Numbers of a damaged file are not evaluated, whatever their size."""
    c = proved("torsional 1T saddle") | {"radius": "1e9999"}
    monkeypatch.setattr(verifier, "fmpq", None)
    assert verifier.verify(c).lines == ["refused: sha256: the file was altered"]
    del c["sha256"]
    assert verifier.verify(c).lines == ["refused: sha256: the file was altered"]


@pytest.mark.parametrize("number", ["1e9999", "1e-9999", "0x1p+9999", "0x1p-9999"])
def test_the_sum_of_exponents_is_bounded(number):
    c = proved("torsional 1T saddle")
    c["stability"]["Q"] = [[[number] * 1000] * 2]
    text = refusal(c)  # 2 * 10^7 in all
    assert "the exponents of its numbers add up to more than 16777216" in text
    c["stability"]["Q"] = [[[number] * 100] * 2]
    assert "points or Q: not of size 2" in refusal(c)


def refusal(forged: dict) -> str:
    (line,) = verifier.verify(sealed(forged, words=False)).lines
    return line


def test_a_few_unknown_keys_are_named_and_the_others_counted():
    c = proved("torsional 1T saddle")
    assert "certificate: 'a0' unknown, 'a1' unknown, 'a2' unknown and 97 more" in refusal(
        c | {f"a{i}": 0 for i in range(10)} | {f"b{i}": 0 for i in range(90)})
    assert refusal(c | {f"a{i}": 0 for i in range(3)}).endswith("'a0' unknown, 'a1' unknown, 'a2' unknown")


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_results_are_printed_in_any_encoding_as_each_file_is_checked(tmp_path, encoding):
    c = proved("torsional 8T")
    c["stability"]["Q"] = [[["1", "0"], ["0", "1"]]] * 8
    (bad := tmp_path / "bad.json").write_text(json.dumps(sealed(c)))
    (good := tmp_path / "good.json").write_text(json.dumps(proved("torsional 1T saddle")))
    for command in ([verifier.__file__], ["-c", "from gearchaos.cli import main; main()", "verify"]):
        run = subprocess.run([sys.executable, *command, bad, good], capture_output=True, check=False,
                             env={**os.environ, "PYTHONIOENCODING": encoding})
        assert (run.returncode, run.stderr) == (1, b"")
        assert b"refused: stability: Q_" in run.stdout and b"exactly one orbit of period 1" in run.stdout


def test_the_first_result_is_not_lost_with_the_second(tmp_path, monkeypatch):
    """As when the check of a later file is interrupted."""
    (good := tmp_path / "good.json").write_text(json.dumps(proved("torsional 1T saddle")))
    (tmp_path / "never.json").write_text("{}")
    script = ("import runpy, sys, pathlib; read = pathlib.Path.read_text\n"
              "def one(path, **named):\n"
              "    if path.name == 'never.json': raise KeyboardInterrupt\n"
              "    return read(path, **named)\n"
              "pathlib.Path.read_text = one; runpy.run_path(sys.argv[0], run_name='__main__')")
    for start, arguments in ((f"import sys; sys.argv = sys.argv[1:]\n{script}", [verifier.__file__]),
                             (script.replace("runpy.run_path(sys.argv[0], run_name='__main__')",
                                             "from gearchaos.cli import main; main()"), ["verify"])):
        run = subprocess.run([sys.executable, "-c", start, *arguments, good, tmp_path / "never.json"],
                             capture_output=True, text=True, check=False)
        assert run.returncode and "exactly one orbit of period 1" in run.stdout


def test_it_shares_no_code_with_the_prover_and_needs_python_flint_alone():
    text, modules = Path(verifier.__file__).read_text(encoding="utf-8"), set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            modules |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            modules.add("." * node.level + (node.module or "").split(".")[0])
    assert modules - sys.stdlib_module_names == {"flint"}
    assert not {"importlib", "runpy", "pkgutil"} & modules and "__import__" not in text
    assert len(text.splitlines()) <= 650


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [TwoLevelStiffness(0.2, 0.2, 1.5), STEPS, HarmonicStiffness((0.2,), (0.3,))])
@pytest.mark.parametrize("tolerance", [0, 1e-4])
def test_images_of_random_segments_contain_the_exact_flow(stiffness, tolerance):
    """Of 30 segments, from very short to long ones, with many that switch at different times or graze."""
    rng, shares, sizes = np.random.default_rng(1), np.linspace(-1, 1, 101), []
    for number in range(30):
        model = MeshModel.of(
            kind=("single", "torsional")[number % 2], omega=rng.uniform(0.4, 2.5), zeta=rng.uniform(0, 0.1),
            q0=rng.uniform(0, 0.2), eps1=rng.uniform(0, 0.3), stiffness=stiffness)
        centre, half = rng.uniform([-2.0, -0.7], [2.0, 0.7]), rng.normal(size=2)
        half *= 10 ** rng.uniform(-6, -0.5) / np.linalg.norm(half)
        x, h = ([fmpq(*v.as_integer_ratio()) for v in w.tolist()] for w in (centre, half))
        with ctx.workprec(64):
            mesh = verifier.Mesh(model_fields(model), [1] if tolerance else [])
            tube = verifier.segment_image(mesh, x, h, [fmpq(*tolerance.as_integer_ratio())] if tolerance else [])
            for sign in (-1, 0, 1) if tolerance else (0,):
                moved = model.with_values({"eps1": model.value("eps1") + sign * tolerance})
                flow = ExactFlow(switched_system(vary(moved, {})))
                states = np.ascontiguousarray((centre + shares[:, None] * half).T)
                ends = flow.advance(states, 1, points=np.zeros(len(shares), int)).w.T
                for share, end in zip(shares, ends, strict=True):
                    at = tube.G * arb_mat([[share], *[[sign * tolerance]] * (tolerance > 0), [1]])
                    assert all((at[i, 0] + arb(0, 1e-11)).contains(arb(end[i])) for i in (0, 1)), (number, share)
            sizes.append(float((tube.G * tube.E)[0, 0].rad()) / np.linalg.norm(half))
    assert np.median(sizes) < 30 + 1e3 * tolerance


@pytest.mark.parametrize("start", [(1.5, 0.4), (0.2, -0.3), (-2.0, 0.0)])
@pytest.mark.parametrize("share", [8, 64, 2**12])
def test_a_step_in_any_contact_state_contains_that_in_the_right_one(start, share):
    with ctx.workprec(64):
        mesh = verifier.Mesh(model_fields(MeshModel.of(omega=1.6, q0=0.1, eps1=0.12, chi1=0.0, chi2=0.0)), [1])
        rows = [[0.01, 0, start[0]], [-0.02, 0, start[1]], [0, 1, 0], [0, 0, 1]]
        tube = verifier.Tube(mesh, arb_mat(rows), arb_mat([[arb(0, 1)], [arb(0, 1e-3)], [1]]), fmpq(0), 0)
        tube.sigma, h = tube.contact(), mesh.rho / share
        after, change = tube.unknown(fmpq(1, 3), h)
        before = tube.G
        tube.frozen(fmpq(1, 3), h)
        for i in range(4):
            assert all(after[i, j].overlaps(tube.G[i, j]) for j in range(3))
            assert (before * tube.E + arb_mat([[change]] * 2 + [[0]] * 2))[i, 0].overlaps((tube.G * tube.E)[i, 0])


def standing(model: MeshModel, z: float, z_dot: float) -> verifier.Tube:
    """The motion from one state at s = 0."""
    tube = verifier.Tube(verifier.Mesh(model_fields(model)), arb_mat([[z], [z_dot], [1]]), arb_mat([[1]]), fmpq(0), 7)
    tube.sigma = tube.contact()
    return tube


@pytest.mark.parametrize("sigma", [-1, 0, 1])
def test_what_a_series_leaves_out_is_bounded_and_part_of_its_end(sigma):
    model = MeshModel.of(omega=1.3, eps1=0.2, q0=0.1, beta1=0.02, c1=0.3, c2=0.1)
    with ctx.workprec(64):
        mesh = verifier.Mesh(model_fields(model))
        h = mesh.rho / 5
        series, end, tail, slope = mesh.expand(fmpq(1, 3), h, sigma)
        assert all(end[i, j].rad() >= tail for i in range(mesh.d) for j in range(mesh.d + 1))
    with ctx.workprec(1024):
        whole, t = verifier.Mesh(model_fields(model)).expand(fmpq(1, 3), h, sigma)[0], arb(h)
        for i, j in np.ndindex(mesh.d, mesh.d + 1):
            rest = [whole[k][i, j] * t ** k for k in range(len(series), len(whole))]
            assert abs(sum(rest, arb(0))) <= tail
            assert abs(sum((k * x / t for k, x in enumerate(rest, len(series))), arb(0))) <= slope


@pytest.mark.parametrize("wrong", [2, 3])
def test_what_a_series_leaves_out_may_hide_a_switch(wrong):
    with ctx.workprec(64):
        tube = standing(MeshModel.of(kind="single", omega=1.3, eps1=0.0, q0=0.0), 0.0, 0.0)
        exact = list(tube.mesh.series(fmpq(0), tube.mesh.rho / 8, 0))
        tube.frozen(fmpq(0), tube.mesh.rho / 8)
        exact[wrong] = arb(1e15)
        tube.mesh.series = lambda *_: exact
        with pytest.raises(verifier.Refused, match="contact state not proved"):
            tube.frozen(fmpq(0), tube.mesh.rho / 8)


@pytest.mark.parametrize("stiffness", [TwoLevelStiffness(0.2, 0.3, 1.4), STEPS, HarmonicStiffness((0.2, 0.1), (0.3,))])
def test_an_interval_of_time_has_every_stiffness_within_it(stiffness):
    mesh = verifier.Mesh(model_fields(MeshModel.of(stiffness=stiffness)))
    for i, j in combinations(range(-1, 41), 2):
        ends = fmpq(i, 20), fmpq(j, 20)
        found = mesh.stiffness_range(*ends)
        inside = [mesh.stiffness_range(t, t) for t in (fmpq(k, 80) for k in range(4 * i, 4 * j))]
        assert all(found.union(x).rad() <= found.rad() * 1.01 + 1e-12 for x in inside), ends


def test_a_window_needs_the_state_before_it_an_order_and_one_sign_of_velocity():
    with ctx.workprec(64):
        model = MeshModel.of(kind="single", omega=1.3, eps1=0.0, q0=0.1)
        mesh = verifier.Mesh(model_fields(model))
        h = mesh.rho / 1000
        crossing = 1 - 1e-9, 0.1
        standing(model, *crossing).window(fmpq(0), h, 1, True)
        for z, z_dot, flank, contact, words in (
                (1 + 1e-9, 0.1, 1, True, "not from the state before"), (*crossing, 1, False, "the state before"),
                (1 - 1e-9, 1e-5, 1, True, "z' is not proved of one sign"), (-1 + 1e-3, -0.1, 1, True, "of one sign"),
                (0.9, 0.1, 1, True, "no crossing"), (1 + 1e-3, -0.1, 1, False, "no crossing")):
            with pytest.raises(verifier.Refused, match=words):
                standing(model, z, z_dot).window(fmpq(0), h, flank, contact)
        twice = [{"time": [s, h / 4], "flank": 1, "into": into} for s, into in ((h, "contact"), (h, "free"))]
        with pytest.raises(verifier.Refused, match="windows out of order"):
            standing(model, 1 - 0.1 * float(h * arb(mesh.T).mid()), 0.1).period(twice)


def parallelogram(*vectors: tuple[float, float]) -> verifier.Parallelogram:
    return verifier.Parallelogram(*([fmpq(*float(v).as_integer_ratio()) for v in vector] for vector in vectors))


def test_a_set_covers_another_only_if_the_map_stretches_it_enough():
    """Free flight without friction: P(z, z') = (z + T z', z'), so that a tall set becomes a sheared one."""
    T = 2 * np.pi / 6.0
    tall = parallelogram((0, 0), (0, 0.5), (0.01, 0))
    sheared = parallelogram((0, 0), (0.45 * T, 0.45), (0.02, 0))
    wide = parallelogram((0, 0), (0, 0.5), (0.1, 0))  # its image has |b| > 1
    aside = parallelogram((1, 0), (0.45 * T, 0.45), (0.02, 0))
    far = parallelogram((2 * T, 2), (0.45 * T, 0.45), (0.02, 0))  # both edges have a < −1
    tight = parallelogram((0, 0), (0.45 * T, 0.45), (0.01005, 0))  # |b| up to 0.995 in its image
    longer = parallelogram((0, 0), (0.499 * T, 0.499), (0.02, 0))  # stretched by 0.2 % only
    with ctx.workprec(64):
        mesh = verifier.Mesh(model_fields(MeshModel.of(kind="single", omega=6.0, zeta=0.0, q0=0.0, eps1=0.0)))
        assert verifier.covered(mesh, tall, sheared, []) > 0
        for first, second in ((sheared, tall), (wide, sheared), *((tall, M) for M in (aside, far, tight, longer))):
            with pytest.raises(verifier.Refused, match="does not cover"):
                verifier.covered(mesh, first, second, [])


def chaotic_set(count: int, **model: float) -> dict:
    """Sets of which the first leads to all others; as its parallelograms are chosen it proves nothing."""
    sets = [{"centre": [str(3 * i), "0"], "unstable": ["1", "0"], "stable": ["0", "1"]} for i in range(count)]
    mesh = MeshModel.of(kind="single", **model)
    return {
        "format": "gearchaos chaotic set", "version": 1, "theorem": "", "model": model_fields(mesh), "tolerances": {},
        "coordinates": ["z", "z_dot"], "bits": 64, "sets": sets, "slack": "0.01", "entropy": "0.01",
        "transitions": [[0, i] for i in range(count)] + [[i, 0] for i in range(1, count)],
        "weights": ["1"] * count, "versions": dict.fromkeys(["python", "gearchaos", "python-flint", "numpy"], "0")}


def test_work_for_a_chaotic_set_is_bounded(monkeypatch):
    monkeypatch.setattr(verifier, "STEPS", 2000)
    many = chaotic_set(65, omega=1.0, zeta=0.1, q0=0.1, eps1=0.1)
    many["entropy"] = "1e-9"
    many["weights"] = ["8"] + ["1"] * 64
    refused(many, "transitions: more than 64 lead from one set")
    many["transitions"].remove([0, 64])
    many["transitions"].append([64, 64])
    refused(many, "sets: one does not cover|contact")
    rest = chaotic_set(2, omega=1.0, zeta=0.1, q0=0.0, eps1=0.0)  # at rest on the contact boundary
    rest["transitions"].append([1, 1])
    rest["sets"][0] = {"centre": ["0.9", "0"], "unstable": ["0.1", "0"], "stable": ["0", "0.1"]}
    refused(rest, "sets: more than 2000 steps for one transition")


def test_sets_apart_are_told_from_sets_that_touch():
    square = parallelogram((0, 0), (1, 0), (0, 1))
    diamond = parallelogram((2, 2), (0.5, 0.5), (0.5, -0.5))  # one of its edges separates them, none of the square
    assert square.apart(parallelogram((2.5, 0), (1, 0), (0, 1))) and diamond.apart(square)
    assert not square.apart(parallelogram((2, 2), (1, 0), (0, 1)))
    assert not square.apart(parallelogram((1.5, 1.5), (1, 0), (0, 1))) and not square.apart(diamond)


def test_an_interval_that_is_not_a_number_passes_no_test():
    nothing = arb(0, 1) / arb(0, 1)
    assert verifier.largest([arb(1), nothing, arb(2)]).is_nan()
    with pytest.raises(verifier.Refused):
        verifier.stability([arb_mat([[nothing]])], [flint.fmpq_mat([[1]])])


SHAPES = (
    {"kind": "single", "beta": 0.0}, {"kind": "torsional"}, {"kind": "torsional", "beta1": 0.02, "J1": 1.5},
    {"kind": "full"}, {"kind": "full", "beta1": 0.03}, {"kind": "full", "kappa1": 0.8},
    {"kind": "full", "mu2": 6.0, "beta2": 0.0})


def random_model(rng: np.random.Generator, number: int) -> MeshModel:
    values = {"omega": rng.uniform(0.4, 2.5), "zeta": rng.uniform(0, 0.05), "q1": rng.uniform(0, 0.3),
              "eps1": rng.uniform(0, 0.3), "theta1": rng.uniform(0, 6), "eps2": rng.uniform(0, 0.05)}
    values["q2"] = values["q1"] * rng.uniform(0.9, 1.1)
    if number % 3 == 0:
        values |= {"chi1": rng.uniform(0, 0.5), "chi2": rng.uniform(0, 0.5), "contact_ratio": rng.uniform(1, 2)}
    elif number % 3 == 1:
        count = int(rng.integers(1, 9))
        starts = tuple(np.sort(rng.uniform(0, 1, count)))
        values["stiffness"] = SteppedStiffness(tuple(rng.uniform(0.5, 1.6, count)), starts)
    else:
        values |= {"c1": rng.uniform(-0.4, 0.4), "c2": rng.uniform(-0.2, 0.2), "alpha1": rng.uniform(0, 6)}
    model = MeshModel.of(**SHAPES[number % len(SHAPES)], **values)
    names = ("z", "z_dot") if model.kind == "single" else gc.model.COORDINATES[model.kind]
    return model.with_values({name: float(rng.uniform(-0.9, 0.9)) for name in names})


def section(model: MeshModel, start: dict[str, float], names: list[str]) -> np.ndarray:
    """heyoka's state after one mesh period, in the verifier's coordinates."""
    from tests.oracles import heyoka_oracle

    end = heyoka_oracle.section(model.with_values(start), 1)
    return np.array(reduced(model, {k: float(v[0]) for k, v in end.items()}, names))


@pytest.mark.slow
@pytest.mark.parametrize("count", [30, pytest.param(100, marks=pytest.mark.exhaustive)])
def test_the_tube_contains_heyokas_motions(count):
    """Of random models: the motions from the centre and two other states of a cube of half edge 1e-8 or 1e-5."""
    pytest.importorskip("heyoka", reason="heyoka is not installed", exc_type=ImportError)
    rng, done, skipped, switches = np.random.default_rng(5), 0, 0, 0
    widths: list[float] = []
    while done < count:
        radius = (1e-8, 1e-5)[done % 2]
        model = random_model(rng, done + skipped)
        start = {name: float(model.initial[name]) for name in model.initial}
        with ctx.workprec(160):
            mesh = verifier.Mesh(model_fields(model))
            center = reduced(model, start, mesh.names)
            points = [fmpq(*x.as_integer_ratio()) for x in center]
            found = Flow(mesh, fmpq(0)).period([arb(x) for x in points])[1]
            form = [{"time": [verifier.NUMBER], "flank": int, "into": str}]
            claimed = verifier.read(windows(mesh, found, radius, 100), form, "windows")
            tube = verifier.cube(mesh, points, arb(radius), fmpq(0), 0)
            try:
                tube.period(claimed)
            except verifier.Refused:
                skipped += 1
                continue
            done, switches, d = done + 1, switches + len(found), mesh.d
            for trial in range(3):
                shift = 0.2 * radius if trial else 0.0
                near = {name: value + rng.uniform(-shift, shift) for name, value in start.items()}
                step = np.array(reduced(model, near, mesh.names)) - center
                assert np.max(np.abs(step)) < radius
                inside = tube.G * arb_mat([[arb(x, 1e-15)] for x in step] + [[1]])
                truth = section(model, near, mesh.names)
                assert all(arb(truth[i], 2e-12).overlaps(inside[i, 0]) for i in range(d)), (model, trial)
                assert all((tube.G * tube.E)[i, 0].overlaps(arb(truth[i], 2e-12)) for i in range(d))
            widths.append(max(float(tube.G[i, d].rad()) for i in range(d)))
    assert skipped < 0.3 * count and switches > count
    assert np.median(widths[::2]) < 1e-13
