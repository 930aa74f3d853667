"""Whether the price that is told before a study is the time that it takes.

    python benchmarks/prices.py                      all commands, one after another, in one process
    python benchmarks/prices.py --only assess        those whose line has this text

Prints the price, the time taken after it was told, their ratio, the time of the trials that the price is from, and last
the share of the prices that are within a factor of two of the time.
"""

from __future__ import annotations

import argparse
import io
import shlex
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory

from gearchaos.cli import main
from gearchaos.studies.core import price as prices

EXAMPLES = Path(__file__).parents[1] / "examples"
SPUR, ISO, TWO_STAGE = "spur_50_50.toml", "iso_tr_6336_30_example_1.toml", "train_two_stage.toml"
ONE_SPRING = "--set design.load_sharing=prescribed"
COMMANDS = f"""
gear {SPUR} --torque 60 --speed 500:3000
gear {SPUR} --torque 300 --speed 500:6000
gear {SPUR} --torque 150 --speed 500:6000 {ONE_SPRING}
gear {ISO} --speed 500:3000
gear spur_27_35.toml --torque 100 --speed 500:3000
assess {SPUR} --speed 500:3000 --torque 100
assess {SPUR} --speed 500:6000 --torque 100,300 --starts 32
assess {SPUR} --speed 500:3000 --torque 100:300:4 --starts 16
assess {SPUR} --speed 1000:2000 --torque 60:300:12 --starts 16 {ONE_SPRING}
assess {SPUR} --speed 1000:4000 --torque 200 --load-change none
assess spur_27_35.toml --speed 500:3000 --torque 50,100 --starts 32
assess {TWO_STAGE} --speed 1000:1500 --starts 16
assess train_idler.toml --speed 1000:2000 --starts 8
zones --axis omega=0.5:2:150 --axis eps1=0:0.3:100 --out z.nc
zones --axis omega=0.5:2:60 --axis eps1=0:0.3:40 --starts 8 --out z.nc
zones --axis omega=0.5:2:250 --axis eps1=0:0.3:250 --refine 8 --out z.nc
zones --set kind=single --axis omega=0.4:2:200 --axis zeta=0.02:0.1:100 --set eps1=0.1 --out z.nc
basins --set kind=single --set omega=0.8 --set eps1=0.1 --axis z=-3:3:150 --axis z_dot=-2:2:150 --out b.nc
attractors --set kind=single --set omega=0.7 --set eps1=0.05 --starts 20000
map {SPUR} --speed 500:3000:100 --torque 60:200:30 --out m.nc
map {SPUR} --speed 500:6000:60 --torque 60:400:20 {ONE_SPRING} --out m.nc
map {SPUR} --speed 500:3000:40 --torque 60:200:16 --starts 8 --out m.nc
map {ISO} --speed 500:3000:60 --torque 1000:9000:10 --out m.nc
map {TWO_STAGE} --speed 500:3000:40 --torque 50:200:6 --out m.nc
bifurcation --set omega=1 --axis eps1=0:0.3:3000 --out b.nc
bifurcation --set omega=1 --axis eps1=0:0.3:400 --mode up --out b.nc
bifurcation train_idler.toml --axis speed=500:3000:200 --out b.nc
rattle train_loose_gear.toml --axis speed=600:3000:40
scatter {SPUR} --vary damping_ratio=0.03:0.1 --speed 1000:4000:20 --samples 128
scatter {SPUR} --vary damping_ratio=0.03:0.1 --vary backlash="0.1:0.2 mm" --speed 1000:4000:10 {ONE_SPRING}
runup {SPUR} --torque 100 --speed 1000:3000 --duration "20 s"
runup {TWO_STAGE} --speed 1000:2000 --duration "5 s"
runup {TWO_STAGE} --speed 500:4000 --duration "10 s" --events
runup train_idler.toml --speed 1000:6000 --duration "20 s" --events
runup {SPUR} --torque 100 --speed 500:3000 --duration "20 s" --events
simulate --set omega=0.05 --set eps1=0.1 --periods 100000 --json
regime --set omega=0.05 --set eps1=0.3
regime train_planetary.toml --set speed=3300 --set torque=20
""".strip().splitlines()


class Told:
    """The price of a command in seconds, when it was told, and how long its trials took."""

    def __init__(self) -> None:
        self._price, self.seconds, self.at, self.trials = prices.price, 0.0, 0.0, 0.0

    def __call__(self, *work: object) -> float:
        begun = time.perf_counter()
        self.seconds = self._price(*work)  # type: ignore[arg-type]
        self.at = time.perf_counter()
        self.trials = self.at - begun
        return self.seconds


def run(line: str) -> str:
    """The exit code and the messages of a command, "" if it succeeded."""
    words = [str(EXAMPLES / word) if word.endswith(".toml") else word for word in shlex.split(line)]
    sys.argv = ["gearchaos", *words]
    stdout, stderr = (io.TextIOWrapper(io.BytesIO()) for _ in range(2))
    try:
        with redirect_stdout(stdout), redirect_stderr(stderr):
            main()
    except SystemExit as end:
        stderr.flush()
        return "" if end.code in (0, None) else f"{end.code}: {stderr.buffer.getvalue()[-300:]!r}"  # type: ignore[attr-defined]
    return ""


def table(only: str) -> None:
    """Run the commands, and print a row for each and the share within a factor of two."""
    told, ratios = Told(), []
    prices.price, prices.TOLD_SECONDS = told, 0.0  # type: ignore[assignment]  # all of them are told
    print("| command | price, s | taken, s | ratio | trials, s |\n| --- | --- | --- | --- | --- |")
    for line in (each for each in COMMANDS if only in each):
        told.at = 0.0
        failed = run(line)
        if failed or not told.at:
            print(f"| {line} | {failed or 'no price'} |", flush=True)
            continue
        taken = time.perf_counter() - told.at
        ratios.append(told.seconds / taken)
        print(f"| {line} | {told.seconds:.1f} | {taken:.1f} | {ratios[-1]:.2f} | {told.trials:.1f} |", flush=True)
    near = sum(0.5 <= ratio <= 2 for ratio in ratios)
    print(f"\nwithin a factor of two: {near} of {len(ratios)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="commands whose line has this text")
    with TemporaryDirectory() as folder:
        from os import chdir

        chdir(folder)
        table(parser.parse_args().only)
