"""What ``gearchaos runup`` prints: where contact is lost and where the motion jumps, and the peaks of the response."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.cli.modes import NEAR
from gearchaos.cli.output import edges_in_words, plain_table, print_table, print_wrapped, ranges
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.io.units import measured
from gearchaos.studies.operation.factor_context import root_in_result, words_beside
from gearchaos.studies.runup.measured_runup import compared_orders, comparison_words
from gearchaos.studies.runup.runup_jumps import GOES_ON, NOT_PERIODIC, response_peaks
from gearchaos.studies.vibration.natural_frequencies import natural_frequencies

if TYPE_CHECKING:
    import xarray as xr


def runup_document(dataset: xr.Dataset, over: xr.Dataset | None, model: Any) -> dict[str, Any]:
    """The JSON document of a run-up: its jumps, peaks with the natural frequency that they are near, if there is one,
    and the ranges of speeds with lost contact in each direction; beside what was measured ``over`` it the largest
    amplitudes of both at mesh orders."""
    names = {"speed": "speed_of_jump", "direction": "direction_of_jump", "from": "factor_before_jump",
             "to": "factor_after_jump", "clear": "clear_jump"}
    jumps = [dict(zip(names, row, strict=True)) for row in zip(
        *(dataset[n].values.tolist() for n in names.values()), strict=True)]
    if "event_kind" in dataset:
        for jump, kind, speed in zip(
                jumps, *(dataset[n].values.tolist() for n in ("event_kind", "event_speed")), strict=True):
            jump |= ({"event": None, "why": _WHY[kind]} if math.isnan(speed) else
                     {"event": {"kind": kind, "speed": speed}})
    natural = natural_frequencies(model.gears)["natural_frequency"].values
    peaks, ways = [], {}
    for way in dataset["direction"].values.tolist():
        one = dataset.sel(direction=way)
        for i in response_peaks(one["dynamic_factor"].values):
            at = one.isel(speed=i)
            line = at["order_force"][1:].fillna(0.0)
            order = line["order"].values[int(line.argmax("order"))].item()
            frequency = order * at["speed"].item() / 60
            near = natural[np.abs(natural / frequency - 1).argmin()].item()
            peaks.append({"speed": at["speed"].item(), "order": order, "frequency": frequency,
                          "natural_frequency": near if abs(near - frequency) <= NEAR * near else None,
                          "dynamic_factor": at["dynamic_factor"].item(), "direction": way})
        states = {word: one["contact"].values == CONTACTS.index(state) for word, state in (
            ("contact_lost", "one-sided"), ("both_flanks", "two-sided"), ("no_contact", "none"))}
        most = one.isel(speed=int(one["dynamic_factor"].fillna(0.0).argmax("speed")))
        largest = {"speed": most["speed"].item(), "dynamic_factor": most["dynamic_factor"].item()}
        ways[way] = {"largest": largest} | {word: ranges(where, one["speed"].values) for word, where in states.items()}
    return {"jumps": jumps, "peaks": peaks, "directions": ways, "status": dataset.attrs["status"],
            **({} if over is None else {"measured": compared_orders(dataset, over)})}


def print_runup(dataset: xr.Dataset, content: dict[str, Any], model: Any) -> None:
    """Print of a run-up where contact is lost and where the motion jumps, then a table of its peaks."""
    def size(jump: Mapping[str, Any]) -> float:
        """By how much the dynamic factor changes, as the logarithm of its ratio; 0 where it is not known."""
        ratio = jump["to"] / jump["from"] if jump["from"] else math.nan
        return abs(math.log(ratio)) if 0 < ratio < math.inf else 0.0

    words = {"contact_lost": "contact is lost", "both_flanks": "both flanks are hit", "no_contact": "no contact"}
    for way, states in content["directions"].items():
        most = states["largest"]
        parts = [f"{text} at {', '.join(edges_in_words(*r) for r in states[name])} rpm" for name, text in words.items()
                 if states[name]]
        if most["dynamic_factor"]:
            root = root_in_result(dataset, most["dynamic_factor"], {"direction": way, "speed": most["speed"]})
            largest = f"dynamic factor up to {measured(most['dynamic_factor'])}{root}"
            parts.insert(0, f"{largest}, at {most['speed']:.5g} rpm")
        if not any(states[name] for name in words):
            parts.append("contact is kept")
        own = [jump for jump in content["jumps"] if jump["direction"] == way]
        clear = sorted((jump for jump in own if jump["clear"] or jump.get("event")), key=size, reverse=True)
        if not own:
            parts.append("no jumps")
        print_wrapped(f"speed {'rising' if way == 'up' else 'falling'}: {'; '.join(parts)}")
        if clear:
            causes = [f": {e['kind']} at {e['speed']:.5g} rpm" if (e := jump.get("event")) else
                      f": {jump['why']}" if "why" in jump else "" for jump in clear]
            print_wrapped("  jumps of the dynamic factor at " + "; ".join(
                f"{j['speed']:.5g} rpm ({j['from']:.3g} to {j['to']:.3g}){why}"
                for j, why in zip(clear, causes, strict=True)))
        others = [jump["speed"] for jump in own if jump not in clear]
        if others:
            print_wrapped(f"  {len(others)} {'more' if clear else 'changes'}, from or to a motion that is not steady: "
                          f"{edges_in_words(min(others), max(others))} rpm")
    if content["status"] != "ok":
        print_wrapped(content["status"])
    step, cycles = float(dataset["speed"][:2].diff("speed").sum()), max(model.cycles.values(), default=1)
    repeats = f" The speed changes after every {cycles} mesh cycles, when all repeats." * (cycles > 1)
    print_wrapped(f"dynamic factor: {', '.join(words_beside(dataset, 'dynamic_factor'))}; the largest in each "
                 f"{step:.3g} rpm. Begun from rest, other motions may exist. Jumps are changes of the force's range "
                 f"by a quarter or more from one steady motion to another, the largest first.{repeats}")
    if content["peaks"]:
        table = plain_table("direction", "peak at (rpm)", "dynamic factor", "order", "Hz", "natural\nfrequency (Hz)",
                            left=("direction",))
        for peak in content["peaks"]:
            near = peak["natural_frequency"]
            table.add_row(peak["direction"], f"{peak['speed']:.5g}", measured(peak["dynamic_factor"]),
                          f"{peak['order']:g}", f"{peak['frequency']:.5g}", f"{near:.5g}" if near else "none near")
        print_table(table)
    if "measured" in content:
        print("Largest amplitudes of the mesh orders over the speeds that both have, peak:")
        table = plain_table("order", "measured (N)", "at (rpm)", "computed (N)", "at (rpm)",
                            "measured over\ncomputed (dB)")
        for row in content["measured"]:
            sizes = (measured(row["measured"]), f"{row['measured_speed']:.5g}", measured(row["computed"]),
                     f"{row['computed_speed']:.5g}")
            table.add_row(f"{row['order']:g}", *sizes, comparison_words(row))
        print_table(table)


_WHY = {GOES_ON: "the branch before goes on", NOT_PERIODIC: "not from a branch, the motion before is not periodic"}
"""Why a jump has no event."""
