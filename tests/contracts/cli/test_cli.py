"""The command line: contracts that other tools rely on, and every bad input in words."""

import io
import json
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from importlib import import_module
from pathlib import Path

import pytest

import gearchaos as gc
from gearchaos.catalogue import STUDIES
from gearchaos.cli.options import study_axes
from gearchaos.studies.core.axis import parse_axis
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.commands import ask, refused, run_json

STUDY = '[model]\nomega = 1.0\n[model.error]\namplitudes = [0.1]\n[study]\nkind = "{kind}"\n'
COMMAND = (sys.executable, "-c", "from gearchaos.cli import main; main()")
HEAVY = ("numba", "xarray", "scipy", "matplotlib", "pint", "h5netcdf", "jinja2", "numpy")
MAP = ("zones", "--axis", "omega=0.9:1.1:2", "--axis", "eps1=0:0.1:2")


def test_nothing_heavy_is_loaded_before_a_command_runs():
    code = (
        "import sys, gearchaos.quantities; from gearchaos.cli import app; from typer.testing import CliRunner;"
        "[CliRunner().invoke(app, command) for command in (['--help'], ['zones', '--help'])];"
        f"print([m for m in {HEAVY!r} if m in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_lists_the_commands_in_groups():
    text = ask("--help").stdout
    panels = re.split(r"(?m)^╭─ (\w+) ─+╮$", text)[1:]
    listed = [(title, re.findall(r"(?m)^│ ([a-z-]+) ", body)) for title, body in zip(*[iter(panels)] * 2, strict=True)]
    studies = {group: [kind.replace("_", "-") for kind, study in STUDIES.items() if study["group"] == group]
               for group in ("Gears", "Motions", "Bifurcations")}
    assert listed[1:] == [
        ("Gears", ["gear", "map", "assess", "modes", *studies["Gears"]]), ("Motions", [*studies["Motions"], "explore"]),
        ("Bifurcations", studies["Bifurcations"]), ("Runs", ["run", "finish", "info", "plot", "export", "check"]),
        ("Proof", ["prove-chaos", "verify", "script", "paper"]), ("Install", ["examples", "warmup", "doctor"])]
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("arguments", [("frobnicate",), ("zones", "--frobnicate"), ("zones",), ("paper",)])
def test_wrong_usage_exits_with_2(arguments):
    result = ask(*arguments)
    assert result.exit_code == 2 and result.stdout == ""


@pytest.mark.parametrize(("kind", "names"), [
    ("single", []), ("torsional", ["x1", "x1_dot", "x2", "x2_dot"]),
    ("full", ["x1", "x1_dot", "x2", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"])])
def test_simulate_json_is_the_section_of_the_study(kind, names):
    sets = [part for text in ("omega=2", "q0=0.2", "eps1=0.1", f"kind={kind}") for part in ("--set", text)]
    found = run_json("simulate", *sets, "--periods", 3, "--transient", 2)
    assert list(found) == ["tau", *names, "z", "z_dot"]
    assert found.pop("tau") == pytest.approx([math.pi * k for k in (3, 4, 5)])
    ds = gc.simulate(gc.MeshModel.of(kind=kind, omega=2.0, q0=0.2, eps1=0.1), 3, transient=2)
    assert found == {name: ds[f"section_{name}"].values.tolist() for name in found}


def test_simulate_takes_its_length_from_the_study_file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format(kind="simulate") + "periods = 5\ntransient = 3\nsamples = 8\n")
    assert len(run_json("simulate", path)["tau"]) == 5
    assert len(run_json("simulate", path, "--periods", 2)["tau"]) == 2


def test_simulate_writes_samples(tmp_path):
    out = tmp_path / "motion.nc"
    result = ask("simulate", "--periods", 2, "--samples", 8, "--out", out, code=0)
    assert "Stroboscopic section" in result.stdout
    assert result.stderr.splitlines()[-1] == f"wrote {out}"  # on a cold cache, it first says that it compiles
    assert gc.load(out).sizes["tau"] == 16
    assert "--samples needs --out" in refused("simulate", "--periods", 1, "--samples", 4)


@pytest.fixture(scope="module")
def pair_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("pair") / "pair.toml"
    path.write_text(
        '[gearpair]\nn1 = 25\nn2 = 50\nR1 = "35 mm"\nR2 = "70 mm"\nI1 = 5e-4\nI2 = 8e-3\nc0 = "400 N/um"\n'
        'k = 530\nbacklash = "0.12 mm"\nM10 = "85 N*m"\nspeed = "14000 rpm"\n')
    return path


def test_simulate_in_physical_units(pair_file):
    plain, scaled = (run_json("simulate", pair_file, "--periods", 2, *options) for options in ((), ("--physical",)))
    assert scaled["units"]["z"] == "µm" and scaled["units"]["tau"] == "ms"
    assert scaled["z"] == pytest.approx([60 * z for z in plain["z"]])
    assert scaled["tau"] == pytest.approx([1e3 * k / (25 * 14000 / 60) for k in (1, 2)])


def test_regime_json_of_a_periodic_motion():
    found, model = run_json("regime", "--set", "eps1=0.206"), gc.MeshModel.of(eps1=0.206)
    verdict = gc.regime(model)
    assert found == json.loads(json.dumps(verdict.to_dict()))
    assert (found["label"], found["period"]) == ("8T", 8)
    assert {len(values) for values in found["section"].values()} == {8}
    assert all(re**2 + im**2 < 1 for re, im in found["multipliers"])
    assert len(found["lyapunov"]) == len(found["lyapunov_ci"]) and found["lyapunov"][0] < 0
    assert found["mesh_force_peak"] == pytest.approx(0.1 * found["dynamic_factor"], rel=1e-14)  # static: q0
    assert found["mesh_force_peak"] == pytest.approx(abs(gc.steady(model, verdict).mesh_force).max().item(), rel=1e-2)
    page = ask("regime", "--set", "eps1=0.206", code=0).stdout
    assert all(text in page for text in ("8T", "Lyapunov exponents", "Floquet multipliers", "dynamic factor"))


def test_regime_json_of_a_chaotic_motion():
    found = run_json("regime", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.23")
    assert (found["label"], found["period"], found["multipliers"]) == ("chaotic", None, [])
    assert 0 < found["lyapunov_ci"][0][0] < found["lyapunov"][0] < found["lyapunov_ci"][0][1]


def test_without_load_there_is_a_peak_mesh_force_but_no_dynamic_factor():
    found = run_json("regime", "--set", "q0=0", "--set", "eps1=0", "--set", "x1=0")
    assert found["dynamic_factor"] is None and found["contact_fraction"] == 0
    found = run_json("regime", "--set", "q0=0", "--set", "eps1=0.4", "--set", "omega=0.9", "--set", "x1=2")
    assert found["dynamic_factor"] is None and found["mesh_force_peak"] > 0


def test_regime_in_physical_units(pair_file):
    scales = load_study(pair_file).pair.scales
    plain, scaled = (run_json("regime", pair_file, *options) for options in ((), ("--physical",)))
    assert plain.keys() | {"omega", "units"} == scaled.keys()
    factors = {
        "v_rms": scales.velocity * 1e3, "z_rms": 60, "z_peak_to_peak": 60, "z_dot_rms": scales.velocity * 1e3,
        "z_dot_peak_to_peak": scales.velocity * 1e3, "mesh_force_peak": scales.force, "dynamic_factor": 1,
        "contact_fraction": 1, "switches_per_period": 1, "trace_error": scales.rate}
    for name, factor in factors.items():
        assert scaled[name] == pytest.approx(factor * plain[name], rel=1e-12), name
    assert scaled["lyapunov"] == pytest.approx([scales.rate * v for v in plain["lyapunov"]])
    assert scaled["lyapunov_ci"][0] == pytest.approx([scales.rate * v for v in plain["lyapunov_ci"][0]])
    assert scaled["section"]["x1"] == pytest.approx([60 * x for x in plain["section"]["x1"]])
    assert scaled["omega"] == pytest.approx(25 * 14000 / 60)
    assert {n: scaled["units"][n] for n in ("omega", "v_rms", "z_rms", "mesh_force_peak", "lyapunov")} == {
        "omega": "Hz", "v_rms": "mm/s", "z_rms": "µm", "mesh_force_peak": "N", "lyapunov": "1/s"}
    assert scaled["units"]["section"]["x1_dot"] == "mm/s" and "label" not in scaled["units"]
    assert scaled["multipliers"] == plain["multipliers"] and scaled["period"] == plain["period"]


@pytest.mark.slow
def test_the_page_of_given_gears_is_in_their_units(pair_file, tmp_path):
    """The units of the printed page do not depend on --physical, which is for JSON, files and pictures."""
    page = ask("regime", pair_file).stdout
    assert page == ask("regime", pair_file, "--physical", "--plot", tmp_path / "p.png").stdout
    assert page.count("V_RMS") == 1 and re.search(r"V_RMS, rms of .* +[\d.]+ mm/s\n", page)
    assert re.search(r"peak mesh force +[\d.]+ N\n", page) and re.search(r"mesh frequency +5833 Hz", page)
    assert re.search(r"speed of wheel 1 +14000 rpm", page) and re.search(r"torque at wheel 1 +85 N m", page)
    assert all(re.search(r"\) 1/s *$", line) for line in page.splitlines() if line.startswith("Lyapunov"))
    assert (tmp_path / "p.png").stat().st_size > 10_000
    assert "--physical needs a study file" in refused("regime", "--physical")
    assert "(µm)" in ask("simulate", pair_file, "--periods", 1).stdout
    assert " rpm" not in ask("regime").stdout


def test_attractors_in_physical_units(pair_file, tmp_path):
    command, out = ("attractors", pair_file, "--starts", 6), tmp_path / "a.nc"
    scales, plain = load_study(pair_file).pair.scales, run_json(*command)
    found = run_json(*command, "--physical", "--out", out)
    assert "units" not in plain
    assert found["units"] == {"v_rms": "mm/s", "lyapunov": "1/s", "lyapunov_lo": "1/s", "lyapunov_hi": "1/s"}
    for one, other in zip(found["attractors"], plain["attractors"], strict=True):
        assert one["v_rms"] == pytest.approx(1e3 * scales.velocity * other["v_rms"], rel=1e-12)
        assert one["lyapunov"] == pytest.approx(scales.rate * other["lyapunov"], rel=1e-12)
        same = ("label", "contact", "fraction", "dynamic_factor", "multiplier", "residual")
        assert all(one[name] == other[name] for name in same)
    assert gc.load(out)["attractor_section_z"].attrs["units"] == "µm"
    page = ask(*command).stdout
    assert page.count("(mm/s)") == page.count("(1/s)") == 1


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    gc.save(gc.zones(gc.MeshModel(), "omega=0.9:1.1:3", "eps1=0:0.2:3", starts=2), folder / "zones.nc")
    gc.save(gc.simulate(gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1), 4), folder / "section.nc")
    return folder


def test_plot_of_saved_data(saved, tmp_path):
    import matplotlib.pyplot as plt

    opened = plt.get_fignums()
    shutil.copy(saved / "section.nc", tmp_path)
    assert (ask("plot", tmp_path / "section.nc", code=0).stdout, plt.get_fignums()) == ("", opened)
    assert (tmp_path / "section.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["section.nc", "section.png"]


def test_plot_says_what_is_possible(saved, tmp_path):
    text = refused("plot", saved / "zones.nc", "--colour", "contakt", "--out", tmp_path / "p.png")
    for words in ("colour must be one of attractors, contact, contact_fraction", "Did you mean 'contact'?", "motion"):
        assert words in text
    assert "--out must end in .png, .pdf, .svg" in refused("plot", saved / "zones.nc", "--out", tmp_path / "p.xyz")
    assert "There is no such file" in refused("plot", tmp_path / "none.nc")
    assert "must be a folder that gearchaos run made" in refused("plot", tmp_path)
    (tmp_path / "words.nc").write_text("words")
    assert "must be a NetCDF file" in refused("plot", tmp_path / "words.nc")
    assert [p.name for p in tmp_path.iterdir()] == ["words.nc"]


def test_plot_of_a_store_is_drawn_beside_it_also_where_one_stands_in_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "error: store must be a folder that gearchaos run made" in refused("plot", ".")
    path, store = tmp_path / "study.toml", tmp_path / "s.zarr"
    path.write_text(STUDY.format(kind="zones") + 'x = "omega=0.9:1.1:2"\ny = "eps1=0:0.1:2"\n')
    ask("run", path, "--out", store, "--threads", 1, code=0)
    monkeypatch.chdir(store)
    ask("plot", ".", code=0)
    plain = (tmp_path / "s.png").read_bytes()
    assert plain.startswith(b"\x89PNG")
    ask("plot", store, "--colour", "v_rms", code=0)  # a colour has a picture of its own
    assert (tmp_path / "s_v_rms.png").read_bytes() != plain == (tmp_path / "s.png").read_bytes()
    refused("plot", store, "--colour", "../v_rms")
    ask("plot", "/", code=2)


def test_zones(tmp_path):
    out, plot = tmp_path / "zones.nc", tmp_path / "zones.png"
    found = run_json(*MAP, "--set", "q0=0.2", "--out", out, "--plot", plot)
    assert found["study"] == "zones" and found["out"] == str(out) and found["plot"] == str(plot)
    assert [(a["name"], a["start"], a["count"]) for a in found["axes"]] == [("omega", 0.9, 2), ("eps1", 0.0, 2)]
    assert sum(found["cells"].values()) == 4
    ds = gc.load(out)
    assert ds.label.dims == ("eps1", "omega") and json.loads(ds.attrs["model"])["q1"] == 0.2
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["zones.nc", "zones.png"]


def test_bifurcation_basins_and_attractors(tmp_path):
    out, plot, single = tmp_path / "b.nc", tmp_path / "b.svg", ("--set", "kind=single", "--set", "omega=0.8")
    found = run_json("bifurcation", *single, "--axis", "eps1=0.05:0.1:3", "--points", 8, "--mode", "up", "--out", out,
                     "--plot", plot)
    assert sum(found["cells"].values()) == 3 and gc.load(out).section_z.shape == (3, 8) and b"<svg" in plot.read_bytes()
    axes = ("--axis", "z=-2:2:3", "--axis", "z_dot=-1:1:3")
    found = run_json("basins", *single, "--set", "eps1=0.1", *axes, "--out", out)
    assert sum(a["fraction"] for a in found["attractors"]) == pytest.approx(1)
    assert {a["label"] for a in found["attractors"]} <= {"1T", "3T"} and gc.load(out).sizes["z_dot"] == 3
    point = ("attractors", *single, "--set", "eps1=0.1", "--starts", 128)
    found = run_json(*point)["attractors"]
    assert [a["label"] for a in found] == ["1T", "3T"] and sum(a["fraction"] for a in found) == 1.0
    assert "3T" in ask(*point, "--out", out).stdout and gc.load(out).sizes["number"] == 2


@pytest.mark.parametrize(("arguments", "figures", "quality", "code"), [
    ((), None, "paper", 0), (("--figures", "2,6, 9", "--quality", "draft"), [2, 6, 9], "draft", 1)])
def test_paper_hands_on_what_is_asked_and_the_exit_code(tmp_path, monkeypatch, arguments, figures, quality, code):
    from gearchaos.paper import report

    asked = []

    def build(out_dir, **options):
        asked.append((out_dir, options))
        return code

    monkeypatch.setattr(report, "build", build)
    assert ask("paper", *arguments, "--out", tmp_path / "report").exit_code == code
    assert asked == [(tmp_path / "report", {"figures": figures, "quality": quality, "progress": True})]


@pytest.mark.parametrize("command", [("regime",), ("simulate", "--periods", 1), (*MAP, "--out", "z.nc")])
@pytest.mark.parametrize(("text", "message"), [
    ("omega=-1", "omega must be greater than 0; got -1.0"), ("eps1=nan", "error.amplitudes must be a finite number"),
    ("omega=fast", "omega must be a number; got 'fast'"), ("kapa=1", "Did you mean 'kappa'?"),
    ("omega", "--set must read name=value; got 'omega'")])
def test_bad_values(tmp_path, monkeypatch, command, text, message):
    """All rules are in tests/contracts/model."""
    monkeypatch.chdir(tmp_path)
    assert message in refused(*command, "--set", text)
    assert list(tmp_path.iterdir()) == []


AXES = ("--axis", "omega=0.9:1.1:2", "--axis")


@pytest.mark.parametrize(("arguments", "message"), [
    (("zones",), "--axis must be given twice"), (("zones", *AXES[:2]), "--axis must be given twice"),
    ((*MAP, "--axis", "q0=0:1:2"), "--axis must be given twice"),
    (("zones", *AXES, "omega=0.9:1.2:2"), "must be two different parameters"),
    (("zones", *AXES, "eps1=0:0.1"), "--axis must read name=start:stop:count; got 'eps1=0:0.1'"),
    (("zones", *AXES, "kappa=0.5:1:2"), "kappa1 must be a parameter of the torsional model"),
    (("zones", *AXES, "c1=0.1:0.2:2"), "c1 must be a parameter of a Fourier stiffness"),
    (("basins", *AXES, "x1=0:1:2"), "must be an initial value of the model"),
    (("bifurcation", *AXES[:2], "--mode", "upp"), "Did you mean 'up'?"),
    (("simulate",), "--periods must be given"), (("simulate", "--periods", 0), "periods"),
    (("simulate", "--periods", 1, "--transient", -1), "transient"), (("simulate", "--periods", 1, "--physical"),
     "--physical needs a study file with a table [gearpair], [design] or [train]"),
    (("attractors", "--physical"), "--physical needs a study file"),
    (("regime", "none.toml"), "study file must be a readable file"),
    (("paper", "--figures", "2,x"), "--figures must be numbers with commas between; got '2,x'"),
    (("paper", "--figures", "99"), "figures must be numbers from 1 to 15; got 99"),
    (("paper", "--quality", "drft"), "Did you mean 'draft'?")])
def test_what_is_refused_leaves_no_file(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    out = () if arguments[0] == "regime" else ("--out", "report" if arguments[0] == "paper" else "o.nc")
    assert message in refused(*arguments, *out)
    assert list(tmp_path.iterdir()) == []


def test_fourier_stiffness_by_name(tmp_path):
    """Where nothing is said of the stiffness; a file that says two-level keeps it."""
    found = run_json("regime", "--set", "c1=0.2", "--set", "omega=0.6")
    assert found["v_rms"] == gc.regime(gc.MeshModel(omega=0.6, stiffness=gc.HarmonicStiffness((0.2,)))).v_rms
    axes = ("--axis", "c1=0.1:0.2:2", "--axis", "omega=0.5:0.6:2")
    ask("zones", "--set", "c1=0.1", *axes, "--out", tmp_path / "z.nc", code=0)
    path = tmp_path / "study.toml"
    path.write_text("[model]\nomega = 0.6\n")
    assert run_json("regime", path, "--set", "c1=0.2")["v_rms"] == found["v_rms"]
    path.write_text("[model.stiffness]\nchi1 = 0.2\n")
    assert "kind = 'harmonics' in [model.stiffness]" in refused("regime", path, "--set", "c1=0.2")
    assert "chi1 must be a parameter of a two-level" in refused("regime", "--set", "c1=0.2", "--set", "chi1=0.1")
    assert "stiffness must be a TwoLevelStiffness" in refused("regime", "--set", "stiffness=0.2")


@pytest.fixture
def no_study(monkeypatch):
    from gearchaos.studies.core.study import Study

    monkeypatch.setattr(Study, "run", lambda *_, **__: pytest.fail("computed before the output was checked"))
    monkeypatch.setattr(import_module("gearchaos.studies.motion.regime").Regime, "verdict", Study.run)


def test_unwritable_output_is_refused_before_any_work(tmp_path, no_study):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder.nc").mkdir()
    for name, message in (
        ("missing/z.nc", "must lie in an existing folder"), ("file/z.nc", "must lie in an existing folder"),
        ("folder.nc", "must be a file"), ("z.xlsx", "must end in .nc")):
        for command in (MAP, ("simulate", "--periods", 1)):
            assert f"--out {message}" in refused(*command, "--out", tmp_path / name)
    assert "--plot must end in .png" in refused(*MAP, "--out", tmp_path / "z.nc", "--plot", tmp_path / "z.xyz")
    assert "must be a folder" in refused("paper", "--figures", "6", "--out", tmp_path / "file")
    assert (tmp_path / "file").read_text() == "kept"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.nc"]


def test_what_is_write_protected(tmp_path, no_study, monkeypatch):
    path = tmp_path / "z.nc"
    path.write_text("kept")
    if os.path.isdir("/proc/self"):  # a folder that nobody can write in
        assert "--out must be writable" in refused(*MAP, "--out", "/proc/self/z.nc")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "--out must be writable" in refused(*MAP, "--out", path)
    assert path.read_text() == "kept"


def raising(error):
    def study(*_, **__):
        raise error

    return study


README = (EXAMPLES / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("command", sorted(set(re.findall(r"`gearchaos ([^`]+)`", README))))
def test_commands_of_the_examples_reach_their_study(tmp_path, monkeypatch, command):
    import gearchaos.flow as flow
    from gearchaos.paper import report
    from gearchaos.studies.core.study import Study

    monkeypatch.setattr(flow, "cache_is_empty", lambda: False)  # else the first one compiles and says so
    monkeypatch.setattr(Study, "run", raising(KeyboardInterrupt()))
    monkeypatch.setattr(
        import_module("gearchaos.studies.motion.regime").Regime, "verdict", raising(KeyboardInterrupt()))
    monkeypatch.setattr(report, "build", raising(KeyboardInterrupt()))
    monkeypatch.setattr(import_module("gearchaos.studies.vibration.natural_frequencies"), "natural_frequencies",
                        raising(KeyboardInterrupt()))
    shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    result = ask(*shlex.split(command))
    said = re.sub(r"(train|assumed): .*\n(  .*\n)*", "", result.stderr)  # as what a train is computed
    assert (result.exit_code, said) == (130, "interrupted\n")


@pytest.mark.parametrize(("error", "code", "message"), [
    (KeyboardInterrupt(), 130, "interrupted"),
    (MemoryError("Unable to allocate 23.5 GiB for an array"), 2, "error: not enough memory, of 16 GB on this machine; "
     "Unable to allocate 23.5 GiB for an array. Ask for fewer cells, points or periods."),
    (MemoryError(), 2, "error: not enough memory, of 16 GB on this machine. Ask for fewer cells, points or periods."),
    (OSError(28, "No space left on device"), 2,
     "error: [Errno 28] No space left on device. Free space, or write to another place."),
    (OSError(27, "It has more than 9 bytes", "a"), 2, "error: [Errno 27] It has more than 9 bytes: 'a'")])
def test_one_line_and_no_file(tmp_path, monkeypatch, error, code, message):
    monkeypatch.setattr(import_module("gearchaos.studies.maps.zones").Zones, "run", raising(error))
    monkeypatch.setattr(import_module("gearchaos.execute.machine"), "memory", lambda: 16 * 10**9)
    result = ask(*MAP, "--out", tmp_path / "z.nc", "--json")
    assert (result.exit_code, result.stderr, result.stdout) == (code, f"{message}\n", "")
    assert list(tmp_path.iterdir()) == []


def test_a_message_is_broken_between_words_in_a_terminal_alone(monkeypatch):
    from typer import Exit

    from gearchaos.cli.errors import reported
    from gearchaos.errors import InputError

    error = InputError("omega", "must be " + "small " * 30 + "indeed", 3.0, "Take\n'a path/with-hyphens' instead.")
    for terminal in (True, False):
        stream = io.StringIO()
        stream.isatty = lambda terminal=terminal: terminal
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("COLUMNS", "80")
        with pytest.raises(Exit), reported():
            raise error
        lines = stream.getvalue().splitlines()
        assert " ".join(lines) == " ".join(f"error: {error}".splitlines())
        assert (max(map(len, lines)) <= 80) == terminal


def test_picture_that_fails_leaves_nothing_half_written(tmp_path, monkeypatch):
    plot = tmp_path / "z.png"
    plot.write_text("kept")
    opened = Path.open

    class Full(io.FileIO):
        def write(self, content):
            if bytes(content[:4]) == b"\x89PNG":
                raise OSError(28, "No space left on device")
            return super().write(content)

    def partial(path, mode="r", **options):
        return Full(path, mode) if path.suffix == ".partial" else opened(path, mode, **options)

    monkeypatch.setattr(Path, "open", partial)
    result = ask(*MAP, "--out", tmp_path / "z.nc", "--plot", plot)
    assert result.exit_code == 2 and "No space left on device: '" in result.stderr
    assert plot.read_text() == "kept"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["z.nc", "z.png"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a POSIX signal")
def test_ctrl_c_ends_cleanly(tmp_path):
    assert ask("regime").exit_code == 0  # so that kernels are compiled: that cannot be interrupted, and may take long
    arguments = ("zones", "--axis", "omega=0.2:3:2000", "--axis", "eps1=0:0.3:2000", "--out", str(tmp_path / "z.nc"))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
    process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    signal.signal(signal.SIGINT, before)
    watch = threading.Timer(120, process.kill)  # else a command that announces nothing would be waited for
    watch.start()
    assert any("this takes" in line for line in process.stderr)  # reads up to this line
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=120)
    watch.cancel()
    assert process.returncode == 130 and stdout == ""
    assert stderr.splitlines()[-1] == "interrupted" and "Traceback" not in stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="closes a POSIX descriptor")
@pytest.mark.parametrize("arguments", ["regime --json", "--version", f"{shlex.join(MAP)} --out z.nc"])
def test_a_closed_stdout_is_refused_before_any_work(arguments, tmp_path):
    done = subprocess.run(
        ["sh", "-c", f"{shlex.join(COMMAND)} {arguments} >&-"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and list(tmp_path.iterdir()) == []
    assert done.stderr.splitlines() == ["error: stdout must be open; got 'closed'. Send it to a file, or to /dev/null."]


@pytest.mark.skipif(sys.platform == "win32", reason="closes a POSIX descriptor")
def test_messages_do_not_go_to_stdout_where_stderr_is_closed():
    done = subprocess.run(
        ["sh", "-c", f"{shlex.join(COMMAND)} regime --set omega=-1 2>&-"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.parametrize(("value", "words"), [
    ("friction=0.1", "docs/explanation/left_out.md"), ("stiffness.kind=tanh", "docs/howto/own_stiffness.md"),
    ("alpha1=180 deg", "in radians"), ("zetta=1", "Did you mean 'zeta'?")])
def test_a_name_that_the_manual_answers_is_pointed_there(value, words):
    assert words in refused("regime", EXAMPLES / "fig05.toml", "--set", value)


def test_units_in_a_dimensionless_model_are_refused_with_what_its_values_are(tmp_path):
    (tmp_path / "a.toml").write_text(
        '[model.stiffness]\nkind = "harmonics"\namplitudes = [0.2]\nphases = ["180 deg"]\n')
    assert "phases in radians, e.g. 3.14159 for 180 deg" in refused("regime", tmp_path / "a.toml")
    (tmp_path / "a.csv").write_text("omega,label\n1,periodic\n")
    assert "--plot FILE.png" in refused("plot", tmp_path / "a.csv")


def test_curves_and_skeletons_take_the_axes_of_a_map_and_basins_do_not():
    of_map = load_study(EXAMPLES / "fig02.toml")
    for kind in ("skeleton", "curve"):
        axes = study_axes(kind, of_map, [])
        assert [(axis.name, axis.start, axis.stop) for axis in axes.values()] == [("omega", 0.2, 3), ("eps1", 0, 0.3)]
    changed = study_axes("skeleton", of_map, [parse_axis("eps1=0:0.1:9", "axis")])
    assert changed["y"].stop == 0.1 and changed["x"] == axes["x"]
    for kind in ("basins", "branch"):
        with pytest.raises(gc.InputError, match="--axis must be given"):
            study_axes(kind, of_map, [])
