"""Results of studies in the physical units of a gear pair."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError
from gearchaos.gears.pair import GearPair
from gearchaos.gears.scales import scaled, unit_of

if TYPE_CHECKING:
    import xarray as xr


def physical(dataset: xr.Dataset, pair: GearPair) -> xr.Dataset:
    """A result of a study in physical units: µm, mm/s, N, ms, and Hz of mesh frequency.

    Parameters
    ----------
    dataset : Dataset
        The result of a study of the pair.
    pair : GearPair
        The pair whose scales apply.

    Returns
    -------
    Dataset
        The same dims and names, with scaled values and their ``units``; x_n is the arc length R_n φ_n. Labels, shares,
        ratios and ``attrs["model"]`` stay as they are. ``attrs["pair"]`` holds the pair as JSON.

    Raises
    ------
    InputError
        If the dataset is in physical units already, or an argument has another type.
    """
    _check_scalable(dataset, pair)
    coordinates, variables = scaled(dataset.coords, pair.scales), scaled(dataset.data_vars, pair.scales)
    return dataset.assign_coords(coordinates).assign(variables).assign_attrs(pair=json.dumps(asdict(pair)))


def _check_scalable(dataset: Any, pair: Any) -> None:
    """Raise `InputError` unless this is a dimensionless Dataset and a pair."""
    if not hasattr(dataset, "data_vars"):
        advice = "Write physical(dataset, pair). Numbers of a verdict times those of pair.scales are in SI."
        raise InputError("dataset", "must be an xarray.Dataset", f"a {type(dataset).__name__}", advice)
    if not isinstance(pair, GearPair):
        raise InputError("pair", "must be a GearPair", f"a {type(pair).__name__}", "A MeshModel alone has no units.")
    if "pair" in dataset.attrs:
        raise InputError("dataset", "must be dimensionless", "physical units", "It has been scaled already.")


def unit_in(dataset: xr.Dataset, name: str) -> float:
    """One dimensionless unit of a variable in the units of a Dataset: 1 unless `physical` has scaled the Dataset."""
    if "pair" not in dataset.attrs:
        return 1.0
    unit = unit_of(name, _pair_from_json(dataset.attrs["pair"]).scales)
    return 1.0 if unit is None else unit[0]


def _pair_from_json(text: str) -> GearPair:
    """The pair that `physical` wrote into the attributes of a Dataset."""
    try:
        return GearPair(**json.loads(text))
    except (RecursionError, TypeError, ValueError) as error:
        raise InputError("dataset", "must carry its gear pair as JSON in attrs['pair']", text,
                         f"gearchaos.physical writes it: scale the dimensionless result again. ({error})") from error
