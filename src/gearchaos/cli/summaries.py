"""What the commands of studies print of a result: a JSON document, or a table or lines of text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.cli.options import in_units
from gearchaos.cli.output import draw, print_json, say_proofs
from gearchaos.cli.tables import branches, maps, motions
from gearchaos.quantities import quantity

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


def _map(found: Found) -> Document:
    """The JSON document of a map; how many cells are proved is also said on stderr."""
    document = maps.map_document(found.dataset)
    say_proofs(document)
    axes = [{**asdict(axis), "units": quantity(axis.name).unit} for axis in found.axes]
    return {"study": found.kind, **found.files, "axes": axes, **document}


SUMMARIES: dict[str, tuple[Callable[[Found], Document], Callable[[Found, Document], None]]] = {
    "section": (lambda found: {**motions.section(found.dataset), **found.units(motions.section_units)},
                lambda found, _: motions.print_section(found.in_units)),
    "attractors": (lambda found: {**motions.attractor_list(found.dataset), **found.units(motions.attractor_units)},
                   lambda found, _: motions.print_attractors(found.in_units, found.loaded.model)),
    "map": (_map, lambda found, content: maps.print_map(content, found.dataset)),
    "branch": (lambda found: branches.branch_document(found.dataset, found.plain),
               lambda found, content: branches.print_branch(content, found.dataset)),
    "curve": (lambda found: branches.curve_document(found.dataset, *(axis.name for axis in found.axes)),
              lambda found, content: branches.print_curve(
                  content, found.dataset, *(axis.name for axis in found.axes))),
    "skeleton": (lambda found: {"study": found.kind, **found.files, **branches.skeleton_document(found.dataset)},
                 lambda found, content: branches.print_skeleton(content)),
    "result": (lambda found: {"study": found.kind, **found.files, **maps.result_document(found.dataset)},
               lambda found, content: maps.print_result(content)),
}
"""The document of a result, and how it is printed, by the `Study.summary` of its study."""


def report(found: Found, summary: str, json_out: bool) -> None:
    """Draw a result, and print it by the entry ``summary`` of `SUMMARIES`."""
    draw(found.dataset, found.plot)
    document, show = SUMMARIES[summary]
    content = document(found)
    print_json(content) if json_out else show(found, content)
