"""What is printed of the motion of a train: its meshes, and how parallel paths share the load."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from gearchaos.cli.errors import PAGE_WIDTH
from gearchaos.cli.output import plain_table, print_table, print_wrapped
from gearchaos.gears.io.units import measured
from gearchaos.studies.motion.regime import shared_loads

if TYPE_CHECKING:
    from gearchaos.gears.train.train import Train
    from gearchaos.studies import Verdict

_LOST = {"one-sided": "contact is lost at", "two-sided": "both flanks are hit at", "none": "no contact at"}
"""Contact states in words before the names of meshes."""


def load_unit(train: Train, name: str) -> str:
    """The unit of what a contact of a train transmits: a torque between the stops of a shaft, a force in a mesh."""
    return "N m" if any(shaft.name == name and shaft.stop is not None for shaft in train.shafts) else "N"


def print_train(verdict: Verdict) -> None:
    """Print the answer for a train: which meshes carry nothing at rest, the contact of each, a table of forces and
    impacts, and how meshes share loads."""
    by_contact: dict[str, list[str]] = {}
    for name, found in verdict.meshes.items():
        by_contact.setdefault(found["contact"], []).append(name)
    kept = by_contact.pop("permanent", [])
    parts = [f"{_LOST[contact]} {', '.join(names)}" for contact, names in by_contact.items()]
    if kept:
        parts.append("all others keep contact" if parts else "all meshes keep contact")
    idle = [name for name, found in verdict.meshes.items() if found["dynamic_factor"] is None]
    if 0 < len(idle) < len(verdict.meshes):  # it is in the table where it is that of all
        parts.insert(0, f"no load at rest on {', '.join(idle)}")
    answer = f"{verdict.label}: {'; '.join(parts)}"
    print(textwrap.fill(answer, PAGE_WIDTH, subsequent_indent="  ", break_on_hyphens=False))
    model: Any = verdict.model
    stops = [name for name in verdict.meshes if load_unit(model.train, name) == "N m"]
    part, unit = ("shaft", "(N m)") if len(stops) == len(verdict.meshes) else ("mesh", "(N)")
    table = plain_table(
        part, "contact", "front", "back", f"peak {unit}", f"rms {unit}", "impacts/s", "dynamic\nfactor", gap=1)
    for name, found in verdict.meshes.items():
        shares = (f"{100 * found[side]:.4g} %" for side in ("front_share", "back_share"))
        numbers = (found[n] for n in ("force_peak", "force_rms", "impacts_per_second", "dynamic_factor"))
        table.add_row(name, found["contact"], *shares, *("none" if v is None else measured(v) for v in numbers))
    print_table(table)
    if part == "mesh" and stops:
        print_wrapped(f"peak and rms of the stops of {', '.join(stops)} are torques, N m")
    rows = shared_loads(verdict)
    if not rows:
        return
    print("\nshared loads; Kγ, the mesh load factor of ISO 6336-1, is the largest share over\nan even one")
    table = plain_table("load of", "Kγ", "share", "mean (N)", "least (N)", "largest (N)", "mesh", gap=1,
                        left=("load of", "mesh"))
    for row in rows:
        table.add_row(*row)
    print_table(table)
