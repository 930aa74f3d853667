"""What the commands of studies print of a result: a JSON document, or a table or lines of text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.cli.errors import PAGE_WIDTH
from gearchaos.cli.options import in_units
from gearchaos.cli.output import (
    SHOWN_ROWS,
    draw,
    plain_table,
    print_json,
    print_table,
    say_proofs,
    shown,
    unit_after,
)
from gearchaos.cli.trains import print_train
from gearchaos.datasets import motions, with_primes
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.io.units import measured
from gearchaos.gears.mesh.pair import Scales
from gearchaos.gears.operation.results import is_physical, unit_of
from gearchaos.quantities import OPERATION, RESPONSES, VERDICTS, parse, quantity
from gearchaos.studies.maps.cells_to_avoid import AFTER_A_LOAD_CHANGE, TO_AVOID
from gearchaos.studies.operation.factor_context import (
    beside_factors,
    root_in_result,
    root_of_model,
    which_mesh,
    words_beside,
)
from gearchaos.studies.proofs.proved_cells import proof_counts

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.model import MeshModel
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.studies import Verdict
    from gearchaos.studies.core.axis import Axis
    from gearchaos.studyfile import LoadedStudy


@dataclass(frozen=True)
class Found:
    """What a command found, and the files that it writes."""

    kind: str
    plain: xr.Dataset  # as it was computed
    loaded: LoadedStudy
    physical: bool
    axes: tuple[Axis, ...]
    out: Path | None
    plot: Path | None
    over: xr.Dataset | None = None  # what was measured

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The result in the units that are wanted."""
        return in_units(self.plain, self.loaded, self.physical)

    @property
    def in_units(self) -> xr.Dataset:
        """The result in the units of the gears, if there are any: tables always have them."""
        return in_units(self.plain, self.loaded, physical=True)

    @property
    def head(self) -> dict[str, Any]:
        """The study and its files, as JSON documents begin."""
        files = {name: None if path is None else str(path) for name, path in (("out", self.out), ("plot", self.plot))}
        return {"study": self.kind, **files}


def _section(dataset: xr.Dataset) -> dict[str, xr.DataArray]:
    """The stroboscopic section of a simulation: τ and every coordinate by name, one value per mesh period."""
    parts = map(parse, (str(name) for name, v in dataset.data_vars.items() if v.ndim == 1))
    names = {"tau": "tau_section", **{name.base: str(name) for name in parts if name.prefix == "section_"}}
    return {short: dataset[name] for short, name in names.items()}


_MOST_EXPONENTS = 8  # that are printed; a pair has at most 7


def section_document(found: Found) -> dict[str, Any]:
    """The JSON document of a stroboscopic section: values by name, in physical units with these."""
    columns = _section(found.dataset)
    units = {"units": {name: values.attrs["units"] for name, values in columns.items()}} if found.physical else {}
    document = {**{name: values.values.tolist() for name, values in columns.items()}, **units}
    model: Any = found.loaded.model
    if model.mesh_names:  # their deflections in m, and rates in m/s, at the end of each common period
        section, length = found.plain, model.units.length
        of = {"deflection": length, "deflection_rate": length * model.units.rate}
        document["meshes"] = {
            name: {n: (section[f"section_{n}"].values[:, m] * unit).tolist() for n, unit in of.items()}
            for m, name in enumerate(section["mesh"].values.tolist())}
    return document


def print_section(dataset: xr.Dataset) -> None:
    """Print the last rows of a stroboscopic section; of a train the deflections of its meshes."""
    columns, what = _section(dataset), "Stroboscopic section"
    if "mesh" in dataset.dims:
        deflections, what = dataset["section_deflection"], "Deflections of the meshes after each common period"
        columns = {"tau": columns["tau"], **{
            name.replace("/", "/\n"): deflections[:, m] for m, name in enumerate(dataset["mesh"].values.tolist())}}
    rows = list(zip(*(values.values.tolist() for values in columns.values()), strict=True))
    text = measured if is_physical(dataset) else shown
    print(f"{what}, last {min(SHOWN_ROWS, len(rows))} of {len(rows)} periods")
    units = {name: values.attrs["units"].replace("*", "\n*") for name, values in columns.items()}
    table = plain_table(*(f"{name}\n({unit})" for name, unit in units.items()), gap=1)
    for column in table.columns:
        column.overflow = "fold"
    for row in rows[-SHOWN_ROWS:]:
        table.add_row(*map(text, row))
    print_table(table)


def print_regime(verdict: Verdict, loaded: Any, proof: Certificate | Unproved | None = None) -> None:
    """Print the verdict at one operating point: the motion, its proof, its evidence, and quantities with a title.

    Those of given gears are in their units.
    """
    values, scales = verdict.to_dict(), None if loaded.pair is None else loaded.pair.scales
    table = plain_table()
    table.add_row("motion", f"{verdict.label}: {verdict.reason}")
    if proof is not None:
        table.add_row("proof", proof.in_words())
    for name, text in _operation(loaded.model, scales):
        table.add_row(name, text)
    (factor, unit, digits) = (1.0, "", 5) if scales is None else (scales.rate, " 1/s", 1)
    exponents = [[f"{factor * n:+.{digits}f}" for n in (v, *ends)]
                 for v, ends in zip(values["lyapunov"], values["lyapunov_ci"], strict=True)]
    lines = {"Lyapunov exponents": [f"{v}  ({low} to {high}){unit}" for v, low, high in exponents],
             "Floquet multipliers": [f"{a:+.6f} {b:+.6f}i" for a, b in values["multipliers"]]}
    for name, rows in lines.items():
        more = [f"and {len(rows) - _MOST_EXPONENTS} more: --json has all"] * (len(rows) > _MOST_EXPONENTS)
        table.add_row(name, "\n".join(rows[:_MOST_EXPONENTS] + more))
    of = which_mesh() if verdict.meshes else {}
    for q in (*RESPONSES, *VERDICTS):
        if q.title and of.get(q.name) != "worst":  # the table of meshes has these
            mesh = f", {next(iter(verdict.meshes))}" if of.get(q.name) == "first" else ""
            title = q.title.replace("the velocity", "z'" if loaded.model.kind in ("single", "train") else "x1'")
            table.add_row(title + mesh, _measured(q.name, values[q.name], scales))
        if q.name == "dynamic_factor" and values[q.name] is not None:
            for name, value in beside_factors(loaded.model, factor=values[q.name]).items():
                table.add_row(*((name, value) if verdict.meshes else ("", f"{name} {value}")))
    if verdict.meshes:
        print_train(verdict)
        print()
    print_table(table)
    print("From the initial values given; `gearchaos attractors` finds other motions.")


def _operation(model: Any, scales: Scales | None) -> list[tuple[str, str]]:
    """Speed, torque and frequency of an operating point of given gears, each with its words; none without scales."""
    if scales is None:
        return []
    train = model.train if model.kind == "train" else None
    wheels: dict[str, Any] = {}
    if train:
        loaded = (body.name for body in train.bodies if train.torque_of(body))
        wheels = {"speed": train.bodies[0].name, "torque": next(loaded, None)}
    rows = [(q.long_name.replace("wheel 1", wheel), f"{shown(model.value(q.name))} {q.unit.replace('*', ' ')}")
            for q in OPERATION if (wheel := wheels.get(q.name, "wheel 1"))]
    frequency = "frequency of the common period" if train else quantity("omega").title
    return [*rows, (frequency, _measured("omega", model.omega, scales))]


def _measured(name: str, value: Any, scales: Scales | None) -> str:
    """A value, in its physical unit if there are scales and it has one."""
    unit = None if scales is None or value is None else unit_of(name, scales)
    return shown(value) if unit is None else f"{measured(value * unit[0])} {unit[1]}"


def attractor_list(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of the attractors of one operating point, with the index of that in which each sweep ends."""
    rows = []
    for i, label in enumerate(motions(dataset["attractor_label"], dataset["attractor_period"])):
        one = {n: dataset[f"attractor_{n}"].values[i].item() for n in _ATTRACTOR_FIELDS}
        period, contact = int(dataset["attractor_period"][i]), CONTACTS[int(dataset["attractor_contact"][i])]
        rows.append({"label": label, "period": period or None, "contact": contact, **one})
        if "attractor_kick" in dataset:
            parts, names = ("attractor_kick_change", "attractor_kick_point"), dataset["coordinate"].values.tolist()
            change, point = (dict(zip(names, dataset[part].values[i].tolist(), strict=True)) for part in parts)
            rows[-1] |= {"kick": dataset["attractor_kick"].values[i].item(), "kick_change": change, "kick_point": point}
    undecided = float((dataset["attractor"] < 0).mean())
    ends = {n: int(dataset[f"attractor_{n}"]) for n in ("up", "down") if f"attractor_{n}" in dataset}
    swept = {f"swept_{n}": i if i >= 0 else None for n, i in ends.items()}
    return {"attractors": rows, "undecided_fraction": undecided, "starts": int(dataset.sizes["start"]), **swept}


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
    units = {name: f"\n({unit})" for name, unit in attractor_units(dataset).items()}
    exponent = f"λ1{units.get('lyapunov', '')}"
    numbers = {"dynamic\nfactor": "dynamic_factor", exponent: "lyapunov", "max |μ|": "multiplier"}
    if "attractor_kick" in dataset:
        numbers["smallest\nkick"] = "kick"
    table = plain_table("motion", "% of starts\n(95 %)", f"V_RMS{units.get('v_rms', '')}", "contact", *numbers,
                        left=("motion", "contact"))
    names = with_primes([a["label"] for a in found["attractors"]])
    for name, a in zip(names, found["attractors"], strict=True):
        share = f"{100 * a['fraction']:.1f} ({100 * a['fraction_lo']:.1f} to {100 * a['fraction_hi']:.1f})"
        measures = (measured(a[number]) for number in numbers.values())
        table.add_row(name, share, measured(a["v_rms"]), a["contact"], *measures)
    if found["undecided_fraction"]:
        table.add_row("diverged or undecided", f"{100 * found['undecided_fraction']:.1f}")
    for way in ("up", "down"):
        if f"swept_{way}" in found:
            end = found[f"swept_{way}"]
            table.add_row(f"swept {way}", "none" if end is None else names[end])
    print_table(table)
    if any(a["dynamic_factor"] is not None for a in found["attractors"]):
        words: list[str] = ["of the worst mesh, as the contact is"] if model.mesh_names else []
        if root := root_of_model(model, 1.0):
            words.append(f"root stress {measured(max(root), 3)} N/mm² times it")
        beside = ", ".join([*words, *map(" ".join, beside_factors(model).items())])
        print(textwrap.fill(f"dynamic factor: {beside}", PAGE_WIDTH, subsequent_indent="  "))


_TEETH = {"permanent": "in contact", "one-sided": "separate", "two-sided": "hit both flanks", "none": "no contact"}
"""Contact states of the teeth of a pair in words."""


def map_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON summary of a map: the numbers of cells with each motion and each contact state, and where the largest
    dynamic factor is, or without static load V_RMS; for basins, the attractors, their shares, and how they mix."""
    if "basin_entropy" in dataset:
        shares = dataset["attractor_fraction"].values.tolist()
        names = motions(dataset["attractor_label"], dataset["attractor_period"])
        measures = {name: dataset[name].item() for name in ("basin_entropy", "uncertainty_exponent")}
        return {"attractors": [{"label": n, "fraction": s} for n, s in zip(names, shares, strict=True)], **measures}
    names = motions(dataset["label"], dataset["period"])
    codes = dataset["contact_worst" if "contact_worst" in dataset else "contact"].values.ravel().tolist()
    document: dict[str, Any] = {
        "cells": {name: names.count(name) for name in sorted(set(names))},
        "contact": {CONTACTS[code]: codes.count(code) for code in sorted({code for code in codes if code >= 0})},
        "largest": None,
    }
    if "to_avoid" in dataset:
        found = dataset["to_avoid"].values.ravel().tolist()
        document["to_avoid"] = {words: found.count(code) for code, words in TO_AVOID.items() if code in found}
        document["share_of_load_changes"] = dataset["share_of_load_changes"].mean().item()
    for name in ("dynamic_factor", "v_rms"):
        known = dataset[name].where(abs(dataset[name]) < math.inf)
        if known.notnull().any():
            at, axes = dataset[name].isel(known.argmax(...)), reversed(dataset[name].dims)
            document["largest"] = {"quantity": name, "value": at.item(), "at": {str(n): at[n].item() for n in axes}}
            if name == "dynamic_factor" and "mesh_dynamic_factor" in dataset:
                meshes = dataset["mesh_dynamic_factor"].sel(document["largest"]["at"])
                document["largest"]["mesh"] = str(meshes["mesh"].values[int(meshes.argmax("mesh"))])
            break
    return document | ({"proofs": proof_counts([dataset])} if "proved" in dataset else {})


def print_map(found: Mapping[str, Any], dataset: xr.Dataset) -> None:
    """Print the JSON summary of a map: the shares of what was found, its extreme, and what this is read with.

    The first line of given gears has the shares of the contact states, that of others the shares of the motions.
    """
    if "attractors" in found:
        names = with_primes([each["label"] for each in found["attractors"]])
        _print_shares("basins", zip(names, (each["fraction"] for each in found["attractors"]), strict=True),
                      "initial values")
        print(f"basin entropy {shown(found['basin_entropy'])} nat, "
              f"uncertainty exponent {shown(found['uncertainty_exponent'])}")
        return
    cells, size = "columns" if dataset["label"].ndim == 1 else "cells", dataset["label"].size
    if "gears" in dataset.attrs:
        one = "" if "contact_worst" in dataset else ", one motion each"  # another one may separate where this does not
        shares = ", ".join(f"{_TEETH[state]} {100 * n / size:.3g} %" for state, n in found["contact"].items())
        teeth = "worst mesh" if "mesh" in dataset.dims else "teeth"
        print(textwrap.fill(f"{teeth}{one}: {shares} of the {cells}", PAGE_WIDTH, subsequent_indent="  "))
        if "to_avoid" in found:
            alone = sum(n for words, n in found["to_avoid"].items() if words.endswith(AFTER_A_LOAD_CHANGE))
            operation = size - alone - found["to_avoid"].get(TO_AVOID[0], 0)
            print(textwrap.fill(
                f"to avoid: {100 * operation / size:.3g} % of the {cells} in operation, {100 * alone / size:.3g} % "
                f"reached by load changes alone; {100 * found['share_of_load_changes']:.3g} % of the load changes lead "
                "to separation", PAGE_WIDTH, subsequent_indent="  "))
    else:
        counts = sorted(found["cells"].items(), key=lambda item: -item[1])
        _print_shares("motions", [(name, count / size) for name, count in counts], cells)
    if (largest := found["largest"]) is None:
        print("no motion is bounded")
        return
    name = largest["quantity"]
    value = f"{quantity(name).symbol or quantity(name).long_name} {largest['value']:.4g}{unit_after(dataset, name)}"
    place = ", ".join(f"{n} {v:.4g}{unit_after(dataset, n)}" for n, v in largest["at"].items())
    which = " (initial values)" if "attractors" in dataset else ""  # other motions of a cell may have a larger one
    mesh = f" of {largest['mesh']}" if "mesh" in largest else ""
    root = root_in_result(dataset, largest["value"], largest["at"]) if name == "dynamic_factor" else ""
    print(textwrap.fill(f"largest {value}{root}{mesh}{which}, at {place}", PAGE_WIDTH, subsequent_indent="  "))
    if words := words_beside(dataset, name):
        print(f"dynamic factor: {', '.join(words)}")


def result_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of any result: its dimensions, and smallest and largest value and unit of each variable."""
    known = {str(n): v for n, v in dataset.data_vars.items() if v.dtype.kind in "fiub" and v.notnull().any()}
    ranges = {n: {"least": v.min().item(), "most": v.max().item(), "units": v.attrs.get("units", "")}
              for n, v in known.items()}
    return {"sizes": {str(n): size for n, size in dataset.sizes.items()}, "variables": ranges}


def print_result(found: Mapping[str, Any]) -> None:
    """Print the sizes of a result, and the range of each of its variables."""
    print(", ".join(f"{name} {size}" for name, size in found["sizes"].items()) or "a single value")
    table = plain_table("variable", "least", "most", "unit", left=("variable", "unit"))
    for name, each in found["variables"].items():
        table.add_row(name, shown(each["least"]), shown(each["most"]), each["units"])
    print_table(table)


def _print_shares(what: str, shares: Iterable[tuple[str, float]], whole: str) -> None:
    """Print shares in a line, as many as have room in it."""
    parts = [f"{name} {100 * share:.3g} %" for name, share in shares]
    lines = [f"{what}: {', '.join([*parts[:n], *(['…'] if n < len(parts) else [])])} of the {whole}"
             for n in range(len(parts), -1, -1)]
    print(next((line for line in lines if len(line) <= PAGE_WIDTH), lines[-1]))


def _of(subject: str, folder: str = "cli") -> Any:
    """The module with the summaries of a subject; loaded when one is printed, since some take half a second."""
    return import_module(f"gearchaos.{folder}.{subject}")


def _map(found: Found) -> dict[str, Any]:
    """The JSON document of a map; how many cells are proved is also said on stderr."""
    document = map_document(found.dataset)
    say_proofs(document)
    axes = [{**asdict(axis), "units": quantity(axis.name).unit} for axis in found.axes]
    return {**found.head, "axes": axes, **document}


SUMMARIES: dict[str, tuple[Callable[[Found], dict[str, Any]], Callable[[Found, dict[str, Any]], None]]] = {
    "section": (section_document, lambda found, _: print_section(found.in_units)),
    "attractors": (lambda found: attractor_list(found.dataset) | (
                       {"units": attractor_units(found.dataset)} if found.physical else {}),
                   lambda found, _: print_attractors(found.in_units, found.loaded.model)),
    "map": (_map, lambda found, content: print_map(content, found.dataset)),
    "branch": (lambda found: _of("branches").branch_document(found.dataset, found.plain),
               lambda found, content: _of("branches").print_branch(content, found.dataset)),
    "curve": (lambda found: _of("branches").curve_document(found.dataset, *(axis.name for axis in found.axes)),
              lambda found, content: _of("branches").print_curve(content, found.dataset)),
    "edge": (lambda found: {**found.head, **_of("branches").edge_document(
                 found.dataset, found.loaded.pair.scales if found.physical and found.loaded.pair else None)},
             lambda _, content: _of("branches").print_edge(content)),
    "skeleton": (lambda found: {**found.head, **_of("branches").skeleton_document(found.dataset)},
                 lambda found, content: _of("branches").print_skeleton(content)),
    "rattle": (lambda found: {**found.head, **_of("rattle").rattle_document(found.plain, found.axes[0])},
               lambda found, content: _of("rattle").print_rattle(
                   found.in_units, content, found.axes[0], found.loaded.model)),
    "runup": (lambda found: {**found.head, **_of("runup").runup_document(
                  found.dataset, found.over, found.loaded.model)},
              lambda found, content: _of("runup").print_runup(found.dataset, content, found.loaded.model)),
    "orders": (lambda found: {**found.head, **_of("orders").orders_document(found.dataset)},
               lambda _, content: _of("orders").print_orders(content)),
    "fit": (lambda found: {**found.head, **_of("fit").fit_document(found.dataset)},
            lambda found, content: _of("fit").print_fit(found.dataset, content)),
    "scatter": (lambda found: {**found.head, **_of("scatter", "datasheet").scatter_document(found.dataset)},
                lambda _, content: _of("scatter").print_scatter(content)),
    "result": (lambda found: {**found.head, **result_document(found.dataset)},
               lambda found, content: print_result(content)),
}
"""The document of a result, and how it is printed, by the `Study.summary` of its study."""


def report(found: Found, summary: str, json_out: bool) -> None:
    """Draw a result, and print it by the entry ``summary`` of `SUMMARIES`."""
    draw(found.dataset, found.plot, over=found.over)
    document, show = SUMMARIES[summary]
    content = document(found)
    print_json(content) if json_out else show(found, content)
