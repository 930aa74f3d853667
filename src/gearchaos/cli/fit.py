"""What ``gearchaos fit`` prints: the estimates with their intervals, what is not identified, and measured amplitudes
beside computed ones."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.cli.output import plain_table, print_table, print_wrapped, shown_rows
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.io.units import measured

if TYPE_CHECKING:
    import xarray as xr

# least share of searches that end at the best fit, and largest residual over the uncertainty, without a warning
_AGREEING, _HIGH = 0.2, 1.3
_UNEXPLAINED = 0.5
"""The residual over the measured amplitudes, each rms, from which the model does not explain them."""


def fit_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a fit: the estimates with their intervals, what is not identified and why, the residual,
    and at how many speeds and searches the answer was found."""
    names = ("varied", "not_identified", "estimate", "estimate_lo", "estimate_hi", "estimate_unit", "bound_lo",
             "bound_hi")
    rows = list(zip(*(dataset[n].values.tolist() for n in names), strict=True))
    settings, rms = json.loads(dataset.attrs["settings"]), dataset["search_rms"].values
    difference = dataset["computed_amplitude"] - dataset["measured_amplitude"]
    residual, size = (float(np.sqrt(np.mean(each**2))) for each in (difference, dataset["measured_amplitude"]))
    other = dataset["speed"].values[dataset["history"].values != "rest"]
    return {
        "quantity": settings["quantity"],
        "estimates": {name: {"value": value, "low": low, "high": high, "unit": unit, "at_bound": min(
            value - least, most - value) < 1e-3 * (most - least)}
            for name, reason, value, low, high, unit, least, most in rows if not reason},
        "not_identified": {name: reason for name, reason, *_ in rows if reason},
        "residual_rms": residual, "unit": dataset["measured_amplitude"].attrs["units"],
        "over_measured": residual / size if size else 1.0,
        "over_uncertainty": float(rms[0]) if settings["uncertainty"] else None, "amplitudes": difference.size,
        "ignored": int(dataset.attrs["ignored"]), "speeds": len(np.unique(dataset["speed"])),
        "speeds_of_other_motions": np.unique(other).tolist(), "searches": len(rms),
        "searches_there": int(np.sum(rms <= 1.001 * rms[0] + 1e-6))}


def print_fit(dataset: xr.Dataset, content: dict[str, Any]) -> None:
    """Print the estimates of a fit, what is not identified, and a table of measured and computed amplitudes."""
    unit = content["unit"]
    if content["over_measured"] > _UNEXPLAINED:
        print_wrapped(f"The model does not explain these amplitudes: the residual is {content['over_measured']:.0%} of "
                      "them (rms). What follows comes nearest within the bounds, and is no estimate of the gears.")
    for name, each in content["estimates"].items():
        value, low, high = (measured(each[n]) for n in ("value", "low", "high"))
        print_wrapped(f"{name}: {' '.join([value, each['unit']]).rstrip()} ({low} to {high} at 95 %)"
                     + ", at one of its bounds" * each["at_bound"])
    for name, reason in content["not_identified"].items():
        print_wrapped(f"{name}: not identified: {reason}")
    ratio, others = content["over_uncertainty"], len(content["speeds_of_other_motions"])
    print_wrapped(f"residual of the {content['quantity']} {measured(content['residual_rms'])} {unit} rms, "
                 f"{content['amplitudes']} amplitudes at {content['speeds']} speeds" + (
                     f", {measured(ratio, 3)} times the uncertainty" if ratio is not None else ""))
    print_wrapped(f"{content['searches_there']} of {content['searches']} searches ended there; at {others} speeds "
                 "another motion than that from rest fits better" + (
                     f"; {content['ignored']} rows of other orders were ignored" if content["ignored"] else ""))
    if content["searches_there"] < _AGREEING * content["searches"] or (ratio or 0.0) > _HIGH:
        print_wrapped("A wrong minimum is likely, or the model lacks something: try more --starts, narrower bounds, "
                      "and leave out speeds of chaotic motions.")
    rows = shown_rows(content["amplitudes"])
    if len(rows) < content["amplitudes"]:
        print(f"{len(rows)} of {content['amplitudes']} rows")
    table = plain_table("speed (rpm)", "order", f"measured ({unit})", f"computed ({unit})", "contact", "motion",
                        left=("contact", "motion"))
    for i in rows:
        at = dataset.isel(measurement=i)
        numbers = (measured(float(at[f"{n}_amplitude"])) for n in ("measured", "computed"))
        table.add_row(f"{float(at.speed):.5g}", f"{float(at.order):g}", *numbers, CONTACTS[int(at.contact)],
                      str(at.history.values))
    print_table(table)
