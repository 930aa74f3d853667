"""Boxes of parameters against orbits and motions computed in floats at random points of the box."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

pytest.importorskip("flint")

from flint import arb, arb_mat

import gearchaos as gc
from gearchaos.continuation.family import ParameterFamily
from gearchaos.errors import InputError
from gearchaos.model import MeshModel, SteppedStiffness
from gearchaos.proof.balls import block, precision
from gearchaos.proof.candidate import converged
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.boxes import BoxSystem, ParameterTube
from gearchaos.proof.families.coefficients import shifted
from gearchaos.proof.families.events import connection
from gearchaos.proof.motion import trajectory
from gearchaos.proof.parameters import exact_parameters, lifted
from gearchaos.studies.proofs.proofs import orbit_points

BITS = 128
STEPS = SteppedStiffness(levels=(1.2, 0.7, 0.9), starts=(0.0, 0.4, 0.75))
CASES = {
    "torsional 1T": (MeshModel.of(kind="torsional", q0=0.1, eps1=0.05, omega=1.0),
                     {"eps1": 1e-4, "omega": 2e-4, "q0": 1e-4, "zeta": 1e-4, "chi1": 1e-4, "chi2": 1e-4, "J": 1e-4,
                      "beta": 1e-4}),
    "torsional 2T": (MeshModel.of(kind="torsional", q0=0.1, eps1=0.05, omega=2.0), {"eps1": 1e-4, "omega": 1e-4}),
    "permanent contact": (MeshModel.of(kind="torsional", q0=0.3, eps1=0.01, omega=0.7),
                          {"eps1": 1e-3, "omega": 1e-3, "chi1": 1e-3, "chi2": 1e-3, "q0": 1e-3}),
    "single, stepped": (MeshModel.of(kind="single", q0=0.1, eps1=0.05, omega=0.95, zeta=0.05, stiffness=STEPS),
                        {"eps1": 1e-4, "zeta": 1e-4, "omega": 1e-4}),
    "full": (MeshModel.of(kind="full", q0=0.1, eps1=0.03, omega=1.5, beta1=0.02, kappa1=0.4),
             {"kappa1": 2e-5, "eps1": 2e-5, "omega": 2e-5, "mu": 2e-5, "zeta_support": 2e-5, "beta2": 2e-5})}


def random_members(model, widths, count):
    """Models at random points of a box, half of them at corners, with u."""
    rng = np.random.default_rng(0)
    for k in range(count):
        u = rng.uniform(-1, 1, len(widths)) if k % 2 else rng.choice([-1.0, 1.0], len(widths))
        yield model.with_values({name: model.value(name) + share * widths[name]
                                 for name, share in zip(widths, u, strict=True)}), u


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_orbits_at_random_points_of_a_proved_box_are_where_it_says(name):
    model, widths = CASES[name]
    proved = gc.prove_box(model, widths)
    assert proved.proved, proved.in_words()
    document = proved.document
    derivatives = np.array([[[float.fromhex(v) for v in row] for row in point] for point in document["derivatives"]])
    widths = {n: w * proved.scale for n, w in widths.items()}
    start = orbit_points(gc.regime(model))[1][0]
    family = ParameterFamily(model, ())
    near = {n: float(v) for n, v in gc.orbit(model, period=proved.period).state.items()}
    assert family.dimension == len(start)
    for member, u in random_members(model, widths, 8):
        found = gc.orbit(member, period=proved.period, near=near)
        points = orbit_points(found)[1]
        shift = min(range(len(points)), key=lambda k: np.abs(np.roll(points, k, 0) - proved.points).max())
        difference = np.roll(points, shift, 0) - proved.points
        assert np.all(np.abs(difference) <= proved.reach + 1e-9)
        assert np.abs(difference - derivatives @ u).max() <= document["radius"] + 1e-9
        assert found.unstable == document["stability"]["outside"]
        assert len(found.switches) == sum(document["switches"])


CONTACT = MeshModel.of(kind="single", omega=6.0, q0=1.0, eps1=0.01, zeta=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("widths", "members", "words"),
    [({"chi1": 0.02, "chi2": 0.02}, (("chi1",), ("chi2",)), "in chi1 by up to 0.02, chi2 by up to 0.02 there"),
     ({"chi0": 0.02}, (("chi1", "chi2"),), "in chi1 and chi2 by the same amount of up to 0.02 there"),
     ({"chi0": 0.02, "omega": 0.01, "eps1": 0.001}, (("chi1", "chi2"), ("omega",), ("eps1",)),
      "in chi1 and chi2 by the same amount of up to 0.02, omega by up to 0.01, eps1 by up to 0.001 there")])
def test_orbits_at_all_corners_and_200_points_of_a_box_lie_in_the_boxes_of_its_theorem(widths, members, words):
    proved = gc.prove_box(CONTACT, widths)
    assert proved.proved and proved.scale == 1 and proved.widths == widths and words in proved.theorem
    assert proved.document["together"] == list(map(list, members))
    derivatives = np.array([[[float.fromhex(v) for v in row] for row in p] for p in proved.document["derivatives"]])
    corners = list(product((-1.0, 1.0), repeat=len(widths)))
    largest = 0.0
    for u in np.array([*corners, *np.random.default_rng(7).uniform(-1, 1, (200, len(widths)))]):
        values = {name: CONTACT.value(name) + share * width
                  for names, width, share in zip(members, widths.values(), u, strict=True) for name in names}
        difference = orbit_points(gc.orbit(CONTACT.with_values(values), period=1))[1] - proved.points
        assert np.all(np.abs(difference) <= proved.reach + 1e-12)
        assert np.abs(difference - derivatives @ u).max() <= proved.document["radius"] + 1e-12
        largest = max(largest, float((np.abs(difference) / proved.reach).max()))
    assert largest > 0.8


def test_the_theorem_of_a_pair_is_no_theorem_of_independent_members():
    """With chi1 and chi2 apart the orbit leaves the boxes of the pair, and is in those of both by name."""
    pair, both = (gc.prove_box(CONTACT, dict.fromkeys(names, 0.02)) for names in (("chi0",), ("chi1", "chi2")))
    apart = CONTACT.with_values({"chi1": CONTACT.value("chi1") + 0.0198, "chi2": CONTACT.value("chi2") - 0.0198})
    difference = np.abs(orbit_points(gc.orbit(apart, period=1))[1] - pair.points)
    assert np.any(difference > 10 * pair.reach) and np.all(difference <= both.reach)


def test_words_say_no_more_than_the_exact_widths():
    """The half-widths of a smaller box are rounded down."""
    found = gc.prove_box(CASES["torsional 1T"][0], {"eps1": 0.05, "omega": 0.03})
    for name, width in {"eps1": 0.05, "omega": 0.03}.items():
        assert Fraction(found.widths[name]) <= Fraction(width) * Fraction(found.scale)
        assert f"{name} by up to {found.widths[name]}" in found.theorem


GRAZING = MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05, omega=0.5333684044733393)
"""The teeth just part from each other in its motion of period 1."""


def test_the_tube_of_a_grazing_motion_contains_motions_that_part_and_motions_that_do_not():
    width, radius, rng, counts = 1e-6, 1e-7, np.random.default_rng(8), set()
    parting = GRAZING.with_values({"omega": GRAZING.value("omega") - width})
    with precision(BITS):
        equations = MeshEquations(exact_parameters(parting), bits=BITS)
        candidate = converged(equations, lifted(orbit_points(gc.orbit(parting, period=1))[1], equations.names))
        system = BoxSystem(candidate, [{"omega": 2 * Fraction(width)}], grazing=True)
        centre, drift = candidate.trajectories[0], system.drift[0][:, 0]
        arguments = system.bounds(Fraction(1)), centre, drift, radius, system.shifts[0]
        tube = ParameterTube(*arguments, grazing=True)
        assert (len(centre.switches), tube.switches) == (2, 1)
        with pytest.raises(UndecidedError, match="windows overlap"):
            ParameterTube(*arguments)
        point, image = (np.array([float(v) for v in values]) for values in (
            candidate.points[0], [v.mid() for v in centre.image.entries()]))
        for u in [-1.0, 1.0, *rng.uniform(-1, 1, 40)]:
            family = ParameterFamily(parting.with_values({"omega": parting.value("omega") + 2 * width * u}), ())
            offsets = radius * rng.choice([-1.0, 1.0], (2, 2))
            flow, starts = family.exact_flow(family.start[None]), point[:, None] + drift[:, None] * u + offsets
            after = flow.advance(starts, np.ones(2, int), points=np.zeros(2, int)).w
            for k in range(2):
                contained(tube.slopes * column(offsets[:, k]) + tube.by_parameters * arb(u), after[:, k] - image)
            contained(tube.slopes * column(offsets[:, 0] - offsets[:, 1]), after[:, 0] - after[:, 1])
            member = MeshEquations(shifted(exact_parameters(parting), {"omega": 2 * Fraction(width) * Fraction(u)}))
            counts.add(len(trajectory(member, arb_mat(2, 1, starts[:, 0].tolist())).switches))
    assert counts == {0, 2}


def system_of(name, scale):
    """The orbit of a case with its box times a scale, in balls."""
    model, widths = CASES[name]
    equations = MeshEquations(exact_parameters(model), bits=BITS)
    points = orbit_points(gc.regime(model))[1]
    directions = [dict.fromkeys(model.set_by(n), Fraction(w) * Fraction(scale)) for n, w in widths.items()]
    return BoxSystem(converged(equations, lifted(points, equations.names)), directions)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("scale", [0.01, 1.0])
def test_the_tube_of_a_box_contains_motions_from_random_states_at_random_parameters(name, scale):
    """P(c + C u + ξ; p(u)) - P(c; p0) in A ξ + B u, and differences of two motions at one p in A (ξ - η)."""
    model, widths = CASES[name]
    widths = {n: w * scale for n, w in widths.items()}
    rng, radius = np.random.default_rng(1), 1e-5 * scale
    with precision(BITS):
        system = system_of(name, scale)
        bounds = system.bounds(Fraction(1))
        centre, d = system.candidate.trajectories[0], system.equations.dimension
        tube = ParameterTube(bounds, centre, system.drift[0], radius, system.shifts[0])
        point = np.array([float(v) for v in system.candidate.points[0]])
        image = np.array([float(v.mid()) for v in centre.image.entries()])
        for member, u in random_members(model, widths, 12):
            ends = [np.where(rng.random(d) < 0.5, rng.choice([-1, 1], d), rng.uniform(-1, 1, d)) for _ in range(2)]
            offsets = [radius * e for e in ends]
            starts = np.stack([point + system.drift[0] @ u + xi for xi in offsets], axis=1)
            family = ParameterFamily(member, ())
            after = family.exact_flow(family.start[None]).advance(starts, np.ones(2, int), points=np.zeros(2, int)).w
            effect = tube.by_parameters * column(u)
            for k in range(2):
                contained(tube.slopes * column(offsets[k]) + effect, after[:, k] - image)
            contained(tube.slopes * column(offsets[0] - offsets[1]), after[:, 0] - after[:, 1])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("contact", [0, 1])
def test_bounds_on_a_piece_contain_the_flows_of_random_parameters(name, contact):
    """Φ(p) - Φ(p0), the motion at p from a state of the motion at p0, and at the corners of a large box."""
    scale, rng = 0.01 / max(CASES[name][1].values()), np.random.default_rng(2)
    with precision(BITS):
        system = system_of(name, scale)
        bounds, equations, d = system.bounds(Fraction(1)), system.equations, system.equations.dimension
        cell, state = equations.cells[0], column(rng.uniform(-1.5, 1.5, d))
        start = arb_mat(d + 1, 1, [*state.entries(), 1])
        size = np.abs([float(v) for v in state.entries()])
        slack = bounds.slack(cell, contact, float(cell.length) * (1 + 1e-15), size)
        gamma = bounds.drift_at_centre(cell, contact, arb(0), arb(1), state)
        here = equations.flow(0, contact)
        used = []
        for _ in range(20):
            u = rng.choice([-1.0, 1.0], system.count)
            parameters = dict(equations.parameters)
            for together, share in zip(system.widths, u.tolist(), strict=True):
                for member, width in together.items():
                    parameters = shifted(parameters, {member: width * Fraction(share)})
            other = MeshEquations(parameters, bits=BITS)
            if other.cells[0].length != cell.length:
                continue
            there = other.flow(0, contact)
            change = block(there.end - here.end, d, range(d))
            moved = block((there.end - here.end) * start, d, range(1))
            first_order = gamma * column(u)
            for i in range(d):
                assert all(abs(change[i, j]) < slack.flow[i, j] + 1e-30 for j in range(d))
                assert abs(moved[i, 0]) < slack.moved[i] + 1e-30
                assert abs(moved[i, 0] - first_order[i, 0]) < slack.drift[i].sum() + 1e-30
            used.append(max(float(abs(moved[i, 0] - first_order[i, 0]).mid()) for i in range(d)))
        assert max(used) > 0


def column(values):
    """Floats as a matrix (d, 1)."""
    return arb_mat(len(values), 1, values.tolist())


def contained(balls, values):
    """Check that balls, widened by the errors of the floats, contain values."""
    for ball, value in zip(balls.entries(), values, strict=True):
        assert (ball + arb(0, 2e-11)).contains(arb(float(value))), (ball, value)


@pytest.mark.parametrize("width", [Fraction(1, 1024), -Fraction(1, 1024)])
def test_an_amplitude_that_is_0_at_the_centre_of_a_box_is_refused(width):
    """The equations at the centre have no such harmonic, so that bounds over the box would miss its effect."""
    model = MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.0, eps2=0.01)
    with precision(BITS):
        equations = MeshEquations(exact_parameters(model), bits=BITS)
        candidate = converged(equations, lifted(orbit_points(gc.orbit(model, period=1))[1], equations.names))
        for name in ("eps1", "eps3"):
            with pytest.raises(InputError, match=f"{name} must not be 0 at the centre of the box"):
                BoxSystem(candidate, [{name: width, "omega": width}])
        assert BoxSystem(candidate, [{"eps2": width}]).drift.any()


@pytest.mark.parametrize("start", [None, "below"])
def test_orbits_at_amplitudes_of_opposite_signs_are_not_connected_through_0(start):
    model = MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=1e-9, eps2=0.01)
    values = (-1e-9, 1e-9) if start is None else (0.0, 1e-9)
    ends = [gc.prove(gc.orbit(model.with_values({"eps1": value}), period=1)) for value in values]
    with pytest.raises(InputError, match="eps1 must not be 0 at the centre"):
        connection(*ends, BITS, ends[0] if start else None)
    apart = [gc.prove(gc.orbit(model.with_values({"eps1": value}), period=1)) for value in (1e-9, 3e-9)]
    assert connection(*apart, BITS, apart[0] if start else None)["radius"]


@pytest.mark.parametrize(("kind", "axis"), [
    ("torsional", "beta1"), pytest.param("full", "kappa1", marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("shares", [(0, 1), (-1, 1), (-1, 0)])
def test_orbits_are_not_connected_through_a_symmetry_that_needs_fewer_coordinates(kind, axis, shares):
    model = MeshModel.of(kind=kind, omega=0.7, q0=0.3, eps1=0.01)
    ends = [gc.prove(gc.orbit(model.with_values({axis: model.value(axis) + share * 2.0**-30}), period=1))
            for share in shares]
    with pytest.raises(UndecidedError, match="coordinates not the same"):
        connection(*ends, BITS)


def test_a_box_that_is_too_large_is_not_proved_but_a_smaller_one_is():
    found = gc.prove_box(CASES["torsional 1T"][0], {"eps1": 0.05})
    assert 0 < found.scale < 0.1 and found.widths["eps1"] == pytest.approx(0.05 * found.scale)
    with precision(BITS), pytest.raises(UndecidedError):
        system_of("torsional 1T", 500).prove(Fraction(1))


def test_slopes_by_the_parameters_prove_a_far_larger_box_than_wide_balls():
    """With parameters as balls in the coefficients, eps1 ± 1e-8 is about the largest box that is proved."""
    assert gc.prove_box(CASES["torsional 1T"][0], {"eps1": 4e-4}).scale == 1


@pytest.mark.parametrize(
    ("widths", "message"),
    [({}, "widths must name a parameter"), ({"eps1": 0.0}, "eps1 must have a positive half-width"),
     ({"eps2": 1e-3}, "eps2 must not be 0"), ({"contact_ratio": 1e-3}, "contact_ratio must be a parameter that a box"),
     ({"q0": 1e-3, "q1": 1e-3}, "widths must name each parameter once"), ({"kappa": 1e-3}, "kappa must")])
def test_wrong_widths_are_named(widths, message):
    with pytest.raises(gc.InputError, match=message):
        gc.prove_box(CASES["torsional 1T"][0], widths)


def test_one_wheel_alone_may_need_another_coordinate():
    found = gc.prove_box(CASES["torsional 1T"][0], {"beta1": 1e-4})
    assert not found.proved and found.reason == "coordinates not the same"
