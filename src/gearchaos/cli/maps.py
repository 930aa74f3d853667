"""What commands make of a map: files, and what was found in it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save, say_proofs
from gearchaos.files import DATA_SUFFIXES
from gearchaos.quantities import quantity

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.axis import Axis


@dataclass(frozen=True)
class MapOutput:
    """What a command makes of a map: the file of its data, its picture if there is a path, and what was found."""

    out: Path | None
    plot: Path | None
    json_out: bool

    def check(self) -> None:
        """Raise `InputError` unless both files can be written."""
        check_output("--out", self.out, DATA_SUFFIXES)
        check_output("--plot", self.plot, PLOT_SUFFIXES)

    def document(self, kind: str, dataset: xr.Dataset, axes: Iterable[Axis]) -> dict[str, Any]:
        """The JSON document of a map; how many cells are proved is also said on stderr."""
        from gearchaos.cli.documents import map_document

        found = map_document(dataset)
        say_proofs(found)
        files = {"out": str(self.out), "plot": None if self.plot is None else str(self.plot)}
        described = [{**asdict(axis), "units": quantity(axis.name).unit} for axis in axes]
        return {"study": kind, **files, "axes": described, **found}

    def write(self, kind: str, dataset: xr.Dataset, axes: Iterable[Axis]) -> None:
        """Write the files of a map, and print what was found, in two lines or as JSON."""
        save(dataset, self.out)
        draw(dataset, self.plot)
        found = self.document(kind, dataset, axes)
        if self.json_out:
            print_json(found)
        else:
            from gearchaos.cli.tables.maps import print_map

            print_map(found, dataset)
