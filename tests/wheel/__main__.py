"""Try the wheel in an empty environment, outside the repository: ``python -m tests.wheel dist [--slow]``.

Every command runs in an empty folder, with caches of its own. A module in that environment (`guard.py`) ends a command
that opens a file of the repository or connects to another host.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
import venv
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests import ROOT

TIME_LIMIT = 600
"""Seconds that one command may take; the first ones compile the kernels."""

DESIGN = """
[design]
teeth = [50, 50]
module = "3 mm"
pressure_angle = "20 deg"
face_width = "20 mm"
material = "steel"
bore = ["30 mm", "30 mm"]
quality = { standard = "ISO 1328-1:1995", grade = 6 }
backlash = { value = "0.12 mm", of = "line of action, total" }
damping_ratio = 0.05
stiffness = "ISO 6336-1"
transmission_error = "from quality"
[operation]
speed = "1500 rpm"
torque = "300 N*m"
"""
STUDY = """
[model]
omega = 1.0
[study]
kind = "zones"
x = "omega=0.9:1.1:4"
y = "eps1=0:0.02:3"
"""
FIRST = ("--version", "--version --verbose --json", "doctor")
"""What is tried first; the last of these compiles the kernels."""

CHAINS = (
    (
        "regime --set omega=0.8 --set q0=0.1 --set eps1=0.1 --prove --certificate c.json --plot r.svg",
        "verify c.json --script v.py",
        "simulate --set omega=0.8 --periods 5 --samples 20 --out s.nc", "plot s.nc --out s.png",
        "attractors --set omega=0.8 --set eps1=0.1 --starts 8 --out a.nc",
        "branch --set omega=0.8 --set eps1=0.1 --axis eps1=0.09:0.11 --out branch.nc --plot branch.png --json",
        "curve --set omega=0.8 --set eps1=0.1 --event fold --axis eps1=0.02:0.14 --axis omega=0.79:0.81 --json",
        "examples", "gear examples/spur_50_50.toml --json",
        "gear design.toml --out sheet.html --json", "gear design.toml --speed 1000:6000:6 --plot factor.png",
    ),
    (
        "bifurcation --set omega=1 --axis eps1=0.1:0.2:4 --points 16 --out bif.nc --plot bif.png --json",
        "zones --axis omega=0.5:2:6 --axis eps1=0:0.3:4 --out z.nc --plot z.pdf --json",
        "plot z.nc --colour contact --out contact.png",
        "basins --set kind=single --set omega=0.8 --set eps1=0.1 --axis z=-3:3:5 --axis z_dot=-2:2:5 --out b.nc",
        "run study.toml --out z.zarr --tile 4", "info z.zarr", "plot z.zarr --out zarr.png", "export z.zarr --out e.nc",
        "map design.toml --speed 1000:6000:4 --torque 100:300:3 --out map.nc --plot map.png --json",
        "script --set omega=0.8 --out script.py",
        "script design.toml --for julia --set damping_law=always --set design.load_sharing=prescribed --out script.jl",
        "--show-completion bash", "doctor --json",
    ),
)
"""What is tried then, two commands at the same time; some read what others of their chain wrote."""

SLOW = (
    "warmup", "skeleton --axis omega=0.9:1.1:3 --axis eps1=0.1:0.2:2 --period 1 --lines 2 1 --starts 1 --out k.nc",
    "prove-chaos --set omega=1.6 --set eps1=0.12 --json", "paper --quality draft --out report",
)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("dist", type=Path, help="folder of the wheel")
    options.add_argument("--slow", action="store_true", help="the commands that take minutes, and no others")
    given = options.parse_args()
    (wheel,) = given.dist.resolve().glob("*.whl")
    with tempfile.TemporaryDirectory(prefix="gearchaos-wheel-") as folder:
        trial = Trial(Path(folder), wheel)
        trial.slow() if given.slow else trial.quick()
    print(f"the wheel works: {wheel.stat().st_size / 1e6:.2f} MB, {time.perf_counter() - trial.begin:.0f} s")


class Trial:
    """An environment with the wheel alone, and an empty folder in which commands run."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        self.begin = time.perf_counter()
        self.python, self.work = folder / "venv" / "bin" / "python", folder / "work"
        self.work.mkdir()
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA", "XDG"))},
            "HOME": str(folder), "GUARDED": str(ROOT), "MPLBACKEND": "Agg",
        }
        venv.create(folder / "venv", with_pip=True)
        install = [str(self.python), "-m", "pip", "install", "--quiet", "--constraint", str(ROOT / "constraints.txt")]
        subprocess.run([*install, f"{wheel}[app,proof]"], check=True)
        (packages,) = (folder / "venv" / "lib").glob("python*/site-packages")
        shutil.copy(Path(__file__).parent / "guard.py", packages / "sitecustomize.py")
        self.say("installed")

    def say(self, what: str) -> None:
        print(f"{time.perf_counter() - self.begin:6.1f} s  {what}", flush=True)

    def run(self, arguments: str) -> str:
        """Run a command, which must succeed; returns its stdout."""
        command = [str(self.python.parent / "gearchaos"), *arguments.split()]
        done = subprocess.run(command, cwd=self.work, env=self.environment, capture_output=True, text=True,
                              timeout=TIME_LIMIT)
        if done.returncode or "Traceback" in done.stderr:
            output = f"{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
            sys.exit(f"gearchaos {arguments}: exit code {done.returncode}\n{output}")
        self.say(f"gearchaos {arguments}")
        return done.stdout

    def quick(self) -> None:
        """Run `FIRST` and `CHAINS`, the help of every command, a script that was written, and the explorer."""
        (self.work / "design.toml").write_text(DESIGN)
        (self.work / "study.toml").write_text(STUDY)
        self.chain(FIRST)
        with ThreadPoolExecutor() as pool:
            list(pool.map(self.chain, CHAINS))
        self.help()
        subprocess.run([str(self.python), "script.py", "2"], cwd=self.work, env=self.environment, check=True,
                       stdout=subprocess.DEVNULL)
        self.explore()

    def chain(self, commands: Iterable[str]) -> None:
        """Run commands one after another."""
        for arguments in commands:
            self.run(arguments)

    def help(self) -> None:
        """Print the help of every command, in one process: each takes half a second to start."""
        code = ("from typer.testing import CliRunner; from gearchaos.cli import app; run = CliRunner().invoke\n"
                "names = [c.name or c.callback.__name__.replace('_', '-') for c in app.registered_commands]\n"
                "assert len(names) > 20\n"
                "for name in names: assert run(app, [name, '--help']).exit_code == 0, name")
        subprocess.run([str(self.python), "-c", code], cwd=self.work, env=self.environment, check=True)
        self.say("--help of every command")

    def explore(self) -> None:
        """Start the explorer, ask for its page, and stop it as Ctrl-C does."""
        command = [str(self.python.parent / "gearchaos"), "explore", "--no-open", "--port", "0"]
        options = {"cwd": self.work, "env": self.environment, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(command, **options) as server:
            try:
                line = next(line for line in server.stderr if line.startswith("explorer at "))
                with urllib.request.urlopen(line.split()[2], timeout=60) as answer:
                    assert answer.status == 200 and b"gearchaos" in answer.read()
                server.send_signal(2)
                assert server.wait(30) == 0, server.returncode
            finally:
                server.kill()
        self.say("gearchaos explore")

    def slow(self) -> None:
        """Run `SLOW`, among them the draft of the report of the paper."""
        self.chain(SLOW)
        assert (self.work / "report" / "index.html").stat().st_size > 100_000


if __name__ == "__main__":
    main()
