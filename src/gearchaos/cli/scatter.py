"""What ``gearchaos scatter`` prints: how likely contact is lost, which input matters, and what tightening it brings."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.cli.output import plain_table, print_table, print_wrapped
from gearchaos.gears.units import measured
from gearchaos.studies.distributions import Scattered
from gearchaos.studies.scatter_results import AIMS, OUTCOMES, OUTPUTS
from gearchaos.studies.scattered_models import DEVIATIONS, STARTS

if TYPE_CHECKING:
    import xarray as xr

_CERTAIN = 0.99  # probability from which on, and to 1 less it, another aim says more
_TOLD = 5e-4  # least share of a distribution beyond its limits that is told
_NOTHING = 1e-3  # share of the larger end of a range below which the other end is 0
_SHOWN_ROWS = 12  # most rows of probabilities along the speed


def scatter_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a scatter: an answer for each torque, with probabilities, percentiles and inputs."""
    settings, along = json.loads(dataset.attrs["settings"]), str(dataset["probability"].dims[2])
    inputs = {}
    for name, words, unit, cut in zip(*(
            dataset[n].values.tolist() for n in ("varied", "distribution", "varied_unit", "cut_share")), strict=True):
        items = [f"{each:g} {unit}".rstrip() if isinstance(each, float) else str(each)
                 for each in Scattered.parse(f"{name}={words}").items]
        inputs[name] = {"distribution": words, "unit": unit, "cut": cut, "items": items}
    torques = dataset["torque"].values.tolist() if "torque" in dataset.coords else [None]
    return {
        "designs": int(dataset.sizes["sample"]), "impossible": float(dataset["impossible"]),
        "impossible_because": dataset.attrs["impossible_because"], "undecided": float(dataset["undecided_share"]),
        "start": settings["start"], "factor": settings["factor"], "along": along, "inputs": inputs,
        along: dataset[along].values.tolist(), "indices_refused": dataset.attrs["indices_refused"],
        "correlations": settings["correlations"],
        "torques": [_at_torque(dataset.isel(torque=t), torque) for t, torque in enumerate(torques)]}


def _at_torque(one: xr.Dataset, torque: float | None) -> dict[str, Any]:
    names = one["varied"].values.tolist()

    def triple(name: str, **at: Any) -> dict[str, Any]:
        values = (one[f"{name}{end}"].sel(at).values.tolist() for end in ("", "_lo", "_hi"))
        return dict(zip(("value", "low", "high"), values, strict=True))

    def of_inputs(variables: dict[str, str], **at: str) -> dict[str, Any]:
        return {name: {key: triple(variable, varied=name, **at) for key, variable in variables.items()}
                for name in names}

    tightened = {aim: of_inputs({"if_best": "if_best", "if_halved": "if_halved"}, aim=aim) for aim in AIMS}
    for aim, found in tightened.items():
        for name, entry in found.items():
            at = one.sel(aim=aim, varied=name)
            entry["best"] = [float(at["best_from"]), float(at["best_to"])]
    return {
        "torque": torque, "anywhere": {n: triple("anywhere", outcome=n) for n in OUTCOMES},
        "along": {n: triple("probability", outcome=n) for n in OUTCOMES},
        **{n: one[n].values.tolist() for n in ("lowest_speed_lost", "highest_speed_lost", "share_lost")},
        "mean_share_lost": float(one["probability"].sel(outcome=OUTCOMES[0]).mean()),
        "indices": {output: of_inputs({"first": "first_index", "total": "total_index"}, output=output)
                    for output in OUTPUTS}, "tightened": tightened}


def print_scatter(content: dict[str, Any]) -> None:
    """Print the answer for each torque, what matters and what to tighten, and probabilities along the speed."""
    for one in content["torques"]:
        _print_answer(content, one)
    inputs = "; ".join(f"{name} {each['distribution']}" + (
        f" ({100 * each['cut']:.2g} % cut off)" if each["cut"] > _TOLD else "")
        for name, each in content["inputs"].items())
    print_wrapped(f"Tried: {content['designs']} designs with {inputs}; motions {STARTS[content['start']]} alone: "
                  "others may be possible at the same speed. In brackets: 95 %.")
    if any(name.startswith(DEVIATIONS) for name in content["inputs"]):
        print_wrapped(f"{DEVIATIONS}: the tooth-to-tooth deviation f_i′ of each wheel over that which the grade "
                      "permits, with its sign. No standard says how it is distributed: this is a convention.")
    if content["impossible"]:
        print_wrapped(f"{_percent(content['impossible'])} of the designs are not possible and count for nothing: "
                      f"{content['impossible_because']}")
    if content["undecided"]:
        print_wrapped(f"{_percent(content['undecided'])} of the motions are undecided: they count as repeating.")
    for one in content["torques"]:
        _print_inputs(content, one)
        _print_along(content, one)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _chance(found: dict[str, Any]) -> str:
    """A probability or share with its interval: "0.63 (0.60 to 0.66)"."""
    if not np.isfinite(found["value"]):
        return "none"
    return "{value:.2f} ({low:.2f} to {high:.2f})".format(**{n: v + 0.0 for n, v in found.items()})


def _head(one: dict[str, Any]) -> str:
    return "" if one["torque"] is None else f"{one['torque']:g} N m: "


def _unit(content: dict[str, Any]) -> str:
    return " rpm" if content["along"] == "speed" else " omega0"


def _print_answer(content: dict[str, Any], one: dict[str, Any]) -> None:
    speeds, unit = content[content["along"]], _unit(content)
    lost, best = one["anywhere"][OUTCOMES[0]], _most(one)
    print_wrapped(
        f"{_head(one)}contact is lost {STARTS[content['start']]} with probability {_chance(lost)} at one or "
        f"more of {len(speeds)} speeds from {speeds[0]:g} to {speeds[-1]:g}{unit}, at "
        f"{_percent(one['mean_share_lost'])} of them on average{best}")
    low, middle, high = one["lowest_speed_lost"]
    if np.isfinite(middle):
        share = one["share_lost"]
        print_wrapped(f"  designs that lose it do so from {middle:.5g}{unit} on (median; 5 to 95 %: {low:.5g} to "
                      f"{high:.5g}); of all designs, share of the speeds {_percent(share[1])} ({_percent(share[0])} to "
                      f"{_percent(share[2])})")
    words = {OUTCOMES[1]: "both flanks hit", OUTCOMES[2]: "no repetition",
             OUTCOMES[3]: f"force over {content['factor']:g} times the quasi-static peak"}
    print_wrapped("  at one or more: " + ", ".join(f"{text} {_chance(one['anywhere'][n])}" for n, text in words.items()
                                              if np.isfinite(one["anywhere"][n]["value"])))
    tightened = _best_tightening(content, one)
    if tightened:
        print_wrapped(f"  {tightened}")


def _most(one: dict[str, Any]) -> str:
    """Which inputs move the share of the speeds with contact loss most, as far as indices tell them apart."""
    totals = {name: each["total"] for name, each in one["indices"][OUTPUTS[0]].items()
              if np.isfinite(each["total"]["value"])}
    if not totals:
        return ""
    most = max(totals.values(), key=lambda each: each["value"])
    alike = [name for name, each in totals.items() if each["high"] >= most["low"]]
    if len(alike) == len(totals) > 1:
        return "; the indices do not tell the inputs apart: more samples might"
    return f"; most by {' or '.join(alike)} (S_T {most['value']:.2f})"


def _aim(one: dict[str, Any]) -> tuple[str, float, str]:
    """What tightening is to reduce, its value and its words: the probability, or the share where loss is certain."""
    value = one["anywhere"][OUTCOMES[0]]["value"]
    if value < _CERTAIN:
        return AIMS[0], value, "the probability"
    return AIMS[1], one["mean_share_lost"], "the share of the speeds"


def _best_tightening(content: dict[str, Any], one: dict[str, Any]) -> str:
    """Which input is to be tightened, and what that surely brings; empty where it is not known."""
    aim, value, words = _aim(one)
    ways = [(each[way], f"with half the spread of {name}" if way == "if_halved" else
             f"with {name} {_where(each['best'], content['inputs'][name])}")
            for name, each in one["tightened"][aim].items() for way in ("if_halved", "if_best")]
    sure = [(found, text) for found, text in ways if found["high"] < value]
    if sure:
        found, text = min(sure, key=lambda each: each[0]["value"])
        return f"{text}, {words} falls from {value:.2f} to {_chance(found)}"
    known = any(np.isfinite(found["value"]) for found, _ in ways)
    return f"tightening any single input does not surely lower {words}" if known and value else ""


def _print_inputs(content: dict[str, Any], one: dict[str, Any]) -> None:
    """Tables of the inputs: indices of both outputs, and what is expected with each held at its best, or halved."""
    if refused := content["indices_refused"]:
        print_wrapped(f"No indices of Sobol: {refused}.")
    else:
        print(f"{_head(one)}which input matters: first-order and total indices (95 %)")
        table = plain_table("input", "S, share of speeds\nwith contact loss", "S_T, the same", "S_T, largest\nforce",
                            left=("input",), gap=1)
        for name, share in one["indices"][OUTPUTS[0]].items():
            force = one["indices"][OUTPUTS[1]][name]
            table.add_row(name, *map(_short, (share["first"], share["total"], force["total"])))
        print_table(table)
    aim, value, words = _aim(one)
    if not any(np.isfinite(entry["if_best"]["value"]) for entry in one["tightened"][aim].values()):
        return
    print(f"{_head(one)}what tightening brings: {words} of contact loss is {value:.2f}")
    table = plain_table("input", "held at its best", "gives (95 %)", "half its spread gives", left=("input",), gap=1)
    for name, entry in one["tightened"][aim].items():
        better = entry["if_best"]["high"] < value
        where = _where(entry["best"], content["inputs"][name]) if better else "none surely better"
        table.add_row(name, where, _short(entry["if_best"]),
                      _short(entry["if_halved"]))
    print_table(table)


def _short(found: dict[str, Any]) -> str:
    if not np.isfinite(found["value"]):
        return "none"
    return "{value:.2f} ({low:.2f}–{high:.2f})".format(**{n: max(v, 0.0) for n, v in found.items()})


def _where(best: list[float], given: dict[str, Any]) -> str:
    """The best part of an input: its ends, or the item of a list."""
    if not np.isfinite(best[0]):
        return "none"
    if given["items"]:
        return given["items"][int(best[0])]
    largest = max(map(abs, best))
    low, high = (measured(end if abs(end) > _NOTHING * largest else 0.0, 3) for end in best)
    return f"{low} to {high} {given['unit']}".rstrip()


def _print_along(content: dict[str, Any], one: dict[str, Any]) -> None:
    """A table of the probabilities along the speed; the rows are spread over it."""
    values = content[content["along"]]
    rows = np.unique(np.linspace(0, len(values) - 1, _SHOWN_ROWS).round().astype(int))
    table = plain_table(f"{content['along']}\n({_unit(content).strip()})", "contact loss\n(95 %)", "both\nflanks",
                        "no\nrepetition", "force over\nlimit", gap=2)
    for i in rows.tolist():
        chances = [{n: v[i] for n, v in one["along"][name].items()} for name in OUTCOMES]
        table.add_row(f"{values[i]:.5g}", _short(chances[0]), *(
            "none" if not np.isfinite(each["value"]) else f"{each['value']:.2f}" for each in chances[1:]))
    print_wrapped(f"{_head(one)}probabilities" + f", {len(rows)} of {len(values)} rows" * (len(rows) < len(values)))
    print_table(table)
