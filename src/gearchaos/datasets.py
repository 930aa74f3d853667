"""The Datasets that studies return: attributes of their variables, provenance, their bytes as NetCDF."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import metadata
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics import REASONS, Label, Reason, motion_name
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import gears_json, gears_of
from gearchaos.model import STIFFNESS_KINDS, GearModel, MeshModel, TransmissionError
from gearchaos.plugins import NotInstalledError, versions_of
from gearchaos.proof.certificate import REASON_CODES, Proved
from gearchaos.quantities import RESPONSES, parse, quantity

if TYPE_CHECKING:
    import xarray as xr


def describe(name: str) -> dict[str, str]:
    """``long_name`` and ``units`` of a variable or axis by its name; raises `InputError` for an unknown name."""
    found = quantity(name)
    prefix = "stroboscopic " if "section_" in parse(name).prefix else ""
    return {"long_name": prefix + (found.long_name or found.name), "units": found.unit}


def flag_attributes(meanings: dict[int, str]) -> dict[str, Any]:
    """Attributes with the meanings of the integer codes of a variable, by the CF conventions."""
    return {"flag_values": np.array(list(meanings), dtype=np.int8),
            "flag_meanings": " ".join(m.replace(" ", "_") for m in meanings.values())}


_CODE_ATTRIBUTES = {
    "label": flag_attributes({int(v): v.name.lower().replace("_", "-") for v in Label}),
    "contact": flag_attributes(dict(enumerate(CONTACTS))),
    "mesh_contact": flag_attributes(dict(enumerate(CONTACTS))),
    "contact_worst": flag_attributes(dict(enumerate(CONTACTS))),
    "sample_contact": flag_attributes(dict(enumerate(CONTACTS))),
    "reason": {**flag_attributes({int(r): r.name.lower() for r in Reason}),
               "comment": "; ".join(f"{int(r)}: {REASONS[r]}" for r in Reason)},
    "proved": flag_attributes({int(p): p.name.lower() for p in Proved}),
    "proof_reason": flag_attributes(REASON_CODES),
}
"""Attributes of the variables that hold integer codes, by name without prefix."""


def variable(name: str, dims: tuple[str, ...], values: np.ndarray, coded: bool = True) -> xr.Variable:
    """A variable with the attributes that belong to its name, which is that of a quantity.

    Not ``coded`` are values that are not the integer codes that variables of this name usually hold, as ``contact``
    along a trajectory, which is −1, 0 or 1; the meanings of the codes are then left out.
    """
    import xarray as xr  # here, since it takes half a second to load, and a printed verdict needs no Dataset

    codes = _CODE_ATTRIBUTES.get(parse(name).base, {}) if coded else {}
    return xr.Variable(dims, values, {**describe(name), **codes})


def variables(dims: tuple[str, ...], values: Mapping[str, np.ndarray]) -> dict[str, xr.Variable]:
    """The variables of several names; each has as many of the first dimensions as its array."""
    return {name: variable(name, dims[: v.ndim], v) for name, v in values.items()}


def new_dataset(
    data: Mapping[str, Any], coords: Mapping[str, Any] | None = None, attrs: Mapping[str, Any] | None = None
) -> xr.Dataset:
    """``xarray.Dataset(data, coords, attrs)``, with xarray imported at the first use, as in `variable`."""
    import xarray as xr

    return xr.Dataset(data, coords, attrs)


def parts(dataset: xr.Dataset, sizes: Mapping[str, int]) -> Iterator[tuple[tuple[slice, ...], xr.Dataset]]:
    """The parts of a Dataset, of these sizes along some dimensions, with the place of each along these, in C order."""
    starts = (range(0, dataset.sizes[dim], size) for dim, size in sizes.items())
    for corner in product(*starts):
        place = tuple(slice(i, min(i + n, dataset.sizes[d])) for i, (d, n) in zip(corner, sizes.items(), strict=True))
        yield place, dataset.isel(dict(zip(sizes, place, strict=True)))


def motions(labels: xr.DataArray, periods: xr.DataArray) -> list[str]:
    """The names of motions: "3T" for a periodic one, otherwise the kind of motion, or "not computed".

    Parameters
    ----------
    labels, periods : DataArray of int
        Of the same shape, with N elements: codes of `Label`, 0 or −1 where nothing was computed, and periods in mesh
        periods.

    Returns
    -------
    list of str
        N names, in C order.

    Raises
    ------
    ValueError
        For a code that is no `Label`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:2", "eps1=0.1:0.2:2")
    >>> gc.studies.motions(zones.label, zones.period)
    ['2T', '2T', 'chaotic', '2T']
    """
    pairs = zip(labels.values.ravel().tolist(), periods.values.ravel().tolist(), strict=True)
    return [motion_name(Label(label), period) if label > 0 else "not computed" for label, period in pairs]


def with_primes(names: Sequence[str]) -> list[str]:
    """Names with primes that tell apart those that are the same: 4T, 4T′."""
    return [name + "′" * list(names[:i]).count(name) for i, name in enumerate(names)]


def model_json(model: GearModel) -> str:
    """All fields of a model as JSON, from which `model_from_json` makes an equal model."""
    return json.dumps(model.record(), sort_keys=True)


def model_from_json(text: str) -> MeshModel:
    """The model that `model_json` wrote; raises `InputError` for anything else."""
    try:
        values = json.loads(text)
        if "train" in values:
            from gearchaos.gears.train.model import TrainModel
            from gearchaos.gears.train.train import Train

            return TrainModel(Train(**values["train"]), values["initial"])  # type: ignore[return-value]
        STIFFNESS_KINDS.check("stiffness.kind", kind := values.pop("stiffness_kind"))
        stiffness = STIFFNESS_KINDS[kind].from_record(values["stiffness"])
        error = TransmissionError(**{name: tuple(found) for name, found in values["error"].items()})
        return MeshModel(**{**values, "error": error, "stiffness": stiffness})
    except NotInstalledError:
        raise
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise InputError("dataset", "must carry the model of its study as JSON in attrs['model']", text,
                         f"Compute it again, or load the file that was saved. ({error})") from error


def of_mesh(dataset: xr.Dataset, mesh: str) -> xr.Dataset:
    """A result of a train whose ``contact``, ``contact_fraction`` and ``dynamic_factor`` are those of one of its
    meshes, not of the worst one, without the measures of the first; raises `InputError` for a name that it has not."""
    known = dataset["mesh"].values.tolist() if "mesh_contact" in dataset else []
    if mesh not in known:
        rule = f"must be one of {', '.join(known)}" if known else "must be left out for a result without meshes"
        raise InputError("mesh", rule, mesh, "" if known else "Maps and diagrams of a train have them.")
    one = dataset.sel(mesh=mesh)
    own = {"contact": one["mesh_contact"], "dynamic_factor": one["mesh_dynamic_factor"],
           "contact_fraction": one["mesh_front_share"] + one["mesh_back_share"]}
    kept = dataset.drop_dims("mesh")
    kept = kept.drop_vars([q.name for q in RESPONSES if q.name in kept and q.name not in own])
    return kept.assign({n: v.assign_attrs(describe(n)) for n, v in own.items()})


def gridded_variable(dataset: xr.Dataset) -> str | None:
    """The first variable that has a number for each value of one or two axes; None if there is none."""
    return next((str(name) for name, v in dataset.data_vars.items()
                 if v.dims and len(v.dims) <= 2 and all(dim in dataset.indexes for dim in v.dims)), None)


def provenance(study: str, model: Any, **settings: Any) -> dict[str, Any]:
    """Attributes of a Dataset: the study, its model, gears and settings as JSON, and the versions of packages.

    Among the packages are those that brought its stiffness or its damping law. An `OperatingModel` has gears, at its
    operating point. ``settings`` are the other arguments of the study, and its
    classification settings as ``classification``.
    """
    gears = {"gears": gears_json(model.operating_gears)} if gears_of(model) else {}
    return {"study": study, "model": model_json(model), "settings": json.dumps(settings, sort_keys=True),
            **_versions(), **versions_of(type(getattr(model, "stiffness", None)), getattr(model, "law", None)), **gears}


PACKAGES = ("gearchaos", "numba", "numpy", "xarray")
"""The packages on which all results depend."""


@cache
def _versions() -> dict[str, str]:
    """The versions of the packages that results depend on, by attribute."""
    return {f"{p}_version": metadata.version(p) for p in PACKAGES}


def netcdf_bytes(dataset: xr.Dataset) -> memoryview:
    """The bytes of a NetCDF file (HDF5) with checksums that holds a Dataset.

    The file is made in memory, of which it takes about as much as the Dataset: the HDF5 library cannot recover from a
    full disk.
    """
    content = io.BytesIO()
    with_checksums(dataset).to_netcdf(content, engine="h5netcdf")  # type: ignore[call-overload]
    return content.getbuffer()


def from_netcdf_bytes(content: bytes) -> xr.Dataset:
    """The Dataset in the bytes of a NetCDF file; the inverse of `netcdf_bytes`."""
    import xarray as xr

    with xr.open_dataset(io.BytesIO(content), engine="h5netcdf") as dataset:
        return dataset.load()


def with_checksums(dataset: xr.Dataset) -> xr.Dataset:
    """The same Dataset, to be written with a Fletcher-32 checksum of every array, by which readers detect damage.

    HDF5 has no checksums for scalars and texts.
    """
    out = dataset.copy(deep=False)
    for variable in out.variables.values():
        if variable.dims and variable.dtype.kind not in "OUT":
            variable.encoding["fletcher32"] = True
    return out
