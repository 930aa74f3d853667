"""A scatter as a document and in words: how likely contact is lost, what it is due to, and what was tried."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import model_from_json
from gearchaos.gears.io.units import measured
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.factor_context import beside_factors
from gearchaos.studies.operation.load_change import LoadChange
from gearchaos.studies.uncertainty.distributions import Scattered
from gearchaos.studies.uncertainty.scatter_results import AFTER, AIMS, OUTCOMES, OUTPUTS
from gearchaos.studies.uncertainty.scattered_models import DEVIATIONS, STARTS

if TYPE_CHECKING:
    import xarray as xr

_CERTAIN = 0.99  # probability from which on, and to 1 less it, another aim says more
_TOLD = 5e-4  # least share of a distribution beyond its limits that is told
QUASI_STATIC = "quasi-static peak"  # that over which the limit of the force is where the stiffness jumps
_OF_STIFFNESS = {"stiffness", "load_sharing", "corner_contact", "tip_relief"}  # inputs that may make it jump
_NOTHING = 1e-3  # share of the larger end of a range below which the other end is 0


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
        **{name: settings[name] for name in ("start", "load_change", "wide", "factor")},
        "force_over": _force_over(dataset), "along": along,
        "inputs": inputs,
        along: dataset[along].values.tolist(), "indices_refused": dataset.attrs["indices_refused"],
        "correlations": settings["correlations"],
        "torques": [_at_torque(dataset.isel(torque=t), torque) for t, torque in enumerate(torques)]}


def _force_over(dataset: xr.Dataset) -> str:
    """The force that its limit is a multiple of, in words: with no jump of the stiffness the peak is the static one."""
    varied = {name.rpartition(".")[2] for name in dataset["varied"].values.tolist()}
    jumps = beside_factors(model_from_json(dataset.attrs["model"]), varied).get("quasi-static ratio")
    return QUASI_STATIC if jumps or varied & _OF_STIFFNESS else "static force"


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

    def of_outcomes(after: str = "") -> dict[str, Any]:
        return {key: {n: triple(f"{variable}{after}", outcome=n) for n in OUTCOMES}
                for key, variable in (("anywhere", "anywhere"), ("along", "probability"))}

    changed = f"probability{AFTER}"
    return {
        "torque": torque, **of_outcomes(), changed: of_outcomes(AFTER) if changed in one else None,
        **{n: one[n].values.tolist() for n in ("lowest_speed_lost", "highest_speed_lost", "share_lost")},
        "mean_share_lost": float(one["probability"].sel(outcome=OUTCOMES[0]).mean()),
        "indices": {output: of_inputs({"first": "first_index", "total": "total_index"}, output=output)
                    for output in OUTPUTS}, "tightened": tightened}


def answer(content: dict[str, Any], one: dict[str, Any]) -> list[str]:
    """The answer at a torque: the probability of contact loss, those of other outcomes, and what to tighten."""
    speeds, unit = content[content["along"]], speed_unit(content)
    lost, single = one["anywhere"][OUTCOMES[0]], len(speeds) == 1
    place = f"at {speeds[0]:g}{unit}" if single else (
        f"at one or more of {len(speeds)} speeds from {speeds[0]:g} to {speeds[-1]:g}{unit}, "
        f"{speeds[1] - speeds[0]:.3g} apart, at {_percent(one['mean_share_lost'])} of them on average")
    start = f" {STARTS[content['start']]}" * (content["start"] != "rest")
    found = [f"{torque_head(one)}contact is lost in operation{start} with probability {_chance(lost)} "
             f"{place}{_most(one)}"]
    if changed := one[f"probability{AFTER}"]:
        share = "" if single else f", at {_percent(np.mean(changed['along'][OUTCOMES[0]]['value']))} of them on average"
        found.append(f"{change_in_words(content)} with probability {_chance(changed['anywhere'][OUTCOMES[0]])}{share}")
    low, middle, high = one["lowest_speed_lost"]
    if np.isfinite(middle) and not single:
        share = one["share_lost"]
        found.append(f"designs that lose it do so from {middle:.5g}{unit} on (median; 5 to 95 %: {low:.5g} to "
                     f"{high:.5g}); of all designs, share of the speeds {_percent(share[1])} ({_percent(share[0])} to "
                     f"{_percent(share[2])})")
    words = {OUTCOMES[1]: "both flanks hit", OUTCOMES[2]: "no repetition",
             OUTCOMES[3]: f"force over {content['factor']:g} times the {content['force_over']}",
             **({BEYOND: BEYOND} if one["anywhere"][BEYOND]["value"] else {})}
    found.append(("there: " if single else "at one or more: ") + ", ".join(
        f"{text} {_chance(one['anywhere'][n])}" for n, text in words.items()
        if np.isfinite(one["anywhere"][n]["value"])))
    tightened = _best_tightening(content, one)
    return [*found, tightened] if tightened else found


def tried(content: dict[str, Any]) -> list[str]:
    """Which designs and motions were tried, and what does not count."""
    inputs = "; ".join(f"{name} {each['distribution']}" + (
        f" ({100 * each['cut']:.2g} % cut off)" if each["cut"] > _TOLD else "")
        for name, each in content["inputs"].items())
    changed = content["load_change"] is not None or content["wide"]
    after = f", and {change_in_words(content)}, one at each speed" if changed else ""
    found = [f"Tried: {content['designs']} designs with {inputs}; motions {STARTS[content['start']]}, those without "
             f"contact as the speed rises and falls{after}: others may be possible, and contact may be lost in "
             "ranges between the speeds. In brackets: 95 %, for the number of designs alone."]
    if any(name.startswith(DEVIATIONS) for name in content["inputs"]):
        found.append(f"{DEVIATIONS}: the tooth-to-tooth deviation f_i′ of each wheel over that which the grade "
                     "permits, with its sign. No standard says how it is distributed: this is a convention.")
    if content["impossible"]:
        found.append(f"{_percent(content['impossible'])} of the designs are not possible and count for nothing: "
                     f"{content['impossible_because']}")
    if content["undecided"]:
        found.append(f"{_percent(content['undecided'])} of the motions are undecided: they count as repeating.")
    return found


def change_in_words(content: dict[str, Any]) -> str:
    """After what contact may be lost that operation keeps: "after a reversal of the load"."""
    return "from wide ranges of states" if content["wide"] else f"after {LoadChange(content['load_change']).words}"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _chance(found: dict[str, Any]) -> str:
    """A probability or share with its interval: "0.63 (0.60 to 0.66)"."""
    if not np.isfinite(found["value"]):
        return "none"
    return "{value:.2f} ({low:.2f} to {high:.2f})".format(**{n: v + 0.0 for n, v in found.items()})


def torque_head(one: dict[str, Any]) -> str:
    """The torque with which an answer begins; empty for a dimensionless model."""
    return "" if one["torque"] is None else f"{one['torque']:g} N m: "


def speed_unit(content: dict[str, Any]) -> str:
    """The unit of the speeds after a blank."""
    return " rpm" if content["along"] == "speed" else " omega0"


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


def aimed_at(one: dict[str, Any]) -> tuple[str, float, str]:
    """What tightening is to reduce, its value and its words: the probability, or the share where loss is certain."""
    value = one["anywhere"][OUTCOMES[0]]["value"]
    if value < _CERTAIN or len(one["along"][OUTCOMES[0]]["value"]) == 1:
        return AIMS[0], value, "the probability"
    return AIMS[1], one["mean_share_lost"], "the share of the speeds"


def _best_tightening(content: dict[str, Any], one: dict[str, Any]) -> str:
    """Which input is to be tightened, and what that surely brings; empty where it is not known."""
    aim, value, words = aimed_at(one)
    ways = [(each[way], f"with half the spread of {name}" if way == "if_halved" else
             f"with {name} {best_part(each['best'], content['inputs'][name])}")
            for name, each in one["tightened"][aim].items() for way in ("if_halved", "if_best")]
    sure = [(found, text) for found, text in ways if found["high"] < value]
    if sure:
        found, text = min(sure, key=lambda each: each[0]["value"])
        return f"{text}, {words} falls from {value:.2f} to {_chance(found)}"
    known = any(np.isfinite(found["value"]) for found, _ in ways)
    return f"tightening any single input does not surely lower {words}" if known and value else ""


def best_part(best: list[float], given: dict[str, Any]) -> str:
    """The best part of an input: its ends, or the item of a list."""
    if not np.isfinite(best[0]):
        return "none"
    if given["items"]:
        return given["items"][int(best[0])]
    largest = max(map(abs, best))
    low, high = (measured(end if abs(end) > _NOTHING * largest else 0.0, 3) for end in best)
    return f"{low} to {high} {given['unit']}".rstrip()
