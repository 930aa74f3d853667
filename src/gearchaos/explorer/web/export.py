"""Files that a visitor can save, made in memory: pictures and data of map, motion, run-up and assessment."""

from __future__ import annotations

import io
from collections.abc import Generator

import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.datasets import netcdf_bytes
from gearchaos.datasheet.printed import report_pdf
from gearchaos.datasheet.report import Report, report_html
from gearchaos.datasheet.scatter import scatter_document
from gearchaos.explorer.core.text import as_toml
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.files import strict_json
from gearchaos.gears.operation.operating import Gears
from gearchaos.gears.operation.results import physical
from gearchaos.plot._assessment import height

_DPI = 150
_MEDIA_TYPES = {"png": "image/png", "svg": "image/svg+xml", "nc": "application/x-netcdf", "json": "application/json",
                "html": "text/html", "pdf": "application/pdf"}

FILES = {
    f"{kind}-{suffix}": f"{words} {description}"
    for kind, words in (("map", "map"), ("motion", "motion"), ("runup", "run-up"))
    for suffix, description in (("png", "PNG"), ("svg", "SVG"), ("nc", "data"))
} | {
    "assessment-html": "assessment as a page", "assessment-pdf": "assessment PDF", "assessment-png": "assessment PNG",
    "assessment-svg": "assessment SVG", "assessment-json": "assessment JSON",
    "changes-html": "changed designs as a page", "changes-pdf": "changed designs PDF",
    "changes-json": "changed designs JSON", "tolerances-nc": "tolerances data", "tolerances-json": "tolerances JSON",
}
"""Files that can be saved, by kind and suffix, each with its description in the menu."""

OF_GEARS = ("runup", "assessment", "changes", "tolerances")
"""The kinds of files that only pages with gears have."""


def picture(kind: str, suffix: str, dataset: xr.Dataset, colour: str, title: str) -> tuple[bytes, str]:
    """A picture and its media type: of a map by the variable ``colour``, of a motion with this title, of a run-up."""
    if kind == "motion":
        figure = plot.motion(dataset, title=title, figure=Figure(figsize=(9.6, 7.2), layout="constrained"))
    elif kind == "runup":
        figure = plot.runup(dataset, figure=Figure(figsize=(6.4, 8.0), layout="constrained"))
    else:
        figure = Figure(figsize=(6.4, 4.8), layout="constrained")
        ax = figure.subplots()
        plot.zones(dataset, ax) if colour == "motion" else plot.level(dataset, colour, ax)
    return _drawn(figure, suffix), _MEDIA_TYPES[suffix]


def _drawn(figure: Figure, suffix: str) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format=suffix, dpi=_DPI, bbox_inches="tight")
    return out.getvalue()


def exported(
    kind: str, suffix: str, dataset: xr.Dataset, colour: str, title: str, gears: Gears | None = None,
) -> Generator[tuple[bytes, str, str]]:
    """One file as (content, media type, file name), the only result of this job; arguments as of `picture`.

    It is in the units of the gears, if there are some. The suffix "nc" gives the Dataset as NetCDF with checksums.
    """
    if gears is not None:
        dataset = physical(dataset)  # which carries its gears: of a train's map those of its file
    if suffix == "nc":
        content, media = bytes(netcdf_bytes(dataset)), _MEDIA_TYPES["nc"]
    else:
        content, media = picture(kind, suffix, dataset, colour, title)
    yield content, media, f"gearchaos-{kind}.{suffix}"


def scatter(suffix: str, dataset: xr.Dataset) -> Generator[tuple[bytes, str, str]]:
    """The file of a scatter at a point as (content, media type, file name), the only result of this job: its data, or
    what `gearchaos scatter --json` prints."""
    content = bytes(netcdf_bytes(dataset)) if suffix == "nc" else strict_json(scatter_document(dataset)).encode()
    yield content, _MEDIA_TYPES[suffix], f"gearchaos-tolerances.{suffix}"


def assessment(kind: str, suffix: str, report: Report, line: SpeedLine) -> Generator[tuple[bytes, str, str]]:
    """The file of an assessment as (content, media type, file name), the only result of this job.

    The suffixes "html" and "pdf" give what `gearchaos assess` writes by ``--out`` and ``--pdf``, "json" what ``--json``
    prints, and the study file of what was assessed.
    """
    found = report.found
    if suffix == "json":
        content = strict_json(report.document() | {"study_file": as_toml(line.view)}).encode()
    elif suffix == "html":
        content = report_html(report).encode()
    elif suffix == "pdf":
        content = report_pdf(report)
    else:
        figure = Figure(figsize=(6.4, height(found)), layout="constrained")
        plot.assessment(found, figure.subplots())
        content = _drawn(figure, suffix)
    yield content, _MEDIA_TYPES[suffix], f"gearchaos-{kind}.{suffix}"
