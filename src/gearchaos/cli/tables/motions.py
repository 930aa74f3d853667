"""What is found at one operating point, as JSON and as tables of text: section, verdict, attractors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gearchaos.cli.tables.text import plain_table, print_table, shown
from gearchaos.datasets import motions
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.results import is_physical
from gearchaos.gears.scales import Scales, unit_of
from gearchaos.gears.units import measured
from gearchaos.quantities import OPERATION, RESPONSES, VERDICTS, parse, quantity

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.model import MeshModel
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.studies import Verdict
    from gearchaos.studyfile import LoadedStudy

_SHOWN_ROWS = 20
"""Most rows of a stroboscopic section that are printed."""


def section(dataset: xr.Dataset) -> dict[str, list[float]]:
    """The stroboscopic section of a simulation: τ and every coordinate by name, one value per mesh period."""
    return {short: dataset[name].values.tolist() for short, name in _section_names(dataset).items()}


def section_units(dataset: xr.Dataset) -> dict[str, str]:
    """The units of `section`, by the same names."""
    return {short: dataset[name].attrs["units"] for short, name in _section_names(dataset).items()}


def _section_names(dataset: xr.Dataset) -> dict[str, str]:
    """The names of the variables of a stroboscopic section, by the names of their coordinates."""
    parts = map(parse, map(str, dataset.data_vars))
    return {"tau": "tau_section", **{name.base: str(name) for name in parts if name.prefix == "section_"}}


def print_section(dataset: xr.Dataset) -> None:
    """Print the last rows of a stroboscopic section."""
    columns, units = section(dataset), section_units(dataset)
    rows = list(zip(*columns.values(), strict=True))
    text = measured if is_physical(dataset) else shown
    print(f"Stroboscopic section, last {min(_SHOWN_ROWS, len(rows))} of {len(rows)} periods")
    table = plain_table(gap=1)
    for name in columns:
        unit = units[name].replace("*", "\n*")
        table.add_column(f"{name}\n({unit})", justify="right", overflow="fold")
    for row in rows[-_SHOWN_ROWS:]:
        table.add_row(*map(text, row))
    print_table(table)


def print_regime(verdict: Verdict, loaded: LoadedStudy, proof: Certificate | Unproved | None = None) -> None:
    """Print the verdict at one operating point: the motion, its proof, its evidence, and quantities with a title.

    Those of given gears are in their units.
    """
    values, scales = verdict.to_dict(), None if loaded.pair is None else loaded.pair.scales
    table = plain_table()
    table.show_header = False
    table.add_row("motion", f"{verdict.label}: {verdict.reason}")
    if proof is not None:
        table.add_row("proof", proof.in_words())
    if scales is not None:
        for q in OPERATION:
            table.add_row(q.long_name, f"{shown(loaded.model.value(q.name))} {q.unit.replace('*', ' ')}")
        table.add_row(quantity("omega").title, _measured("omega", loaded.model.omega, scales))
    table.add_row("Lyapunov exponents", _exponents(values, scales))
    table.add_row("Floquet multipliers", "\n".join(f"{a:+.6f} {b:+.6f}i" for a, b in values["multipliers"]))
    for q in (*RESPONSES, *VERDICTS):
        if q.title:
            table.add_row(q.title, _measured(q.name, values[q.name], scales))
        if q.name == "dynamic_factor" and (ratio := _quasi_static(loaded.model, values[q.name])):
            table.add_row("", ratio)
    print_table(table)
    print("From the initial values given; `gearchaos attractors` finds other motions.")


def _quasi_static(model: MeshModel, *factors: float | None) -> str:
    """The quasi-static ratio to be read beside dynamic factors; empty without any, or if no stiffness jumps."""
    from gearchaos.studies.speed_and_torque import quasi_static_ratio

    known = any(factor is not None and math.isfinite(factor) for factor in factors)
    ratio = quasi_static_ratio(model) if known else 1.0
    return f"{measured(ratio, 3)} as the speed goes to 0" if ratio > 1 else ""


def _measured(name: str, value: Any, scales: Scales | None) -> str:
    """A value, in its physical unit if there are scales and it has one."""
    unit = None if scales is None or value is None else unit_of(name, scales)
    return shown(value) if unit is None else f"{measured(value * unit[0])} {unit[1]}"


def _exponents(values: dict[str, Any], scales: Scales | None) -> str:
    """A line for each Lyapunov exponent with its interval, per unit of τ; with scales, per second."""
    factor, unit = (1.0, "") if scales is None else (scales.rate, " 1/s")
    digits = 5 if scales is None else 1
    rows = zip(values["lyapunov"], values["lyapunov_ci"], strict=True)
    numbers = [[f"{factor * n:+.{digits}f}" for n in (v, *ends)] for v, ends in rows]
    return "\n".join(f"{v}  ({low} to {high}){unit}" for v, low, high in numbers)


def attractor_list(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of the attractors of one operating point.

    It has an entry for each attractor, the fraction of initial states that diverge or stay undecided, the number of
    initial states, and the index of the attractor in which each sweep ends.
    """
    rows = []
    for i, label in enumerate(motions(dataset["attractor_label"], dataset["attractor_period"])):
        one = {n: dataset[f"attractor_{n}"].values[i].item() for n in _ATTRACTOR_FIELDS}
        period, contact = int(dataset["attractor_period"][i]), CONTACTS[int(dataset["attractor_contact"][i])]
        rows.append({"label": label, "period": period or None, "contact": contact, **one, **_kick(dataset, i)})
    undecided = float((dataset["attractor"] < 0).mean())
    ends = {n: int(dataset[f"attractor_{n}"]) for n in ("up", "down") if f"attractor_{n}" in dataset}
    swept = {f"swept_{n}": i if i >= 0 else None for n, i in ends.items()}
    return {"attractors": rows, "undecided_fraction": undecided, "starts": int(dataset.sizes["start"]), **swept}


def _kick(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    """The smallest destabilising perturbation of one attractor; empty if it was not computed."""
    if "attractor_kick" not in dataset:
        return {}
    parts = ("attractor_kick_change", "attractor_kick_point")
    names = dataset["coordinate"].values.tolist()
    change, point = (dict(zip(names, dataset[n].values[number].tolist(), strict=True)) for n in parts)
    return {"kick": dataset["attractor_kick"].values[number].item(), "kick_change": change, "kick_point": point}


_ATTRACTOR_FIELDS = (
    "fraction", "fraction_lo", "fraction_hi", "v_rms", "contact_fraction", "dynamic_factor", "lyapunov",
    "lyapunov_lo", "lyapunov_hi", "multiplier", "residual",
)
"""The variables ``attractor_<name>`` that are keys of the JSON of an attractor."""


def attractor_units(dataset: xr.Dataset) -> dict[str, str]:
    """The physical units in `attractor_list`, by key; empty for a dimensionless result."""
    units = {name: dataset[f"attractor_{name}"].attrs["units"] for name in _ATTRACTOR_FIELDS}
    return {name: unit for name, unit in units.items() if unit != quantity(name).unit}


def print_attractors(dataset: xr.Dataset, model: MeshModel) -> None:
    """Print the attractors of an operating point of a model, one per row."""
    found = attractor_list(dataset)
    print(f"Attractors found from {found['starts']} starts: {len(found['attractors'])}")
    table = plain_table()
    units = {name: f"\n({unit})" for name, unit in attractor_units(dataset).items()}
    exponent = f"λ1{units.get('lyapunov', '')}"
    numbers = {"dynamic\nfactor": "dynamic_factor", exponent: "lyapunov", "max |μ|": "multiplier"}
    if "attractor_kick" in dataset:
        numbers["smallest\nkick"] = "kick"
    for title in ("motion", "% of starts\n(95 %)", f"V_RMS{units.get('v_rms', '')}", "contact", *numbers):
        table.add_column(title, justify="left" if title in ("motion", "contact") else "right")
    for a in found["attractors"]:
        share = f"{100 * a['fraction']:.1f} ({100 * a['fraction_lo']:.1f} to {100 * a['fraction_hi']:.1f})"
        measures = (measured(a[name]) for name in numbers.values())
        table.add_row(a["label"], share, measured(a["v_rms"]), a["contact"], *measures)
    if found["undecided_fraction"]:
        table.add_row("diverged or undecided", f"{100 * found['undecided_fraction']:.1f}")
    for way in ("up", "down"):
        if f"swept_{way}" in found:
            end = found[f"swept_{way}"]
            label = "none" if end is None else f"{found['attractors'][end]['label']}, row {end + 1}"
            table.add_row(f"swept {way}", label)
    print_table(table)
    if ratio := _quasi_static(model, *(a["dynamic_factor"] for a in found["attractors"])):
        print(f"dynamic factor: {ratio}")
