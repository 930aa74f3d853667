"""The parts of a proof on functions and matrices that are known exactly, each where it must refuse."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_mat, arb_poly

from gearchaos.model import MeshModel
from gearchaos.proof import tube as tubes
from gearchaos.proof.balls import least, magnitude, norm, precision, rounded
from gearchaos.proof.candidate import Candidate, CyclicSystem
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.motion import (
    BOUNDARIES,
    Displacement,
    _verified,
    clearance,
    clearance_by_bounds,
    crossing_time,
    first_crossing,
)
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.series import Flow, constant_series
from gearchaos.proof.stability import _positive_eigenvalues, stability
from gearchaos.proof.tube import StartTube

BITS = 128


@pytest.fixture(autouse=True)
def _bits():
    with precision(BITS):
        yield


def equations(**values):
    return MeshEquations(exact_parameters(MeshModel.of(**{"omega": 1.0, "q0": 0.1, **values})), bits=BITS)


SINGLE = {"kind": "single", "zeta": 0.1}


def parabola(*coefficients):
    return Displacement(arb_poly([arb(c) if not isinstance(c, tuple) else arb(*c) for c in coefficients]))


def bump(top, height):
    """z on [0, 1] with its largest value ``top`` at 1/2, and lower by ``height`` at both ends."""
    return parabola(top - height, 4 * height, -4 * height)


def bounds(motion):
    """What `Flow.bounds` gives for a motion."""
    span = arb(0.5, 0.5)
    return arb_mat(4, 1, [motion.z(arb(0)), motion.z(arb(1)), motion.first(span), motion.second(span)])


def cleared(motion, contact, low=0.0, high=1.0):
    ends = (motion.z(arb(u)) for u in (low, high))
    return clearance(motion, contact, arb(low), arb(high), *ends)


@pytest.mark.parametrize("height", [1e-3, 0.1, 0.5])
@pytest.mark.parametrize("gap", [1e-9, 1e-3])
def test_a_hidden_maximum_is_seen(height, gap):
    """The chord between the ends is at a distance of 1; the bump comes near or beyond it."""
    assert cleared(bump(1 - gap, height), 0) <= gap
    assert (clearance_by_bounds(bounds(bump(1 - gap, height)), 0) or 0) <= gap
    with pytest.raises(UndecidedError):
        cleared(bump(1 + gap, height), 0)
    assert clearance_by_bounds(bounds(bump(1 + gap, height)), 0) is None


def test_the_maxima_of_a_family_are_seen():
    """Motions with maxima at various times: where the middle one has its maximum, all are below 1, but not later."""
    family = parabola(0.29, (2, 0.4), -2)
    assert family.z(arb(0.5)) < 1 < parabola(0.29, 2.4, -2).z(arb(0.6))
    with pytest.raises(UndecidedError):
        clearance(family, 0, arb(0), arb(1), arb(0.29), arb(0.29, 0.4))
    lower = parabola(0.26, (2, 0.4), -2)
    assert 0 < clearance(lower, 0, arb(0), arb(1), arb(0.26), arb(0.26, 0.4)) <= 0.02001


@pytest.mark.parametrize("contact", [1, -1])
def test_a_hidden_minimum_is_seen_in_contact(contact):
    touching, clear = (parabola(contact * (1.2 + side), -0.8 * contact, 0.8 * contact) for side in (-0.01, 0.01))
    assert 0 < cleared(clear, contact) <= 0.0101
    with pytest.raises(UndecidedError):
        cleared(touching, contact)
    assert clearance_by_bounds(bounds(touching), contact) is None


def test_bounds_of_monotonous_motions():
    assert 0.24 < clearance_by_bounds(bounds(parabola(0, 0.25, 0.25, 0.25)), 0) <= 0.25
    assert clearance_by_bounds(bounds(parabola(0, 1.5)), 0) is None


@pytest.mark.parametrize("flank", [1, -1])
def test_both_boundaries_are_watched_in_free_flight(flank):
    assert flank in {b.flank for b in BOUNDARIES[0]}
    assert first_crossing(parabola(0, 2 * flank), 0, arb(0), arb(1)).flank == flank


def test_first_crossing_of_two():
    """z passes 1 at 1/4 and comes back at 3/4: the first one is found, and the second after it."""
    motion = parabola(1 - 0.1875, 1, -1)
    crossing = first_crossing(motion, 0, arb(0), arb(1))
    assert crossing_time(motion, crossing).overlaps(arb(0.25))
    back = first_crossing(motion, 1, arb(0.25), arb(1), leaving=1)
    assert crossing_time(motion, back).overlaps(arb(0.75))
    with pytest.raises(UndecidedError) as failure:
        first_crossing(bump(1, 0.25), 0, arb(0), arb(1))
    assert failure.value.reason == "tangency undecided"


def test_return_after_leaving_is_seen():
    """After leaving contact at u = 0, z returns to the boundary at 0.3 and leaves it again at 0.55."""
    motion = Displacement(arb_poly([1]) - arb_poly([0, 1]) * arb_poly([arb(-0.3), 1]) * arb_poly([arb(-0.55), 1]))
    crossing = first_crossing(motion, 0, arb(0), arb(1), leaving=1)
    assert crossing_time(motion, crossing).overlaps(arb(0.3)) and motion.z(arb(1)) < 1


def test_speed_in_a_window_must_have_one_sign(monkeypatch):
    mesh, box = equations(eps1=0.206), arb_mat(2, 1, [arb(-1.2649, 1e-6), arb(-0.2324, 1e-6)])
    assert len(StartTube(mesh, box).windows) == 2
    monkeypatch.setattr(tubes, "enclosure", lambda *_: arb_mat(2, 1, [arb(1, 1e-3), arb(0.1, 0.2)]))
    with pytest.raises(UndecidedError, match="tangency"):
        StartTube(mesh, box)


def test_window_across_the_section_is_refused():
    mesh = equations(eps1=0.206)
    for z in (1 - 1.5e-3, 1 - 0.5e-3):
        with pytest.raises(UndecidedError, match="section"):
            StartTube(mesh, arb_mat(2, 1, [arb(z, 1e-3), arb(0.6, 1e-3)]))
    assert StartTube(mesh, arb_mat(2, 1, [arb(0.9, 1e-3), arb(0.6, 1e-3)])).windows[0].low > 0


def test_slopes_in_a_window_contain_both_contact_states():
    """From the first to the last switch of a box a motion may be free or in contact."""
    mesh, duration = equations(**SINGLE), arb(2.0**-7)
    slopes = tubes.slopes_through(mesh, duration)
    for chi in (0, 0.75, 1.25):
        for share in (0.25, 1):
            pushed = mesh.matrix - arb_mat([[0, 0], [chi * mesh.spring[1, 0], 0]])
            mixed = (pushed * (duration * share)).exp() * (mesh.matrix * (duration * (1 - share))).exp()
            assert all(slopes[i, j].contains(mixed[i, j].mid()) for i in range(2) for j in range(2))
    assert max(magnitude(slopes[i, j] - slopes[i, j].mid()) for i in range(2) for j in range(2)) < 0.1


def test_enclosure_of_a_window_contains_free_and_contact_motions():
    mesh, duration = equations(**SINGLE), arb(2.0**-6)
    states = arb_mat(2, 1, [arb(0.99, 1e-3), arb(0.5, 1e-3)])
    found = tubes.enclosure(mesh, states, tubes.Window(arb(0.25), arb(0.25) + duration, 1, True))
    assert found.contains(states.mid())
    reached = states[0, 0].mid() + mesh.duration * duration * arb(0.49)
    assert found[0, 0].contains(reached.mid()) and found[1, 0] > 0
    with pytest.raises(UndecidedError, match="tangency"):  # over half a mesh period no box is mapped into itself
        tubes.enclosure(mesh, arb_mat(2, 1, [0.99, 0.5]), tubes.Window(arb(0.25), arb(0.75), 1, True))


@pytest.mark.parametrize(("terms", "rate"), [(64, 1.0), (3, 0.7), (5, 0.7), (8, 0.7)])
def test_a_series_of_an_oscillation_however_short_contains_it_and_its_derivatives(terms, rate):
    """x'' = -x over a cell: cosine and sine, with a remainder that is not 0."""
    rows = constant_series(arb_mat([[0, 1, 0], [-1, 0, 0], [0, 0, 0]]) * arb(rate), 2, terms)
    flow, start = Flow(list(rows)), arb_mat(3, 1, [1, 0, 1])
    path = Displacement(flow.polynomial(start))
    low, high, slope, curvature = (flow.bounds * start).entries()
    assert low == 1 and high.overlaps(arb(rate).cos())
    for u in np.linspace(0, 1, 9).tolist():
        x = arb(u) * arb(rate)
        matrix = flow.at(arb(u))
        assert matrix[0, 0].overlaps(x.cos()) and matrix[0, 1].overlaps(x.sin())
        assert matrix[0, 0].rad() > 0 or u == 0
        first, second = -arb(rate) * x.sin(), -arb(rate) ** 2 * x.cos()
        assert path.z(arb(u)).overlaps(x.cos())
        assert path.first(arb(u)).overlaps(first) and path.second(arb(u)).overlaps(second)
        assert slope.contains(first.mid()) and curvature.contains(second.mid())
    assert terms > 8 or rows[0].nrows() < 16


@pytest.mark.parametrize(("slopes", "defect", "least", "most"), [
    (0.0, 0.0, 0.99, 1), (0.5, 0.0, 0.49, 0.5), (0.5, 2.5e-4, 0.24, 0.25), (1.5, 0.0, -np.inf, 0),
    (0.5, 6e-4, -np.inf, 0)])
def test_krawczyk_counts_slopes_and_defects(slopes, defect, least, most):
    """One equation P(x) = x with slopes in [-1/2, 1/2]: |K - c|/r is 1/2 + defect/r."""
    system = CyclicSystem.at([arb_mat([[0]])])
    assert least < system.margin([arb_mat([[arb(0, slopes)]])], [arb_mat([[arb(defect)]])], 1e-3) <= most


def test_krawczyk_around_a_cycle():
    """P multiplies by 2 and by 1/8 in turns: with the defects (1, 0) the corrections are known."""
    system = CyclicSystem.at([arb_mat([[2]]), arb_mat([[0.125]])])
    step = system.newton_step([arb_mat([[1]]), arb_mat([[0]])])
    assert step.ravel() == pytest.approx([1 / 6, 4 / 3])
    assert CyclicSystem.at([arb_mat([[2]]), arb_mat([[0.5]])]) is None


def random_cycle(rng, n, moduli):
    """n random matrices whose product has eigenvalues of given moduli^n."""
    d = len(moduli)
    bases = [rng.normal(size=(d, d)) + 2 * np.eye(d) for _ in range(n)]
    return [bases[(k + 1) % n] @ np.diag(moduli) @ np.linalg.inv(bases[k]) for k in range(n)]


@pytest.mark.parametrize(("n", "moduli"), [
    (1, (0.5, 0.2)), (2, (-0.9, 0.3)), (7, (2.0, 0.4)), (40, (-1.5, 3.0)), (7, (1.2, 1.1, 0.9, 0.1)),
    (40, (0.99, -0.98, 0.2)), (2, (3.0, 0.5, 0.4))])
def test_multipliers_inside_and_outside(n, moduli):
    cycle = [arb_mat(a.tolist()) for a in random_cycle(np.random.default_rng(n), n, moduli)]
    found = stability(cycle, cycle)
    assert found.inside == sum(abs(m) < 1 for m in moduli) and found.outside == sum(abs(m) > 1 for m in moduli)


@pytest.mark.parametrize(("size", "inside"), [(0.95, 2), (1.05, 0)])
def test_complex_multipliers(size, inside):
    turn = arb_mat([[np.cos(1.0) * size, -4 * np.sin(1.0) * size], [np.sin(1.0) * size / 4, np.cos(1.0) * size]])
    assert stability([turn], [turn]).inside == inside


@pytest.mark.parametrize("matrix", [
    *([[(sign * at, size), 0], [0, 0.5]] for at, size in ((1, 0), (0.9, 0.2), (1.05, 0.1)) for sign in (1, -1)),
    [[0.5, (0, 10)], [0, 0.5]]])
def test_neutral_multipliers_and_balls_that_are_stable_at_the_midpoint_alone(matrix):
    """All matrices of the balls must satisfy the inequality, also in a coordinate off the diagonal."""
    matrix = arb_mat([[arb(*entry) if isinstance(entry, tuple) else arb(entry) for entry in row] for row in matrix])
    with pytest.raises(UndecidedError, match="neutral"):
        stability([matrix], [matrix.mid()])


def test_matrices_that_are_no_proof(monkeypatch):
    """Q = 1 is refused where it is no solution: for a stable matrix that first stretches."""
    matrix, close = arb_mat([[0.5, 3], [0, 0.5]]), arb_mat([[arb(0.5), arb(0, 0.01)], [arb(0), arb(0.5)]])
    assert stability([matrix], [matrix]).inside == stability([close], [close.mid()]).inside == 2
    monkeypatch.setattr("gearchaos.proof.stability._stein_matrices", lambda _: np.eye(2)[None])
    with pytest.raises(UndecidedError, match="neutral"):
        stability([matrix], [matrix])


def test_bounds_as_floats():
    third = arb(1) / 3
    assert Fraction(magnitude(third)) > Fraction(1, 3) > Fraction(least(third))
    assert magnitude(arb(-2, 1)) >= 3 and least(arb(-2, 1)) <= -3
    assert magnitude(arb("inf")) == np.inf and magnitude(arb.nan()) == np.inf
    assert norm(arb_mat([[1, -2], [0.5, 0.25]])) == pytest.approx(3, rel=1e-12)
    assert norm(arb_mat([[1, -2], [0.5, 0.25]])) >= 3 and rounded(third, 4) == Fraction(5, 16)


def test_inertia_of_wide_balls_is_undecided():
    values = np.diag([1.0, -1.0])
    assert _positive_eigenvalues(arb_mat([[1, 0], [0, -1]]), values) == 1
    with pytest.raises(UndecidedError, match="neutral"):
        _positive_eigenvalues(arb_mat([[1, arb(0, 2)], [arb(0, 2), -1]]), values)


def test_cubes_that_overlap_are_not_told_apart():
    """Centres 3/2 r apart: the cubes of radius r overlap."""
    candidate = Candidate(None, [[Fraction(0)], [Fraction(3, 2000)]], [])
    assert candidate.separation(Fraction(1, 2000)) == pytest.approx(1)
    with pytest.raises(UndecidedError, match="period not minimal"):
        candidate.separation(Fraction(1, 1000))


def test_a_wrong_crossing_time_is_refused():
    motion = parabola(0.5, 1)
    crossing = first_crossing(motion, 0, arb(0), arb(1))
    assert _verified(motion, crossing, arb(0.5)).contains(arb(0.5))
    with pytest.raises(UndecidedError):
        _verified(parabola(0.5, 0.5, 0.5), crossing, arb(0.999))
