"""Mesh stiffness by ISO 6336-1 and from tables: means, levels and phases that are known in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.geometry.mechanics import STEEL
from gearchaos.gears.stiffness import MeshStiffness
from gearchaos.gears.stiffness.iso6336 import fourier_coefficients, from_iso, relative_length, tooth_stiffness
from gearchaos.gears.stiffness.potential_energy import ToothPairs, from_energy
from gearchaos.gears.stiffness.table import from_table
from gearchaos.model import HarmonicStiffness, SteppedStiffness, TwoLevelStiffness
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

GRID = (np.arange(100_000) + 0.5) / 100_000
HIGH_CONTACT = spur(teeth=(60, 60), addendum=1.35, dedendum=1.6, root_radius=0.25)


@pytest.mark.parametrize("geometry", [SPUR_62, spur(teeth=(20, 30)), spur(centre_distance=0.1255)])
def test_two_levels_of_iso_are_one_and_1_75_single_stiffnesses(geometry):
    """Their mean is the mesh stiffness; two pairs are in contact from the beginning of the period on."""
    tooth = tooth_stiffness(geometry)
    stiffness = from_iso(geometry, tooth.mesh_stiffness)
    assert isinstance(stiffness.waveform, TwoLevelStiffness)
    assert stiffness.reference == pytest.approx(tooth.mesh_stiffness * 0.02, rel=1e-15)
    if geometry == SPUR_62:
        single = tooth.single_stiffness * 0.02
        assert stiffness.extremes == pytest.approx((single, 1.75 * single), rel=1e-14)
        assert stiffness.reference == pytest.approx(460.9e6, rel=2e-4)
    assert stiffness.truncation == 0 and stiffness.notes == () and stiffness.method == "ISO 6336-1"
    end = geometry.contact_ratio - 1
    values = stiffness(np.array([0, 0.5 * end, end - 1e-9, 1, end, 0.99]))
    assert np.all(values[:4] == values[0]) and np.all(values[4:] == values[4]) and values[0] > values[4]


def test_three_and_two_pairs_of_a_high_contact_ratio():
    assert 2 < HIGH_CONTACT.contact_ratio < 3
    stiffness = from_iso(HIGH_CONTACT, 1e10)
    assert isinstance(stiffness.waveform, SteppedStiffness) and stiffness.truncation == 0
    assert stiffness.waveform.starts == pytest.approx((0, HIGH_CONTACT.contact_ratio - 2), abs=1e-14)
    mean = 0.75 * HIGH_CONTACT.contact_ratio + 0.25  # of 0.75 n + 0.25 with n pairs in contact
    assert stiffness.waveform.levels == pytest.approx((2.5 / mean, 1.75 / mean), rel=1e-14)
    assert stiffness.reference == 1e10 * 0.02


def test_helical_gears_have_the_series_of_their_contact_lines():
    tooth = tooth_stiffness(ISO_TR_EXAMPLE_1)
    stiffness = from_iso(ISO_TR_EXAMPLE_1, tooth.mesh_stiffness, tolerance=1e-3)
    ratios = ISO_TR_EXAMPLE_1.contact_ratio, ISO_TR_EXAMPLE_1.overlap_ratio
    assert isinstance(stiffness.waveform, HarmonicStiffness)
    assert stiffness.reference == pytest.approx(17.46e9 * 0.1, rel=2e-3)
    count = len(stiffness.waveform.amplitudes)
    amplitudes, phases = fourier_coefficients(*ratios, count)
    share = 0.75 * ratios[0] / (0.75 * ratios[0] + 0.25)
    assert stiffness.waveform.amplitudes == pytest.approx(share * amplitudes, abs=1e-15)
    assert stiffness.waveform.phases == pytest.approx(phases, abs=1e-15)
    difference = stiffness(GRID) / stiffness.reference - 1 - share * (relative_length(*ratios)(GRID) - 1)
    assert stiffness.truncation == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-4)
    assert stiffness.truncation <= 1e-3 and np.abs(difference).max() < 5e-3


@pytest.mark.parametrize("pair", [SPUR_62, HIGH_CONTACT], ids=["two levels", "steps"])
@pytest.mark.parametrize("angle", [1e-14, 1e-9, 1e-6])
def test_the_waveform_of_helical_gears_tends_to_that_of_spur_gears(pair, angle):
    helical = replace(pair, helix_angle=angle)
    spur_gears, found = from_iso(pair, 1e10), from_iso(helical, 1e10)
    difference = (found(GRID) - spur_gears(GRID)) / spur_gears.reference
    assert helical.overlap_ratio > 0 and found.reference == spur_gears.reference
    assert np.abs(np.sort(np.abs(difference))[: -len(GRID) // 1000]).max() < 1e-4  # but near the jumps


def test_helical_gears_of_tiny_overlap_need_steps_and_what_cannot_be_reached_is_said():
    geometry = spur(helix_angle=1e-3, centre_distance=0.12400007)
    assert 0 < geometry.overlap_ratio < 0.01
    stiffness = from_iso(geometry, 1e10)
    assert isinstance(stiffness.waveform, SteppedStiffness) and stiffness.truncation <= 2e-3
    stiffness = from_iso(ISO_TR_EXAMPLE_1, 1e10, tolerance=1e-7)
    assert stiffness.truncation > 1e-7 and "more than the bound 1e-07" in stiffness.notes[0]


def test_of_different_face_widths_the_smaller_one_counts():
    for widths in ((0.02, 0.03), (0.03, 0.02)):
        pair = spur(face_width=widths)
        assert from_iso(pair, 1e10).reference == 1e10 * 0.02
        energy = from_energy(pair, (STEEL, STEEL), (0.035, 0.035))
        assert energy.reference == from_energy(SPUR_62, (STEEL, STEEL), (0.035, 0.035)).reference
        assert energy.notes == ()


@pytest.mark.parametrize(("arguments", "field"), [
    ((spur(centre_distance=0.1262), 1e10), "contact_ratio"), ((SPUR_62, 0.0), "mesh_stiffness"),
    ((SPUR_62, np.nan), "mesh_stiffness")])
def test_bad_values_for_iso_are_refused(arguments, field):
    with pytest.raises(InputError) as raised:
        from_iso(*arguments)
    assert raised.value.field == field


def test_a_bore_below_the_range_of_the_wheel_body_is_taken_at_its_end_and_said():
    """Sainsot's h is the root diameter over the bore, at most 7."""
    least = SPUR_62.root_diameter[1] / 7
    small, limit, wider = (from_energy(SPUR_62, (STEEL, STEEL), (0.035, bore))
                           for bore in (0.0, least * (1 + 1e-12), least * 7 / 6))
    assert small.reference == pytest.approx(limit.reference, rel=1e-9)
    assert limit.notes == wider.notes == ()
    (note,) = small.notes
    assert f"wheel 2: the root diameter is more than 7 bores, beyond Sainsot's compliance of the wheel body; it is " \
        f"that of a bore of {1e3 * least:.3g} mm" in note
    assert f"would change the mean stiffness by {wider.reference / limit.reference - 1:+.1%}" in note
    with pytest.raises(InputError, match=r"bore\[1\] must be at most .* at least 1\.4 bores"):
        from_energy(SPUR_62, (STEEL, STEEL), (0.035, SPUR_62.root_diameter[1] / 1.39))


@pytest.mark.parametrize("stiffness", [
    from_iso(SPUR_62, 1e10), from_iso(HIGH_CONTACT, 1e10), from_iso(ISO_TR_EXAMPLE_1, 1e10),
    from_energy(SPUR_62, (STEEL, STEEL), (0.035, 0.035)),
    MeshStiffness(3.0, SteppedStiffness((1.5, 0.5), (0.25, 0.75)), 0.0, "test"),
], ids=["two levels", "steps", "series", "energy", "steps after 0"])
def test_reference_and_extremes_are_those_of_the_values(stiffness):
    values = stiffness(GRID)
    assert values.mean() == pytest.approx(stiffness.reference, rel=2e-5)
    assert stiffness.extremes == pytest.approx((values.min(), values.max()), rel=1e-4) and np.all(values > 0)
    assert stiffness(GRID[:9] + 3) == pytest.approx(values[:9], rel=1e-12)


@pytest.fixture
def table(tmp_path):
    """A function that writes a table and reads it as mesh stiffness, of a wheel with 20 teeth."""
    def table(text, **options):
        (tmp_path / "tvms.csv").write_text(text)
        return from_table(tmp_path / "tvms.csv", **{"teeth": 20, **options})

    return table


def wave(x):
    """A smooth stiffness over the mesh period, N/µm."""
    return 400 + 60 * np.cos(2 * np.pi * x - 0.7) + 20 * np.cos(6 * np.pi * x + 2)


def rows(x, values):
    return "".join(f"{float(a)!r},{float(b)!r}\n" for a, b in zip(x, values, strict=True))


STEPS = {
    "levels": "fraction,level [N/um]\n0,400\n0.5,250\n",
    "levels over angle": "roll angle [deg],level [N/um]\n0,400\n9,250\n",
    "levels over time": "time [ms],level [N/um]\n0,400\n7.853981633974483,250\n",
    "points": "fraction,stiffness [N/um]\n0,400\n0.5,400\n0.5,250\n1,250\n1,400\n",
    "jump at the beginning": "fraction,stiffness [N/um]\n0,250\n0,400\n0.5,400\n0.5,250\n1,250\n",
    "points over angle": "deg,N/m\n0,4e8\n9,4e8\n9,2.5e8\n18,2.5e8\n18,4e8\n",
    "points over time, rounded": "time (s);kN/mm\n0;400\n0,007854;400\n0,007854;250\n0,01571;250\n0,01571;400\n"}


@pytest.mark.parametrize("form", STEPS)
def test_steps_of_a_table_are_taken_over_exactly(table, form):
    stiffness = table(STEPS[form], **({"speed": 600 / math.pi} if "time" in form else {}))  # 20 rad/s
    assert stiffness.reference == pytest.approx(325e6, rel=1e-4 if "rounded" in form else 1e-15)
    assert stiffness.waveform.levels == pytest.approx((400 / 325, 250 / 325), rel=1e-4 if "rounded" in form else 1e-14)
    assert stiffness.waveform.starts == pytest.approx((0, 0.5), abs=1e-4 if "rounded" in form else 1e-15)
    assert stiffness.truncation == 0 and stiffness.method == "table tvms.csv"


def test_a_smooth_table_becomes_a_series_that_gives_the_table_back(table):
    t = np.linspace(0, 1, 201)
    stiffness = table(ANGLE + rows(18 * t, wave(t)))
    assert isinstance(stiffness.waveform, HarmonicStiffness) and len(stiffness.waveform.amplitudes) == 3
    assert stiffness.waveform.amplitudes == pytest.approx((0.15, 0, 0.05), abs=1e-4)
    assert stiffness.waveform.phases[0] == pytest.approx(0.7, abs=1e-9)
    assert stiffness.waveform.phases[2] == pytest.approx(-2, abs=1e-9)
    assert stiffness(t) == pytest.approx(1e6 * wave(t), rel=1e-3)


def test_the_curve_by_energy_written_to_a_table_comes_back(table):
    pair = spur(teeth=(20, 30))
    curve = ToothPairs(pair, (STEEL, STEEL), (0.012, 0.02)).curve()
    ends = [(curve.knots[i + n], values[i]) for i in range(len(curve.first)) for n, values in enumerate((
        curve.first, curve.last))]
    kept = [end for i, end in enumerate(ends) if i == 0 or end != ends[i - 1]] + [(1.0, curve.first[0])]
    found = table("fraction,stiffness [N/m]\n" + rows(*zip(*kept, strict=True)))
    expected = from_energy(pair, (STEEL, STEEL), (0.012, 0.02))
    assert expected.reference == curve.mean and expected.truncation <= 2e-3 and expected.method == "potential energy"
    (note,) = expected.notes
    assert note.startswith("wheel 1: half the angle")  # beyond which the wheel body is extrapolated
    assert found.reference == pytest.approx(expected.reference, rel=1e-13)
    assert found.waveform.levels == pytest.approx(expected.waveform.levels, rel=1e-9)
    assert found.waveform.starts == pytest.approx(expected.waveform.starts, abs=1e-9)


ANGLE, TURN = "roll angle [deg],stiffness [N/um]\n", np.arange(401)
BAD_TABLES = {
    "not closed": ("fraction,N/um\n0,400\n1,390\n", 3, "stiffness of line 2, 400 N/um"),
    "less than a period": ("fraction,N/um\n0,400\n0.99,400\n", 3, "end of the mesh period, 1; got"),
    "more than a period": ("deg,N/um\n0,400\n18.1,400\n", 3, "the end of 2 mesh periods, 36 deg"),
    "not from 0": ("fraction,N/um\n0.1,400\n1.1,400\n", 2, "the fraction 0"),
    "negative": ("fraction,N/um\n0,400\n0.5,-1\n1,400\n", 3, "between 1000 and 1e+14 N/m"),
    "millinewtons": ("fraction,mN/um\n0,400\n0.5,0.9\n1,400\n", 3, "check the unit"),
    "meganewtons": ("fraction,MN/um\n0,400\n0.5,300\n1,400\n", 2, "check the unit"),
    "end among levels": ("fraction,level [N/um]\n0,400\n0.5,300\n1,400\n", 4, "less than the mesh period"),
    "two levels at once": ("fraction,level [N/um]\n0,400\n0.5,300\n0.5,200\n", 4, "repeat the fraction of line 3"),
    "one row": ("fraction,N/um\n0,400\n", 2, "end of the mesh period"),
    "torsional stiffness": ("deg,stiffness [N*m/rad]\n0,400\n", 1, "unit of a stiffness"),
    "half a tooth too few": (ANGLE + rows(TURN * 0.9, wave(TURN / 400 * 19.5)), 402, "the stiffness of line 2"),
    "a tooth too few": (ANGLE + rows(TURN * 0.9, wave(TURN / 400 * 19)), 402, "in each of its 20 mesh periods"),
    "twice the teeth": (ANGLE + rows(TURN * 0.9, wave(TURN / 400 * 40)), 402, "a mesh period; got '2 periods'"),
    # 51 rows of 20.4 teeth would be one of 20 teeth without the last row, but return to the first one
    "20.4 teeth": (ANGLE + rows(np.arange(52) / 51 * 360 / 20.4, wave(np.arange(52) / 51)), 53, "mesh period, 18 deg"),
    "other jumps": (ANGLE + "0,400\n9,400\n9,300\n18,300\n18,400\n28,400\n28,300\n36,300\n36,400\n", 10,
                    "the same jumps in each of its 2"),
    "two thirds": (ANGLE + "0,400\n6,300\n12,350\n", 4, "the end of the mesh period, 18 deg; got '12 deg'"),
    "a degree short": (ANGLE + "0,400\n9,400\n9,300\n17,350\n", 5, "the mesh period, 18 deg; got '17 deg'")}


@pytest.mark.parametrize(("text", "line", "words"), BAD_TABLES.values(), ids=BAD_TABLES)
def test_tables_that_are_no_period_of_a_stiffness_are_refused(table, text, line, words):
    with pytest.raises(InputError) as raised:
        table(text)
    assert raised.value.field.endswith(f"tvms.csv, line {line},") and words in str(raised.value)


def test_a_table_over_time_needs_the_speed(table):
    for form, speed, words in (("levels over time", None, "given"), ("levels over time", 0.0, "given"),
                               ("levels over angle", 20.0, "left out for a stiffness over the roll angle; got 20")):
        with pytest.raises(InputError, match=f"speed must be {words}"):
            table(STEPS[form], speed=speed)


def test_stiffness_and_level_exclude_each_other(table):
    with pytest.raises(InputError, match=r"line 1, must have the column stiffness \[N/um\] or level \[N/um\]"):
        table("fraction,force [N]\n0,1\n1,1\n")
    text = "fraction,stiffness [N/um],level [N/um]\n0,1,3\n0.5,2,4\n1,1,3\n"
    with pytest.raises(InputError, match=r"exactly one column for stiffness or level; .*columns = \{ stiffness = "):
        table(text)
    assert table(text, columns={"value": "stiffness"}).reference == pytest.approx(1.5e6, rel=1e-15)


@pytest.mark.parametrize(("cycles", "steps", "closed"), [
    (20, 400, True), (20, 397, False), (3, 60, False), (20, 390, True)])
def test_a_table_over_several_mesh_periods_becomes_their_mean(table, cycles, steps, closed):
    """Of the linear curves through its rows, also where its steps do not divide the mesh period."""
    x = np.arange(steps + closed) * cycles / steps
    found = table(ANGLE + rows(18 * x, wave(x)))
    fine, at = np.arange(steps + 1) * cycles / steps, np.arange(2000) / 2000
    mean = np.mean([np.interp(at + i, fine, wave(fine)) for i in range(cycles)], axis=0)
    assert found.reference == pytest.approx(400e6, rel=1e-9)
    assert np.sqrt(np.mean((found(at) / 1e6 - mean) ** 2)) <= 2.1e-3 * 400
    assert f"covers {cycles} mesh periods" in found.notes[-1]
    assert any("no row that closes" in note for note in found.notes) is not closed


@pytest.mark.parametrize("digits", [12, 4])
def test_steps_over_a_whole_turn_become_those_of_one_period(table, digits):
    """Also where the angles are rounded."""
    share = (9 + 1 / 3) / 18
    x = np.round(np.add.outer(18 * np.arange(20), (0, 18 * share)).ravel(), digits)
    levels = table("roll angle [deg],level [N/um]\n" + rows(x, np.tile((400, 250), 20)))
    jumps = table(ANGLE + rows(np.repeat(np.append(x, 360), 2)[1:],
                               np.append(np.repeat(np.tile((400, 250), 20), 2), 400)))
    for found in (levels, jumps):
        assert found.reference == pytest.approx(1e6 * (250 + 150 * share), rel=1e-12 if digits == 12 else 1e-5)
        assert found.waveform.starts == pytest.approx((0, share), abs=10.0**-digits)


@pytest.mark.parametrize("unit", [
    "N/(mm*um)", "N/(mm·µm)", "N/mm/µm", "N/mm·µm", "N/(mm µm)", "N/mm µm", "N/(mmµm)", "GPa"])
def test_a_stiffness_over_the_face_width_is_multiplied_by_it(table, unit):
    text = f"fraction,level [{unit}]\n0,20\n0.5,10\n"
    assert table(text, face_width=0.03).reference == pytest.approx(15e9 * 0.03, rel=1e-14)
    with pytest.raises(InputError, match="line 1, must have the unit of a stiffness for level"):
        table(text)
