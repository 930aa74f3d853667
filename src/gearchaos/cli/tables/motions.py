"""The tables of one operating point: section, verdict, attractors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gearchaos.cli.documents import attractor_list, attractor_units, section, section_units
from gearchaos.cli.tables.text import plain_table, print_table, shown
from gearchaos.gears.results import is_physical
from gearchaos.gears.scales import Scales, unit_of
from gearchaos.gears.units import measured
from gearchaos.quantities import OPERATION, RESPONSES, VERDICTS, quantity

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.model import MeshModel
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.studies import Verdict
    from gearchaos.studyfile import LoadedStudy

_SHOWN_ROWS = 20
"""Most rows of a stroboscopic section that are printed."""


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
    from gearchaos.studies.quasi_static import quasi_static_ratio

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
