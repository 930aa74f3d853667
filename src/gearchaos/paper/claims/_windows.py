"""Statements about ranges of one parameter: where windows of periodic or quasi-periodic motion begin and end."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.paper.bench import Bench
from gearchaos.paper.claims._outcome import (
    CONTRADICTED,
    HOLDS,
    MISPRINT,
    Outcome,
    graded,
    judge,
)
from gearchaos.paper.claims._read import (
    is_chaotic,
    is_periodic,
    is_quasi_periodic,
    labels,
    on_torus,
    runs,
    summary,
)
from gearchaos.studies import Axis

_LOAD = {"omega": 1.0, "eps1": 0.1}
_SCAN = "Verdicts on a fine scan of the range, each from the paper's start."


@judge("6a")
def end_of_chaos(bench: Bench) -> Outcome:
    """Where the last chaotic column before the 2T range stands, and how much of the range below it is chaotic."""
    fine = bench.scan(Axis("q0", 0.0495, 0.052, 51), patient=True, **_LOAD)
    q0 = fine["q0"].values
    end = float(q0[is_chaotic(fine)].max())
    whole = bench.study(6, "a")
    below = whole["q0"].values < end
    share = float(is_chaotic(whole)[below].mean())
    evidence = {"last_chaotic": round(end, 6), "after_it": labels(fine)[int(np.searchsorted(q0, end)) + 1],
                "share_of_chaotic_columns_below": round(share, 4), "columns_below": int(below.sum())}
    enough = share >= 0.9
    return Outcome(
        graded(enough and abs(end - 0.0508) < 1e-4, enough and abs(end - 0.0508) < 5e-4),
        f"{_SCAN} The share of chaotic columns is that of Fig. 6.", evidence,
        f"chaos ends at {end:.5f}, where the motion becomes {evidence['after_it']}",
    )


@judge("6c")
def third_window(bench: Bench) -> Outcome:
    inside = labels(bench.scan(Axis("q0", 0.02486, 0.02499, 14), patient=True, **_LOAD))
    around = bench.scan(Axis("q0", 0.0247, 0.0252, 101), patient=True, **_LOAD)
    window = runs(around["q0"].values, around["period"].values == 3)
    evidence = {"inside": dict(Counter(inside)), "windows_of_3T": [[round(a, 6), round(b, 6)] for a, b in window]}
    return Outcome(graded(set(inside) == {"3T"}), _SCAN, evidence)


@judge("6d")
def sixth_after_third(bench: Bench) -> Outcome:
    printed = bench.regime(**_LOAD, q0=0.0255)
    around = bench.scan(Axis("q0", 0.02505, 0.0256, 111), patient=True, **_LOAD)
    window = runs(around["q0"].values, around["period"].values == 6)
    evidence = {"at_0.0255": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in window]}
    if printed.label == "6T":
        return Outcome(HOLDS, _SCAN, evidence)
    where = f"{printed.label} at 0.0255; 6T from {window[0][0]:.5g} to {window[-1][1]:.5g}" if window else ""
    return Outcome(MISPRINT if window else CONTRADICTED, _SCAN, evidence, where)


@judge("6e")
def sixth_alone(bench: Bench) -> Outcome:
    printed = bench.regime(**_LOAD, q0=0.047)
    around = bench.scan(Axis("q0", 0.04695, 0.04705, 101), patient=True, **_LOAD)
    window = runs(around["q0"].values, around["period"].values == 6)
    rounds = [(a, b) for a, b in window if b > 0.04695 and a < 0.04705]
    evidence = {"at_0.047": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in window]}
    return Outcome(graded(printed.label == "6T", bool(rounds)), _SCAN, evidence,
                   f"6T at values from {rounds[0][0]:.6f} to {rounds[-1][1]:.6f}" if rounds else "")


_SOFT: dict[str, Any] = {"kind": "full", "kappa": 0.5, "omega": 1.05, "q0": 0.1}


@judge("12a")
def first_torus(bench: Bench) -> Outcome:
    ds = bench.scan(Axis("eps1", 0.030, 0.050, 61), **_SOFT)
    eps1 = ds["eps1"].values
    inside = (eps1 > 0.033) & (eps1 < 0.048)
    share, first = float(on_torus(ds)[inside].mean()), _longest(eps1, on_torus(ds))
    near = share >= 0.75 and abs(first[0] - 0.033) <= 1.001e-3
    return Outcome(graded(share == 1, near), _SCAN, _ranges(ds, "eps1", share),
                   f"on the torus from {first[0]:.4g} to {first[1]:.4g}" + _beyond(ds, eps1, first[1], 0.048))


@judge("12b")
def second_torus(bench: Bench) -> Outcome:
    ds = bench.scan(Axis("eps1", 0.19, 0.22, 61), **_SOFT)
    eps1 = ds["eps1"].values
    first = _longest(eps1, on_torus(ds))
    before = Counter(np.array(labels(ds))[eps1 < first[0]])
    doubled = before.most_common(1)[0][0] == "2T" if before else False
    lasting = float(on_torus(ds)[eps1 > 0.2].mean()) == 1
    near = doubled and abs(first[0] - 0.2) <= 0.01 and first[1] >= 0.205
    return Outcome(graded(doubled and lasting and abs(first[0] - 0.2) < 1e-3, near), _SCAN, _ranges(ds, "eps1"),
                   f"on the torus from {first[0]:.4g} to {first[1]:.4g}" + _beyond(ds, eps1, first[1], 0.22))


@judge("14a")
def torus_over_load(bench: Bench) -> Outcome:
    ds = bench.scan(Axis("q0", 0.1305, 0.1695, 40), kind="full", kappa=0.5, omega=0.9, eps1=0.1)
    share = float(on_torus(ds).mean())
    return Outcome(graded(share == 1, share >= 0.75), _SCAN, _ranges(ds, "q0", share),
                   f"on the torus at {share:.0%} of the values between the printed limits")


@judge("14b")
def locked_torus(bench: Bench) -> Outcome:
    ds = bench.scan(Axis("q0", 0.155, 0.185, 61), kind="full", kappa=1.0, omega=1.0, eps1=0.1)
    q0 = ds["q0"].values
    inside = (q0 >= 0.16) & (q0 <= 0.18)
    quasi = is_quasi_periodic(ds)
    pure = float(quasi[inside].mean())
    locked = quasi[inside].any() and float(on_torus(ds)[inside].mean()) > 0.95
    return Outcome(graded(pure == 1, bool(locked)), _SCAN, _ranges(ds, "q0", pure),
                   "; ".join(f"{name} from {a:.5g} to {b:.5g}" for name, a, b in _stretches(ds, q0)))


@judge("14c")
def wider_chaos(bench: Bench) -> Outcome:
    ends = {}
    for name, number, panel in (("6", 6, "a"), ("14a", 14, "a"), ("14b", 14, "b")):
        ds = bench.study(number, panel)
        ends[name] = round(float(ds["q0"].values[is_chaotic(ds)].max()), 5)
    return Outcome(graded(min(ends["14a"], ends["14b"]) > ends["6"]), "The last chaotic column of each diagram.",
                   {"chaos_reaches_q0": ends})


def _longest(values: np.ndarray, flags: np.ndarray) -> tuple[float, float]:
    """The longest run of true flags, single breaks bridged (narrow windows of short periods lie within)."""
    bridged = flags.copy()
    bridged[1:-1] |= flags[:-2] & flags[2:]
    found = runs(values, bridged)
    return max(found, key=lambda ab: ab[1] - ab[0]) if found else (np.nan, np.nan)


def _beyond(ds: xr.Dataset, values: np.ndarray, start: float, stop: float) -> str:
    """What prevails beyond a range, in words."""
    rest = np.array(labels(ds))[(values > start) & (values <= stop)]
    return f", then mostly {Counter(rest).most_common(1)[0][0]} up to {stop:g}" if len(rest) else ""


def _stretches(ds: xr.Dataset, values: np.ndarray) -> list[tuple[str, float, float]]:
    """Stretches of one label that span at least three columns."""
    names = np.array(labels(ds))
    out = [(name, a, b) for name in dict.fromkeys(names) for a, b in runs(values, names == name)]
    step = values[1] - values[0]
    return sorted((s for s in out if s[2] - s[1] > 1.5 * step), key=lambda s: s[1])


def _ranges(ds: xr.Dataset, axis: str, share: float | None = None) -> dict[str, Any]:
    """The scan in short: what was found where."""
    out: dict[str, Any] = {
        "columns": int(ds.sizes[axis]),
        "stretches": [[name, round(a, 6), round(b, 6)] for name, a, b in _stretches(ds, ds[axis].values)],
        "locked_periods": sorted({int(p) for p in ds["period"].values[is_periodic(ds)] if p > 8}),
    }
    return out if share is None else {**out, "share_of_the_printed_range": round(share, 4)}
