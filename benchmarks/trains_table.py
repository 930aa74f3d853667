"""Twenty trains: their size, their common period, and whether an assessment takes the time that is told before it.

    python benchmarks/trains_table.py                      1000 to 1200 rpm with 8 states after load changes
    python benchmarks/trains_table.py --speed 500:4000 --starts 128 --only idler
    python benchmarks/trains_table.py --sizes              what a mesh cycle costs by state variables and contacts
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import gearchaos as gc
from gearchaos.gears.operation.operating import as_model
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.core.price import price
from gearchaos.studies.speeds import assess

EXAMPLES = Path(__file__).parents[1] / "examples"
STEPS = {"levels": ["3e8 N/m", "2e8 N/m"], "starts": [0, 0.6]}
MODULE = 1.5e-3  # of base circles, m
CYCLES = 50  # of which the time is taken


def chain(*pairs: tuple[int, int], shafts: bool = False) -> gc.Train:
    """Meshes one after another from a motor to a load, with a shaft between two stages or one body."""
    bodies, links, meshes, ratio, last = [gc.Body(name="motor", inertia=4e-3, torque=20.0)], [], [], 1.0, "motor"
    for i, (a, b) in enumerate(pairs):
        if shafts and i:
            bodies.append(gc.Body(name=f"pinion{i}", inertia=4e-4))
            links.append(gc.Shaft(between=(last, f"pinion{i}"), stiffness=5e4, damping=2.0))
            last = f"pinion{i}"
        bodies.append(gc.Body(name=f"wheel{i}", inertia=1e-3))
        meshes.append(gc.Mesh(
            between=(last, f"wheel{i}"), teeth=(a, b), base_radii=(a * MODULE / 2, b * MODULE / 2), stiffness=STEPS,
            damping=700.0, backlash=1e-4, error_amplitudes=[5e-6], phase=0.2 * i))
        ratio, last = ratio * b / a, f"wheel{i}"
    bodies[-1] = replace(bodies[-1], inertia=2e-2, torque=-20.0 * ratio)
    return gc.Train(speed=3000.0, bodies=bodies, shafts=links, meshes=meshes)


def loose(**mesh: object) -> gc.Train:
    """The loose wheel of the examples with another mesh."""
    train = gc.open(EXAMPLES / "train_loose_gear.toml")
    return replace(train, meshes=(replace(train.meshes[0], **mesh),))


def trains() -> Iterator[tuple[str, gc.Train]]:
    """The trains by name."""
    for name in ("idler", "two_stage", "loose_gear", "planetary"):
        yield name, gc.open(EXAMPLES / f"train_{name}.toml")
    yield "loose wheel, stepped stiffness", loose(stiffness=STEPS)
    yield "loose wheel, error", loose(error_amplitudes=("5 um",))
    for a, b in ((20, 40), (24, 36), (20, 61)):
        yield f"one mesh {a}/{b}", chain((a, b))
    for wheels in ((20, 30), (30, 40), (40, 30), (30, 50)), ((20, 30), (30, 20), (20, 30)), ((25, 50), (50, 25)):
        yield f"{len(wheels)} meshes in a row {wheels[0][0]}/{'/'.join(str(b) for _, b in wheels)}", chain(*wheels)
    for pairs in ((20, 40), (20, 50)), ((20, 60), (20, 60)), ((18, 54), (20, 60)), ((20, 61), (19, 73)):
        words = ", ".join(f"{a}/{b}" for a, b in pairs)
        yield f"two stages {words}", chain(*pairs)
        yield f"two stages with shaft {words}", chain(*pairs, shafts=True)


def row(name: str, train: gc.Train, speed: str, starts: int) -> str:
    """The row of the table of a train, by the price that `assess` tells and the time that it takes."""
    told = []

    def announce(work: object, *_: object) -> None:
        told.append(price(work))
        told.append(time.perf_counter())

    assess.announce = announce
    gc.assess(train, speed, starts=starts)
    taken, model = time.perf_counter() - told[1], as_model(train)
    return (f"| {name} | {len(model.state_names)} | {len(model.mesh_names)} | {model.most_cycles} | {told[0]:.1f} | "
            f"{taken:.1f} | {told[0] / taken:.2f} |")


def size_row(bodies: int, meshes: int) -> str:
    """Time of a mesh cycle in contact, and memory, of a chain of equal bodies: meshes 20/20, then shafts."""
    parts = [gc.Body(name=f"b{i}", inertia=1e-3, torque=200.0 * ((i == 0) - (i == bodies - 1))) for i in range(bodies)]
    ends = [(f"b{i}", f"b{i + 1}") for i in range(bodies - 1)]
    radius = 20 * MODULE / 2
    train = gc.Train(
        speed=1500.0, bodies=parts,
        meshes=[gc.Mesh(between=pair, teeth=(20, 20), base_radii=(radius, radius), stiffness=STEPS, damping=700.0,
                        backlash=1e-4, error_amplitudes=[5e-7]) for pair in ends[:meshes]],
        shafts=[gc.Shaft(between=pair, stiffness=5e4, damping=2.0) for pair in ends[meshes:]])
    problem = initial_value_problems(as_model(train))
    flow, w = problem.flow, np.repeat(problem.w, 8, axis=1)
    best, points = np.inf, np.zeros(8, int)
    for _ in range(7):
        begun = time.thread_time()
        flow.advance(w, CYCLES, points=points)
        best = min(best, (time.thread_time() - begun) / (8 * CYCLES))
    table = sum(array.nbytes for array in flow._tables)
    return f"| {len(w)} | {meshes} | {flow.step_count[0]} | {1e6 * best:.1f} | {table / 1e6:.1f} |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speed", default="1000:1200", help="range of speeds, rpm")
    parser.add_argument("--starts", type=int, default=8, help="states after load changes at each speed")
    parser.add_argument("--only", default="", help="trains whose name has this text")
    parser.add_argument("--sizes", action="store_true", help="the table of sizes instead")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    if given.sizes:
        print("| state variables | meshes | steps in a mesh cycle | µs of a mesh cycle | MB of tables |")
        print("| --- | --- | --- | --- | --- |")
        for bodies, meshes in ((3, 1), (5, 1), (8, 1), (16, 1), (26, 1), (51, 1), (16, 3), (16, 8), (51, 8)):
            print(size_row(bodies, meshes), flush=True)
        raise SystemExit
    print("| train | coordinates | contacts | mesh cycles in a period | price, s | taken, s | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, train in trains():
        if given.only in name:
            print(row(name, train, given.speed, given.starts), flush=True)
