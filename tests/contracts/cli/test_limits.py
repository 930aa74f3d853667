"""What cannot end, or not be kept, is refused before any work; what takes long says how long."""

import time
from unittest.mock import ANY

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.errors import LARGEST_INTEGER, whole_number
from gearchaos.execute import machine, tiles
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studies import cost as costs
from gearchaos.studies.cost import ANNOUNCED_SECONDS, MAX_STEPS, estimate
from gearchaos.studies.registry import STUDIES
from gearchaos.studyfile import load_study
from gearchaos.validation import LARGEST, SMALLEST
from tests import EXAMPLES
from tests.commands import ask

PAIR = gc.MeshModel.of(eps1=0.1)
SMALL = gc.Axis("eps1", 0.0, 0.2, 3)
GIGABYTE = 1 << 30

@pytest.mark.parametrize(("call", "field", "rule", "value", "advice"), [
    (lambda: gc.MeshModel.of(omega=1e13), "omega", "at most 1e+12", 1e13, "units"),
    (lambda: gc.MeshModel.of(q0=-1e13), "q1", "at most 1e+12", -1e13, "units"),
    (lambda: gc.MeshModel.of(J=1e-31), "J1", "at least 1e-30", 1e-31, "units"),
    (lambda: gc.MeshModel.of(beta=1e-31), "beta1", "at least 1e-30, if it is not 0", 1e-31, "units"),
    (lambda: gc.MeshModel.of(eps1=10**400), "error.amplitudes", "at most 1e+12", 10**400, "units"),
    (lambda: gc.MeshModel.of(x1=1e13), "initial.x1", "at most 1e+12", 1e13, "units"),
    (lambda: vary(PAIR, {"zeta": [0.1, 1e300]}), "zeta", "at most 1e+12", 1e300, "units"),
    (lambda: gc.Axis("mu", 1.0, 1e200, 3), "mu1", "at most 1e+12", 1e200, "units"),
    (lambda: gc.regime(gc.MeshModel.of(omega=1e-6)), "steps of a mesh period", "at most 1,000,000", 1.6e7, "omega"),
    (lambda: gc.regime(gc.MeshModel.of(zeta=1e6)), "steps of a mesh period", "at most 1,000,000", 2.79e7, "zeta"),
    (lambda: gc.zones(PAIR, gc.Axis("omega", 1e-7, 1, 3), SMALL), "steps of a mesh period", "at most", ANY, "omega"),
    (lambda: gc.bifurcation(PAIR, gc.Axis("zeta", 0, 1e6, 3)), "steps of a mesh period", "at most", 2.79e7, "zeta"),
    (lambda: gc.simulate(PAIR, 10**20), "periods", "at most", 10**20, ""),
    (lambda: gc.simulate(PAIR, 10, transient=10**20), "transient", "at most", 10**20, ""),
    (lambda: gc.simulate(PAIR, 10, transient=9 * 10**15), "the study", "end within 100 years", ANY, "followed"),
    (lambda: gc.simulate(PAIR, 2 * 10**6), "periods", "by its memory", 2 * 10**6, ""),
    (lambda: gc.simulate(PAIR, 3, samples=10**6), "periods times samples", "by its memory", 3 * 10**6, ""),
    (lambda: gc.bifurcation(PAIR, SMALL, points=10**7), "columns times points", "memory", 3 * 10**7, ""),
    (lambda: gc.attractors(PAIR, 2, kicks=3000), "kicks", "by its memory", 3000, ""),
    (lambda: gc.attractors(PAIR, 2, box={"x1": (0, 1, 2)}), "box x1", "two finite numbers", (0, 1, 2), "-3, 3"),
    (lambda: gc.attractors(PAIR, 2, box={"x1": ("a", 1)}), "box x1", "must be a number", "a", ""),
    (lambda: gc.attractors(PAIR, 2, box=[("x1", 0, 1)]), "box", "a range for each", [("x1", 0, 1)], "-3, 3"),
    (lambda: Classification(transient_lengths="80"), "classification.transient_lengths", "a list of whole numbers",
     "80", "80, 80"),
    (lambda: Classification(transient_lengths=(80, 10**8)), "classification.transient_lengths", "at most 10,000,000",
     10**8, ""),
    (lambda: Classification(doublings=10**6), "classification.doublings", "at most 20", 10**6, ""),
    (lambda: Classification(exponent_run=10**6, doublings=4), "classification.exponent_run", "all doublings",
     "1000000 x 2^4", "doublings"),
    (lambda: Classification(averaging_periods=10**20), "classification.averaging_periods", "at most 10,000,000",
     10**20, ""),
    (lambda: Classification(longest_period=10**6), "classification.longest_period", "at most 100,000", 10**6, "")])
def test_what_cannot_end_or_be_kept_is_refused_at_once(call, field, rule, value, advice, monkeypatch):
    monkeypatch.setattr(machine, "memory", lambda: GIGABYTE)
    begin = time.perf_counter()
    with pytest.raises(gc.InputError) as refused:
        call()
    error = refused.value
    assert error.field == field and rule in error.rule and advice in error.advice
    assert error.value == (pytest.approx(value, rel=0.02) if isinstance(value, float) else value)
    assert time.perf_counter() - begin < 10.0


@pytest.mark.parametrize("beta", [0.0, 1e-20, 1e-14, 1e-6])
def test_weak_friction_and_light_wheels_are_taken(beta):
    model = gc.MeshModel.of(beta1=beta, beta2=0.0, J1=0.01, J2=1e6, q0=1e-9)
    assert gc.simulate(model, 2).attrs["status"] == "ok"


def test_a_number_of_either_end_is_taken():
    assert gc.MeshModel.of(omega=LARGEST, zeta=0.0, J1=SMALLEST).J1 == SMALLEST
    assert whole_number("n", LARGEST_INTEGER, 0) == LARGEST_INTEGER
    assert Classification(longest_period=100_000, transient_lengths=(10**7,), exponent_run=10**6, doublings=3)


def test_long_values_are_shown_short():
    for value in (10**3000, 10**5000, "a" * 10**5, [0.0] * 10**5):
        assert len(str(gc.InputError("field", "rule", value))) < 300


def system(**values):
    return switched_system(vary(gc.MeshModel.of(**values), {}))


@pytest.mark.parametrize("values", [
    {}, {"omega": 0.01}, {"zeta": 30.0}, {"kind": "full", "kappa": 400.0}, {"eps9": 0.1}])
@pytest.mark.parametrize("samples", [0, 7, 500])
def test_the_estimate_is_what_the_flow_does(values, samples):
    from gearchaos.flow import ExactFlow

    made = int(ExactFlow(system(**values), samples).step_count[0])
    assert made / 1.4 <= estimate(system(**values), 1, 1, samples=samples).steps <= made


@pytest.mark.parametrize("values", [
    {"eps4": 1e6}, {"c1": 0.2, "eps1": 1e6}, {"kind": "full", "eps64": 1e6}, {"eps64": 1e6, "c64": 0.2}])
def test_the_estimate_covers_what_harmonics_cost(values):
    from gearchaos.flow import ExactFlow

    def per_estimate(**values):
        """Seconds of a run of eight motions over those of the estimate, the least of three."""
        eight = system(**values).take(np.zeros(8, int))
        flow, work = ExactFlow(eight), estimate(eight, 8, 1)
        periods, start = 60_000 // work.steps, np.random.default_rng(0).normal(size=(eight.dimension, 8))
        took = []
        for _ in range(3):
            begun = time.process_time()
            flow.advance(start.copy(), periods)
            took.append(time.process_time() - begun)
        return min(took) / (periods * work.seconds(1))

    kind = values.get("kind", "single")
    plain = per_estimate(kind=kind, eps1=1e6)
    assert per_estimate(**{"kind": kind, **values}) <= 1.3 * plain


def test_harmonics_make_nothing_too_long_to_begin(monkeypatch):
    plain, waves = system(kind="single"), system(kind="single", eps64=0.1)
    assert estimate(plain, 1, 10).step_cost == 1.0
    found = estimate(waves, 1, 10)
    monkeypatch.setattr(costs, "_MAX_SECONDS", 1.001 * found.seconds() / found.step_cost)
    assert estimate(waves, 1, 10).seconds() == found.seconds()


def test_time_grows_with_work_and_falls_with_threads():
    one = estimate(system(), 1, 1000)
    assert estimate(system(), 1, 2000).seconds() == pytest.approx(2 * one.seconds())
    assert estimate(system(), 8, 1000).seconds() == pytest.approx(one.seconds())  # eight share a vector
    many = estimate(system(), 2**16, 1000)
    assert many.seconds(4) == pytest.approx(many.seconds(1) / 4)
    assert estimate(system(), 1, 1000, sequential=1000).seconds(4) == pytest.approx(2 * one.seconds())


@pytest.mark.parametrize(("seconds", "words"), [
    (ANNOUNCED_SECONDS - 0.01, None), (45, "45 seconds"), (300, "5 minutes"), (3 * 3600, "3 hours"),
    (400 * 86400, "400 days"), (9e8, "29 years")])
def test_long_work_says_how_long(seconds, words, monkeypatch, capsys):
    monkeypatch.setattr(costs.Cost, "seconds", lambda *_: seconds)
    estimate(system(), 12345, 1000).announce()
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(lines) == (
        (words and f"this may take up to about {words}, if all motions are chaotic; most settle far "
         "sooner. 12,345 motions are followed for at most 1,000 periods of 16 steps.") or "")
    assert all(len(line) <= 80 for line in lines)
    estimate(system(), 1, 1000).announce()
    assert "chaotic" not in capsys.readouterr().err  # the only motion of `simulate` is followed to its end


@pytest.mark.parametrize("command", [
    ["regime"], ["simulate", "--periods", "2"],
    ["zones", "--axis", "omega=1:2:2", "--axis", "eps1=0:.1:2", "--out", "o.nc"], ["run", "s.toml", "--out", "o.zarr"],
], ids=lambda c: c[0])
def test_every_command_says_how_long(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text('[study]\nkind = "simulate"\nperiods = 2\n')
    assert "may take" not in ask(*command).stderr
    monkeypatch.setattr(costs, "ANNOUNCED_SECONDS", 0.0)
    (tmp_path / "again").mkdir()
    monkeypatch.chdir(tmp_path / "again")
    result = ask(*(c.replace("s.toml", "../s.toml") for c in command))
    assert result.exit_code == 0 and result.stderr.count("this may take up to about") == 1


def test_step_matrices_of_many_points_take_a_part_of_the_memory(monkeypatch):
    monkeypatch.setattr(costs, "memory", lambda: GIGABYTE)
    slow = estimate(system(c1=0.2, omega=1e-3), 10**6, 1)
    assert slow.max_parameter_points(1) * slow.table_bytes <= GIGABYTE // 4
    assert slow.max_parameter_points(4) == slow.max_parameter_points(1) // 4
    assert estimate(system(), 10**6, 1).max_parameter_points(64) == tiles.TILE


@pytest.mark.parametrize(("longest", "most"), [(64, tiles.TILE), (640, 1000), (50_000, 16)])
def test_records_of_long_periods_make_tiles_small(longest, most, monkeypatch):
    asked, split = [], tiles.split
    monkeypatch.setattr(tiles, "split", lambda count, largest, threads: asked.append(largest) or split(count, largest))
    settings = Classification(transient_lengths=(longest + 1,), longest_period=longest, exponent_run=longest + 1,
                              longest_transient=0, doublings=0)
    gc.zones(PAIR, gc.Axis("omega", 2.0, 2.1, 2), SMALL, settings=settings)
    assert most / 2 <= max(asked) <= most


def test_tiles_of_any_size_give_the_same_map(monkeypatch):
    model = gc.MeshModel(stiffness=gc.HarmonicStiffness((0.2,)))
    axes = gc.Axis("omega", 0.5, 1.0, 9), gc.Axis("eps1", 0, 0.2, 5)
    short = Classification(longest_transient=400, doublings=1)
    whole = gc.zones(model, *axes, starts=2, settings=short)
    monkeypatch.setattr(costs.Cost, "max_parameter_points", lambda *_: 8)
    assert gc.zones(model, *axes, starts=2, settings=short).identical(whole)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda p: p.stem)
def test_no_example_is_refused(path):
    study = load_study(path)
    if study.kind is not None:
        cost = study.study(STUDIES[study.kind]).cost
        assert cost.seconds(2) < 7200 and cost.steps < MAX_STEPS / 100
    assert np.isfinite(estimate(switched_system(vary(study.model, {})), 1, Classification().max_periods).seconds())
