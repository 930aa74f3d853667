"""Dynamic factors of random spur pairs beside K_v of ISO 6336-1, method B, with three models of the mesh.

    python benchmarks/reality.py --designs 200 --out build/reality.jsonl --plot docs/pictures/reality.png
    python benchmarks/reality.py --pair

Every design is computed from rest at 18 speeds between 0.3 and 2 times the main resonance: with a prescribed stiffness,
with tooth pairs on their path of contact, and with corner contact. Half of the designs have a tip relief. K_v is an
empirical consensus, not a measurement. ``--error`` says which transmission error the wheels have. A repeated command
adds what the file lacks. An error takes about a minute. ``--pair`` prints a table of the pair 50/50 of
the examples instead, with all four errors.
"""

from __future__ import annotations

import argparse
import cmath
import json
import math
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

import gearchaos as gc
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.dynamic_factor.iso_method_b import of_design
from gearchaos.gears.dynamic_factor.main_resonance import MAIN_END, SUPERCRITICAL_START
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.loaded_error import loaded_error
from gearchaos.gears.transmission_error import PERMISSIBLE_OVER_SD

MODELS = ("prescribed stiffness", "pairs on the path", "corner contact")

ERRORS = {"typical": "from quality (typical)", "turned over": "from quality", "none": "none", "limit": "from quality"}
"""The transmission error: typical of the grade, the same of profiles that deviate the other way, none, or the limit of
the grade; and what a design says for it."""

RANGES = ("subcritical", "main resonance", "intermediate", "supercritical")
RATIOS = np.linspace(0.3, 2.0, 18)
"""Resonance ratios N = n1/n_E1 of ISO 6336-1, at its own stiffness."""
_HALF = 2  # which of them is 0.5

_LEAST_RATIO, _MOST_RATIO = 1.3, 2.1  # contact ratios
_LINE_LOADS = (50.0, 400.0)  # N/mm
_MOST_STRESS = 150.0  # F_t/(b m), N/mm²: more breaks the teeth of most steels
_MOST_DRAWN = 10_000  # pairs that are drawn for one that can run
_FASTEST = 60.0  # pitch line velocity up to which spur gears run, m/s
_PAIR_SPEEDS = gc.Axis("speed", 500, 7400, 139)  # every 50 rpm
_POSITIONS = np.arange(1024) / 1024  # of the mesh cycle, for its first harmonic


def drawn_design(number: int) -> gc.GearDesign:
    """A spur pair of usual proportions at its load, without relief; those that cannot run or carry it are drawn again.
    The pinion drives, and has at least the profile shift of its wheel.
    """
    rng = np.random.default_rng([number, 2027])
    for _ in range(_MOST_DRAWN):
        teeth, module = np.sort(rng.integers(17, 81, 2)), float(rng.choice([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]))
        line_load = math.exp(rng.uniform(*np.log(_LINE_LOADS)))
        addendum, face = float(rng.uniform(0.85, 1.3)), module * 1e-3 * float(rng.uniform(6, 14))
        drawing = {
            "teeth": tuple(teeth.tolist()), "module": module * 1e-3, "face_width": face,
            "pressure_angle": f"{rng.choice([20.0, 20.0, 20.0, 22.5, 25.0])} deg",
            "rack": {"addendum": addendum, "dedendum": addendum + 0.25, "root_radius": 0.25},
            "profile_shift": tuple(np.sort(rng.uniform(-0.1, 0.4, 2))[::-1].tolist()),
            "bore": tuple((teeth * module * 1e-3 * rng.uniform(0.25, 0.5)).tolist()),
            "quality": {"standard": "ISO 1328-1:1995", "grade": int(rng.integers(5, 9))},
            "backlash": {"value": module * 1e-3 * float(rng.uniform(0.02, 0.08)), "of": "line of action, total"},
            "damping_ratio": float(rng.uniform(0.03, 0.08)), "load_sharing": "prescribed"}
        radius = teeth[0] * module * 1e-3 / 2  # F_t of ISO 6336-1 is that at the reference circle
        try:
            design = gc.GearDesign(**drawing, speed=1000.0, torque=line_load * 1e3 * face * float(radius))
            design.to_pair()
        except InputError:
            continue
        if _LEAST_RATIO <= design.geometry.contact_ratio <= _MOST_RATIO and line_load / module <= _MOST_STRESS:
            return design
    raise RuntimeError(f"none of {_MOST_DRAWN} pairs that were drawn can run")


def relief(design: gc.GearDesign, number: int) -> dict[str, Any] | None:
    """Of every other design a linear relief of both wheels: 0.5 to 1 times the deflection of one pair under the load,
    over 0.5 to 1 times the way from the tip to single contact.
    """
    depth, reach = np.random.default_rng([number, 2028]).uniform(0.5, 1.0, 2).tolist()
    if number % 2 == 0:
        return None
    geometry = design.geometry
    length = reach * min(geometry.contact_ratio - 1, 1.0) * geometry.base_pitch
    starts = [2 * math.hypot(base / 2, tip - length)
              for base, tip in zip(geometry.base_diameter, geometry.tip_tangents, strict=True)]
    return {"amount": depth * design.load.line_load / design.tooth_stiffness.single_stiffness, "start_diameter": starts}


def with_error(design: gc.GearDesign, error: str) -> gc.GearDesign:
    """A design with one of `ERRORS`."""
    found = replace(design, transmission_error=ERRORS[error])
    if error != "turned over":
        return found
    first, second = found.error_harmonics.tooth_to_tooth
    share = -math.hypot(first, second) / (PERMISSIBLE_OVER_SD * (first + second))
    quality = {"standard": design.quality.standard, "grade": design.quality.grade, "deviations": (share, share)}
    return replace(found, quality=quality)


def under_load(design: gc.GearDesign) -> tuple[float, float]:
    """The first harmonic of the transmission error under load, at rest, and the mean deflection of the mesh, m."""
    deflection = loaded_error(design, None, _POSITIONS)
    harmonic = 2 * np.mean(deflection * np.exp(-2j * np.pi * _POSITIONS))
    error = design.error_harmonics
    if error.amplitudes:
        harmonic += error.amplitudes[0] * cmath.exp(-1j * error.phases[0])
    return float(abs(harmonic)), float(deflection.mean())


def excitation(design: gc.GearDesign) -> float:
    """The first harmonic of the transmission error under load, at rest, over the mean deflection of the mesh."""
    harmonic, mean = under_load(design)
    return harmonic / mean


def pair_table(threads: int | None = None) -> str:
    """The pair 50/50 of the examples with each error, on the path and with corner contact, from rest."""
    pair = gc.GearDesign(
        teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm",
        quality={"standard": "ISO 1328-1:1995", "grade": 6}, damping_ratio=0.05, speed="3000 rpm", torque="300 N*m",
        backlash={"value": "0.12 mm", "of": "line of action, total"})
    lines = ["| error | its first harmonic | under load, on the path | with corner contact | largest factor, path "
             "| with corner contact |", "| --- | --- | --- | --- | --- | --- |"]
    for error in ERRORS:
        design = with_error(pair, error)
        models = replace(design, corner_contact=False), design
        unloaded = design.error_harmonics.amplitudes[0] if error != "none" else 0.0
        harmonics = [unloaded, *(under_load(model)[0] for model in models)]
        largest = [float(gc.dynamic_factor(model, _PAIR_SPEEDS, threads=threads).dynamic_factor.max())
                   for model in models]
        lines.append(" | ".join([f"| {error}", *(f"{each * 1e6:.2f} µm" for each in harmonics),
                                 *(f"{each:.2f}" for each in largest)]) + " |")
    return "\n".join(lines)


def trial(number: int, error: str = "typical", threads: int | None = None) -> dict[str, Any]:
    """K_v and the factors of one design along the speed, or why there are none."""
    plain = with_error(drawn_design(number), error)
    given = relief(plain, number)
    found: dict[str, Any] = {"number": number, "error": error, "relieved": given is not None,
                             "contact_ratio": plain.geometry.contact_ratio}
    try:
        pairs = replace(plain, load_sharing="tooth pairs", corner_contact=False, tip_relief=given)
        designs = dict(zip(MODELS, (plain, pairs, replace(pairs, corner_contact=True)), strict=True))
    except InputError as refused:
        return {**found, "skipped": refused.field}
    method = of_design(pairs)
    if method.value is None:
        return {**found, "skipped": "K_v"}
    main = method.resonance.resonance_speed / RPM
    axis = gc.Axis("speed", RATIOS[0] * main, RATIOS[-1] * main, len(RATIOS))
    for name, design in designs.items():
        along = gc.dynamic_factor(design, axis, threads=threads)
        found[name] = {
            "factor": along["dynamic_factor"].values.tolist(), "separated": (along["contact"].values > 0).tolist(),
            "both_flanks": (along["contact"].values == 2).tolist(), "label": along["label"].values.tolist(),
            "quasi_static": float(along["quasi_static_ratio"]), "excitation": excitation(design)}
        if name == "pairs on the path":
            found["K_v"] = along["Kv_ISO_B"].values.tolist()
    return {**found, "main_start": method.resonance.lower_limit_ratio,
            "velocity": (axis.values * RPM * plain.geometry.reference_diameter[0] / 2).tolist()}


class Compared:
    """The designs of one error that all three models can take, as arrays over designs and speeds."""

    def __init__(self, trials: list[dict[str, Any]]) -> None:
        self.skipped = Counter(each["skipped"] for each in trials if "skipped" in each)
        self.trials = [each for each in trials if "skipped" not in each]
        self.standard = np.array([each["K_v"] for each in self.trials])
        starts = np.array([each["main_start"] for each in self.trials])[:, None]
        self.range = np.select([starts >= RATIOS, MAIN_END >= RATIOS, SUPERCRITICAL_START > RATIOS], [0, 1, 2], 3)
        self.slow = np.array([each["velocity"] for each in self.trials]) <= _FASTEST

    def of(self, model: str, name: str) -> np.ndarray:
        return np.array([each[model][name] for each in self.trials])

    def factor(self, model: str) -> np.ndarray:
        """The dynamic factors, infinite where a motion grows without bound."""
        found = self.of(model, "factor")
        return np.where(np.isnan(found), np.inf, found)

    def ratios(self, model: str) -> tuple[np.ndarray, np.ndarray]:
        """The factors over K_v, and these over the quasi-static factor: the response, as the speed goes to 0, to jumps
        of the stiffness, which K_v does not have. A peak is not their product: the second ratio is a guide alone.
        """
        over = self.factor(model) / self.standard
        return over, over / self.of(model, "quasi_static")[:, None]

    def largest(self, model: str) -> np.ndarray:
        """The largest factor of each design in the range of main resonance."""
        return np.where(self.range == 1, self.factor(model), 0.0).max(axis=1)

    def correlation(self) -> float:
        """Spearman's rank correlation, over the designs, of two ratios of corner contact to pairs on the path: of the
        first harmonic under load, and of the largest factor of main resonance; motions without bound are the largest.
        """
        path, corner = MODELS[1:]
        harmonic = self.of(corner, "excitation") / self.of(path, "excitation")
        return float(spearmanr(harmonic, self.largest(corner) / self.largest(path)).statistic)


def _quartiles(values: np.ndarray) -> str:
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75], method="nearest")
    return f"{median:.2f} ({low:.2f} to {high:.2f})"


def summary(found: Compared) -> str:
    """The table, and what the two models of tooth pairs differ in."""
    count, reasons = len(found.trials), ", ".join(f"{n} by {name}" for name, n in found.skipped.items())
    lines = [f"{count + found.skipped.total()} designs, {found.skipped.total()} skipped ({reasons}), "
             f"{sum(each['relieved'] for each in found.trials)} of {count} with a relief, {len(RATIOS)} speeds", "",
             "| range | speeds | model | factor/K_v | factor/(K_v × quasi-static factor) | with separation |",
             "| --- | --- | --- | --- | --- | --- |"]
    for number, name in enumerate(RANGES):
        here = found.range == number
        for model in MODELS:
            over, dynamic = (_quartiles(each[here]) for each in found.ratios(model))
            lines.append(f"| {name} | {here.sum()} | {model} | {over} | {dynamic} | "
                         f"{100 * found.of(model, 'separated')[here].mean():.0f} % |")
    path, corner = (found.of(model, "excitation") for model in MODELS[1:])
    larger = found.largest(MODELS[2]) > 1.01 * found.largest(MODELS[1])
    slow = ", ".join(f"{np.median(found.ratios(model)[0][found.slow]):.2f}" for model in MODELS)
    half = ", ".join(f"{np.median(found.ratios(model)[0][:, _HALF]):.2f}" for model in MODELS)
    separated = ", ".join(f"{100 * found.of(model, 'separated').mean():.0f} %" for model in MODELS)
    unbound = ", ".join(str(np.isinf(found.factor(model)).sum()) for model in MODELS)
    return "\n".join([*lines, "", (
        f"First harmonic of the error under load over the mean deflection, median: {np.median(path):.2f} on the path, "
        f"{np.median(corner):.2f} with corner contact, larger so in {(corner > path).sum()} designs. Largest factor of "
        f"main resonance more than 1 % larger with corner contact: {larger.sum()} designs. Rank correlation of what "
        f"corner contact changes, in this harmonic and in this factor: {found.correlation():.2f}. Up to {_FASTEST:g} "
        f"m/s: {found.slow.sum()} speeds, median factor over K_v {slow}. At N = {RATIOS[_HALF]:.1f}: {half}. Of all "
        f"speeds with separation: {separated}. Motions without bound: {unbound}.")])


def draw(found: Compared, path: Path) -> None:
    """Medians and quartiles of both ratios, and the share of designs with separation, along the resonance ratio."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.6), layout="constrained")
    for model, colour in zip(MODELS, ("#6b6b6b", "#14648c", "#c03a1e"), strict=True):
        for ax, values in zip(axes, found.ratios(model), strict=False):
            low, median, high = np.quantile(values, [0.25, 0.5, 0.75], axis=0, method="nearest")
            ax.plot(RATIOS, median, color=colour, label=model)
            ax.fill_between(RATIOS, low, high, color=colour, alpha=0.15, lw=0)
        axes[2].plot(RATIOS, found.of(model, "separated").mean(axis=0), color=colour, label=model)
    for ax, title in zip(axes, ("factor over $K_v$", "factor over $K_v$ and quasi-static factor",
                                "share of designs with separation"), strict=True):
        ax.set_title(title, fontsize=10)
        ax.set_xlabel("resonance ratio $N$")
    for ax in axes[:2]:
        ax.axhline(1, color="black", lw=0.8, ls=":")
        ax.set(yscale="log", ylim=(0.3, 4), yticks=[0.3, 0.5, 1, 2, 4], yticklabels=["0.3", "0.5", "1", "2", "4"])
        ax.minorticks_off()
    axes[2].set(ylim=(0, 1))
    axes[0].legend(fontsize=8)
    figure.savefig(path, dpi=110, bbox_inches="tight", pil_kwargs={"optimize": True})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=200)
    parser.add_argument("--error", choices=list(ERRORS), default="typical")
    parser.add_argument("--out", type=Path, default=Path("build/reality.jsonl"))
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--pair", action="store_true")
    parser.add_argument("--threads", type=int)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DesignWarning)
    if chosen.pair:
        print(pair_table(chosen.threads))
        return
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in chosen.out.read_text().splitlines()] if chosen.out.exists() else []
    done = {(each["number"], each["error"]) for each in known}
    for number in range(chosen.designs):
        if (number, chosen.error) not in done:
            known.append(trial(number, chosen.error, chosen.threads))
            with chosen.out.open("a") as file:
                file.write(json.dumps(known[-1]) + "\n")
    found = Compared([each for each in known if each["error"] == chosen.error and each["number"] < chosen.designs])
    print(summary(found))
    if chosen.plot:
        draw(found, chosen.plot)


if __name__ == "__main__":
    main()
