"""Scripts and SymPy equations that are written for a model, against the exact flow and the oracle's right sides."""

import io
import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg

import gearchaos as gc
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.train.modes import modes
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TransmissionError
from tests import EXAMPLES
from tests.oracles import scipy_oracle
from tests.oracles.march import levels
from tests.oracles.random_trains import random_train

sympy = pytest.importorskip("sympy")

MODELS = {
    "torsional": (MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), 6),
    "chaotic": (MeshModel.of(omega=1.0, q0=0.1, eps1=0.22, initial={"x1": 0.3, "x2_dot": 0.2}), 5),
    "single": (MeshModel.of(kind="single", omega=0.8, eps1=0.1, eps2=0.03, theta2=0.7), 6),
    "unequal": (MeshModel.of(kind="full", omega=1.05, kappa=0.5, eps1=0.04, beta1=0.02, kappa1=0.4, mu2=3.0,
                             zeta_support1=0.03), 6),
    "fourier": (MeshModel.of(omega=1.2, c1=0.2, alpha1=0.4, c3=0.05, eps1=0.1, q1=0.12), 6),
    "steps": (MeshModel(kind="full", omega=0.9, stiffness=SteppedStiffness((1.2, 0.8, 1.05), (0.1, 0.4, 0.8)),
                        error=TransmissionError((0.05, 0.02, 0.0), (0.3, 1.0))), 6),
    "one level": (MeshModel.of(omega=0.7, contact_ratio=1.0, eps1=0.1, zeta=0.05), 6),
    "on both flanks": (MeshModel.of(kind="single", omega=0.6, q0=0.02, eps1=0.25, initial={"z": -1.5}), 8),
    "at rest": (MeshModel.of(omega=0.7, chi0=0.0, initial={"x1": 0.8}), 6)}


def apart(shape, seed):
    """A random train whose meshes begin apart or on either flank."""
    rng = np.random.default_rng(seed)
    model = as_model(random_train(shape, rng))
    return model.with_values({n: rng.uniform(-1.5, 1.5) for n in model.state_names})


TRAINS = {shape: (apart(shape, seed), 1) for shape, seed in (("stages", 5), ("stops", 5), ("pairs", 6))}
MOTIONS = {**MODELS, **TRAINS}
RUN = """
import contextlib, io, json, runpy, sys
tables = {}
for file, periods in json.loads(sys.argv[1]):
    sys.argv, printed = [file, str(periods)], io.StringIO()
    with contextlib.redirect_stdout(printed):
        runpy.run_path(file, run_name="__main__")
    tables[file] = printed.getvalue()
assert not [m for m in sys.modules if m.split(".")[0] == "gearchaos"]
json.dump(tables, sys.stdout)
"""


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What the script of each model prints, in a process of their own that does not import gearchaos."""
    folder = tmp_path_factory.mktemp("scripts")
    for name, (model, _) in MOTIONS.items():
        (folder / name).write_text(gc.script(model, "scipy"), encoding="utf-8")
    asked = json.dumps([(name, periods) for name, (_, periods) in MOTIONS.items()])
    run = subprocess.run([sys.executable, "-I", "-c", RUN, asked], stdout=subprocess.PIPE, text=True, timeout=300,
                         check=True, cwd=folder)
    return json.loads(run.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTIONS)
def test_the_script_for_scipy_reproduces_a_simulation(name, printed):
    """Errors of 1e-12 grow in chaotic motions."""
    model, periods = MOTIONS[name]
    table = np.atleast_1d(np.genfromtxt(io.StringIO(printed[name]), delimiter=",", names=True, deletechars=""))
    expected = gc.simulate(model, periods)
    columns = {str(n).removeprefix("section_") for n, v in expected.items() if v.ndim == 1} - {"tau_section"}
    assert len(table) == periods and columns == set(table.dtype.names[1:])
    assert np.abs(table["tau"] - expected["tau_section"].values).max() < 1e-12 * expected["tau_section"].values.max()
    for column in table.dtype.names[1:]:
        assert np.abs(table[column] - expected[f"section_{column}"].values).max() < 1e-8, column


@pytest.mark.slow
def test_two_extrema_within_a_step_of_the_solver_lose_no_switch():
    """z falls to a minimum and rises to a maximum 0.04 units of τ later, before the teeth separate."""
    model = MeshModel(
        kind="single", omega=1.3759737525697233, zeta=0.011352614787732663, J1=1.155589271550981,
        J2=3.6458839944053896, q1=0.06689238776907715, q2=0.17757384418727007, stiffness=gc.TwoLevelStiffness(
            0.15218774995057582, 0.23587691824861778, 1.7629406699892858),
        error=TransmissionError((-0.0853964234124286, 0.13568187686579383, 0.018438517790344056, -0.06769090470969473),
                                (3.7523037559312495, 2.075504963812924, 1.2079396400260511, 0.7858843600702061)))
    names = {"__name__": "script"}
    exec(gc.script(model), names)
    found, expected = names["section"](8), gc.simulate(model, 8)
    assert np.abs(found[:, 1] - expected["section_z"].values).max() < 1e-10


class _Spring:
    """A shaft of openTorsion 0.3, or its elastic gear, of a ratio of radii, between two nodes."""

    def __init__(self, first, second, k, c, ratio=-1.0):
        at, row = np.ix_((first, second), (first, second)), np.array([1.0, ratio])
        self.at, self.K, self.C = at, k * np.outer(row, row), c * np.outer(row, row)


class _Gear:
    def __init__(self, node, I, R, k=0.0, c=0.0, parent=None):  # their names
        self.node, self.R, self.I = node, R, I
        self.spring = _Spring(parent.node, node, k, c, R / parent.R) if parent else None


class _Disk:
    def __init__(self, node, I, c=0.0, k=0.0):
        self.node, self.I, self.c, self.k = node, I, c, k


class _Assembly:
    """By the documentation of openTorsion 0.3.2, with which the frequencies of the script were compared once."""

    def __init__(self, shafts, disk_elements, elastic_gear_elements):
        self.M, self.C, self.K = (np.zeros((1 + max(disk.node for disk in disk_elements),) * 2) for _ in range(3))
        for each in (*disk_elements, *elastic_gear_elements):
            self.M[each.node, each.node] += each.I
        for disk in disk_elements:
            self.K[disk.node, disk.node] += disk.k
            self.C[disk.node, disk.node] += disk.c
        for each in (*shafts, *(gear.spring for gear in elastic_gear_elements if gear.spring)):
            self.K[each.at] += each.K
            self.C[each.at] += each.C

    def undamped_modal_analysis(self):
        return np.linalg.eig(np.linalg.solve(self.M, self.K))


@pytest.mark.parametrize("shape", ["chain", "branched", "stages", "stops", "internal", "driven", "pairs", "split"])
def test_the_script_for_opentorsion_has_the_linear_train(shape, monkeypatch):
    parts = {"Assembly": _Assembly, "Disk": _Disk, "ElasticGear": _Gear, "Shaft": _Spring}
    monkeypatch.setitem(sys.modules, "opentorsion", SimpleNamespace(**parts))
    train = random_train(shape, np.random.default_rng(4))
    names = {"__name__": "script"}
    exec(gc.script(train, "opentorsion"), names)
    found = modes(train)
    expected, elastic = found.frequency / (2 * np.pi), found.frequency > 0
    assert names["frequencies"]() == pytest.approx(expected, rel=1e-9, abs=1e-6 * expected.max())
    turning = [train.speeds[name] for name in names["nodes"]]  # as a whole, which deflects nothing
    if not elastic.all():
        torques = names["assembly"].K * turning
        assert np.abs(torques.sum(axis=1)).max() < 1e-12 * np.abs(torques).max()
    # of the damping of each mode, by the shapes of the script
    _, shapes = scipy.linalg.eigh(names["assembly"].K, names["assembly"].M)
    damping = np.einsum("im,ij,jm->m", shapes, names["assembly"].C, shapes)
    assert damping[elastic] == pytest.approx((2 * found.damping_ratio * found.frequency)[elastic], rel=1e-9)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The mode of .* is hardly damped")
def test_the_script_for_ross_balances_the_mean_torques_by_the_forces(tmp_path):
    train, file = gc.open(EXAMPLES / "train_two_stage.toml"), tmp_path / "motion.csv"
    names = {"__name__": "script"}
    script = gc.script(train, "ross")
    exec(script, names)
    assert f"--samples {64 * max(train.cycles.values())} " in script
    motion = gc.physical(gc.simulate(train, 2, 200, 2048))
    gc.save(motion, file)
    times, forces = names["read_forces"](tmp_path / "motion_tau_mesh.csv")
    assert times[[0, 1, -1]] == pytest.approx(np.array([0, 1, 4095]) * train.period / 2048, abs=1e-12)
    rotor = SimpleNamespace(ndof=30, number_dof=6)
    (a, force), (b, other) = forces.items()
    found = names["on_rotor"](rotor, [(a, "motor", 0, 0.3), (a, "wheel", 3, 0.3 + np.pi), (b, "drum", 4, 1.0)], forces)
    np.testing.assert_allclose(force, motion.mesh_force.sel(mesh=a), rtol=1e-12)
    np.testing.assert_allclose(found[:, [0, 1]], np.outer(force, [np.cos(0.3), np.sin(0.3)]), rtol=1e-12)
    np.testing.assert_allclose(found[:, :2], -found[:, 18:20], atol=1e-9)
    sense = {name: np.sign(speed) for name, speed in train.speeds.items()}
    assert sense["drum"] == 1 and sense["wheel"] == -1
    torque = found[:, [5, 23, 29]].mean(axis=0)  # the drum's load is balanced, and the motor's drive
    assert torque == pytest.approx([-20, -40, 100], rel=1e-3)
    assert np.count_nonzero(found.any(axis=0)) == 9 and np.allclose(found[:, 24], np.cos(1.0) * other)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_equations_in_sympy_are_those_of_the_oracle(name):
    model, _ = MODELS[name]
    symbolic = gc.to_sympy(model)
    tau, rates = sympy.Symbol("tau", real=True), {}
    plain = sympy.symbols(f"w:{2 * len(symbolic.coordinates)}")
    for f, value, rate in zip(symbolic.coordinates, plain[::2], plain[1::2], strict=True):
        rates |= {f.diff(tau): rate, f: value}
    rows = [a.subs(symbolic.values).subs(rates) for a in symbolic.accelerations().values()]
    compute = sympy.lambdify([tau, *plain], rows, "numpy")
    random = np.random.default_rng(3)
    seen = set()
    for state in random.uniform(-2, 2, (60, len(plain))):
        begin, end, level = levels(model)[random.integers(len(levels(model)))]
        t = random.uniform(begin, end)
        gaps = scipy_oracle._gaps(model, level, np.array([t]), state[:, None])
        contact = scipy_oracle._contact(*(gap[0] for gap in gaps))
        expected = scipy_oracle._right_side(model, contact, level)(t, state)[1::2]
        assert np.allclose(compute(t, *state), expected, rtol=1e-12, atol=1e-12)
        seen.add(contact)
    assert seen == {-1, 0, 1}


@pytest.mark.slow
@pytest.mark.parametrize("model", [
    *(model for model, _ in MODELS.values()), MeshModel(stiffness=HarmonicStiffness((0.0, 0.0), (0.0, 0.3))),
    MeshModel(stiffness=HarmonicStiffness(())), MeshModel(error=TransmissionError(())),
    MeshModel(kind="single", error=TransmissionError((0.1,)), stiffness=HarmonicStiffness(()))])
def test_a_model_comes_back_from_sympy(model):
    """Also one without harmonics."""
    assert gc.from_sympy(gc.to_sympy(model)) == model
