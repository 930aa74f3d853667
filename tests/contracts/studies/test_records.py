"""What results say of themselves: codes, units, intervals and flags; and what studies do without being asked."""

import json
import pickle
import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification, Label, Reason, Verdicts
from gearchaos.dynamics.response import CONTACTS, Response
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.core import warmup
from gearchaos.studies.core.axis import shared_coordinates
from gearchaos.studies.core.study import Study
from tests import ROOT

VERDICTS = (ROOT / "docs" / "verdicts.md").read_text()
SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
FIGURE_2 = MeshModel.of(q0=0.1)


@pytest.fixture(scope="module")
def mixed():
    """A map with orbits, chaos and chaos that ended."""
    return gc.zones(FIGURE_2, gc.Axis("omega", 0.5, 1.5, 16), gc.Axis("eps1", 0.0, 0.3, 14), settings=SHORT)


def test_codes_are_those_of_the_documentation():
    """Stores and files keep them, so they never change."""
    rows = [re.split(r"(?<!\\)\|", line) for line in VERDICTS.splitlines() if line.startswith("|")]
    codes = {row[3].strip(): int(row[4]) for row in rows if len(row) == 7 and row[4].strip().isdigit()}
    assert {r.name.lower(): int(r) for r in Reason} == codes | {"inferred": 9}
    labels = {row[2].split(",")[0].strip(): int(row[1]) for row in rows if len(row) == 7 and row[1].strip().isdigit()}
    assert {v.name.lower().replace("_", "-"): int(v) for v in Label} == labels
    assert tuple(re.findall(r"\d `([a-z-]+)`", re.search(r"\| `contact` \| (.*?) \|", VERDICTS)[1])) == CONTACTS


def test_intervals_hold_their_exponents_and_flags_are_true(mixed):
    label, value = mixed.label.values, mixed.lyapunov.values
    chaotic, periodic = label == Label.CHAOTIC, label == Label.PERIODIC
    assert chaotic.sum() > 5 and periodic.sum() > 50 and not (label == Label.QUASI_PERIODIC).any()
    assert not mixed.period.values[chaotic].any() and mixed.residual.values[periodic].max() <= 1e-10
    low, high = mixed.lyapunov_lo.values, mixed.lyapunov_hi.values
    assert np.all((low < value)[chaotic] & (value < high)[chaotic])
    assert np.all((low == value)[periodic] & (value == high)[periodic])
    assert not mixed.transient_chaos.values[~periodic].any()
    quick = periodic & (mixed.periods_spent.values <= 1280)  # settled before anybody asked for exponents
    assert quick.sum() > 50 and not mixed.transient_chaos.values[quick].any()
    assert np.all(np.isfinite(mixed.v_rms.values[label != Label.DIVERGED]))


def test_a_verdict_on_one_motion_has_its_exponents_intervals_and_section():
    found = gc.regime(FIGURE_2.with_values({"eps1": 0.206}))
    assert len(found.multipliers) == len(found.lyapunov) == 2 and found.period == 8
    assert found.lyapunov_ci == [[v, v] for v in found.lyapunov]
    chaos = gc.regime(FIGURE_2.with_values({"eps1": 0.26}), settings=SHORT)
    assert chaos.label == "chaotic" and chaos.multipliers == [] and chaos.period is None and chaos.residual is None
    assert all(low < value < high for (low, high), value in zip(chaos.lyapunov_ci, chaos.lyapunov, strict=True))
    assert sum(chaos.lyapunov) == pytest.approx(-2 * 0.025 - 2 * 0.01 / 2, abs=1e-6)  # −2ζ(1/J1 + 1/J2) − 2β/J
    assert {len(v) for v in chaos.section.values()} == {512}
    assert (found.spectral_label, chaos.spectral_label) == ("8T", "chaotic")


@pytest.mark.parametrize(("values", "settings"), [
    ({"eps1": 0.206}, None), ({"eps1": 0.26}, SHORT), ({"kind": "single", "omega": 2.0, "z": 30.0}, None),
])
def test_a_verdict_as_a_dataset_is_saved_and_loaded_whole(tmp_path, values, settings):
    found = gc.regime(MeshModel.of(**{"q0": 0.1, **values}), settings=settings)
    data = found.to_dataset()
    gc.save(data, tmp_path / "verdict.nc")
    xr.testing.assert_identical(gc.load(tmp_path / "verdict.nc"), data)
    assert all(v.attrs["long_name"] and v.attrs["units"] for v in data.variables.values())
    assert (data.attrs["motion"], data.attrs["study"]) == (found.label, "regime")
    assert int(data.period) == (found.period or 0) and int(data.periods_spent) == found.periods_spent
    for name, measure in {"v_rms": found.v_rms, "z_rms": found.z_rms, "mesh_force_peak": found.mesh_force_peak,
                          "switches": found.switches_per_period, "residual": found.residual}.items():
        np.testing.assert_array_equal(float(data[name]), np.nan if measure is None else measure, err_msg=name)
    if found.label != "diverged":
        assert data.lyapunov_spectrum.values.tolist() == found.lyapunov
        ends = np.stack([data.lyapunov_spectrum_lo, data.lyapunov_spectrum_hi], axis=1)
        assert ends.tolist() == found.lyapunov_ci
    multipliers = data.multipliers_real.values + 1j * data.multipliers_imag.values
    assert multipliers[np.isfinite(multipliers)].tolist() == found.multipliers
    assert {n.removeprefix("section_"): data[n].values.tolist() for n in data if "section" in n} == found.section


def test_a_verdict_has_complex_multipliers_that_become_pairs_in_json():
    found = gc.regime(MeshModel.of(kind="single", omega=1.7, zeta=0.05, q0=0.5, eps1=0.02, chi0=0.0))
    assert all(isinstance(m, complex) for m in found.multipliers)
    assert found.multipliers[0].imag == -found.multipliers[1].imag != 0
    assert found.to_dict()["multipliers"] == [[m.real, m.imag] for m in found.multipliers]


@pytest.mark.slow
def test_the_regime_command_loads_neither_pandas_nor_scipy_s_special_functions_and_linear_algebra():
    """They take half a second, and the verdict none of it."""
    command = ["gearchaos", "regime", "--set", "eps1=0.206", "--json"]
    code = (f"import sys; sys.argv = {command}\nfrom gearchaos.cli import main\ntry: main()\nexcept SystemExit: pass\n"
            "print([m for m in ('pandas', 'xarray', 'scipy.special', 'scipy.linalg') if m in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    document, loaded = done.stdout.splitlines()
    assert json.loads(document)["label"] == "8T" and loaded == "[]"


@pytest.mark.slow
def test_a_command_can_import_scipy_s_linear_algebra_after_numba():
    """`attractors` needs it for the intervals of the shares."""
    code = ("import sys; from gearchaos.cli import main; sys.argv = ['gearchaos', 'attractors', '--starts', '4', "
            "'--set', 'kind=single']; main()")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "% of starts" in done.stdout, done.stderr


def test_verdicts_are_compared_copied_and_shown_by_their_values():
    model = FIGURE_2.with_values({"eps1": 0.206})
    found, again, other = gc.regime(model), gc.regime(model), gc.regime(FIGURE_2)
    assert found == again == pickle.loads(pickle.dumps(found)) and found != other
    assert repr(found).startswith("Verdict(label='8T', period=8, reason='a stable periodic orbit")
    assert {"v_rms", "switches_per_period", "label"} <= set(dir(found))
    with pytest.raises(AttributeError, match="no attribute 'v_rsm'"):
        _ = found.v_rsm


def test_every_response_measure_is_in_the_verdict_and_those_with_a_variable_in_maps(mixed):
    found, measures = gc.regime(FIGURE_2), Response.declared()
    document, data = found.to_dict(), found.to_dataset()
    assert set(measures) <= set(document) and all(getattr(found, n) == document[n] for n in measures)
    assert {column.variable or name for name, column in measures.items()} <= set(data.data_vars)
    assert {column.variable for column in measures.values() if column.variable} <= set(mixed.data_vars)
    assert all(column.meaning for column in Verdicts.declared().values())


def test_columns_are_taken_and_overwritten_with_those_of_nested_tables():
    verdicts = Verdicts.unresolved(np.arange(12.0).reshape(2, 6))
    verdicts.response.v_rms[:], verdicts.multipliers[:, 0] = np.arange(6), np.arange(6) * 1j
    some = verdicts.take(np.array([4, 1]))
    assert (some["v_rms"].tolist(), some["w"].tolist()) == ([4, 1], [[4, 1], [10, 7]])
    assert some["multipliers"][:, 0].tolist() == [4j, 1j] and some["contact"].tolist() == [3, 3]
    verdicts.put(np.array([0, 5]), some)
    assert verdicts["v_rms"].tolist() == [4, 1, 2, 3, 4, 1] and verdicts["w"][1].tolist() == [10, 7, 8, 9, 10, 7]
    with pytest.raises(KeyError, match="v_rsm"):
        verdicts["v_rsm"]


def test_a_motion_that_ran_away_has_neither_response_nor_section():
    found = gc.regime(MeshModel.of(kind="single", omega=2.0, z=30.0))
    assert (found.label, found.section, found.period, found.spectral_label) == ("diverged", {}, None, None)
    assert (found.contact, found.v_rms, found.dynamic_factor, found.residual) == (None, None, None, None)


def test_a_torus_has_the_range_of_its_two_halves():
    found = gc.regime(MeshModel.of(kind="full", omega=1.05, eps1=0.04))
    assert found.label == "quasi-periodic"
    for (low, high), value in zip(found.lyapunov_ci, found.lyapunov, strict=True):
        assert low <= high and value == pytest.approx((low + high) / 2, rel=1e-12, abs=1e-15)


def test_steady_motions_are_sampled_over_eight_rounds_or_512_periods():
    orbit = FIGURE_2.with_values({"eps1": 0.231})
    assert gc.steady(orbit, gc.regime(orbit)).sizes == {"period": 48, "tau": 48 * 64}
    chaos = FIGURE_2.with_values({"eps1": 0.26})
    assert gc.steady(chaos, gc.regime(chaos, settings=SHORT)).sizes["period"] == 512


@pytest.mark.parametrize(("count", "dtype"), [(300, np.int32), (2**31 - 1, np.int32), (2**31, np.int64)])
def test_pieces_are_numbered_in_as_few_bytes_as_will_do(count, dtype, monkeypatch):
    monkeypatch.setattr(np, "arange", lambda n, dtype: (n, dtype))

    class Numbers(Study):
        grid = {"x": count}  # noqa: RUF012 -- it stands for a property
        cost = SimpleNamespace(check_time=lambda: None)

        def compute(self, items, **_):
            return {"numbers": items}

        def finish(self, found, **_):
            return found

    assert Numbers(FIGURE_2).run()["numbers"] == (count, dtype)


def test_a_map_has_the_coordinates_that_its_corners_need():
    few, more, omega = ("z", "z_dot"), ("z", "z_dot", "x2_dot"), gc.Axis("omega", 1.0, 2.0, 5)
    for axes, coordinates in (([gc.Axis("beta1", 0.005, 0.01, 2)], more), ([gc.Axis("beta1", 0.01, 0.02, 2)], more),
                              ([gc.Axis("beta1", 0.01, 0.02, 1)], few), ([omega], few),
                              ([omega, gc.Axis("beta1", 0.01, 0.02, 3)], more)):
        assert shared_coordinates(MeshModel.of(beta2=0.01), *axes) == coordinates


def test_the_kernels_warmed_are_of_every_dimension_and_it_is_said_how_long_it_took():
    for dimension, values in warmup.MODELS.items():
        assert switched_system(vary(MeshModel.of(**values), {})).dimension == dimension
    *kernel, seconds = warmup._run(2, "always")
    assert kernel == [2, "always"] and 0 < seconds < 600


def test_the_response_of_coexisting_motions_is_that_of_the_classified_ones():
    """With runs so short that many motions stay undecided, and an initial value of x1 where the others are of z."""
    short = Classification(transient_lengths=(20, 20), longest_period=4, exponent_run=21, doublings=0,
                           longest_transient=0)
    model, axes = MeshModel.of(kind="single", x1=0.5), (gc.Axis("omega", 0.4, 2.3, 20), gc.Axis("eps1", 0.05, 0.3, 8))
    data = gc.zones(model, *axes, starts=4, settings=short)
    count, least, most = (data[n].values for n in ("attractors", "v_rms_least", "v_rms_most"))
    assert 0 < np.mean(data.label == Label.UNDECIDED) < 1 and (count == 0).any() and (count > 1).any()
    some = count > 0
    assert np.array_equal(np.isfinite(least), some) and np.array_equal(np.isfinite(most), some)
    assert np.all((least[some] > 0) & (least[some] <= most[some]))
    own = some & np.isin(data.label, (Label.PERIODIC, Label.CHAOTIC))
    assert np.all((least <= data.v_rms.values)[own] & (data.v_rms.values <= most)[own])
    assert np.all(data.contact_worst.values[~some] == 3)


def test_the_coarsest_refinement_is_half_a_part():
    model, axes = MeshModel.of(kind="single"), (gc.Axis("omega", 2.0, 2.2, 3), gc.Axis("eps1", 0, 0.1, 3))
    xr.testing.assert_equal(gc.zones(model, *axes, refine=128).label, gc.zones(model, *axes).label)
