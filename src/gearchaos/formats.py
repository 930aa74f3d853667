"""The formats of files of results, one declaration each: saving, checks of paths, help and messages are made from them.

**To add a format,** write a function of a Dataset and a path, and enter a `Format` in `FORMATS`. Another package offers
one in the group ``gearchaos.formats``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError
from gearchaos.files import NOT_REGULAR, check_target, write_bytes
from gearchaos.plugins import Register, value_of

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Format:
    """A format of files of results: its name, the suffixes that choose it, and how a Dataset is written."""

    name: str  # of the entry point
    suffixes: tuple[str, ...]  # in lower case, with the dot; the first stands for the format in help texts
    words: str  # what a file is for a reader: "tables"
    write: Callable[[xr.Dataset, Path], list[Path]]  # writes whole files or none, and returns their paths
    spectra_only: bool = False  # whether it holds nothing but order spectra and signals
    check: Callable[[str], None] = lambda option: None  # raises `InputError` if a package that it needs is missing
    # writes the result in a store that may be larger than the memory: a Dataset, the names of its stored variables,
    # the sizes of a block by dimension, the path, and a function that converts a part to other units; None if only a
    # Dataset in memory can be written
    write_blocks: Callable[[xr.Dataset, Collection[str], Mapping[str, int], Path, Any], list[Path]] | None = None


def _write_netcdf(dataset: xr.Dataset, path: Path) -> list[Path]:
    from gearchaos.datasets import netcdf_bytes  # here, as below: commands take suffixes from this module at once

    write_bytes(path, netcdf_bytes(dataset))
    return [path]


def _export_netcdf(
    dataset: xr.Dataset, stored: Collection[str], block: Mapping[str, int], path: Path, convert: Any
) -> list[Path]:
    from gearchaos.export import export_dataset

    export_dataset(dataset, stored, block, path, convert)
    return [path]


def _write_tables(dataset: xr.Dataset, path: Path) -> list[Path]:
    from gearchaos.csv_tables import save_csv

    return save_csv(dataset, path)


def _export_tables(
    dataset: xr.Dataset, stored: Collection[str], block: Mapping[str, int], path: Path, convert: Any
) -> list[Path]:
    from gearchaos.csv_tables import save_csv

    return save_csv(dataset, path, convert, next(iter(block.values())))


def _write_uff(dataset: xr.Dataset, path: Path) -> list[Path]:
    from gearchaos.uff_files import save_uff

    save_uff(dataset, path)
    return [path]


def _check_uff(option: str) -> None:
    from gearchaos.uff_files import check_installed

    check_installed(option)


NETCDF = Format("netcdf", (".nc", ".nc4", ".netcdf", ".h5", ".hdf5"), "NetCDF", _write_netcdf,
                write_blocks=_export_netcdf)
CSV = Format("csv", (".csv",), "tables", _write_tables, write_blocks=_export_tables)
UFF = Format("uff", (".uff", ".unv"), "programs of test benches", _write_uff, spectra_only=True, check=_check_uff)


def _fault(name: str, found: Any) -> str:
    """What is wrong with a format of another package; empty if nothing is."""
    if wrong := value_of(Format, "name")(name, found):
        return wrong
    taken = [suffix for each in FORMATS.own.values() for suffix in each.suffixes if suffix in found.suffixes]
    return f"it must have suffixes of its own, not {', '.join(taken)}" if taken else ""


FORMATS: Register[Format] = Register("gearchaos.formats", {each.name: each for each in (NETCDF, CSV, UFF)}, _fault)
"""The formats by name; the first is that of a path without a suffix, and the only one that can be loaded."""


def formats(spectra: bool = True) -> list[Format]:
    """The formats of gearchaos and of other packages, for spectra or for any result."""
    return [each for each in FORMATS.values() if spectra or not each.spectra_only]


def format_of(field: str, path: Path, spectra: bool = True) -> Format:
    """The format of a path by its suffix; raises `InputError` for a suffix of none, or of none for such a result.

    Formats of other packages are looked for only if none of gearchaos has the suffix.
    """
    suffix = path.suffix.lower() or NETCDF.suffixes[0]
    for known in (FORMATS.own, FORMATS):
        for each in known.values():
            if suffix in each.suffixes and (spectra or not each.spectra_only):
                return each
    possible = formats(spectra)
    suffixes = ", ".join(suffix for each in possible for suffix in each.suffixes)
    raise InputError(field, f"must end in {suffixes}, or have no ending", str(path),
                     f"{_in_words(possible)}; other packages can offer more: docs/howto/extend.md.")


def help_words(spectra: bool = False) -> str:
    """What ``--out`` writes, by the formats of gearchaos: "NetCDF, or .csv for tables"."""
    return _in_words([each for each in FORMATS.own.values() if spectra or not each.spectra_only])


def _in_words(of: list[Format]) -> str:
    first, *others = of
    *some, last = (f"{each.suffixes[0]} for {each.words}" for each in others)
    return ", ".join([first.words, *some, f"or {last}"])


def save(dataset: xr.Dataset, path: str | os.PathLike[str]) -> list[Path]:
    """Write a Dataset as a NetCDF file (HDF5) with checksums, or as tables of text.

    A file appears, or replaces an older one, only when it is complete.

    Parameters
    ----------
    dataset : Dataset
        The result of any study.
    path : path
        Its suffix must be .nc, .nc4, .netcdf, .h5, .hdf5, .csv, .uff or .unv, one of a format that another package
        offers, or empty. CSV has a row for each cell, column, point or event. The titles of its columns have units; a
        value whose unit is none of SI has a second column in SI. Codes are in words. What is over other dimensions than
        the first variable is in files of its own, ``x_number.csv`` beside ``x.csv``. It lacks the attributes, such as
        the model: only NetCDF can be loaded. UFF, which needs pyuff, has the order spectra of `orders` and `runup` in
        the units of the gears, and signals.

    Returns
    -------
    list of Path
        The files written, ``path`` first.

    Raises
    ------
    InputError
        If ``dataset`` is not a Dataset, the suffix is another, or the path cannot be written to.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from tempfile import TemporaryDirectory
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1), periods=4)
    >>> with TemporaryDirectory() as folder:
    ...     written = gc.save(motion, f"{folder}/motion.nc")
    ...     gc.load(f"{folder}/motion.nc").equals(motion)
    True
    >>> with TemporaryDirectory() as folder:
    ...     (table,) = gc.save(motion[["section_z"]], f"{folder}/motion.csv")
    ...     table.read_text().splitlines()[0]
    'period [T],section_z [delta]'
    """
    import xarray as xr

    target = Path(path)
    if not isinstance(dataset, xr.Dataset):
        raise InputError("dataset", "must be an xarray.Dataset", f"a {type(dataset).__name__}",
                         "E.g. save(gc.regime(model).to_dataset(), path) for a verdict.")
    chosen = format_of("path", target)
    check_target("path", target)
    return chosen.write(dataset, target)


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a Dataset that `gearchaos.save` wrote.

    Parameters
    ----------
    path : path
        A NetCDF file.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        If there is no file at the path, or it is damaged or not NetCDF.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from tempfile import TemporaryDirectory
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:2", "eps1=0.1:0.2:2")
    >>> with TemporaryDirectory() as folder:
    ...     paths = gc.save(zones, f"{folder}/zones.nc")
    ...     gc.load(f"{folder}/zones.nc").equals(zones)
    True
    """
    import xarray as xr

    not_loaded = {".toml", *(suffix for each in FORMATS.own.values() if each is not NETCDF for suffix in each.suffixes)}
    if not Path(path).is_file() or Path(path).suffix.lower() in not_loaded:
        advice = "There is no such file."
        if Path(path).suffix.lower() == ".toml" and Path(path).is_file():
            advice = "gearchaos.open reads the gears or the model of a study file."
        elif Path(path).is_file():
            advice = ("It lacks the model and the settings. Save the result as NetCDF, --out FILE.nc, or draw it at "
                      "once with --plot FILE.png.")
        elif Path(path).is_dir():
            advice = "gearchaos.load reads the folder of a run."
        elif Path(path).exists():
            advice = f"It is {NOT_REGULAR}."
        raise InputError("path", "must be a NetCDF file", str(path), advice)
    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            return dataset.load()
    except (OSError, KeyError) as error:  # KeyError if the entry of a name is damaged
        raise InputError("path", "must be a NetCDF file, whole and readable", str(path),
                         f"If gearchaos saved it, it is damaged: save it again. ({error})") from error
