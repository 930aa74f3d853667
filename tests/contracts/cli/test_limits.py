"""What cannot end, or not be kept, is refused before any work; what takes long says how long."""

import contextlib
import time
from dataclasses import dataclass, replace
from types import SimpleNamespace
from unittest.mock import ANY

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.errors import LARGEST_INTEGER, DesignWarning, InputError, whole_number
from gearchaos.execute import machine, tiles
from gearchaos.execute import progress as progress_bars
from gearchaos.execute.progress import left_text, told_end
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.core import cost as costs
from gearchaos.studies.core import price as prices
from gearchaos.studies.core.cost import MAX_STEPS, estimate
from gearchaos.studies.core.registry import STUDIES
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
    (lambda: gc.simulate(PAIR, 2 * 10**6), "periods", "by its memory", 2 * 10**6, "They need 1.4 GB of its 1.07 GB."),
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


@dataclass(frozen=True)
class _Work:
    """Work that takes 5 ms for each of its motions, and 10 s more for the first kernels, on a clock that it moves."""

    motions: int
    clock: SimpleNamespace
    choice: str = ""

    @property
    def cost(self):
        return estimate(system(), self.motions, 1_000_000)

    def thinned(self, share):
        return replace(self, motions=max(64, round(share * self.motions / 64) * 64))

    def smaller(self, share):
        return (self.choice, self.thinned(share)) if self.choice else None

    def needed(self, found):
        return 1.0

    def tells(self, found):
        return True

    def run(self, threads=None):
        self.clock.runs.append(self.motions)
        self.clock.now += 10 * (len(self.clock.runs) == 1) + 0.005 * self.motions


@pytest.fixture
def clock(monkeypatch):
    found = SimpleNamespace(now=0.0, runs=[])
    read = lambda: found.now  # noqa: E731 -- of the processors and on the wall
    monkeypatch.setattr(prices, "time", SimpleNamespace(perf_counter=read, process_time=read, monotonic=read))
    yield found
    told_end.set(None)


@pytest.mark.parametrize("motions", [64 * 100, 64 * 1000, 64 * 10_000])
def test_a_price_is_that_of_a_trial_without_loading_kernels(motions, clock):
    assert prices.price(_Work(motions, clock), 1) == pytest.approx(0.005 * motions)
    assert 0.7 <= 0.005 * clock.runs[-1] < 4 and sum(clock.runs) <= 0.2 * motions


def test_a_busy_machine_makes_a_price_higher_and_a_trial_no_smaller(clock, monkeypatch):
    quiet = prices.price(_Work(64_000, clock), 1)
    runs, clock.runs = clock.runs, []
    monkeypatch.setattr(prices.time, "process_time", lambda: clock.now / 5)
    monkeypatch.setattr(_Work, "run", lambda work, threads: (clock.runs.append(work.motions), setattr(
        clock, "now", clock.now + 0.025 * work.motions)))
    assert prices.price(_Work(64_000, clock), 1) == pytest.approx(5 * quiet)
    assert clock.runs == runs


def test_a_price_is_of_what_is_needed_by_a_trial_that_tells(clock, monkeypatch):
    monkeypatch.setattr(_Work, "needed", lambda self, found: 0.5)
    assert prices.price(_Work(640_000, clock), 1) == pytest.approx(0.5 * 0.005 * 640_000)
    enough, clock.runs = clock.runs[-1], []
    monkeypatch.setattr(_Work, "tells", lambda self, found: self.motions > enough)
    prices.price(_Work(640_000, clock), 1)
    assert clock.runs[-1] == pytest.approx(3 * enough, rel=0.05)


def test_a_choice_that_is_hardly_smaller_is_not_told(clock, capsys, monkeypatch):
    work = _Work(64 * 10_000, clock, "--less")
    monkeypatch.setattr(_Work, "smaller", lambda self, share: ("--less", self))
    prices.announce(work, threads=1)
    told = capsys.readouterr().err
    assert "this takes about" in told and "--less" not in told


def test_what_is_soon_done_is_hardly_tried(clock, capsys):
    prices.announce(_Work(1000, clock), threads=1)
    assert clock.runs == [64, 64] and capsys.readouterr().err == "" and told_end.get() is None


@pytest.mark.parametrize(("motions", "words"), [
    (64 * 62, None), (9000, "45 seconds"), (64_000, "5 minutes"), (2_160_000, "3 hours")])
def test_long_work_says_how_long(motions, words, clock, capsys):
    prices.announce(_Work(motions, clock), threads=1)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(lines) == ("" if words is None else (
        f"this takes about {words}. {motions:,} motions are followed for at most 1,000,000 periods of 16 steps."))
    assert all(len(line) <= 80 for line in lines)
    assert told_end.get() == (words and pytest.approx(clock.now + 0.005 * motions, rel=0.02))


def test_above_a_minute_a_smaller_choice_has_its_price(clock, capsys):
    for motions, more in ((9000, ""), (64_000, "With --samples 8 it takes about 80 seconds.")):
        prices.announce(_Work(motions, clock, "--samples 8"), threads=1)
        assert " ".join(capsys.readouterr().err.split()).endswith(f"steps. {more}".strip())
    prices.announce(_Work(64_000, clock), progress=False)
    assert capsys.readouterr().err == ""


def test_what_is_left_is_that_told_but_no_less_than_of_a_bar(monkeypatch):
    monkeypatch.setattr(progress_bars.time, "monotonic", lambda: 100.0)
    assert left_text(7.2) == "7 s left"
    told_end.set(160.0)
    assert (left_text(7.2), left_text(90.0)) == ("60 s left", "90 s left")
    told_end.set(None)


GRID = gc.Axis("omega", 0.5, 2.0, 400), gc.Axis("eps1", 0.0, 0.3, 100)
DESIGN = load_study(EXAMPLES / "spur_50_50.toml", {"torque": 100.0, "design.load_sharing": "prescribed"}).gears


@pytest.mark.parametrize(("study", "words"), [
    (gc.Zones(PAIR, *GRID), "--refine 8"),
    (gc.Zones(PAIR, *GRID, starts=4), "omega=0.5:2:200 and eps1=0:0.3:50"),
    (gc.Zones(PAIR, *GRID, refine=8), "omega=0.5:2:200 and eps1=0:0.3:50"),
    (gc.Bifurcation(PAIR, GRID[0], mode="up"), "omega=0.5:2:100"),
    (gc.Attractors(PAIR, 4096, kicks=20), "--starts 1024 and --kicks 5"),
    (gc.Simulate(PAIR, 1000, 200), "--periods 250 and --transient 50"),
    (gc.Scatter(DESIGN, ["damping_ratio=0.03:0.1"], "speed=1000:4000:4", samples=256), "--samples 64"),
    (gc.RunUp(DESIGN, "speed=500:1000", 40.0, events=True), "--duration 10"),
    (gc.Regime(PAIR), None),
], ids=lambda each: getattr(each, "kind", ""))
def test_a_study_names_a_smaller_choice(study, words):
    found = study.smaller(0.25)
    if words is None:
        assert found is None and study.thinned(0.25).cost.seconds() < study.cost.seconds() / 5
    else:
        assert found[0] == words
        least = 2 if words.startswith("--refine") else 3.5
        assert study.cost.seconds(1) / 8.5 < found[1].cost.seconds(1) < study.cost.seconds(1) / least
    assert study.thinned(0.0).cost.seconds(1) < study.cost.seconds(1) / 2


def test_a_trial_of_a_refined_map_has_its_coarsest_lattice():
    parts = [gc.Zones(PAIR, *GRID, refine=8).thinned(share) for share in (1.0, 0.25, 1 / 64)]
    assert [(part.x.count, part.y.count, part.refine) for part in parts] == [(400, 100, 8), (200, 50, 4), (50, 12, 1)]


def test_a_trial_of_a_map_with_several_starts_has_rows_to_follow_side_by_side():
    part = gc.Zones(PAIR, *GRID, starts=4).thinned(0.0)
    assert (part.x.count, part.y.count, part.starts) == (8, 32, 4)


@pytest.mark.parametrize("command", [
    ["regime"], ["simulate", "--periods", "2"],
    ["zones", "--axis", "omega=1:2:2", "--axis", "eps1=0:.1:2", "--out", "o.nc"], ["run", "s.toml", "--out", "o.zarr"],
    ["orders", str(EXAMPLES / "physical_pair.toml")],
], ids=lambda c: c[0])
def test_every_command_says_how_long(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text('[study]\nkind = "simulate"\nperiods = 2\n')
    assert "this takes" not in ask(*command).stderr
    monkeypatch.setattr(prices, "TOLD_SECONDS", 0.0)
    (tmp_path / "again").mkdir()
    monkeypatch.chdir(tmp_path / "again")
    result = ask(*(c.replace("s.toml", "../s.toml") for c in command))
    assert result.exit_code == 0 and result.stderr.count("this takes about") == 1


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


@pytest.mark.parametrize(("damping", "words"), [(0, "vibration"), (12_000, "decay")])
def test_too_many_steps_of_a_train_are_said_with_the_parts_that_make_them(damping, words):
    """A light wheel on a heavy one, m w² = k with m = J/r²; the decay by the roots of m s² + c s + k."""
    bodies = [gc.Body(name="motor", inertia=1e-6, torque=1), gc.Body(name="wheel", inertia=1e3, torque=-2),
              gc.Body(name="drum", inertia=1e3)]
    shaft = gc.Shaft(between=("wheel", "drum"), stiffness=1e3, damping=3e4)
    train = gc.Train(speed=1e-3, bodies=bodies, shafts=[shaft],
                     meshes=[gc.Mesh(name="first", between=("motor", "wheel"), teeth=(17, 34), base_radii=(0.1, 0.2),
                                     stiffness=3e8, damping=damping, error_amplitudes=["1 um"], backlash=1e-4)])
    rate = np.abs(np.roots([1e-6 / 0.1**2, damping, 3e8])).max()
    with pytest.warns(DesignWarning, match="hardly damped") if not damping else contextlib.nullcontext(), pytest.raises(
            InputError, match="steps of a common period must be at most 1,000,000") as error:
        gc.regime(train)
    assert error.value.advice.startswith(
        f"Steps follow a {words} of {rate:.3g} rad/s through a common period of {60 / (17 * 1e-3):.4g} s (mesh cycles: "
        "1 of first). It is that of motor (100 % of its kinetic energy) on first (100 % of its strain energy, ")
    assert f"give motor more inertia, or first less {'damping' if damping else 'stiffness'}" in error.value.advice


@pytest.mark.parametrize(("motion", "before", "runs"), [
    ("chaotic", 20_000, 2), ("quasi-periodic", 1280, 1), ("undecided", 1280, 7), ("2T", None, 0),
    ("diverged", None, 0)])
def test_the_price_of_one_motion_is_that_of_its_kind(motion, before, runs):
    """Transients of 80, 80, 160, 320, 640 periods, exponent runs of 2000 with two doublings, averages over 1000; the
    part has the first of each. The torsional pair has two coordinates, and an exponent run as many tangent vectors."""
    part = gc.Regime(PAIR).thinned(0.3)
    bound = (80 + 2 * 2000 + 1000) / (1280 + 2 * 7 * 2000 + 20_000 + 1000)
    run = 2000 * (2 + 1)
    share = 1 if before is None else (before + 1000 + runs * run) / (80 + 1000 + run)
    assert part.cost.dimension == 2
    for each in (part, part.thinned(0.1)):
        assert each.needed(SimpleNamespace(attrs={"motion": motion})) == pytest.approx(bound * share, rel=1e-12)
