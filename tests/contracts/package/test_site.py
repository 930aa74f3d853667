"""The manual's own tools: reference pages generated from the program, and the check of the finished site."""

import sys
from dataclasses import fields
from pathlib import Path

import pytest
import typer.main

from gearchaos.cli import app
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.quantities import COORDINATES, GEARS, HARMONICS, OPERATION, PARAMETERS, RESPONSES, RESULTS, VERDICTS
from gearchaos.studies.core.options import file_options
from gearchaos.studies.core.registry import STUDIES
from tests import ROOT

sys.path.insert(0, str(ROOT / "docs" / "_ext"))
import check_site
import command_pages
import dataset_pages
import file_pages
import repository_pages
import stale


def _section(page: str, title: str, level: str = "##") -> str:
    """The text below a title."""
    return page.split(f"\n{level} {title}\n")[1].split(f"\n{level} ")[0]


def test_the_page_of_commands_has_every_option_of_every_command():
    page, group = command_pages.page(), typer.main.get_command(app)
    for name, command in group.commands.items():
        section = _section(page, name)
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert f"`{parameter.opts[-1]}" in section, (name, parameter.name)
        assert command.help.split("\n")[0] in section


def test_the_page_of_quantities_has_every_name_once():
    tables = (PARAMETERS, OPERATION, GEARS, HARMONICS.values(), COORDINATES, RESPONSES, VERDICTS, RESULTS)
    page = file_pages.quantities_page()
    for quantity in (q for rows in tables for q in rows):
        assert page.count(f"\n| `{quantity.name}` |") == 1, quantity.name


def test_the_page_of_study_files_has_every_key():
    page = file_pages.study_file_page()
    for kind, study in STUDIES.items():
        section = _section(page, f'`kind = "{kind}"`', "###")
        for name in file_options(study):
            assert f"| `{name}` |" in section, (kind, name)
    for title, value in (("`[gearpair]`", GearPair), ("`[design]`", GearDesign)):
        missing = [f.name for f in fields(value) if f"`{f.name}`" not in _section(page, title)]
        assert [name for name in missing if name not in file_pages.OPERATION] == []


@pytest.mark.parametrize("kind", ["zones", "rattle"])
def test_the_page_of_datasets_describes_what_a_study_returns(kind):
    """Of a study in a form for this page, and of one in that of its docstring; the manual's build runs all."""
    found = dataset_pages.smallest(kind)
    section = dataset_pages.dataset_section(kind, found)
    for name, variable in found.variables.items():
        assert f"| `{name}` | {', '.join(variable.dims)} |" in section
        assert f"| {variable.attrs.get('long_name', '')} | {variable.attrs.get('units', '')} |" in section


def test_vertical_bars_do_not_end_a_cell():
    assert command_pages.table(["a"], [["x|y"]]).endswith("| x\\|y |\n")


def test_links_to_files_outside_the_manual_lead_to_their_copies():
    text = "[a](../benchmarks/README.md#branches) [b](model.md#parameters) [c](../LICENSE) [d](https://x.org) [e](#f)"
    assert repository_pages.relinked(text, ROOT / "docs") == (
        "[a](/generated/reference/benchmarks.md#branches) [b](/model.md#parameters) c (`LICENSE`) "
        "[d](https://x.org) [e](#f)")


def _site(folder: Path, body: str, **others: str) -> list[str]:
    """What is wrong with a site of one page with this body, and others."""
    for name, text in {"index": f"<html><body>{body}</body></html>", **others}.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return check_site.problems(folder)


@pytest.mark.parametrize(("body", "problem"), [
    ('<a href="other.html#there">', None), ('<a href="#here"><p id="here">', None),
    ('<a href="https://example.org/page">', None), ('<img src="data:image/png;base64,AA">', None),
    ('<a href="missing.html">', "missing.html does not exist"),
    ('<a href="other.html#elsewhere">', "other.html#elsewhere does not exist"),
    ('<a href="../outside.html">', "../outside.html does not exist"),
    ('<img src="picture.png">', "picture.png does not exist"),
    ('<script src="https://cdn.example.org/x.js">', "loads https://cdn.example.org/x.js"),
    ('<script src="//cdn.example.org/x.js">', "loads //cdn.example.org/x.js"),
    ('<link rel="stylesheet" href="https://example.org/x.css">', "loads https://example.org/x.css"),
    ('<link rel="preconnect" href="https://example.org">', "loads https://example.org"),
    ('<iframe src="https://example.org/x">', "loads https://example.org/x"),
    ("<style>@import 'https://example.org/f.css';</style>", "loads https://example.org/f.css"),
    ('<p style="background: url(https://example.org/b.png)">', "loads https://example.org/b.png"),
])
def test_the_check_of_links(tmp_path, body, problem):
    found = _site(tmp_path, body, other='<p id="there">')
    assert found == ([] if problem is None else [f"index.html: {problem}"])


@pytest.mark.parametrize(("name", "body", "problems"), [
    ("a_long_run", "", ["no card", "0 pictures, not 1"]),
    ("a_long_run", '<b class="gearchaos-card"><img src="1.png">', []),
    ("paper_in_ten_figures", '<b class="gearchaos-card">' + '<img src="1.png">' * 10, ["1 pictures, not 10"]),
    ("index", "", [])])
def test_the_check_of_tutorials(tmp_path, name, body, problems):
    (tmp_path / "tutorials").mkdir()
    (tmp_path / "tutorials" / "1.png").touch()
    assert _site(tmp_path, "", **{f"tutorials/{name}": body}) == [f"tutorials/{name}.html: {p}" for p in problems]


def test_the_check_of_style_sheets_and_of_an_empty_site(tmp_path):
    assert check_site.problems(tmp_path) != []
    (tmp_path / "site.css").write_text("@font-face { src: url(https://fonts.example.org/a.woff2); }")
    assert _site(tmp_path, "") == ["site.css: loads https://fonts.example.org/a.woff2"]


def test_pages_of_removed_scripts_and_names_are_stale(tmp_path):
    pictures = "generated/gallery/images/sphx_glr_plot_"
    for name in ("gallery/plot_kept.py", "generated/gallery/plot_kept.rst", "generated/gallery/plot_gone.rst",
                 f"{pictures}gone_001.png", f"{pictures}kept_001.png", "generated/api/gearchaos.zones.rst",
                 "generated/api/gearchaos.Zones-class.rst", "generated/api/gearchaos.gone.rst"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "reference").mkdir()
    (tmp_path / "reference" / "api.rst").write_text("   gearchaos.zones\n   gearchaos.Zones\n")
    assert {file.name for file in stale.stale(tmp_path)} == {
        "plot_gone.rst", "sphx_glr_plot_gone_001.png", "gearchaos.gone.rst"}
