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
import time
from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gearchaos.catalogue import STUDIES
from gearchaos.cli import app
from tests import EXAMPLES

STUDY = """
[model]
omega = 1.0
[model.error]
amplitudes = [0.1]
[study]
kind = "{kind}"
"""
COMMAND = (sys.executable, "-c", "from gearchaos.cli import main; main()")
HEAVY = ("numba", "xarray", "scipy", "matplotlib", "pint", "h5netcdf", "jinja2", "numpy")
MAP = ("zones", "--axis", "omega=0.9:1.1:2", "--axis", "eps1=0:0.1:2")


def run(*arguments):
    """Run a command in this process; anything but a clean exit is raised."""
    result = CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)
    assert "Traceback" not in result.stderr
    return result


def run_json(*arguments):
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def refused(*arguments):
    """The one line on stderr of a command that must end with exit code 2."""
    result = run(*arguments)
    assert result.exit_code == 2, result.stderr
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ")
    return lines[0]


# --- starting up ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("code", [
    "import gearchaos",
    "from gearchaos.cli import app; from typer.testing import CliRunner; CliRunner().invoke(app, ['--help'])",
    "from gearchaos.cli import app; from typer.testing import CliRunner; CliRunner().invoke(app, ['zones', '--help'])",
])
def test_nothing_heavy_is_loaded(code):
    report = f"{code}; import sys; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_lists_the_commands_in_groups():
    text = run("--help").stdout
    panels = re.split(r"(?m)^╭─ (\w+) ─+╮$", text)[1:]
    listed = [(title, re.findall(r"(?m)^│ ([a-z-]+) ", body)) for title, body in zip(*[iter(panels)] * 2, strict=True)]
    studies = {group: [kind.replace("_", "-") for kind, study in STUDIES.items() if study["group"] == group]
               for group in ("Gears", "Motions", "Bifurcations")}
    assert listed[1:] == [
        ("Gears", ["gear", "map", "assess", *studies["Gears"]]),
        ("Motions", [*studies["Motions"], "explore"]),
        ("Bifurcations", studies["Bifurcations"]),
        ("Runs", ["run", "finish", "info", "plot", "export", "check"]),
        ("Proof", ["prove-chaos", "verify", "script", "paper"]),
        ("Install", ["examples", "warmup", "doctor"]),
    ]
    assert max(map(len, text.splitlines())) <= 80


def test_version():
    from importlib.metadata import version

    assert run("--version").stdout == f"gearchaos {version('gearchaos')}\n"


@pytest.mark.parametrize("arguments", [("frobnicate",), ("zones", "--frobnicate"), ("zones",), ("paper",)])
def test_wrong_usage_exits_with_2(arguments):
    result = run(*arguments)
    assert result.exit_code == 2 and result.stdout == ""


# --- simulate ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "names"), [
    ("single", []),
    ("torsional", ["x1", "x1_dot", "x2", "x2_dot"]),
    ("full", ["x1", "x1_dot", "x2", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"]),
])
def test_simulate_json(kind, names):
    found = run_json(
        "simulate", "--set", "omega=2", "--set", "eps1=0.1", "--set", f"kind={kind}", "--periods", 3, "--transient", 2
    )
    assert list(found) == ["tau", *names, "z", "z_dot"]
    assert found["tau"] == pytest.approx([math.pi * k for k in (3, 4, 5)])
    assert all(len(values) == 3 for values in found.values())


def test_simulate_json_is_the_study():
    import gearchaos as gc

    ds = gc.simulate(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.1), 4)
    found = run_json("simulate", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.1", "--periods", 4)
    assert found["x1"] == ds.section_x1.values.tolist()
    assert found["z_dot"] == ds.section_z_dot.values.tolist()


def test_simulate_takes_its_length_from_the_study_file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format(kind="simulate") + "periods = 5\ntransient = 3\nsamples = 8\n")
    assert len(run_json("simulate", path)["tau"]) == 5
    assert len(run_json("simulate", path, "--periods", 2)["tau"]) == 2


def test_simulate_writes_samples(tmp_path):
    import gearchaos as gc

    out = tmp_path / "motion.nc"
    result = run("simulate", "--periods", 2, "--samples", 8, "--out", out)
    assert result.exit_code == 0 and "Stroboscopic section" in result.stdout
    assert result.stderr.splitlines()[-1] == f"wrote {out}"  # on a cold cache, it first says that it compiles
    assert gc.load(out).sizes["tau"] == 16


@pytest.fixture
def pair_file(tmp_path):
    path = tmp_path / "pair.toml"
    path.write_text(
        '[gearpair]\nn1 = 25\nn2 = 50\nR1 = "35 mm"\nR2 = "70 mm"\nI1 = 5e-4\nI2 = 8e-3\nc0 = "400 N/um"\n'
        'k = 530\nbacklash = "0.12 mm"\nM10 = "85 N*m"\nspeed = "14000 rpm"\n'
    )
    return path


def test_simulate_in_physical_units(pair_file):
    path = pair_file
    plain = run_json("simulate", path, "--periods", 2)
    scaled = run_json("simulate", path, "--periods", 2, "--physical")
    assert scaled["units"]["z"] == "µm" and scaled["units"]["tau"] == "ms"
    assert scaled["z"] == pytest.approx([60 * z for z in plain["z"]])
    assert scaled["tau"] == pytest.approx([1e3 * k / (25 * 14000 / 60) for k in (1, 2)])


# --- regime --------------------------------------------------------------------------------------------------------

FIELDS = {
    "label": str, "period": int, "reason": str, "multipliers": list, "lyapunov": list, "lyapunov_ci": list,
    "v_rms": float, "contact_fraction": float, "contact": str, "dynamic_factor": float, "section": dict,
}


def test_regime_json_of_a_periodic_motion():
    found = run_json("regime", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.206")
    assert {name: type(found[name]) for name in FIELDS} == FIELDS
    assert (found["label"], found["period"]) == ("8T", 8)
    assert {len(values) for values in found["section"].values()} == {8}
    assert all(re**2 + im**2 < 1 for re, im in found["multipliers"])
    assert len(found["lyapunov"]) == len(found["lyapunov_ci"]) and found["lyapunov"][0] < 0
    assert found["contact"] in ("permanent", "one-sided", "two-sided")


def test_regime_json_of_a_chaotic_motion():
    found = run_json("regime", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.23")
    assert (found["label"], found["period"], found["multipliers"]) == ("chaotic", None, [])
    assert 0 < found["lyapunov_ci"][0][0] < found["lyapunov"][0] < found["lyapunov_ci"][0][1]


def test_regime_without_load_has_no_dynamic_factor():
    found = run_json("regime", "--set", "q0=0", "--set", "eps1=0", "--set", "x1=0")
    assert found["dynamic_factor"] is None and found["contact_fraction"] == 0


def test_regime_page():
    result = run("regime", "--set", "omega=1", "--set", "eps1=0.206")
    assert result.exit_code == 0
    for text in ("8T", "Lyapunov exponents", "Floquet multipliers", "dynamic factor"):
        assert text in result.stdout


def test_regime_in_physical_units(pair_file):
    from gearchaos.gears.pair import GearPair
    from gearchaos.studyfile import load_study

    scales = load_study(pair_file).pair.scales
    assert isinstance(load_study(pair_file).pair, GearPair)
    plain, scaled = (run_json("regime", pair_file, *options) for options in ((), ("--physical",)))
    assert plain.keys() | {"omega", "units"} == scaled.keys()
    factors = {
        "v_rms": scales.velocity * 1e3, "z_rms": 60, "z_peak_to_peak": 60, "z_dot_rms": scales.velocity * 1e3,
        "z_dot_peak_to_peak": scales.velocity * 1e3, "mesh_force_peak": scales.force, "dynamic_factor": 1,
        "contact_fraction": 1, "switches_per_period": 1, "trace_error": scales.rate,
    }
    for name, factor in factors.items():
        assert scaled[name] == pytest.approx(factor * plain[name], rel=1e-12), name
    assert scaled["lyapunov"] == pytest.approx([scales.rate * v for v in plain["lyapunov"]])
    assert scaled["lyapunov_ci"][0] == pytest.approx([scales.rate * v for v in plain["lyapunov_ci"][0]])
    assert scaled["section"]["x1"] == pytest.approx([60 * x for x in plain["section"]["x1"]])
    assert scaled["omega"] == pytest.approx(25 * 14000 / 60)
    assert {n: scaled["units"][n] for n in ("omega", "v_rms", "z_rms", "mesh_force_peak", "lyapunov")} == {
        "omega": "Hz", "v_rms": "mm/s", "z_rms": "µm", "mesh_force_peak": "N", "lyapunov": "1/s",
    }
    assert scaled["units"]["section"]["x1_dot"] == "mm/s" and "label" not in scaled["units"]
    assert scaled["multipliers"] == plain["multipliers"] and scaled["period"] == plain["period"]


@pytest.mark.slow
def test_the_page_of_given_gears_is_in_their_units(pair_file, tmp_path):
    """The units of the printed page do not depend on --physical, which is for JSON, files and pictures."""
    page = run("regime", pair_file).stdout
    assert page == run("regime", pair_file, "--physical", "--plot", tmp_path / "p.png").stdout
    assert page.count("V_RMS") == 1 and re.search(r"V_RMS, rms of .* +[\d.]+ mm/s\n", page)
    assert re.search(r"peak mesh force +[\d.]+ N\n", page) and re.search(r"mesh frequency +5833 Hz", page)
    assert re.search(r"speed of wheel 1 +14000 rpm", page) and re.search(r"torque at wheel 1 +85 N m", page)
    assert all(re.search(r"\) 1/s *$", line) for line in page.splitlines() if line.startswith("Lyapunov"))
    assert (tmp_path / "p.png").stat().st_size > 10_000
    assert "--physical needs a study file" in refused("regime", "--physical")
    assert "(µm)" in run("simulate", pair_file, "--periods", 1).stdout
    assert " rpm" not in run("regime").stdout


def test_attractors_in_physical_units(pair_file, tmp_path):
    import gearchaos as gc
    from gearchaos.studyfile import load_study

    out, loaded = tmp_path / "a.nc", load_study(pair_file)
    plain = run_json("attractors", pair_file, "--starts", 6)
    found = run_json("attractors", pair_file, "--starts", 6, "--physical", "--out", out)
    assert "units" not in plain
    assert found["units"] == {"v_rms": "mm/s", "lyapunov": "1/s", "lyapunov_lo": "1/s", "lyapunov_hi": "1/s"}
    for one, other in zip(found["attractors"], plain["attractors"], strict=True):
        assert one["v_rms"] == pytest.approx(1e3 * loaded.pair.scales.velocity * other["v_rms"], rel=1e-12)
        assert one["lyapunov"] == pytest.approx(loaded.pair.scales.rate * other["lyapunov"], rel=1e-12)
        same = ("label", "contact", "fraction", "dynamic_factor", "multiplier", "residual")
        assert all(one[name] == other[name] for name in same)
    assert gc.load(out)["attractor_section_z"].attrs["units"] == "µm"
    page = run("attractors", pair_file, "--starts", 6).stdout
    assert page.count("(mm/s)") == page.count("(1/s)") == 1
    assert "--physical needs a study file" in refused("attractors", "--physical")


def test_peak_mesh_force_is_the_dynamic_factor_times_the_static_one_and_is_there_without_load():
    found = run_json("regime", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.206")
    assert found["mesh_force_peak"] == pytest.approx(0.1 * found["dynamic_factor"], rel=1e-14)  # static: q0
    found = run_json("regime", "--set", "q0=0", "--set", "eps1=0.4", "--set", "omega=0.9", "--set", "x1=2")
    assert found["dynamic_factor"] is None and found["mesh_force_peak"] > 0
    import gearchaos as gc

    model = gc.MeshModel.of(q0=0.1, omega=1.0, eps1=0.206)
    motion = gc.steady(model, gc.regime(model))
    peak = abs(motion.mesh_force).max().item()
    assert run_json("regime", "--set", "eps1=0.206")["mesh_force_peak"] == pytest.approx(peak, rel=1e-2)


# --- plot ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A file of every kind of result."""
    import gearchaos as gc

    folder, single = tmp_path_factory.mktemp("saved"), gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)
    results = {
        "zones": gc.zones(gc.MeshModel(), "omega=0.9:1.1:3", "eps1=0:0.2:3", starts=2),
        "bifurcation": gc.bifurcation(single, "eps1=0:0.2:3", points=8), "simulate": gc.simulate(single, 4, samples=8),
        "exponents": gc.bifurcation(single, "eps1=0:0.2:3", points=0), "section": gc.simulate(single, 4),
        "basins": gc.basins(single, "z=-2:2:3", "z_dot=-1:1:3"), "attractors": gc.attractors(single, 8),
    }
    for name, ds in results.items():
        gc.save(ds, folder / f"{name}.nc")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", ["zones", "bifurcation", "exponents", "simulate", "section", "basins", "attractors"])
def test_plot_of_saved_data(saved, tmp_path, name):
    import matplotlib.pyplot as plt

    opened = plt.get_fignums()
    shutil.copy(saved / f"{name}.nc", tmp_path)
    result = run("plot", tmp_path / f"{name}.nc")
    assert (result.exit_code, result.stdout, plt.get_fignums()) == (0, "", opened)
    assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"{name}.nc", f"{name}.png"]


@pytest.mark.slow
def test_plot_of_a_map_in_any_colour(saved, tmp_path):
    pictures = set()
    for colour in ("motion", "contact", "dynamic_factor", "v_rms", "hysteresis", "attractors", "reason"):
        out = tmp_path / f"{colour}.svg"
        assert run("plot", saved / "zones.nc", "--colour", colour, "--out", out).exit_code == 0
        pictures.add(out.read_bytes())
    assert len(pictures) == 7
    assert re.search("in contact|separation|both flanks", (tmp_path / "contact.svg").read_text())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bifurcation", "exponents"])
def test_plot_of_a_diagram_shows_any_of_its_variables(saved, tmp_path, name):
    for colour in ("dynamic_factor", "contact", "v_rms", "lyapunov"):
        assert run("plot", saved / f"{name}.nc", "--colour", colour, "--out", tmp_path / f"{colour}.png").exit_code == 0
    assert len({p.read_bytes() for p in tmp_path.iterdir()}) == 4
    text = refused("plot", saved / f"{name}.nc", "--colour", "hysteresis", "--out", tmp_path / "p.png")
    assert "colour must be one of contact, contact_fraction, dynamic_factor" in text


def test_plot_says_what_is_possible(saved, tmp_path):
    text = refused("plot", saved / "zones.nc", "--colour", "contakt", "--out", tmp_path / "p.png")
    assert "colour must be one of attractors, contact, contact_fraction" in text and "Did you mean 'contact'?" in text
    assert "motion" in text
    text = refused("plot", saved / "basins.nc", "--colour", "contact", "--out", tmp_path / "p.png")
    assert "colour must be left out" in text and "It is of basins" in text
    assert "--out must end in .png, .pdf, .svg" in refused("plot", saved / "zones.nc", "--out", tmp_path / "p.xyz")
    assert "There is no such file" in refused("plot", tmp_path / "none.nc")
    assert "must be a folder that gearchaos run made" in refused("plot", tmp_path)
    (tmp_path / "words.nc").write_text("words")
    assert "must be a NetCDF file" in refused("plot", tmp_path / "words.nc")
    assert [p.name for p in tmp_path.iterdir()] == ["words.nc"]


def test_plot_of_the_folder_one_is_in(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "must be a folder that gearchaos run made" in refused("plot", ".")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["attractors", "simulate", "bifurcation", "zones", "basins"])
def test_plot_of_a_store(tmp_path, kind):
    settings = {
        "attractors": "starts = 8", "simulate": "periods = 4\nsamples = 8",
        "bifurcation": 'axis = "eps1=0:0.1:3"\npoints = 0',
        "zones": 'x = "omega=0.9:1.1:2"\ny = "eps1=0:0.1:2"', "basins": 'x = "z=-2:2:3"\ny = "z_dot=-1:1:3"',
    }
    path = tmp_path / "study.toml"
    path.write_text(f'[model]\nkind = "single"\n[study]\nkind = "{kind}"\n{settings[kind]}\n')
    assert run("run", path, "--out", tmp_path / "s.zarr", "--threads", 1).exit_code == 0
    assert run("plot", tmp_path / "s.zarr").exit_code == 0
    plain = (tmp_path / "s.png").read_bytes()
    assert plain.startswith(b"\x89PNG")
    if kind == "zones":  # a colour has a picture of its own
        assert run("plot", tmp_path / "s.zarr", "--colour", "v_rms").exit_code == 0
        assert (tmp_path / "s_v_rms.png").read_bytes().startswith(b"\x89PNG")
        assert (tmp_path / "s.png").read_bytes() == plain
        refused("plot", tmp_path / "s.zarr", "--colour", "../v_rms")


# --- maps ----------------------------------------------------------------------------------------------------------


def test_zones(tmp_path):
    import gearchaos as gc

    out, plot = tmp_path / "zones.nc", tmp_path / "zones.png"
    found = run_json(*MAP, "--set", "q0=0.2", "--out", out, "--plot", plot)
    assert found["study"] == "zones" and found["out"] == str(out) and found["plot"] == str(plot)
    assert [a["name"] for a in found["axes"]] == ["omega", "eps1"]
    assert sum(found["cells"].values()) == 4
    ds = gc.load(out)
    assert ds.label.dims == ("eps1", "omega") and json.loads(ds.attrs["model"])["q1"] == 0.2
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["zones.nc", "zones.png"]


def test_bifurcation(tmp_path):
    import gearchaos as gc

    out, plot = tmp_path / "b.nc", tmp_path / "b.svg"
    found = run_json(
        "bifurcation", "--set", "kind=single", "--axis", "eps1=0.05:0.1:3", "--points", 8, "--mode", "up",
        "--out", out, "--plot", plot,
    )
    assert sum(found["cells"].values()) == 3
    assert gc.load(out).section_z.shape == (3, 8)
    assert b"<svg" in plot.read_bytes()


def test_basins(tmp_path):
    out = tmp_path / "basins.nc"
    found = run_json(
        "basins", "--set", "kind=single", "--set", "omega=0.8", "--set", "eps1=0.1", "--axis", "z=-2:2:3",
        "--axis", "z_dot=-1:1:3", "--out", out, "--plot", tmp_path / "basins.png",
    )
    assert sum(a["fraction"] for a in found["attractors"]) == pytest.approx(1)
    assert {a["label"] for a in found["attractors"]} <= {"1T", "3T"}
    assert (tmp_path / "basins.png").stat().st_size > 1000


def test_axes_of_the_study_file_are_refined_by_name(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format(kind="zones") + 'x = "omega=0.9:1.1:500"\ny = "q0=0.1:0.2:2"\n')
    found = run_json("zones", path, "--axis", "omega=1:1.1:2", "--out", tmp_path / "z.nc")
    assert [(a["name"], a["start"], a["count"]) for a in found["axes"]] == [("omega", 1.0, 2), ("q0", 0.1, 2)]


def test_results_without_json_are_three_lines(tmp_path):
    result = run(*MAP, "--out", tmp_path / "z.nc")
    assert result.exit_code == 0 and len(result.stdout.splitlines()) == 3 and "wrote" in result.stderr


# --- paper ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("arguments", "figures", "quality", "code"), [
    ((), None, "paper", 0),
    (("--figures", "2,6, 9", "--quality", "draft"), [2, 6, 9], "draft", 1),
])
def test_paper_hands_on_what_is_asked_and_the_exit_code(tmp_path, monkeypatch, arguments, figures, quality, code):
    from gearchaos.paper import report

    asked = []

    def build(out_dir, **options):
        asked.append((out_dir, options))
        return code

    monkeypatch.setattr(report, "build", build)
    assert run("paper", *arguments, "--out", tmp_path / "report").exit_code == code
    assert asked == [(tmp_path / "report", {"figures": figures, "quality": quality, "progress": True})]


# --- bad input -----------------------------------------------------------------------------------------------------

BAD_VALUES = [
    ("omega=0", "omega must be greater than 0; got 0.0"),
    ("omega=-1", "omega must be greater than 0; got -1.0"),
    ("omega=nan", "omega must be a finite number; got nan"),
    ("eps1=nan", "error.amplitudes must be a finite number; got nan"),
    ("q0=inf", "q1 must be a finite number; got inf"),
    ("omega=fast", "omega must be a number; got 'fast'"),
    ("zeta=-0.01", "zeta must not be negative; got -0.01"),
    ("beta=-0.01", "beta1 must not be negative; got -0.01"),
    ("zeta_support=-0.01", "zeta_support1 must not be negative; got -0.01"),
    ("J1=-2", "J1 must be greater than 0; got -2.0"),
    ("mu2=0", "mu2 must be greater than 0; got 0.0"),
    ("contact_ratio=0.99", "contact_ratio must lie in [1, 2]; got 0.99"),
    ("contact_ratio=2.01", "contact_ratio must lie in [1, 2]; got 2.01"),
    ("chi2=1", "chi2 must be less than 1; got 1.0"),
    ("chi1=-1", "chi1 must be greater than -1; got -1.0"),
    ("omgea=1", "Did you mean 'omega'?"),
    ("kapa=1", "Did you mean 'kappa'?"),
    ("kind=torsion", "Did you mean 'torsional'?"),
    ("omega", "--set must read name=value; got 'omega'"),
]


@pytest.mark.slow
@pytest.mark.parametrize("command", [("regime",), ("simulate", "--periods", 1), (*MAP, "--out", "z.nc")])
@pytest.mark.parametrize(("text", "message"), BAD_VALUES)
def test_bad_values(tmp_path, monkeypatch, command, text, message):
    monkeypatch.chdir(tmp_path)
    assert message in refused(*command, "--set", text)
    assert list(tmp_path.iterdir()) == []


def test_stiffness_series_that_reaches_zero(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('[model.stiffness]\nkind = "harmonics"\namplitudes = [0.5, 0.6]\nphases = [3.14159, 3.14159]\n')
    assert "must keep the mesh stiffness above 0" in refused("regime", path)


def test_bad_study_files(tmp_path):
    assert "study file must be a readable file" in refused("regime", tmp_path / "none.toml")
    path = tmp_path / "study.toml"
    path.write_text("[model]\nomgea = 1\n")
    assert "Did you mean 'omega'?" in refused("regime", path)


BAD_AXES = [
    ((), "--axis must be given twice"),
    (("omega=0.9:1.1:2",), "--axis must be given twice"),
    (("omega=0.9:1.1:2", "eps1=0:0.1:2", "q0=0:1:2"), "--axis must be given twice"),
    (("omega=0.9:1.1:2", "omega=0.9:1.2:2"), "must be two different parameters"),
    (("omega=0.9:1.1:0", "eps1=0:0.1:2"), "axis omega count must be a whole number from 1"),
    (("omega=1.1:0.9:3", "eps1=0:0.1:2"), "axis omega must run from a smaller to a larger value; got '1.1:0.9'"),
    (("omega=1:1:3", "eps1=0:0.1:2"), "axis omega must run from a smaller to a larger value; got '1:1'"),
    (("omega=0:1:3", "eps1=0:0.1:2"), "omega must be greater than 0; got 0.0"),
    (("omega=0.9:1.1", "eps1=0:0.1:2"), "--axis must read name=start:stop:count; got 'omega=0.9:1.1'"),
    (("omga=0.9:1.1:2", "eps1=0:0.1:2"), "Did you mean 'omega'?"),
    (("kappa=0.5:1:2", "eps1=0:0.1:2"), "kappa1 must be a parameter of the torsional model"),
    (("c1=0.1:0.2:2", "eps1=0:0.1:2"), "c1 must be a parameter of a Fourier stiffness"),
]


@pytest.mark.parametrize(("axes", "message"), BAD_AXES)
def test_bad_axes(tmp_path, axes, message):
    arguments = [part for axis in axes for part in ("--axis", axis)]
    assert message in refused("zones", *arguments, "--out", tmp_path / "z.nc")
    assert list(tmp_path.iterdir()) == []


def test_fourier_stiffness_by_name(tmp_path):
    """Where nothing is said of the stiffness; a file that says two-level keeps it."""
    import gearchaos as gc

    found = run_json("regime", "--set", "c1=0.2", "--set", "omega=0.6")
    model = gc.MeshModel(omega=0.6, stiffness=gc.HarmonicStiffness((0.2,)))
    assert found["v_rms"] == gc.regime(model).v_rms
    out = tmp_path / "z.nc"
    arguments = ("--axis", "c1=0.1:0.2:2", "--axis", "omega=0.5:0.6:2", "--out", out)
    assert run("zones", "--set", "c1=0.1", *arguments).exit_code == 0
    path = tmp_path / "study.toml"
    path.write_text("[model]\nomega = 0.6\n")
    assert run_json("regime", path, "--set", "c1=0.2")["v_rms"] == found["v_rms"]
    path.write_text("[model.stiffness]\nchi1 = 0.2\n")
    assert "kind = 'harmonics' in [model.stiffness]" in refused("regime", path, "--set", "c1=0.2")
    assert "chi1 must be a parameter of a two-level" in refused("regime", "--set", "c1=0.2", "--set", "chi1=0.1")
    assert "stiffness must be a TwoLevelStiffness" in refused("regime", "--set", "stiffness=0.2")


def test_basins_need_initial_values(tmp_path):
    text = refused("basins", "--axis", "omega=1:2:2", "--axis", "x1=0:1:2", "--out", tmp_path / "b.nc")
    assert "must be an initial value of the model" in text


@pytest.fixture
def no_study(monkeypatch):
    """Fail if a study starts."""
    from gearchaos.studies.study import Study

    monkeypatch.setattr(Study, "run", lambda *_, **__: pytest.fail("computed before the output was checked"))
    monkeypatch.setattr(import_module("gearchaos.studies.regime").Regime, "verdict", Study.run)


def outputs(tmp_path):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder.nc").mkdir()
    return [
        (tmp_path / "missing" / "z.nc", "must lie in an existing folder"),
        (tmp_path / "file" / "z.nc", "must lie in an existing folder"),
        (tmp_path / "folder.nc", "must be a file"),
        (tmp_path / "z.xlsx", "must end in .nc"),
    ]


def test_unwritable_output_is_refused_before_any_work(tmp_path, no_study):
    for path, message in outputs(tmp_path):
        assert f"--out {message}" in refused(*MAP, "--out", path)
        assert f"--out {message}" in refused("simulate", "--periods", 1, "--out", path)
    assert "--plot must end in .png" in refused(*MAP, "--out", tmp_path / "z.nc", "--plot", tmp_path / "z.xyz")
    assert (tmp_path / "file").read_text() == "kept"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.nc"]


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder that nobody can write in")
def test_folder_that_nobody_can_write_in(no_study):
    assert "--out must be writable" in refused(*MAP, "--out", "/proc/self/z.nc")


def test_file_that_is_write_protected(tmp_path, no_study, monkeypatch):
    path = tmp_path / "z.nc"
    path.write_text("kept")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "--out must be writable" in refused(*MAP, "--out", path)
    assert path.read_text() == "kept"


def test_report_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("kept")
    assert "must be a folder" in refused("paper", "--figures", "6", "--out", tmp_path / "file")


@pytest.mark.parametrize(("arguments", "message"), [
    (("--figures", "2,x"), "--figures must be numbers with commas between; got '2,x'"),
    (("--figures", "99"), "figures must be numbers from 1 to 15; got 99"),
    (("--quality", "drft"), "Did you mean 'draft'?"),
])
def test_bad_report(tmp_path, arguments, message):
    assert message in refused("paper", *arguments, "--out", tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


def test_lengths():
    assert "--periods must be given" in refused("simulate")
    assert "--samples needs --out" in refused("simulate", "--periods", 1, "--samples", 4)
    assert run("simulate", "--periods", 0).exit_code == 2
    assert run("simulate", "--periods", 1, "--transient", -1).exit_code == 2


def test_physical_needs_a_pair(tmp_path):
    text = refused("simulate", "--periods", 1, "--physical")
    assert "--physical needs a study file with a table [gearpair], [design] or [train]" in text


def test_unknown_mode(tmp_path):
    text = refused("bifurcation", "--axis", "eps1=0:0.1:2", "--mode", "upp", "--out", tmp_path / "b.nc")
    assert "Did you mean 'up'?" in text
    assert list(tmp_path.iterdir()) == []


# --- things that go wrong on the way -------------------------------------------------------------------------------


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
    from gearchaos.studies.study import Study

    monkeypatch.setattr(flow, "cache_is_empty", lambda: False)  # else the first one compiles and says so
    monkeypatch.setattr(Study, "run", raising(KeyboardInterrupt()))
    monkeypatch.setattr(import_module("gearchaos.studies.regime").Regime, "verdict", raising(KeyboardInterrupt()))
    monkeypatch.setattr(report, "build", raising(KeyboardInterrupt()))
    shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    result = run(*shlex.split(command))
    said = re.sub(r"train: .*\n(  .*\n)+", "", result.stderr)  # as what a train is computed
    assert (result.exit_code, said) == (130, "interrupted\n")


@pytest.mark.parametrize(("error", "code", "message"), [
    (KeyboardInterrupt(), 130, "interrupted"),
    (MemoryError(), 2, "error: not enough memory. Ask for fewer cells, points or periods."),
    (OSError(28, "No space left on device"), 2, "error: [Errno 28] No space left on device"),
])
def test_one_line_and_no_file(tmp_path, monkeypatch, error, code, message):
    monkeypatch.setattr(import_module("gearchaos.studies.zones").Zones, "run", raising(error))
    result = run(*MAP, "--out", tmp_path / "z.nc", "--json")
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
    result = run(*MAP, "--out", tmp_path / "z.nc", "--plot", plot)
    assert result.exit_code == 2 and "No space left on device: '" in result.stderr
    assert plot.read_text() == "kept"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["z.nc", "z.png"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a POSIX signal")
def test_ctrl_c_ends_cleanly(tmp_path):
    assert run("regime").exit_code == 0  # so that kernels are compiled: that cannot be interrupted, and may take long
    arguments = ("zones", "--axis", "omega=0.2:3:2000", "--axis", "eps1=0:0.3:2000", "--out", str(tmp_path / "z.nc"))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
    process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    signal.signal(signal.SIGINT, before)
    time.sleep(6)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 130 and stdout == ""
    assert stderr.splitlines()[-1] == "interrupted" and "Traceback" not in stderr
    assert list(tmp_path.iterdir()) == []


def test_exit_code_of_the_installed_command(tmp_path):
    done = subprocess.run([*COMMAND, "regime", "--set", "omega=-1"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: omega must be greater than 0; got -1.0.")
    assert len(done.stderr.splitlines()) == 1


def test_regime_draws_the_motion_behind_the_verdict(tmp_path):
    picture = tmp_path / "motion.png"
    run("regime", "--set", "kind=single", "--set", "omega=2.3", "--set", "eps1=0.05", "--plot", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_attractors_as_a_table_and_as_json(tmp_path):
    point = ("attractors", "--set", "kind=single", "--set", "omega=0.8", "--set", "eps1=0.1", "--starts", 128)
    found = run_json(*point, "--json")
    assert [a["label"] for a in found["attractors"]] == ["1T", "3T"]
    assert sum(a["fraction"] for a in found["attractors"]) == 1.0
    assert "3T" in run(*point, "--out", tmp_path / "found.nc").stdout
    assert (tmp_path / "found.nc").exists()


def test_the_store_in_which_one_stands_is_drawn_beside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run("plot", ".")
    assert result.exit_code == 2 and result.stderr.startswith("error: store must be a folder that gearchaos run made")
    (tmp_path / "s.toml").write_text('[study]\nkind = "simulate"\nperiods = 3\n')
    assert run("run", "s.toml", "--out", "m.zarr").exit_code == 0
    monkeypatch.chdir(tmp_path / "m.zarr")
    result = run("plot", ".")
    assert (result.exit_code, (tmp_path / "m.png").is_file()) == (0, True)
    assert run("plot", "/").exit_code == 2


@pytest.mark.skipif(sys.platform == "win32", reason="closes a POSIX descriptor")
@pytest.mark.parametrize(
    "arguments", ["regime --json", "regime", "--version", "--help", f"{shlex.join(MAP)} --out z.nc"])
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
