"""Edges, jumps and usable speeds of an assessment against branches, and motions that are lost between speeds."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binomtest

import gearchaos as gc
from benchmarks.reality import drawn_design, with_error
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.natural import FollowedOrbits, Follower, Path, PathEnd
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import as_model
from gearchaos.studies.core.proportions import proportion
from gearchaos.studies.operation.followed_motions import FollowedMotions, Motion
from gearchaos.studies.operation.window_edges import Bracket, MotionPath, continue_orbits
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studies.speeds.speed_windows import RandomStates, UsableRange
from tests.closed_forms.linear_gears import SPUR

EDGE = 1e-8  # relative: what an edge is to agree with the event of a branch


def events(design, speed, state, period, axis):
    """The events by speed on the branch of the motion from a state at a speed, from rest for None."""
    start = None
    if state is not None:
        family = ParameterFamily(as_model(design.at(speed=speed)), ("speed",))
        initial = as_initial_values(family, np.array([[speed]]), np.array([[state]]))
        start = {name: float(value[0, 0]) for name, value in initial.items()}
    found = gc.branch(design.at(speed=speed), axis, start=start, period=period)
    return dict(zip(found.event_value.values.tolist(), found.event_kind.values.tolist(), strict=True))


def nearest(found, speed):
    """The event nearest to a speed: how far it is, relatively, and its kind."""
    at = min(found, key=lambda each: abs(each - speed))
    return abs(at - speed) / speed, found[at]


def to_avoid_in_the_middle(found):
    (window,) = (w for torque, w in found.avoid if torque == 100 and w.start < 850)
    return window


@pytest.fixture(scope="module")
def found():
    return gc.assess(SPUR, "750:1330:20", [100.0, 300.0], starts=16, spacing=0.02, wide=True)


@pytest.mark.slow
def test_a_range_of_a_motion_that_no_sweep_reaches_begins_at_the_fold_of_its_branch(found):
    window = to_avoid_in_the_middle(found)
    assert (window.begins_with, window.start_resolution, window.operation) == ("fold", 0.0, False)
    design = replace(SPUR, torque=100.0)
    there = gc.attractors(design.at(speed=800.0), 64)  # a motion with separating teeth that random states reach
    i = np.flatnonzero((there.attractor_contact.values > 0) & (there.attractor_period.values == 2))[0]
    state = np.array([there[f"attractor_section_{name}"].values[i, 0] for name in ("z", "z_dot")])
    far, kind = nearest(events(design, 800.0, state, 2, "speed=780:830"), window.start)
    assert far < EDGE and kind == "fold"
    assert window.ends_with == "" and 0 < window.stop_resolution < 5e-4 * window.stop  # chaos ends


def test_the_jumps_of_slow_sweeps_are_at_the_folds_of_the_branch_between_them(found):
    jumps = {jump.direction: jump for jump in found.at[0].jumps if jump.speed > 1200}
    design = replace(SPUR, torque=100.0)
    along = events(design, 1300.0, None, 1, "speed=1200:1330")
    for direction in ("up", "down"):
        far, kind = nearest(along, jumps[direction].speed)
        assert far < EDGE and (kind, jumps[direction].event) == ("fold", "fold")
    assert jumps["up"].speed > jumps["down"].speed and jumps["down"].factor_before > jumps["down"].factor_after


@pytest.mark.slow
def test_torques_side_by_side_are_as_each_alone(found):
    own, alone = found.at[1], gc.speeds_to_avoid(SPUR, "750:1330:20", 300.0, starts=16, spacing=0.02, wide=True)
    assert alone.windows == own.windows and alone.jumps == own.jumps and alone.tried == own.tried


def test_torques_are_in_rising_order_however_they_are_given():
    found = gc.assess(SPUR, "500:505:2", [300.0, 100.0], starts=0)
    assert [each.torque for each in found.at] == [100.0, 300.0]


def test_the_share_of_random_states_is_that_of_a_basin_drawn_anew(found):
    window, design = to_avoid_in_the_middle(found), replace(SPUR, torque=100.0)
    speeds = np.linspace(window.start, window.stop, 6)[1:-1]
    drawn = [gc.attractors(design.at(speed=speed), 256, seed=7) for speed in speeds.tolist()]
    share = np.mean([each.attractor_fraction.values[each.attractor_contact.values > 0].sum() for each in drawn])
    states = window.random_states
    assert 0 < states.fraction_lo < share < states.fraction_hi < 1 and states.fraction_lo < states.fraction


def test_every_range_has_as_many_random_states_as_a_speed_where_nothing_is_to_be_avoided_up_to_64(found):
    narrow = gc.assess(SPUR, "520:640:3", 100.0, starts=16, spacing=0.02)  # has fewer in a range by itself
    (many,) = gc.assess(SPUR, "530:550:2", 100.0, starts=128, spacing=0.02).at  # a range alone
    assert len(many.windows) == 1 and many.windows[0].random_states.states >= 64
    for each in (*found.at, *narrow.at):
        counts, speeds = each.dataset.random_states.values, each.dataset.speed.values
        assert counts.max() >= 16
        for window in each.windows:
            inside = (speeds >= window.start) & (speeds <= window.stop)
            assert counts[inside].sum() >= 16
            counted, avoided = counts[inside], each.dataset.avoided_states.values[inside]
            assert (window.random_states.states, window.random_states.speeds) == (counted.sum(), (counted > 0).sum())
            assert avoided.sum() > 0 and np.all(avoided <= counted)


def states_at(speeds, states, avoided):
    return xr.Dataset({"random_states": ("speed", states), "avoided_states": ("speed", avoided)},
                      {"speed": speeds, "motion": ["rest", "load change"]})


def test_the_interval_of_a_share_is_that_of_clopper_and_pearson():
    for k, n in ((0, 64), (3, 64), (64, 64)):
        exact = binomtest(k, n).proportion_ci(0.95)
        assert proportion(k, n) == pytest.approx([k / n, exact.low, exact.high], abs=1e-9)
    assert proportion(0, 8)[2] == pytest.approx(1 - 0.025 ** (1 / 8)) and np.isnan(proportion(0, 0)).all()
    alike = RandomStates.of(states_at([10.0, 20.0, 30.0], [8, 8, 8], [0, 8, 4]))
    assert [alike.fraction, alike.fraction_lo, alike.fraction_hi] == pytest.approx(proportion(12, 24))
    assert (alike.states, alike.speeds) == (24, 3)


def test_each_speed_counts_by_the_range_for_which_it_stands_not_by_its_states():
    found = RandomStates.of(states_at([10.0, 20.0, 25.0, 40.0], [64, 8, 0, 8], [0, 8, 0, 4]))
    weights = np.array([10.0, 15.0, 20.0]) / 45  # the speed without states is left out
    assert found.fraction == pytest.approx(weights @ [0, 1, 0.5]) and (found.states, found.speeds) == (80, 3)
    alike = 1 / (weights**2 @ [1 / 64, 1 / 8, 1 / 8])
    assert [found.fraction_lo, found.fraction_hi] == pytest.approx(proportion(found.fraction * alike, alike)[1:])
    assert RandomStates.of(states_at([10.0], [0], [0])) is None
    assert RandomStates.of(states_at([10.0, 20.0, 25.0, 40.0], [3, 3, 3, 3], [3, 3, 3, 3])).fraction == 1


@pytest.mark.parametrize(("inside", "outside", "ends", "edge"), [
    (100.0, 110.0, (106.0, 103.0), 106.0), (110.0, 100.0, (104.0, 107.0), 104.0),
    (100.0, 110.0, (103.0, 106.0), 106.0)])
def test_an_edge_is_that_of_the_motion_that_goes_furthest_in_whatever_order(inside, outside, ends, edge):
    bracket = Bracket(None, inside, outside, (), (), lambda _: 1, PathEnd(inside))
    for speed in ends:
        bracket.reach(PathEnd(speed))
    assert bracket.found.value == edge


def test_an_orbit_of_a_shorter_period_is_the_same_motion_only_where_both_merge():
    one = np.ones(1)
    far = FollowedOrbits(np.full((2, 1), 0.1), np.zeros((1, 2)), one > 0, one > 0, one.astype(int), one, one, one,
                  np.zeros((1, 0), int), np.zeros((1, 0)), one > 0)
    paths = [Path({}, 100.0, 101.0, 2, np.zeros(2))]
    assert far.fails(np.zeros((2, 1)), paths).tolist() == [1] and far.fails(far.w - 1e-3, paths).tolist() == [0]
    assert replace(far, shorter=one < 0).fails(np.zeros((2, 1)), paths).tolist() == [0]


def test_usable_ranges_are_between_those_to_avoid_and_shared_by_all_torques(found):
    for own in found.at:
        ends = sorted([750.0, 1330.0, *(v for w in own.windows for v in (
            w.start - w.start_resolution, w.stop + w.stop_resolution))])
        inner = [pair for pair in zip(ends[::2], ends[1::2], strict=True) if pair[0] < pair[1]]
        assert [(part.start, part.stop) for part in own.usable] == inner
    for part in found.usable_at_all:
        middle = (part.start + part.stop) / 2
        assert all(any(each.start < middle < each.stop for each in own.usable) for own in found.at)
    for margins in ([part.margin for _, part in found.usable], [part.margin for part in found.usable_at_all]):
        assert len(margins) > 1 and margins == sorted(margins, reverse=True)
    assert UsableRange(900.0, 1100.0).margin == pytest.approx(0.1)  # 10 % either way of 1000 rpm


ISOLA, TORQUE = 394.06281334269397, 1420.7565772023154
"""rpm and N m, at which one of 64 initial states of this pair as one spring reaches a closed branch."""
ISOLATED = gc.GearDesign(
    teeth=(31, 93), module=0.008, face_width=0.08947997091148856, bore=0.09920000000000001, load_sharing="prescribed",
    profile_shift=(0.2987759361162018, 0.06112138567744463), quality={"standard": "ISO 1328-1:1995", "grade": 8},
    backlash={"value": 0.0004974453499870733, "of": "line of action, total"}, damping_ratio=0.062435902488182496,
    transmission_error="from quality")


@cache
def isola():
    """The model of that design at that speed, and the point and the dynamic factor of the motion on that branch."""
    model = as_model(ISOLATED.at(speed=ISOLA, torque=TORQUE))
    there = gc.attractors(model, 64, seed=1016)
    (i,) = np.flatnonzero(there.attractor_contact.values > 0)
    state = np.array([there[f"attractor_section_{name}"].values[i, 0] for name in ("z", "z_dot")])
    return model, state, float(there.attractor_dynamic_factor.values[i])


def isola_motion():
    model, state, factor = isola()
    return model, Motion(1, 1, 2, factor, -0.1, tuple(state), state)


@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")
def test_an_orbit_is_followed_to_both_folds_of_a_closed_branch():
    model, motion = isola_motion()
    paths = [MotionPath(None, ISOLA, to, motion) for to in (0.9 * ISOLA, 1.1 * ISOLA)]
    along = events(model.gears, ISOLA, motion.w, 1, "speed=300:500")
    for end, _ in Follower(model, "speed").ends([path.of_orbit for path in paths]):
        far, kind = nearest(along, end.value)
        assert far < EDGE and (kind, end.kind, end.resolution) == ("fold", "fold", 0.0)


@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")
def test_a_motion_that_is_known_at_one_speed_is_added_where_its_orbit_goes_on():
    model, motion = isola_motion()
    speeds = [384.0, 387.0, 390.0, ISOLA, 397.0, 400.0, 403.0]
    found = FollowedMotions(model)
    found.speeds = speeds
    quiet = {speed: Motion(1, 1, 0, 1.7, 0.5, (9.0, 9.0), np.zeros(2)) for speed in speeds}
    found.at = {speed: [quiet[speed]] for speed in speeds}
    found.at[ISOLA].append(motion)
    for here, there in [*pairwise(speeds), *pairwise(speeds[::-1])]:
        for each in found.at[here]:
            each.leads_to[there] = quiet[there]  # so that the motion is lost on both sides
    continue_orbits(model, [found])
    assert [len(found.at[speed]) for speed in speeds] == [1, 1, 2, 2, 2, 2, 1]
    assert all(found.at[speed][1].contact == 2 for speed in speeds[2:6])
    assert all(list(found.at[speed][1].meshes) == [2] for speed in (390.0, 397.0, 400.0))  # their own, not the first's
    assert motion.leads_to[397.0].leads_to[400.0] is found.at[400.0][1]


@pytest.mark.parametrize(("options", "message"), [
    ({"torque": []}, "torque must be 1 to"), ({"torque": "150,60"}, "torque must rise"),
    ({"torque": 0}, "torque must be finite and not 0"), ({"starts": -1}, "starts must be"),
    ({"speed": "900"}, "speed must read"),
    ({"torque": [100, "100 N*m"]}, "torque must be given once"), ({"torque": [100, float("nan")]}, "torque"),
    ({"speed": "900:800"}, "speed must run"), ({"speed": "1:30000:2"}, "speed must take at most 4000 speeds"),
    ({"spacing": 0.0009}, "spacing must lie in"), ({"gears": gc.MeshModel.of(q0=0.1)}, "gears must be")])
def test_bad_input_is_refused(options, message):
    with pytest.raises(InputError) as error:
        gc.assess(**{"gears": SPUR, "speed": "1000:1100", "torque": 100, **options})
    assert str(error.value).startswith(message)


def test_nothing_to_avoid_says_what_was_tried():
    exact = replace(SPUR, transmission_error="none")
    found = gc.assess(exact, "200:220:2", 400.0, starts=4, spacing=0.1)
    assert isinstance(found, Assessment) and found.avoid == []
    assert [(part.start, part.stop) for part in found.usable_at_all] == [(200.0, 220.0)]
    for words in (found.at[0].tried, "friction"):
        assert any(words in each for each in found.assumptions)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")
@pytest.mark.parametrize("number", [*range(6), *(pytest.param(n, marks=pytest.mark.exhaustive) for n in range(6, 40))])
def test_what_operation_meets_does_not_depend_on_how_states_are_drawn(number):
    """Nor on the number of first speeds."""
    law = ("always", "contact", "unilateral")[number % 3]
    shared = law != "unilateral" and number // 3 % 2
    design = replace(with_error(drawn_design(number), "typical"), damping_law=law,
                     load_sharing=None if shared else "prescribed")
    pair = design.to_pair()
    resonance = pair.speed * pair.omega0 / pair.mesh_frequency
    speeds = f"{0.5 * resonance:.0f}:{1.3 * resonance:.0f}"
    ways = [{"starts": 16, "spacing": 0.01}, {"starts": 0}, {"starts": 16, "spacing": 0.02, "seed": 5, "wide": True}]
    found = [gc.assess(design, speeds + count, design.torque, **options)
             for options, count in zip(ways, ("", ":7", ""), strict=True)]
    ranges = [[window for _, window in one.avoid if window.operation] for one in found]
    assert all([(w.begins_with, w.ends_with) for w in own] == [(w.begins_with, w.ends_with) for w in ranges[0]]
               for own in ranges)
    for own in ranges[1:]:
        for window, other in zip(own, ranges[0], strict=True):
            assert window.reach == pytest.approx(other.reach, rel=1e-6 if not other.start_resolution else 0.01)
