"""What ``gearchaos scatter`` prints: how likely contact is lost, which input matters, and what tightening it brings."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.cli.output import plain_table, print_table, print_wrapped
from gearchaos.datasheet.scatter import aimed_at, answer, best_part, speed_unit, torque_head, tried
from gearchaos.studies.uncertainty.scatter_results import AFTER, OUTCOMES, OUTPUTS

_SHOWN_ROWS = 12  # most rows of probabilities along the speed


def print_scatter(content: dict[str, Any]) -> None:
    """Print the answer for each torque, what matters and what to tighten, and probabilities along the speed."""
    for one in content["torques"]:
        first, *more = answer(content, one)
        print_wrapped(first)
        for text in more:
            print_wrapped(f"  {text}")
    for text in tried(content):
        print_wrapped(text)
    for one in content["torques"]:
        _print_inputs(content, one)
        _print_along(content, one)


def _print_inputs(content: dict[str, Any], one: dict[str, Any]) -> None:
    """Tables of the inputs: indices of both outputs, and what is expected with each held at its best, or halved."""
    if refused := content["indices_refused"]:
        print_wrapped(f"No indices of Sobol: {refused}.")
    else:
        print(f"{torque_head(one)}which input matters: first-order and total indices (95 %)")
        table = plain_table("input", "S, share of speeds\nwith contact loss", "S_T, the same", "S_T, largest\nforce",
                            left=("input",), gap=1)
        for name, share in one["indices"][OUTPUTS[0]].items():
            force = one["indices"][OUTPUTS[1]][name]
            table.add_row(name, *map(_short, (share["first"], share["total"], force["total"])))
        print_table(table)
    aim, value, words = aimed_at(one)
    if not any(np.isfinite(entry["if_best"]["value"]) for entry in one["tightened"][aim].values()):
        return
    print(f"{torque_head(one)}what tightening brings: {words} of contact loss is {value:.2f}")
    table = plain_table("input", "held at its best", "gives (95 %)", "half its spread gives", left=("input",), gap=1)
    for name, entry in one["tightened"][aim].items():
        better = entry["if_best"]["high"] < value
        part = best_part(entry["best"], content["inputs"][name]) if better else "none surely better"
        table.add_row(name, part, _short(entry["if_best"]),
                      _short(entry["if_halved"]))
    print_table(table)


def _short(found: dict[str, Any]) -> str:
    if not np.isfinite(found["value"]):
        return "none"
    return "{value:.2f} ({low:.2f}–{high:.2f})".format(**{n: max(v, 0.0) for n, v in found.items()})


def _print_along(content: dict[str, Any], one: dict[str, Any]) -> None:
    """A table of the probabilities along the speed; the rows are spread over it, and those of the largest."""
    values, changed = content[content["along"]], one[f"probability{AFTER}"]
    largest = [int(np.argmax(np.nan_to_num(each["along"][OUTCOMES[0]]["value"]))) for each in (one, changed) if each]
    rows = np.unique([*np.linspace(0, len(values) - 1, _SHOWN_ROWS).round().astype(int), *largest])
    beside = "from wide states" if content["wide"] else "after load change"
    table = plain_table(f"{content['along']}\n({speed_unit(content).strip()})", "contact loss\n(95 %)",
                        *[f"{beside}\n(95 %)"] * bool(changed), "both\nflanks", "no\nrepetition",
                        "force over\nlimit", gap=2)
    for i in rows.tolist():
        chances = [{n: v[i] for n, v in one["along"][name].items()} for name in OUTCOMES[:4]]
        after = [{n: v[i] for n, v in changed["along"][OUTCOMES[0]].items()}] if changed else []
        table.add_row(f"{values[i]:.5g}", *map(_short, [chances[0], *after]), *(
            "none" if not np.isfinite(each["value"]) else f"{each['value']:.2f}" for each in chances[1:]))
    shown = f", {len(rows)} of {len(values)} rows" * (len(rows) < len(values))
    print_wrapped(f"{torque_head(one)}probabilities{shown}")
    print_table(table)
