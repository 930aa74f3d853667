"""What ``gearchaos rattle`` prints: where meshes lose contact and hit both flanks, onsets, and impacts from rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gearchaos.cli.output import edges_in_words, plain_table, print_table, print_wrapped, ranges, shown, shown_rows
from gearchaos.cli.trains import load_unit
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.io.units import measured
from gearchaos.quantities import quantity

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.core.axis import Axis


def rattle_document(dataset: xr.Dataset, axis: Axis) -> dict[str, Any]:
    """The JSON document of a scan for rattle: the axis, onsets, and of each mesh the ranges of the axis where contact
    is lost from rest, where both flanks are hit from rest, and where it is lost after a sweep alone."""
    onsets = [{"mesh": str(mesh), "value": value, "linear": None if math.isnan(linear) else linear}
              for mesh, value, linear in zip(*(dataset[n].values.tolist() for n in (
                  "onset_mesh", "onset_value", "onset_linear")), strict=True)]
    meshes = {}
    for name in dataset["mesh"].values.tolist():
        contact = dataset["mesh_contact"].sel(mesh=name)
        lost, both = contact != CONTACTS.index("permanent"), contact == CONTACTS.index("two-sided")
        rest = {"history": "rest"}
        of_sweeps = lost.any("history") & ~lost.sel(rest)
        meshes[name] = {key: ranges(where.values, axis.values) for key, where in (
            ("lost", lost.sel(rest)), ("both_flanks", both.sel(rest)), ("lost_after_sweeps_alone", of_sweeps))}
    return {"axis": axis.name, "onsets": onsets, "meshes": meshes}


def print_rattle(dataset: xr.Dataset, content: dict[str, Any], axis: Axis, model: Any) -> None:
    """Print of each mesh where it loses contact and hits both flanks, the onsets, and a table of impacts from rest."""
    unit, values = quantity(axis.name).unit.replace("*", " "), axis.values
    for name, lost in content["meshes"].items():
        parts = [f"{words} at {', '.join(edges_in_words(*r) for r in some)} {unit}" for words, some in (
            ("contact is lost", lost["lost"]), ("both flanks are hit", lost["both_flanks"]),
            ("after a sweep alone it is lost", lost["lost_after_sweeps_alone"])) if some]
        print_wrapped(f"{name}: " + ("; ".join(parts) or "contact is kept in all motions that were tried"))
        own = [onset for onset in content["onsets"] if onset["mesh"] == name]
        if own:
            linear = "; by the linear train " + ", ".join(f"{o['linear']:.7g}" for o in own if o["linear"] is not None)
            linear = linear if own[0]["linear"] is not None else "; its stiffness varies, so there is no closed form"
            print_wrapped(f"  changes from rest at {', '.join(format(o['value'], '.7g') for o in own)} {unit}{linear}")
    step = f", every {values[1] - values[0]:.4g} {unit}" if len(values) > 1 else ""
    print_wrapped(f"Tried: from rest, and slow sweeps of the axis, rising and falling{step}: narrower ranges may be "
                 "missed, and other motions may exist.")
    rows = shown_rows(len(values))
    for name in dataset["mesh"].values.tolist():
        one, load = dataset.sel(mesh=name, history="rest"), load_unit(model.train, name)
        table = plain_table(
            axis.name, "contact", "front %", "back %", "impacts/s", f"impulse/s\n({load})", f"rms ({load})",
            f"standard\ndev. ({load})", gap=1)
        for i in rows:
            at = one.isel({axis.name: i})
            numbers = (100 * at.mesh_front_share, 100 * at.mesh_back_share, at.mesh_impacts, at.mesh_impulse,
                       at.mesh_rms_force, at.mesh_force_deviation)
            table.add_row(shown(float(one[axis.name][i])), CONTACTS[int(at.mesh_contact)],
                          *(measured(float(v), 3) for v in numbers))
        print(f"{name}, from rest" + f", {len(rows)} of {len(values)} rows" * (len(rows) < len(values)))
        print_table(table)
