"""What ``gearchaos orders`` prints of a spectrum: the strongest lines and sidebands, and how other gears differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gearchaos.cli.output import plain_table, print_table, print_wrapped
from gearchaos.gears.io.measured_quantities import MEASURED
from gearchaos.gears.io.units import measured
from gearchaos.studies.vibration.orders import FLOOR

if TYPE_CHECKING:
    import xarray as xr

_DIFFERENCES = 3  # lines that the answer names as differing most
_LEAST_DIFFERENCE = 1.0  # dB


def orders_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of an order spectrum: its strongest lines, levels in dB."""
    of, quantity = next(each for each in MEASURED.items() if each[1].variable in dataset)
    name, lines = quantity.variable, list[dict[str, Any]]()
    shown = dataset.drop_dims(["modulation_order", "quefrency"]).isel(order=dataset["line"].values != "")
    least = FLOOR * float(dataset[name][1:].max())
    for i in shown[name].values.argsort(kind="stable")[::-1].tolist():
        at = {str(n): v.values.item() for n, v in shown.isel(order=i).variables.items()}
        amplitude, ratio = at[name], at["sideband_ratio"]
        lines.append({"order": at["order"], "frequency": at["order_frequency"], "amplitude": amplitude,
                      "level": _decibel(amplitude / quantity.reference), "name": at["line"],
                      "sideband_level": None if math.isnan(ratio) else _decibel(ratio)})
        if f"against_{name}" in at:
            other = at[f"against_{name}"]
            lines[-1] |= {"against": other, "difference": _decibel(amplitude / other) if other > least else None}
    attrs = {n: dataset.attrs[n] for n in ("amplitude", "motion", "window", "status")}
    mesh = {"mesh": dataset["mesh"].item()} if "mesh" in dataset.coords else {}
    speed = 60 * float(dataset["order_frequency"][1] / dataset["order"][1])
    return {**mesh, "of": of, "units": dataset[name].attrs["units"],
            "reference": quantity.reference_words, **attrs, "speed": speed, "lines": lines}


def _decibel(ratio: float) -> float:
    return 20 * math.log10(ratio)


def print_orders(content: dict[str, Any]) -> None:
    """Print the strongest line and sideband, the lines in which other gears differ most, and a table of lines."""
    lines, unit = content["lines"], content["units"]
    mesh = f" of {content['mesh']}" if "mesh" in content else ""
    answer = f"{content['of']}{mesh} at {content['speed']:g} rpm: "
    if not lines:
        print(f"{answer}{'no line' if content['status'] == 'ok' else content['status']}")
        return
    first = lines[0]
    answer += f"strongest line {first['name']}, {measured(first['amplitude'])} {unit} at {first['frequency']:.5g} Hz"
    if sideband := next((line for line in lines if line["sideband_level"] is not None), None):
        level, below = sideband["sideband_level"], "below" if sideband["sideband_level"] < 0 else "above"
        answer += f"; strongest sideband {sideband['name']}, {abs(level):.1f} dB {below} its mesh harmonic"
    print_wrapped(answer)
    if "against" in first:
        new = [line["name"] for line in lines if line["difference"] is None][:_DIFFERENCES]
        known = sorted((line for line in lines if line["difference"] is not None), key=lambda v: -abs(v["difference"]))
        most = [f"{line['name']} by {line['difference']:+.1f} dB" for line in known[:_DIFFERENCES]
                if abs(line["difference"]) >= _LEAST_DIFFERENCE]
        parts = ([f"new are {', '.join(new)}"] if new else []) + ([f"{', '.join(most)}"] if most else [])
        print_wrapped("against the others: " + ("; ".join(parts) or "no line differs by 1 dB"))
    exact = content["window"].startswith("none")
    print_wrapped(f"motion {content['motion']}: " + (
        f"exact lines, {content['window'].removeprefix('none, ')}" if exact else
        f"no exact lines but a band, {content['window']}") + ". Other motions may exist.")
    titles = ["order", "Hz", f"{unit.replace('^2', '²')}\n{content['amplitude']}", f"dB re\n{content['reference']}",
              "sideband\ndB", *(["against\ndB"] * ("against" in first))]
    table = plain_table(*titles, "line", left=("line",), gap=1)
    for line in lines:
        beside = "" if line["sideband_level"] is None else f"{line['sideband_level']:.1f}"
        other = ["new" if line["difference"] is None else f"{line['difference']:+z.1f}"] if "against" in first else []
        table.add_row(f"{line['order']:.6g}", f"{line['frequency']:.5g}", measured(line["amplitude"]),
                      f"{line['level']:.1f}", beside, *other, line["name"])
    print_table(table)

