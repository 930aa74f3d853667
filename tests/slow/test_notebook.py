"""A notebook, executed in a real kernel: cards, progress bars and the explorer."""

import re

import nbformat
import pytest
from nbclient import NotebookClient

CELLS = {
    "model": """
        import gearchaos as gc
        model = gc.MeshModel.of(kind="single", zeta=0.025, omega=0.8, q0=0.1, eps1=0.1)
        model""",
    "verdict": "verdict = gc.regime(model)\nverdict",
    "study": 'study = gc.Zones(model, "omega=0.6:1:12", "eps1=0:0.2:9")\nstudy',
    "zones": "zones = gc.run(study, progress=True)\ngc.card(zones)",
    "store": 'gc.run(gc.Bifurcation(model, "eps1=0:0.2:12"), out="run.zarr", tile=3, progress=True)',
    "branch": 'gc.card(gc.branch(model, "omega=0.75:0.85"))',
    "picture": "%matplotlib inline\nax = gc.plot.zones(zones)",
    "explorer": "page = gc.explore(model)\npage",
    "served": """
        from urllib.request import ProxyHandler, build_opener
        content = build_opener(ProxyHandler({})).open(page.url, timeout=60).read().decode()
        page.stop()
        print("bokeh" in content.lower())""",
}


@pytest.fixture(scope="module")
def outputs(tmp_path_factory) -> dict[str, list]:
    from textwrap import dedent

    cells = [nbformat.v4.new_code_cell(dedent(source).strip()) for source in CELLS.values()]
    notebook = nbformat.v4.new_notebook(cells=cells)
    folder = tmp_path_factory.mktemp("notebook")
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=240, kernel_name="python3", resources=resources).execute()
    return {name: cell.outputs for name, cell in zip(CELLS, notebook.cells, strict=True)}


def shown(outputs: list) -> str:
    return "".join(str(o.data.get("text/html", "")) for o in outputs if "data" in o)


@pytest.mark.parametrize(("cell", "title"), [
    ("model", "Single-degree-of-freedom model"), ("verdict", "Verdict: 3T"), ("study", "Study: zones"),
    ("zones", "Result: zones"), ("branch", "Result: branch")])
def test_a_value_is_shown_as_a_card(outputs, cell, title):
    html = shown(outputs[cell])
    assert html.count("gearchaos-card") == 1 and title in html and "<svg" in html
    assert not re.search(r'(src|href)="(?!data:)', html) and "<script" not in html, "nothing is loaded"


@pytest.mark.parametrize(("cell", "done"), [("zones", "108/108"), ("store", "6/6")])
def test_a_progress_bar_ends_at_its_total_and_is_kept_once(outputs, cell, done):
    bars = [o.data["text/plain"] for o in outputs[cell] if "<progress" in str(o.get("data", ""))]
    counts = [re.search(r"^(.*?) ([\d,]+)/([\d,]+) ", text).groups() for text in bars]
    assert len({name for name, *_ in counts}) == len(counts) and done in bars[0], "one for each stage"
    assert all(reached == total for _, reached, total in counts)
    assert "widget" not in str(outputs[cell]) and "install" not in str(outputs[cell])


def test_a_picture_is_shown_below_its_cell(outputs):
    assert any("image/png" in o.get("data", {}) for o in outputs["picture"])


def test_the_explorer_is_shown_in_a_frame_and_is_served(outputs):
    assert re.search(r'<iframe src="http://(localhost|127\.0\.0\.1):\d+', shown(outputs["explorer"]))
    assert outputs["served"][0].text == "True\n"
