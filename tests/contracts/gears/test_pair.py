"""A physical pair: its model against (2.1) itself, units at the boundary, bad values, results in physical units."""

import itertools
import json
import math
import re
import warnings
from dataclasses import asdict

import numpy as np
import pytest

from gearchaos import attractors, simulate, zones
from gearchaos.errors import InputError
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.operation.results import physical
from gearchaos.model import HarmonicStiffness, backlash, mesh_stiffness, transmission_error
from gearchaos.studyfile import load_study

SI = {
    "n1": 25, "n2": 40, "I1": 4.88e-4, "I2": 3.2e-3, "R1": 0.03524, "R2": 0.05638, "c0": 4e8, "k": 530.0,
    "backlash": 1.2e-4, "M10": 85.0, "speed": 14000.0, "error_amplitudes": [6e-6, 2e-6],
    "error_phases": [0.3, math.pi / 2],
}
SUPPORTS = {"m1": 0.694, "m2": 1.776, "c1": 2e8, "c2": 3e8, "k1": 520.0, "k2": 1340.0}
STRINGS = {
    "I1": "4880 g*cm^2", "I2": "32 kg*cm^2", "R1": "35.24 mm", "R2": "5.638 cm", "c0": "400 N/um", "k": "0.53 N*s/mm",
    "backlash": "120 um", "M10": "8500 N*cm", "speed": "14000 rpm", "error_amplitudes": ["6 um", "2000 nm"],
    "error_phases": [0.3, "90 deg"],
}


def pair(**changes):
    return GearPair(**{**SI, **changes})


def mesh(p, t, phi, phi_dot, u, u_dot):
    """The mesh force S of (2.5) in N, with (2.3), (2.4), (2.6) and the two-level c(t), all in SI."""
    w = p.n1 * p.speed * math.pi / 30
    orders = list(zip(range(1, 9), p.error_amplitudes, p.error_phases, strict=False))
    e = sum(a * math.cos(j * w * t - th) for j, a, th in orders)
    e_dot = -sum(a * j * w * math.sin(j * w * t - th) for j, a, th in orders)
    gap = p.R1 * phi[0] - p.R2 * phi[1] + u[0] - u[1] - e
    gap_dot = p.R1 * phi_dot[0] - p.R2 * phi_dot[1] + u_dot[0] - u_dot[1] - e_dot
    stiff = (t * w / (2 * math.pi)) % 1 < p.contact_ratio - 1
    c, half = p.c0 * (1 + p.chi1 if stiff else 1 - p.chi2), p.backlash / 2
    return p.k * gap_dot + c * (gap - max(-half, min(half, gap)))


def accelerations_si(p, t, phi, phi_dot, u, u_dot):
    """φ1'', φ2'', u1'', u2'' of (2.1) with (2.2), M2 resisting."""
    s = mesh(p, t, phi, phi_dot, u, u_dot)
    return [(p.M10 - p.b1 * phi_dot[0] - p.R1 * s) / p.I1, (-p.M20 - p.b2 * phi_dot[1] + p.R2 * s) / p.I2,
            (-p.k1 * u_dot[0] - p.c1 * u[0] - s) / p.m1, (-p.k2 * u_dot[1] - p.c2 * u[1] + s) / p.m2]


def accelerations_dimensionless(m, tau, x, x_dot, y, y_dot):
    """x1'', x2'', y1'', y2'' of (2.12), corrected."""
    z = x[0] - x[1] + y[0] - y[1] - transmission_error(m, tau)
    z_dot = x_dot[0] - x_dot[1] + y_dot[0] - y_dot[1] - transmission_error(m, tau, 1)
    s = 2 * m.zeta * z_dot + mesh_stiffness(m, tau) * backlash(z)
    return [
        (m.q1 - 2 * m.beta1 * x_dot[0] - s) / m.J1, (-m.q2 - 2 * m.beta2 * x_dot[1] + s) / m.J2,
        (-2 * m.mu1 * m.zeta_support1 * y_dot[0] - m.kappa1 * y[0] - s) / m.mu1,
        (-2 * m.mu2 * m.zeta_support2 * y_dot[1] - m.kappa2 * y[1] + s) / m.mu2,
    ]


@pytest.mark.parametrize("seed", range(6))
def test_model_is_the_physical_equations_in_other_units(seed):
    rng = np.random.default_rng(seed)
    p = pair(
        **SUPPORTS, M20=rng.uniform(50, 200), b1=rng.uniform(0, 0.3), b2=rng.uniform(0, 0.9),
        chi1=rng.uniform(0, 0.4), chi2=rng.uniform(0, 0.4), contact_ratio=rng.uniform(1, 2),
    )
    m, s, radii = p.to_model(), p.scales, np.array([p.R1, p.R2])
    for _ in range(10):
        tau, (x, x_dot, y, y_dot) = rng.uniform(0, 50), rng.uniform(-3, 3, (4, 2))
        si = accelerations_si(
            p, tau * s.time, x * s.length / radii, x_dot * s.velocity / radii, y * s.length, y_dot * s.velocity)
        expected = np.array(si) * np.array([*radii, 1, 1]) / (s.length / s.time**2)
        found = accelerations_dimensionless(m, tau, x, x_dot, y, y_dot)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def test_strings_give_the_same_pair_as_si_numbers():
    a, b = pair(), pair(**STRINGS)
    for name in (*STRINGS, "M20"):
        assert getattr(b, name) == pytest.approx(getattr(a, name), rel=1e-12), name


def test_torque_left_out_is_the_one_in_balance():
    assert pair().to_model().q1 == pytest.approx(pair().to_model().q2)


def test_harmonic_stiffness_in_newtons_per_metre():
    m = pair(stiffness_amplitudes=["100 N/um", "20 N/um"], stiffness_phases=["0 deg", "90 deg"]).to_model()
    assert isinstance(m.stiffness, HarmonicStiffness) and m.stiffness.amplitudes == pytest.approx((0.25, 0.05))
    assert m.stiffness.phases == pytest.approx((0, math.pi / 2))


BAD = [
    ({"I1": -1.0}, "I1 must be greater than 0; got -1.0"), ({"k": -5.0}, "k must not be negative"),
    ({"b1": -0.1}, "b1 must not be negative"), ({"backlash": 0.0}, "backlash must be greater than 0"),
    ({"M10": "inf N*m"}, "M10 must be a finite number"),
    ({"error_amplitudes": [float("nan")]}, "error_amplitudes[0] must be a finite number"),
    ({"R1": "3 kg"}, "R1 must be a length; got '3 kg'"), ({"R1": ""}, "R1 must be a length"),
    ({"R1": "35.24 degC"}, "R1 must be a length"), ({"R1": None}, "R1 must be a length"),
    ({"R1": True}, "R1 must be a length"), ({"error_amplitudes": "6 um"}, "error_amplitudes must be a list"),
    ({"error_phases": [0, 0, 0]}, "error_phases must not be longer"),
    ({"speed": "40 Hz"}, "speed must be an angular velocity; got '40 Hz'"),
    ({"speed": 0}, "speed must be greater than 0"),
    ({"n1": 2}, "n1 must be a whole number of teeth, at least 3; got 2"),
    ({"n2": 40.0}, "n2 must be a whole number of teeth"), ({"R2": 0.06}, "R1/R2 must equal n1/n2 = 0.625 to 1 %"),
    ({"chi1": -1.0}, "chi1 must be greater than -1"), ({"chi2": 1.0}, "chi2 must be less than 1"),
    ({"contact_ratio": 2.5}, "contact_ratio must lie in [1, 2]"),
    ({"stiffness_amplitudes": [4e8]}, "must keep the mesh stiffness above 0"),
    ({"stiffness_amplitudes": [1e8], "chi1": 0.2}, "chi1 must be left out beside stiffness_amplitudes"),
    ({"c1": 2e8}, "c2 must be given where the supports are elastic"),
    ({**SUPPORTS, "m2": None}, "m2 must be given where the supports are elastic"),
    ({"k1": 500.0}, "k1 must be left out where the supports are rigid"),
    ({"tooth_pairs": {"stiffness": "200 N/um", "contact_ratio": 1.5}, "stiffness_levels": ["300 N/um"]},
     "must be left out beside tooth_pairs"),
    # sizes that no pair has
    ({"I1": 1e-150, "I2": 1e-150, "R1": 1e-150, "R2": 1e-150 * 1.6}, "I1 must lie between 1e-40 and 1e"),
    ({"c0": 1e41}, "c0 must lie between"), ({"error_amplitudes": ["1e60 m"]}, "error_amplitudes[0] must lie between"),
    ({"M10": 1e40}, "M20 must lie between"), ({"n1": 10**400}, "n1 must be at most 1,000,000 teeth; got 1000"),
    ({"n1": np.array([25])}, "n1 must be a whole number"), ({"speed": 10**400}, "speed must lie between"),
    ({**SUPPORTS, "c1": 10**5000}, "got a number too long to show"),
    *(({"k": value}, "k must be a damping coefficient") for value in (
        np.array([1, 2]), np.array([1.0]), 1 + 0j, np.complex64(1), np.datetime64("2000-01-01"))),
]


@pytest.mark.parametrize(("changes", "message"), BAD, ids=[f"{i}-{m.split()[0]}" for i, (_, m) in enumerate(BAD)])
def test_bad_values_are_named(changes, message):
    with pytest.raises(InputError, match=re.escape(message)):
        pair(**changes)


@pytest.mark.parametrize(("changes", "words"), [
    ({"c0": 3e5, "k": 530.0}, "damping ratio k/(2 m ω0) is"), ({"backlash": "100 mm"}, "backlash is 100 mm"),
    ({"error_amplitudes": [4, 1e-6]}, "4e+06 µm, 3.333e+04 times the back"), ({"chi1": 25}, "chi1 is 25: the great"),
    ({"error_phases": [30]}, "phase is 30 rad of the first"), ({"speed": "1e6 rpm"}, "3690 m/s at 1e+06 rpm"),
    ({"error_phases": ["400 deg"]}, ""), ({"error_phases": [0.0, 12.0]}, ""), ({}, ""),
])
def test_slips_of_units_are_warned_of(changes, words, tmp_path):
    made = pair(**changes)
    assert [words in text for text in made.warnings] == [True] * bool(words)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        as_model(made)
    assert [str(each.message) for each in found] == list(made.warnings)
    lines = [f"{name} = {value!r}" for name, value in {**SI, **changes}.items()]
    (tmp_path / "pair.toml").write_text("\n".join(["[gearpair]", *lines]))
    assert load_study(tmp_path / "pair.toml").warnings == made.warnings


def test_radii_within_a_percent_pass():
    for factor in (0.9905, 1.0095):
        assert pair(R2=0.05638 * factor).to_model().J2 > 1


def test_kind_follows_the_supports_and_kinds_that_do_not_fit_are_refused():
    assert pair().rigid and pair().to_model().kind == "torsional"
    elastic, single = pair(**SUPPORTS), pair().to_model("single")
    assert elastic.to_model().kind == "full" and elastic.to_model("torsional").kind == "torsional"
    assert single.kind == "single" and sum(1 / J for J in (single.J1, single.J2)) == pytest.approx(1, rel=1e-14)
    for changes, kind, words in (({}, "full", "must be torsional or single"), ({}, "sngle", "Did you mean 'single'"),
                                 ({"b1": 0.1}, "single", "beta must be 0")):
        with pytest.raises(InputError, match=words):
            pair(**changes).to_model(kind)


@pytest.fixture(scope="module")
def motion():
    p = GearPair(**{**SI, **STRINGS, **SUPPORTS, "speed": "6000 rpm", "damping_law": "always"})
    dimensionless = simulate(p.to_model(), periods=50, transient=600, samples=400)
    return p, dimensionless, physical(dimensionless, p)


def test_physical_values_and_units(motion):
    p, dimensionless, ds = motion
    frequency = 25 * 6000 / 60  # Hz
    np.testing.assert_allclose(np.diff(ds.tau_section), 1e3 / frequency, rtol=1e-9)
    assert ds.tau.attrs["units"] == ds.tau_section.attrs["units"] == "ms"
    for name, unit, factor in (
        ("section_x1", "µm", 60), ("y2", "µm", 60), ("z", "µm", 60), ("z_dot", "mm/s", 0.06 * p.omega0),
        ("section_y1_dot", "mm/s", 0.06 * p.omega0), ("mesh_force", "N", 4e8 * 6e-5),
    ):
        assert ds[name].attrs["units"] == unit
        np.testing.assert_allclose(ds[name], dimensionless[name].values * factor, rtol=1e-12)
    assert ds.contact.identical(dimensionless.contact.assign_coords(tau=ds.tau))
    assert json.loads(ds.attrs["pair"])["pair"]["R1"] == pytest.approx(0.03524)
    assert dimensionless.z.attrs["units"] != "µm", "the dataset handed in is left alone"
    assert physical(ds, p) is ds


def test_velocities_are_slopes_and_the_mean_force_balances_the_torque(motion):
    ds = motion[2]
    slope = np.gradient(ds.x1.values, ds.tau.values)  # µm/ms = mm/s
    assert np.max(np.abs(slope - ds.x1_dot.values)[1:-1]) < 0.01 * np.ptp(ds.x1_dot.values)
    assert float(ds.mesh_force.mean()) == pytest.approx(85 / 0.03524, rel=2e-3)


def test_axes_velocities_forces_and_rates_of_results_are_scaled():
    p = pair()
    ds = physical(zones(p.to_model(), "omega=0.9:1.1:2", "q0=0.1:0.2:2", starts=2), p)
    assert ds.omega.attrs["units"] == "Hz" and ds.q0.attrs["units"] == "N*m"
    np.testing.assert_allclose(ds.omega, np.array([0.9, 1.1]) * p.omega0 / (2 * math.pi))
    np.testing.assert_allclose(ds.q0, np.array([0.1, 0.2]) * 4e8 * 6e-5 * 0.03524)
    assert p.scales.torque2 == pytest.approx(4e8 * 6e-5 * 0.05638)
    for name in ("v_rms", "v_rms_least", "v_rms_most", "v_rms_up", "v_rms_down", "z_dot_rms"):
        assert ds[name].attrs["units"] == "mm/s", name
    assert ds.lyapunov.attrs["units"] == ds.trace_error.attrs["units"] == "1/s" and ds.label.dtype == np.int8
    found = physical(attractors(p.to_model(), 4), p)
    assert found["start_x1"].attrs["units"] == "µm" and found["attractor_section_z"].attrs["units"] == "µm"
    assert all("omega0" not in v.attrs.get("units", "") for d in (ds, found) for v in d.variables.values())


def test_a_pair_at_the_ends_of_the_range_has_finite_scales():
    for inertia, radius, stiffness in itertools.product((1e-40, 1e40), (1e-40, 1e39), (1e-40, 1e40)):
        made = pair(I1=inertia, I2=inertia, R1=radius, R2=1.6 * radius, c0=stiffness, M10=1.0)
        assert all(0 < scale < math.inf for scale in asdict(made.scales).values())
