"""Whether changes of the load and knocks do what an assessment says, by an integrator that shares no code with it.

    python benchmarks/load_changes.py --designs 12 --out build/load_changes.jsonl
    python benchmarks/load_changes.py --table 100 --out build/load_classes.jsonl

Random designs are assessed, spur and helical, of tooth pairs and of one spring, with all damping laws. At 40 speeds
outside the ranges to avoid, the load of a good motion goes to −λT and comes back 200 times, in steps and ramps at
random phases, and 100 times twice: a motion that does not come back to permanent contact is a contradiction. At 40
speeds inside them, operation or at least one of 200 changes must end in separation. The least knocks must end there,
and those of 0.5 to 0.9 times their size must not. Motions are integrated by Runge and Kutta's method with fixed steps
between the jumps of the stiffness; forces are those of the model's springs, gaps and damping law, written here anew.

``--table`` assesses many designs of `reality.drawn_design` instead, and says which share of their speeds is to be
avoided in operation, after load changes, and by knocks. ``--check`` prints how far the integrator is from the exact
flow. A repeated command adds what the file lacks.
"""

from __future__ import annotations

import argparse
import json
import math
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
from reality import drawn_design, relief, with_error
from speeds_to_avoid import random_design

import gearchaos as gc
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.operation.knocks import Knock
from gearchaos.studies.operation.load_change import stored_energy
from gearchaos.studies.speeds.assess import Assessment

LAWS = ("always", "contact", "unilateral")
KINDS = ("prescribed", "helical", "tooth pairs", "corner contact")
SPEEDS, EVENTS, REPEATED, KNOCKS = 40, 200, 100, 1000

_RANGE = (0.15, 1.6)  # of the main resonance
_STEPS, _STEP = 100, 0.06  # least in a mesh period; largest in units of 1/ω0
_BLOCK, _BLOCKS = 100, 30  # mesh periods; a motion in contact throughout a block keeps it
_HOME = 1e-4  # of the deflection: a motion that comes so near to the good one, which attracts, has come back to it
_REST, _SWEPT, _SWEEP = 600, 80, 160  # periods from rest and at each speed of a sweep; speeds of a sweep
_UNBOUND = 1e4
_NEVER = -1.0  # the instant of no knock


@numba.njit
def _mesh_force(z, v, x, k, gap, sides, damping, law):
    """The force of the mesh, and whether it touches, a share x of a step after its beginning."""
    first, middle, last = (1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)
    spring, flank = 0.0, 0.0
    for e in range(len(sides)):
        depth = sides[e] * z - (first * gap[0, e] + middle * gap[1, e] + last * gap[2, e])
        if depth > 0.0 and k[1, e] > 0.0:
            spring += sides[e] * depth * (first * k[0, e] + middle * k[1, e] + last * k[2, e])
            flank = sides[e]
    force = spring + damping * v
    if flank == 0.0:
        return damping * v * (law == 0), False
    if law == 2 and flank * force < 0.0:
        return 0.0, False
    return force, True


@numba.njit
def _load(t, dips):
    """The load over its mean; ``dips`` (E, 5) are begin, length of the fall, of the low load and of the rise, and by
    how much it falls."""
    lost = 0.0
    for begin, fall, low, rise, by in dips:
        if begin < t < begin + fall + low + rise:
            lost = max(lost, by * min(1.0, (t - begin) / fall, (begin + fall + low + rise - t) / rise))
    return 1.0 - lost


@numba.njit
def _acceleration(z, v, x, t, dips, load, drive, spring):
    """z'' a share x of a step after its beginning, at t."""
    own = (1 - x) * (1 - 2 * x) * drive[0] + 4 * x * (1 - x) * drive[1] + x * (2 * x - 1) * drive[2]
    return load * _load(t, dips) + own - _mesh_force(z, v, x, *spring)[0]


@numba.njit
def _step(z, v, begin, length, period, dips, load, drive, spring):
    """z and z' after a step; one in which contact begins or ends is divided until that happens in a 1024th of it."""
    x, share, touches = 0.0, 1.0, _mesh_force(z, v, 0.0, *spring)[1]
    while x < 1.0:
        h, half, t = share * length * period, x + share / 2, begin + x * length
        middle = begin + half * length
        a1 = _acceleration(z, v, x, t, dips, load, drive, spring)
        v2 = v + h / 2 * a1
        a2 = _acceleration(z + h / 2 * v, v2, half, middle, dips, load, drive, spring)
        v3 = v + h / 2 * a2
        a3 = _acceleration(z + h / 2 * v2, v3, half, middle, dips, load, drive, spring)
        v4 = v + h * a3
        a4 = _acceleration(z + h * v3, v4, x + share, begin + (x + share) * length, dips, load, drive, spring)
        next_z, next_v = z + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        then = _mesh_force(next_z, next_v, x + share, *spring)[1]
        if then != touches and share > 1 / 1024:
            share /= 4
            continue
        z, v, touches, x = next_z, next_v, then, x + share
        share = 1.0 - x
    return z, v


@numba.njit(parallel=True)
def _follow(w, first, last, dips, knocks, home, phase, drive, k, gap, sides, period, load, damping, law):
    """States (2, L) from the beginning of the period ``first`` (L,) to that of ``last``, the number of steps without
    contact, 0 for one that comes to the state ``home`` (2,) at phase 0, and the states when the load is back."""
    out, back, opened = w.copy(), w.copy(), np.zeros(w.shape[1], np.int64)
    for lane in numba.prange(w.shape[1]):
        z, v, ends = w[0, lane], w[1, lane], 0.0
        for e in range(dips.shape[1]):
            ends = max(ends, dips[lane, e, :4].sum())
        for n in range(first[lane], last[lane]):
            for s in range(len(phase) - 1):
                t, length = n + phase[s], phase[s + 1] - phase[s]
                if t <= knocks[lane, 0] < t + length:
                    v += knocks[lane, 1]
                if t <= ends < t + length:
                    back[0, lane], back[1, lane] = z, v
                spring = (k[s], gap[s], sides, damping, law)
                opened[lane] += not _mesh_force(z, v, 0.0, *spring)[1]
                z, v = _step(z, v, t, length, period, dips[lane], load, drive[s], spring)
            if not abs(z) < _UNBOUND:
                z, v, opened[lane] = np.nan, np.nan, last[lane]
                break
            if (z - home[0]) ** 2 + (v - home[1]) ** 2 < (_HOME * load) ** 2:
                opened[lane] = 0
                break
        out[0, lane], out[1, lane] = z, v
    return out, opened, back


@dataclass(frozen=True)
class Mesh:
    """A model with one mesh, tabulated over the mesh period: S steps that end where the stiffness jumps, M contacts."""

    phase: np.ndarray  # (S + 1,)
    drive: np.ndarray  # (S, 3) −ε'' at the beginning, the middle and the end of each step
    k: np.ndarray  # (S, 3, M)
    gap: np.ndarray  # (S, 3, M)
    sides: np.ndarray  # (M,)
    period: float
    load: float
    damping: float
    law: int
    rest: np.ndarray  # (2,), both wheels at rest, the front flanks touching but for the transmission error

    @classmethod
    def of(cls, model: MeshModel) -> Mesh:
        system = switched_system(vary(model, {}))  # for the numbers of the springs alone
        assert system.dimension == 2 and model.beta1 == model.beta2 == 0
        several = system.contacts
        edges = np.append(system.starts[0] if several is None else several.edges[0], 1.0)
        count = max(_STEPS, math.ceil(model.period / _STEP))
        phase, piece = [0.0], list[int]()
        for n in np.flatnonzero(np.diff(edges) > 0).tolist():
            steps = math.ceil((edges[n + 1] - edges[n]) * count)
            phase += np.linspace(edges[n], edges[n + 1], steps + 1)[1:].tolist()
            piece += [n] * steps
        ends = np.array(phase)
        at = np.stack([ends[:-1], (ends[:-1] + ends[1:]) / 2, ends[1:]], axis=1)  # (S, 3)
        if several is None:
            order = 2 * np.pi * at[..., None] * np.arange(1, system.chi_cos.shape[1] + 1)
            waves = np.cos(order) @ system.chi_cos[0] + np.sin(order) @ system.chi_sin[0]
            chi = system.levels[0, piece][:, None] + waves
            sides, k, gap = np.array([1.0, -1.0]), np.repeat(chi[..., None], 2, axis=2), np.ones((*chi.shape, 2))
        else:
            since = (at - edges[piece][:, None])[..., None] ** np.arange(3)
            sides, k = several.sides.astype(float), np.repeat(several.stiffness[0][:, piece].T[:, None], 3, axis=1)
            gap = np.einsum("msk,sjk->sjm", several.offset[0][:, piece], since)
        error = [(a, j * model.omega, p) for j, (a, p) in enumerate(
            zip(model.error.amplitudes, model.error.phases, strict=True), 1)]
        tau = at * model.period
        drive = sum((a * w**2 * np.cos(w * tau - p) for a, w, p in error), np.zeros_like(tau))
        rest = np.array([1 - sum(a * math.cos(p) for a, w, p in error), -sum(a * w * math.sin(p) for a, w, p in error)])
        return cls(ends, drive, k, gap, sides, model.period, model.q1 / model.J1 + model.q2 / model.J2,
                   2 * model.zeta, LAWS.index(model.damping_law), rest)

    def follow(
        self, w: np.ndarray, first: Any, last: Any, dips: np.ndarray | None = None, knocks: np.ndarray | None = None,
        home: Any = (np.nan, np.nan),
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`_follow` in this mesh."""
        lanes = w.shape[1]
        return _follow(w, *(np.broadcast_to(np.asarray(n), lanes) for n in (first, last)),
                       np.zeros((lanes, 0, 5)) if dips is None else dips,
                       np.full((lanes, 2), _NEVER) if knocks is None else knocks, np.array(home),
                       self.phase, self.drive, self.k, self.gap, self.sides, self.period, self.load, self.damping,
                       self.law)

    def separated(self, w: np.ndarray, home: Any, blocks: int = _BLOCKS) -> np.ndarray:
        """Whether motions from states (2, L) neither keep contact throughout a block of periods nor come home, (L,)."""
        out = np.ones(w.shape[1], bool)
        for _ in range(blocks):
            w, opened, _ = self.follow(w, 0, _BLOCK, home=home)
            out[out] = opened > 0
            w = w[:, opened > 0]
        return out

    def stored(self, ratio: np.ndarray, excess: float) -> np.ndarray:
        """The energy (L,) up to which `studies.operation.load_change` draws states; the mean stiffness is 1."""
        rest = -self.load - self.load**2 / 2
        after = np.array([stored_energy(1.0, 1.0, self.load, each) for each in ratio])
        return rest + (np.sqrt(after - rest) + excess * self.load / math.sqrt(2)) ** 2

    def energy(self, w: np.ndarray) -> np.ndarray:
        """That of states under the load, (L,)."""
        return w[1] ** 2 / 2 + np.maximum(0.0, np.abs(w[0]) - 1) ** 2 / 2 - self.load * w[0]


def design_of(number: int) -> gc.GearDesign:
    """A random design of one of the `KINDS`, with one of the `LAWS` that it can have, at its load."""
    kind = KINDS[number % len(KINDS)]
    law = LAWS[number // len(KINDS) % len(LAWS)]
    if kind not in KINDS[:2] and law == "unilateral":  # tooth pairs have one damper
        law = "contact"
    if kind == "helical":
        drawn = (random_design(n) for n in range(100 * number, 100 * number + 100))
        design = next(each for each in drawn if each.helix_angle)
        load = 1e3 * np.random.default_rng([number, 2029]).uniform(50, 300)  # N/m
        radius = design.geometry.base_diameter[0] / 2
        return replace(design, damping_law=law, torque=float(load * design.geometry.common_face_width * radius))
    design = replace(with_error(drawn_design(number), "typical"), damping_law=law)
    if kind == "prescribed":
        return design
    corner = kind == "corner contact"
    return replace(design, load_sharing="tooth pairs", corner_contact=corner, tip_relief=relief(design, number // 2))


def main_resonance(design: gc.GearDesign) -> float:
    """The speed at which the mesh frequency is that of the mean stiffness, rpm."""
    return 1000 / float(as_model(design.at(speed=1000.0)).omega)


def assessed(design: gc.GearDesign, **options: Any) -> Assessment:
    main = main_resonance(design)
    return gc.assess(design, f"{_RANGE[0] * main!r}:{_RANGE[1] * main!r}", **options)


def drawn_dips(rng: np.random.Generator, count: int, changes: int) -> np.ndarray:
    """Changes of the load (count, changes, 5): half of them reversals, others fall to between T/2 and −T; half of the
    falls and rises are steps. A second one begins up to ten periods after the load is back."""
    dips = np.exp(rng.uniform(np.log(0.05), np.log(30), (count, changes, 5)))
    dips[..., [1, 3]] = np.where(rng.random((count, changes, 2)) < 0.5, 1e-9, dips[..., [1, 3]])
    dips[..., 4] = 1 + np.where(rng.random((count, 1)) < 0.5, 1.0, rng.uniform(-0.5, 1.0, (count, 1)))
    dips[:, 0, 0] = rng.random(count)
    for n in range(1, changes):
        dips[:, n, 0] = dips[:, n - 1, :4].sum(axis=1) + rng.uniform(0, 10, count)
    return dips


class At:
    """A design at a speed: what operation meets there, and what changes of the load and knocks of it lead to."""

    def __init__(self, mesh: Mesh, states: np.ndarray) -> None:
        self.mesh, self.rest = mesh, states[:, 0]
        self.operation = bool(mesh.separated(states, (np.nan, np.nan), blocks=3).any())

    def ends(self, dips: np.ndarray, blocks: int = _BLOCKS) -> tuple[np.ndarray, np.ndarray]:
        """Whether changes of the load (L, E, 5) end in lasting separation, and the states when the load is back."""
        w = np.repeat(self.rest[:, None], len(dips), axis=1)
        last = np.ceil(dips[..., :4].sum(axis=2).max(axis=1)).astype(int) + 1
        after, _, back = self.mesh.follow(w, 0, last, dips)
        return self.mesh.separated(after, self.rest, blocks), back

    def outside(self, dips: np.ndarray, factor: float) -> dict[str, int]:
        """How many changes of the load end in separation, and how many reversals and others leave the set of energy."""
        separated, back = self.ends(dips)
        beyond = self.mesh.energy(back) > self.mesh.stored(dips[:, 0, 4] - 1, min(factor, 2.0) - 1)
        reversals = dips[:, 0, 4] == 2
        return {"count": len(dips), "separated": int(separated.sum()), "reversals": int(reversals.sum()),
                "reversals beyond": int((beyond & reversals).sum()), "others beyond": int((beyond & ~reversals).sum())}

    def knocked(self, phase: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Whether steps (L,) of the velocity at phases end in lasting separation."""
        w = np.repeat(self.rest[:, None], len(step), axis=1)
        return self.mesh.separated(self.mesh.follow(w, 0, 1, knocks=np.stack([phase, step], axis=1))[0], self.rest)


def operated(design: gc.GearDesign, speeds: np.ndarray) -> list[At]:
    """A design at speeds in rising order, with the motions from rest, and of slowly rising and falling speed."""
    low, high = _RANGE[0] * main_resonance(design), _RANGE[1] * main_resonance(design)
    grid = np.unique(np.concatenate([speeds, np.geomspace(low, high, _SWEEP)]))
    meshes = [Mesh.of(as_model(design.at(speed=each))) for each in grid.tolist()]
    both = [swept(meshes), swept(meshes[::-1])[:, ::-1]]
    chosen = np.searchsorted(grid, speeds).tolist()
    return [At(meshes[i], np.stack([
        meshes[i].follow(meshes[i].rest[:, None], 0, _REST)[0][:, 0], *(each[:, i] for each in both)], axis=1))
        for i in chosen]


def swept(meshes: list[Mesh]) -> np.ndarray:
    """The states (2, N) that slow sweeps reach at each of N speeds in turn."""
    w, out = meshes[0].follow(meshes[0].rest[:, None], 0, _REST)[0], []
    for mesh in meshes:
        w = mesh.follow(np.where(np.isfinite(w), w, mesh.rest[:, None]), 0, _SWEPT)[0]
        out.append(w[:, 0])
    return np.stack(out, axis=1)


def _by(at: At, dips: np.ndarray) -> str:
    """By what motions separate at a speed: operation, a change of the load, or nothing."""
    if at.operation:
        return "operation"
    return "load change" if at.ends(dips, blocks=3)[0].any() else "nothing"


def trial(number: int) -> dict[str, Any]:
    """What an integration of its own says of the assessment of a design."""
    design, rng = design_of(number), np.random.default_rng([number, 2030])
    found = assessed(design).at[0]
    low, high = (main_resonance(design) * each for each in _RANGE)
    drawn = rng.uniform(low, high, 20_000)
    inside_of = [next((w for w in found.windows if w.reach[0] <= s <= w.reach[1]), None) for s in drawn.tolist()]
    listed = np.array([w is not None for w in inside_of])
    free, avoided = (np.sort(drawn[part][:SPEEDS]) for part in (~listed, listed))
    windows = {s: w for s, w in zip(drawn.tolist(), inside_of, strict=True)}
    out: dict[str, Any] = {
        "number": number, "kind": KINDS[number % len(KINDS)], "law": design.damping_law, "listed": float(listed.mean()),
        "outside": [], "inside": [], "knocks": []}
    factors = found.dataset["dynamic_factor"].sel(motion="rest")
    met = dict(zip(np.sort([*free, *avoided]).tolist(), operated(design, np.sort([*free, *avoided])), strict=True))
    for speed, at in ((s, met[s]) for s in free.tolist()):
        factor = float(factors.sel(speed=speed, method="nearest"))
        out["outside"].append({"speed": speed, "operation": at.operation} | {
            name: at.outside(drawn_dips(rng, count, changes), factor)
            for name, count, changes in (("once", EVENTS, 1), ("twice", REPEATED, 2))})
    for speed, at in ((s, met[s]) for s in avoided.tolist()):
        window = windows[speed]
        out["inside"].append({
            "speed": speed, "by": _by(at, drawn_dips(rng, EVENTS, 1)), "for_operation": window.operation, "share":
            window.random_states and window.random_states.fraction, "range": window.words, "minor": window.minor})
    out["knocks"] = [check_knock(design, knock, rng) for knock in found.knocks]
    return out


def check_knock(design: gc.GearDesign, knock: Knock, rng: np.random.Generator) -> dict[str, Any]:
    """Whether a knock does what it should, and how many of 0.5 to 0.9 times its size at any phase do, too."""
    pair = design.to_pair()
    step = knock.speed_step * RPM * pair.R1 / (pair.half_backlash * pair.omega0)
    mesh = Mesh.of(as_model(design.at(speed=knock.speed)))
    at = At(mesh, mesh.follow(mesh.rest[:, None], 0, _REST)[0])
    size = step * rng.uniform(0.5, 0.9, KNOCKS) * rng.choice([1.0, -1.0], KNOCKS, p=[0.9, 0.1])
    return {"speed": knock.speed, "step": knock.speed_step,
            "itself": bool(at.knocked(np.array([knock.phase]), np.array([step]))[0]),
            "smaller": int(at.knocked(rng.random(KNOCKS), size).sum())}


def integration_error(number: int) -> float:
    """The largest difference in z from the exact flow after three periods from rest at four speeds, in deflections."""
    design, out = design_of(number), 0.0
    for speed in np.array([0.3, 0.55, 0.9, 1.2]) * main_resonance(design):
        model = as_model(design.at(speed=float(speed)))
        mesh, exact = Mesh.of(model), initial_value_problems(model)
        own = mesh.follow(mesh.rest[:, None], 0, 3)[0]
        out = max(out, abs(own[0, 0] - exact.flow.advance(exact.w.copy(), 3).w[0, 0]) / mesh.load)
    return out


def classes(number: int) -> dict[str, Any]:
    """Which shares of the speeds of a design are to be avoided, and why."""
    plain = with_error(drawn_design(number), "typical")
    design = replace(plain, load_sharing="tooth pairs", tip_relief=relief(plain, number))
    found = assessed(design, starts=32, spacing=0.01)
    at = found.at[0]
    data = at.dataset
    known = data["period"].values != 0
    return {
        "number": number, "operation": 1 - found.usable_share_in_operation,
        "load change": found.usable_share_in_operation - found.usable_share,
        "knock": sum(k.stop - k.start for k in at.knocks) / (found.speeds[1] - found.speeds[0]),
        "knocks": [check_knock(design, knock, np.random.default_rng([number, 2031])) for knock in at.knocks],
        "factor": float(at.largest.dynamic_factor), "motions": int(known.sum()),
        "beyond": int(data["beyond_the_teeth"].values.sum()), "ranges": len(at.windows),
        "beyond_ranges": sum(w.beyond_the_teeth for w in at.windows)}


def summary(trials: list[dict[str, Any]]) -> str:
    """A row for each design."""
    heads = ("design", "law", "listed", "speeds outside", "operation separates", "changes that separate",
             "repeated ones", "reversals beyond the set", "others beyond", "inside by operation, change, nothing",
             "knocks", "lead there", "smaller ones")
    lines = ["".join(f"| {head} " for head in heads) + "|", "| --- " * len(heads) + "|"]
    for each in trials:
        outside, by = each["outside"], Counter(at["by"] for at in each["inside"])
        total = {what: [sum(at[name][what] for at in outside) for name in ("once", "twice")] for what in (
            "count", "separated", "reversals", "reversals beyond", "others beyond")}
        lines.append(" | ".join([
            f"| {each['number']} {each['kind']}", each["law"], f"{100 * each['listed']:.0f} %", str(len(outside)),
            str(sum(at["operation"] for at in outside)),
            *(f"{n} of {count}" for n, count in zip(total["separated"], total["count"], strict=True)),
            f"{sum(total['reversals beyond'])} of {sum(total['reversals'])}",
            f"{sum(total['others beyond'])} of {sum(total['count']) - sum(total['reversals'])}",
            ", ".join(str(by[name]) for name in ("operation", "load change", "nothing")), str(len(each["knocks"])),
            str(sum(knock["itself"] for knock in each["knocks"])),
            f"{sum(knock['smaller'] for knock in each['knocks'])} of {KNOCKS * len(each['knocks'])}"]) + " |")
    return "\n".join(lines)


def summary_of_classes(trials: list[dict[str, Any]]) -> str:
    """Quantiles over the designs."""
    lines = [f"{len(trials)} designs", "", "| | median | largest | designs with any |", "| --- | --- | --- | --- |"]
    for name, words in (("operation", "speeds to avoid in operation"), ("load change", "after load changes alone"),
                        ("knock", "good speeds with a knock"), ("beyond", "motions beyond the teeth")):
        of = [each["motions"] if name == "beyond" else 1.0 for each in trials]
        shares = np.array([each[name] for each in trials]) / of
        median, most = 100 * np.median(shares), 100 * shares.max()
        lines.append(f"| {words} | {median:.1f} % | {most:.1f} % | {(shares > 0).sum()} |")
    factors = np.array([each["factor"] for each in trials])
    names = "beyond", "motions", "beyond_ranges"
    beyond, motions, ranges = (sum(each[name] for each in trials) for name in names)
    knocks = [knock for each in trials for knock in each["knocks"]]
    return "\n".join([*lines, "", (
        f"Largest factor of a design: median {np.nanmedian(factors):.2f}, most {np.nanmax(factors):.2f}, none in "
        f"{np.isnan(factors).sum()}. Beyond the teeth: {beyond} of {motions} motions, in {ranges} ranges. Least "
        f"knocks: {len(knocks)}; {sum(knock['itself'] for knock in knocks)} lead there, and of "
        f"{KNOCKS * len(knocks)} smaller ones {sum(knock['smaller'] for knock in knocks)}.")])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=12)
    parser.add_argument("--table", type=int)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("build/load_changes.jsonl"))
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DesignWarning)
    if chosen.check:
        print(", ".join(f"{integration_error(number):.1e}" for number in range(chosen.designs)))
        return
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in chosen.out.read_text().splitlines()] if chosen.out.exists() else []
    done: set[int] = {each["number"] for each in known}
    found_of: Callable[[int], dict[str, Any]] = trial if chosen.table is None else classes
    for number in set(range(chosen.table or chosen.designs)) - done:
        try:
            known.append(found_of(number))
        except InputError as refused:
            known.append({"number": number, "skipped": refused.field})
        with chosen.out.open("a") as file:
            file.write(json.dumps(known[-1]) + "\n")
    trials = sorted((each for each in known if "skipped" not in each), key=lambda each: each["number"])
    print(summary(trials) if chosen.table is None else summary_of_classes(trials))


if __name__ == "__main__":
    main()
