"""What the commands of studies print of a result: a JSON document, or a table or lines of text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.cli import documents
from gearchaos.cli.maps import MapOutput
from gearchaos.cli.options import in_units
from gearchaos.cli.tables.branches import print_branch, print_curve, print_skeleton
from gearchaos.cli.tables.maps import print_map, print_result
from gearchaos.cli.tables.motions import print_attractors, print_section

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.axis import Axis
    from gearchaos.studyfile import LoadedStudy

Document = dict[str, Any]


class Found(NamedTuple):
    """What a command found.

    Attributes
    ----------
    kind : str
        The kind of study.
    dataset, plain : Dataset
        The result in the units that are wanted, and as it was computed.
    loaded : LoadedStudy
    physical : bool
    axes : tuple of Axis
    out, plot : Path or None
        The files that were written.
    """

    kind: str
    dataset: xr.Dataset
    plain: xr.Dataset
    loaded: LoadedStudy
    physical: bool
    axes: tuple[Axis, ...]
    out: Path | None
    plot: Path | None

    @property
    def files(self) -> Document:
        """The files as JSON."""
        return {"out": str(self.out), "plot": None if self.plot is None else str(self.plot)}

    def units(self, of: Callable[[xr.Dataset], dict[str, str]]) -> Document:
        """The units in a document, if physical ones are wanted."""
        return {"units": of(self.dataset)} if self.physical else {}

    @property
    def in_units(self) -> xr.Dataset:
        """The result in the units of the gears, if there are any: tables always have them."""
        return in_units(self.plain, self.loaded, physical=True)


def _section(found: Found) -> Document:
    return {**documents.section(found.dataset), **found.units(documents.section_units)}


def _attractors(found: Found) -> Document:
    return {**documents.attractor_list(found.dataset), **found.units(documents.attractor_units)}


def _map(found: Found) -> Document:
    return MapOutput(found.out, found.plot, True).document(found.kind, found.dataset, found.axes)


def _curve(found: Found) -> Document:
    return documents.curve_document(found.dataset, *(axis.name for axis in found.axes))


SUMMARIES: dict[str, tuple[Callable[[Found], Document], Callable[[Found, Document], None]]] = {
    "section": (_section, lambda found, _: print_section(found.in_units)),
    "attractors": (_attractors, lambda found, _: print_attractors(found.in_units, found.loaded.model)),
    "map": (_map, lambda found, content: print_map(content, found.dataset)),
    "branch": (lambda found: documents.branch_document(found.dataset, found.plain),
               lambda found, content: print_branch(content, found.dataset)),
    "curve": (_curve, lambda found, content: print_curve(
        content, found.dataset, *(axis.name for axis in found.axes))),
    "skeleton": (lambda found: {"study": found.kind, **found.files, **documents.skeleton_document(found.dataset)},
                 lambda found, content: print_skeleton(content)),
    "result": (lambda found: {"study": found.kind, **found.files, **documents.result_document(found.dataset)},
               lambda found, content: print_result(content)),
}
"""The document of a result, and how it is printed, by the `Study.summary` of its study."""
