"""What the benchmark of dynamic factors beside K_v draws, skips and counts."""

import math

import numpy as np
import pytest

from benchmarks.reality import MODELS, RATIOS, Compared, drawn_design, excitation, relief, summary, trial, with_error


@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")
def test_without_a_relief_pairs_on_their_path_are_one_spring_and_with_one_they_are_not():
    plain, relieved = trial(2), trial(3)
    assert (plain["relieved"], relieved["relieved"]) == (False, True)
    one, path, _ = MODELS
    assert plain[one]["factor"][:6] == pytest.approx(plain[path]["factor"][:6], rel=1e-9)
    assert relieved[one]["quasi_static"] == pytest.approx(1.75)
    assert relieved[path]["quasi_static"] < 1.5


@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")
def test_designs_with_more_than_two_pairs_are_computed_and_jump_by_less():
    number = next(n for n in range(0, 200, 2) if drawn_design(n).geometry.contact_ratio > 2)
    found = trial(number)
    assert not found["relieved"] and found[MODELS[0]]["quasi_static"] == pytest.approx(2.5 / 1.75)
    assert found[MODELS[0]]["factor"][:6] == pytest.approx(found[MODELS[1]]["factor"][:6], rel=1e-9)


def test_the_four_errors_of_a_design():
    """A third of the limit, the same turned over, and none; a relief takes no part in them."""
    limit, typical, turned, none = (with_error(drawn_design(3), error).error_harmonics for error in (
        "limit", "typical", "turned over", "none"))
    assert limit.amplitudes == pytest.approx(3 * np.array(typical.amplitudes)) and none.amplitudes == ()
    assert turned.amplitudes == pytest.approx(typical.amplitudes, rel=1e-12)
    assert np.exp(1j * (np.array(turned.phases) - typical.phases)) == pytest.approx(-1)


def test_a_relief_begins_between_tip_and_single_contact_with_no_more_than_one_pair_bends():
    for number in (1, 3, 5, 7, 9):
        design = drawn_design(number)
        given, geometry = relief(design, number), design.geometry
        bends = design.load.line_load / design.tooth_stiffness.single_stiffness
        assert 0.5 * bends <= given["amount"] <= bends
        if geometry.contact_ratio < 2:
            for start, tip, single in zip(given["start_diameter"], geometry.tip_diameter,
                                          geometry.single_contact_diameter, strict=True):
                assert single <= start < tip
    assert relief(drawn_design(2), 2) is None


def test_the_excitation_of_a_rectangular_deflection_in_closed_form():
    """Exact teeth without relief: F/c has its first harmonic 2/π (F/c₁ − F/c₂) sin π(ε − 1)."""
    design = with_error(drawn_design(2), "none")
    share, single = design.geometry.contact_ratio - 1, design.tooth_stiffness.single_stiffness
    one, two = 1 / single, 1 / (1.75 * single)
    expected = 2 / math.pi * (one - two) * math.sin(math.pi * share) / (share * two + (1 - share) * one)
    assert excitation(design) == pytest.approx(expected, rel=3e-3)


def test_the_table_counts_ranges_quartiles_and_motions_without_bound():
    count = len(RATIOS)
    designs = [{"number": n, "relieved": False, "K_v": [2.0] * count, "main_start": 0.85, "velocity": [50.0] * count,
                **{model: {"factor": [value] * count, "separated": [n == 0] * count, "quasi_static": 1.25,
                           "excitation": 0.1 * i * (1 + n * (i == 2))}
                   for i, (model, value) in enumerate(zip(MODELS, values, strict=True))}}
               for n, values in enumerate([(2.0, 2.0, 3.0), (3.0, 2.0, math.nan), (4.0, 2.0, 2.0)])]
    text = summary(Compared([*designs, {"number": 9, "skipped": "load_sharing"}]))
    assert "4 designs, 1 skipped (1 by load_sharing)" in text
    assert "| main resonance | 9 | prescribed stiffness | 1.50 (1.00 to 2.00) | 1.20 (0.80 to 1.60) | 33 % |" in text
    assert "| subcritical | 18 | pairs on the path | 1.00 (1.00 to 1.00)" in text
    assert "| intermediate | 9 |" in text and "| supercritical | 18 | corner contact | 1.50 (1.00 to inf)" in text
    assert "larger with corner contact: 2 designs" in text and f"Motions without bound: 0, 0, {count}." in text
    assert "in this harmonic and in this factor: -0.50." in text  # ranks 1, 2, 3 and 2, 3, 1
