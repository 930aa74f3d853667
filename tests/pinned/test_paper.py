"""The 2008 study: settings as data, checks of claims, and the report."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib.resources import files
from io import BytesIO

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.files import write_bytes
from gearchaos.flow import StoppedError
from gearchaos.flow.exact import raise_if_cancelled
from gearchaos.model import MeshModel, TwoLevelStiffness, mesh_stiffness
from gearchaos.paper import build, claims, settings
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims import CHECKS, _maps, _motions, records
from gearchaos.paper.claims._claim import VERDICTS, CheckResult, PeriodicMotion
from gearchaos.paper.figures import draw, spectral_comparison
from gearchaos.paper.page import _claim, _flat, _maths, proofs_in_words
from gearchaos.proof.certificate import Unproved, checksum
from gearchaos.studies import load

pytestmark = pytest.mark.slow

TINY = settings.Quality(
    "tiny", zones=(12, 9), basins=(40, 40), longest_transient=1500, bifurcation=(12, 8), portrait=64, trajectory=12,
    dpi=100,
)
STATED = {
    "2a", "3a", "3b", "4a", "4b", "4c", "4d", "4e", "5a", "6a", "6b", "6c", "6d", "6e", "7a", "7b", "7c", "7d", "7e",
    "8a", "8b", "9a", "9b", "9c", "12a", "12b", "13a", "13b", "14a", "14b", "15a", "15b", "beta", "chi", "rho",
}


# --- settings ---------------------------------------------------------------------------------------------------------


def test_ranges_are_given_by_figure_10_alone_and_assumed_for_a_reason_elsewhere():
    ranges = [(f.number, name, r) for f in settings.all_figures().values() for s in f.studies.values()
              for name, r in s.axes.items()]
    assert [(number, name) for number, name, r in ranges if r.range == "given"] == [(10, "kappa")]
    assert all(r.start < r.stop and ((r.why and r.range == "assumed") or r.range == "given") for *_, r in ranges)


def test_paper_quality_is_fine_enough_to_publish():
    q = settings.quality("paper")
    assert q.zones >= (400, 300) and min(q.basins) >= 400 and q.bifurcation >= (2000, 128)


# --- figures ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tiny_bench():
    return ComputationCache(TINY)


def test_there_are_fifteen_figures():
    assert list(settings.all_figures()) == list(range(1, 16))


@pytest.mark.parametrize("number", settings.all_figures())
def test_every_figure_computes_and_draws(tiny_bench, number):
    figure = settings.all_figures()[number]
    assert figure.title and figure.caption and figure.shows
    assert grey_range(draw(figure, tiny_bench.figure(figure))) > 10


def grey_range(png: bytes) -> float:
    """Standard deviation of the grey values of a picture; a blank page has none."""
    return float(imread(BytesIO(png), format="png")[..., :3].mean(axis=2).std() * 255)


def test_figure_4_shows_the_five_motions_that_starts_end_on(tiny_bench):
    data = tiny_bench.figure(settings.all_figures()[4])
    assert list(data) == ["1T_1", "3T_1", "4T_1", "4T_2", "5T_1"]
    for key, ds in data.items():
        n, z = int(key[0]), ds["section_z"].values
        assert z[n:] == pytest.approx(z[:n], abs=1e-9)


# --- claims -----------------------------------------------------------------------------------------------------------


def test_every_record_has_a_check_and_says_where_what_and_by_which_criterion():
    assert {record["check"] for record in records().values()} == set(CHECKS) and set(records()) >= STATED
    for record in records().values():
        assert record["figure"] in settings.all_figures()
        assert all(record[key] for key in ("where", "statement", "setting", "criterion"))
    assert claims.claims_of([9]) == ["9a", "9b", "9c"]


@pytest.fixture(scope="module")
def draft_cache():
    return ComputationCache(settings.quality("draft"))


@pytest.mark.parametrize(("name", "verdict"), [
    ("3b", "holds"), ("4b-caption", "misprint"), ("4d", "holds"), ("4e", "holds"), ("6b", "holds"), ("6c", "holds"),
    ("6d", "misprint"), ("8a", "holds"), ("13a", "holds"), ("13b", "holds"),
    ("14b", "holds within the printed digits"), ("15b", "holds"),
])
def test_verdicts_on_the_statements_of_the_paper(draft_cache, name, verdict):
    (claim,) = claims.check_all(draft_cache, [name])
    assert claim.verdict == verdict
    cited = json.dumps(claim.evidence["verdicts"])
    assert "multiplier" in cited or "exponent" in cited
    json.dumps(claim.to_dict(), allow_nan=False)


def test_what_two_threads_ask_for_is_computed_once_and_each_hears_its_own():
    cache, computed, together = ComputationCache(TINY), [], threading.Barrier(2)

    def inner():
        computed.append("inner")
        return 1

    def outer():
        computed.append("outer")
        time.sleep(0.1)  # the other thread asks meanwhile
        return cache.cached("inner", inner) + 1

    def ask(key):
        with cache.requested_keys() as asked:
            together.wait()
            found = [cache.cached("outer", outer), cache.cached(key, lambda: key)]
        return found, asked

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(ask, "ab")
    assert first == ([2, "a"], ["outer", "a"]) and second == ([2, "b"], ["outer", "b"])
    assert computed == ["outer", "inner"]


def claim_with(verdict: str, expected: str = "") -> claims.Claim:
    texts = dict.fromkeys(("where", "statement", "setting", "criterion", "computed", "instead"), "")
    return claims.Claim(id="x", figure=1, verdict=verdict, evidence={}, expected=expected, **texts)


def test_only_contradictions_and_unknown_misprints_fail():
    good = [claim_with("holds"), claim_with("holds within the printed digits"), claim_with("misprint", "misprint")]
    bad = [claim_with("contradicted"), claim_with("misprint"), claim_with("contradicted", "misprint")]
    assert claims.failed(good + bad) == bad


def test_intervals_are_unbroken():
    values, flags = np.arange(6.0), np.array([1, 1, 0, 0, 1, 0], dtype=bool)
    assert _motions.intervals(values, flags) == [(0.0, 1.0), (4.0, 4.0)]
    assert _motions.intervals(values, ~(values < 9)) == []


def labelled(period: np.ndarray) -> xr.Dataset:
    flags = {"flag_values": np.arange(1, 6), "flag_meanings": "periodic quasi-periodic chaotic undecided diverged"}
    label = np.where(period > 0, 1, 3).astype(np.int8)
    return xr.Dataset({"label": (("y", "x"), label, flags), "period": (("y", "x"), period),
                       "v_rms": (("y", "x"), period + 0.5)})


def test_similarity_counts_the_cells_that_keep_their_class():
    one = np.ones((6, 6), dtype=int)
    one[:, 3:] = 2
    two = np.roll(one, 1, axis=1)
    two[:, 0] = 1
    assert _maps.similarity(labelled(one), labelled(one)) == {"same_class": 1.0, "v_rms_correlation": 1.0}
    assert _maps.similarity(labelled(one), labelled(two))["same_class"] == pytest.approx(5 / 6, abs=1e-4)


def test_the_spectral_class_is_reported_where_it_differs():
    ds = gc.bifurcation(gc.MeshModel.of(omega=1.0, q0=0.1), gc.Axis("eps1", 0.2, 0.23, 7), points=128)
    assert "says the same in all of 7 columns" in spectral_comparison(ds, "eps1")
    wrong = ds.assign(label=ds["label"].copy(data=np.full(7, 4, dtype=np.int8)), period=ds["period"] * 0)
    assert "says the same in 0 of 7 columns" in spectral_comparison(wrong, "eps1")
    assert "not undecided" in spectral_comparison(wrong, "eps1")


def portrait(x: np.ndarray, y: np.ndarray) -> xr.Dataset:
    return xr.Dataset({"section_x1": ("period", x), "section_x1_dot": ("period", y)})


def test_closed_curves_are_counted_and_points_that_fill_a_square_have_dimension_two():
    k = np.arange(4000)
    angle = 2 * np.pi * k * (np.sqrt(5) - 1) / 2
    for count in (1, 2):
        pieces, dimension = _motions.curves(portrait(np.cos(angle) + 4 * (k % count), np.sin(angle)))
        assert pieces == count and dimension == pytest.approx(1, abs=0.1)
    points = np.random.default_rng(1).random((2, 4000))
    assert _motions.curves(portrait(*points))[1] == pytest.approx(2, abs=0.15)


def test_distance_of_a_portrait_to_itself_is_zero_and_grows_with_a_shift():
    angle = np.linspace(0, 2 * np.pi, 500)
    base = portrait(np.cos(angle), np.sin(angle))
    near, far = (portrait(np.cos(angle) + shift, np.sin(angle)) for shift in (0.1, 1.0))
    distances = [_motions.distance(base, other, base) for other in (base, near, far)]
    assert distances[0] == 0 and distances[0] < distances[1] < distances[2]


@pytest.mark.parametrize("wave", [
    TwoLevelStiffness(), TwoLevelStiffness(chi1=0.2, chi2=0.3, contact_ratio=1.6), TwoLevelStiffness(0.3, 0.1, 1.25),
])
def test_the_suitable_sine_is_the_first_fourier_harmonic(wave):
    model, n = MeshModel(stiffness=wave), 200_000
    phase = (np.arange(n) + 0.5) / n
    chi = mesh_stiffness(model, phase * model.period)
    coefficient = 2 * (chi * np.exp(2j * np.pi * phase)).mean()
    sine = _maps.first_harmonic(wave)
    assert sine.amplitudes[0] * np.exp(1j * sine.phases[0]) == pytest.approx(coefficient, abs=1e-4)


# --- the report -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def report(tmp_path_factory, draft_cache):
    folder = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gearchaos.paper.report.ComputationCache", lambda *_, **__: draft_cache)
        return folder, build(folder, [1, 9], "draft", progress=False)


def test_report_of_statements_that_hold_holds_page_pictures_claims_and_data_and_nothing_else(report):
    folder, code = report
    data = {f"data/fig09{name}.nc" for name in ("a", "b", "_a_section", "_b_section")}
    proofs = {f"certificates/{name}" for name in ("9b-6T-eps1-0.231.json", "verifier.py")}
    assert code == 0 and {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()} == {
        "index.html", "claims.json", "fig01.png", "fig09.png"} | data | proofs
    assert all(grey_range(path.read_bytes()) > 10 for path in folder.glob("*.png"))


def test_claims_json_has_the_schema(report):
    found = json.loads((report[0] / "claims.json").read_text())
    assert [c["id"] for c in found] == ["9a", "9b", "9c"]
    for claim in found:
        assert claim["verdict"] in VERDICTS
        assert isinstance(claim["figure"], int) and isinstance(claim["evidence"], dict) and claim["evidence"]
        assert all(isinstance(claim[k], str) for k in ("where", "statement", "setting", "criterion", "computed"))


def test_data_can_be_loaded_again_with_its_model(report):
    ds = load(report[0] / "data" / "fig09a.nc")
    assert ds.sizes["tau"] == 120 * 64
    assert json.loads(ds.attrs["model"])["error"]["amplitudes"] == [0.23]


@pytest.fixture(scope="module")
def page(report):
    return (report[0] / "index.html").read_text()


def values_of(page: str, names: str) -> list[str]:
    """The values of all attributes with these names."""
    return re.findall(rf"""\s(?:{names})=["']?([^"'\s>]*)""", page)


def test_page_is_self_contained(page):
    assert not re.search(r"<(script|link|iframe|object)|https?://|url\(|@import", page)
    sources, links = values_of(page, "src|srcset"), values_of(page, "href")
    assert sources and all(source.startswith("data:image/") for source in sources)
    assert links and set(links) <= {f"#{name}" for name in values_of(page, "id")}


def test_style_sheet_is_not_escaped(page):
    style = page.split("<style>")[1].split("</style>")[0]
    assert '"Helvetica Neue"' in style and "&#" not in style


def test_page_shows_figures_corrections_verdicts_and_run(page):
    assert {"fig1", "fig9", "claim-9a", "corrections", "run"} <= set(values_of(page, "id"))
    printed = tomllib.loads(files("gearchaos.paper").joinpath("corrections.toml").read_text(encoding="utf-8"))
    assert page.count("<tr><td>(2.") >= 3 and len(printed["correction"]) == 8
    assert "draft quality" in page and "holds" in page and "6T" in page


def test_a_contradicted_statement_makes_the_exit_code_one(tmp_path, monkeypatch):
    monkeypatch.setitem(CHECKS, "motion", lambda cache, **_: CheckResult("contradicted", "nothing", {"label": "1T"}))
    monkeypatch.setattr(claims, "claims_of", lambda figures: ["9a"])
    assert build(tmp_path, [1], "draft", progress=False) == 1
    assert "Not confirmed: 9a" in (tmp_path / "index.html").read_text()


def test_a_failure_leaves_no_half_written_file(tmp_path, monkeypatch):
    def broken(*_):
        raise RuntimeError("no page")

    monkeypatch.setattr("gearchaos.paper.report.render", broken)
    with pytest.raises(RuntimeError):
        build(tmp_path, [1], "draft", progress=False)
    assert {p.name for p in tmp_path.iterdir()} == {"fig01.png", "claims.json"}


def test_a_failed_drawing_is_raised_and_stops_the_checks(tmp_path, monkeypatch):
    left = []

    def endless(cache, names):
        try:
            for _ in range(2000):
                raise_if_cancelled()
                time.sleep(0.01)
        except StoppedError:
            left.append(True)
            raise

    def broken(*_):
        time.sleep(0.2)
        raise RuntimeError("no ink")

    monkeypatch.setattr(claims, "check_all", endless)
    monkeypatch.setattr("gearchaos.paper.report.draw", broken)
    with pytest.raises(RuntimeError, match="no ink"):
        build(tmp_path, [1], "draft", progress=False)
    assert left


def test_write_is_whole_or_not_at_all(tmp_path, monkeypatch):
    target = tmp_path / "page.html"
    write_bytes(target, b"old")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        write_bytes(target, b"new")
    assert target.read_bytes() == b"old" and list(tmp_path.iterdir()) == [target]


def test_a_report_of_no_figure_is_refused_before_any_work(tmp_path):
    with pytest.raises(InputError, match="figures must name at least one figure"):
        build(tmp_path / "report", [], "draft", progress=False)
    assert not (tmp_path / "report").exists()


# --- proofs of periodic motions ---------------------------------------------------------------------------------------


def test_the_periodic_statement_alone_is_a_theorem(report, page):
    chaotic, periodic, other = json.loads((report[0] / "claims.json").read_text())
    assert chaotic["proofs"] == other["proofs"] == []
    (proof,) = periodic["proofs"]
    assert proof["proved"] and proof["period"] == 6 and proof["at"] == {"eps1": 0.231} and proof["outside"] == 0
    certificate = json.loads((report[0] / proof["file"]).read_text())
    assert certificate["theorem"] == proof["theorem"] and certificate["period"] == 6
    assert float.fromhex(certificate["model"]["eps"][0]) == 0.231
    assert page.count('<span class="mark theorem">theorem</span>') == 3  # legend, overview, statement
    assert proof["file"] in page and "1 of 1 periodic motions" in page


def test_the_verifier_beside_the_certificates_accepts_them_and_refuses_a_forgery(report, tmp_path):
    script, good = report[0] / "certificates" / "verifier.py", report[0] / "certificates" / "9b-6T-eps1-0.231.json"
    document = json.loads(good.read_text())
    document["model"]["eps"][0] = (0.231 + 1e-7).hex()
    (forged := tmp_path / "forged.json").write_text(json.dumps({**document, "sha256": checksum(document)}))
    for file, code, word in ((good, 0, "proved"), (forged, 1, "refused")):
        done = subprocess.run([sys.executable, "-I", script, file], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == code and word in done.stdout


def periodic_claim(period: int, count: int = 1) -> claims.Claim:
    values = [round(0.231 + 0.0001 * i, 4) for i in range(count)]
    motions = [
        PeriodicMotion(period, MeshModel.of(omega=1.0, q0=0.1, eps1=value), {"eps1": value}) for value in values
    ]
    return replace(claim_with("holds"), motions=motions)


def test_a_motion_that_is_not_proved_says_why(tmp_path, monkeypatch):
    (other,) = claims.prove_claims([periodic_claim(5)], tmp_path)
    assert _claim(other)["mark"] == "" and not list(tmp_path.iterdir())
    assert _claim(other)["proofs"][0]["text"] == "5T at ε1 = 0.231: not proved, computed again, the motion is 6T"
    monkeypatch.setattr(claims, "prove", lambda verdict: Unproved("neutral", float("nan"), 512))
    (neutral,) = claims.prove_claims([periodic_claim(6)], tmp_path)
    assert json.loads(json.dumps(neutral.proofs, allow_nan=False))[0]["margin"] is None
    assert _claim(neutral)["proofs"][0]["text"] == "6T at ε1 = 0.231: not proved, neutral"
    assert "0 of 1 periodic motions" in proofs_in_words([neutral])


def test_a_range_is_proved_at_the_values_computed_with_the_same_certificates_on_each_run(tmp_path):
    (again := tmp_path / "again").mkdir()
    (scan,), _ = claims.prove_claims([periodic_claim(6, 4)], tmp_path), claims.prove_claims([periodic_claim(6)], again)
    assert _claim(scan)["mark"] == "6T proved at 4 values"
    (line,) = _claim(scan)["proofs"]
    assert line["text"].startswith("6T at 4 of the values of ε1 computed, from 0.231 to 0.2313: radius ")
    assert line["file"] == "certificates/x-6T-eps1-*.json"
    assert _claim(replace(scan, proofs=scan.proofs[:1], verdict="misprint"))["mark"] == ""
    for name in ("x-6T-eps1-0.231.json", "verifier.py"):
        one, two = (folder / "certificates" / name for folder in (tmp_path, again))
        assert one.read_bytes() == two.read_bytes()


def test_without_python_flint_the_report_says_so_once(tmp_path, monkeypatch, capsys, draft_cache):
    monkeypatch.setattr("gearchaos.paper.report.ComputationCache", lambda *_, **__: draft_cache)
    monkeypatch.setattr("gearchaos.studies.proofs.proofs.find_spec", lambda name: None)
    assert build(tmp_path, [9], "draft") == 0
    assert 'pip install "gearchaos[proof]"' in " ".join(capsys.readouterr().err.split())
    text = (tmp_path / "index.html").read_text()
    assert text.count("python-flint") == 1 and "theorem" not in text.split("</style>")[1]
    assert not (tmp_path / "certificates").exists()


# --- the page's text --------------------------------------------------------------------------------------------------


def test_indices_of_symbols_are_set_low_and_nothing_else_is():
    assert _maths("x1(0) = 1") == "x<sub>1</sub>(0) = 1"
    assert _maths("Fig. 7d, 12T at 0.0164 & d = 2") == "Fig. 7d, 12T at 0.0164 &amp; d = 2"


def test_evidence_becomes_lines():
    evidence = {"by_kappa": {"20": {"same": 0.5}}, "windows": [[0.1, 0.2], [0.3, 0.4]], "nothing": []}
    assert list(_flat(evidence)) == [
        ("by kappa · 20", "same 0.5"), ("windows", "0.1, 0.2; 0.3, 0.4"), ("nothing", "none"),
    ]
