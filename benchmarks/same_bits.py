"""Whether a change of the code changed a result: every array, certificate, printed text and pixel of a fixed list.

    python benchmarks/same_bits.py OUT.npz [--pictures]      computes the list with the gearchaos that it imports
    python benchmarks/same_bits.py --compare OLD.npz NEW.npz  names what differs, exit code 1 if anything does

It proves nothing of whether the results are right: `tests/` does.
"""

import argparse
import contextlib
import io
import itertools
import json
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
GALLERY = EXAMPLES.parent / "docs" / "gallery"


def models() -> dict[str, object]:
    """Every kind of model with every kind of stiffness."""
    import gearchaos as gc

    stiffness = {
        "two-level": None,
        "harmonic": gc.HarmonicStiffness(amplitudes=(0.2, 0.05), phases=(0.3, 1.1)),
        "stepped": gc.SteppedStiffness(levels=(1.2, 0.9, 0.75), starts=(0.1, 0.5, 0.8)),
    }
    found = {}
    for kind, (name, shape) in itertools.product(("single", "torsional", "full"), stiffness.items()):
        extra = {} if shape is None else {"stiffness": shape}
        more = {"zeta": 0.05} if kind == "single" else {}
        found[f"{kind} {name}"] = gc.MeshModel.of(kind=kind, q0=0.1, eps1=0.1, omega=0.9, **more, **extra)
    return found


def text(proof) -> str:
    return json.dumps({k: v for k, v in proof.to_dict().items() if k != "seconds"}) if proof else repr(proof)


def state_axes(model) -> tuple[str, str]:
    return ("z=-1:1:10", "z_dot=-1:1:8") if model.kind == "single" else ("x1=-1:1:10", "x1_dot=-1:1:8")


def in_python(keep) -> None:
    """Arrays of every study for every model; `keep` takes a name and what makes a Dataset or a value."""
    import gearchaos as gc
    from gearchaos.studyfile import load_design

    for name, m in models().items():
        keep(f"{name} simulate", lambda model=m: gc.simulate(model, 40, transient=20, samples=32))
        keep(f"{name} regime", lambda model=m: repr(gc.regime(model)))
        keep(f"{name} attractors", lambda model=m: gc.attractors(model, 32, kicks=4))
        keep(f"{name} bifurcation", lambda model=m: gc.bifurcation(model, "omega=0.8:1.8:24", mode="up"))
        keep(f"{name} zones", lambda model=m: gc.zones(model, "omega=0.8:1.8:10", "eps1=0.02:0.2:8", starts=2))
        keep(f"{name} basins", lambda model=m: gc.basins(model, *state_axes(model)))
        keep(f"{name} branch", lambda model=m: gc.branch(model, "omega=0.6:1.2", longest_step=0.1))
    single = gc.MeshModel.of(kind="single", q0=0.1, eps1=0.05, omega=2.3, zeta=0.025)
    keep("branch to the end", lambda: gc.branch(single, "omega=0.3:2.4"))
    torsional = gc.MeshModel.of(q0=0.1, eps1=0.206)
    keep("cascade", lambda: gc.branch(torsional, "eps1=0:0.3", cascade=2))
    keep("flip curve", lambda: gc.curve(torsional, "flip", "omega=0.8:2", "eps1=0.02:0.3", max_points=40))
    keep(
        "skeleton",
        lambda: gc.skeleton(torsional, "omega=1.2:1.8", "eps1=0.05:0.2", period=2, lines=(2, 2), starts=1, workers=1),
    )
    keep("manifolds", lambda: gc.manifolds(single, period=3, length=4))
    keep(
        "edge state", lambda: repr(gc.edge_state(single, {"z": 0.5, "z_dot": 0.0}, {"z": -2.0, "z_dot": 1.0}, rounds=8))
    )
    keep("chaos", lambda: text(gc.prove_chaos(gc.MeshModel.of(q0=0.1, eps1=0.12, omega=1.6))))
    keep("box", lambda: text(gc.prove_box(gc.MeshModel.of(q0=0.1, eps1=0.1, omega=0.9), {"omega": 1e-4})))
    keep(
        "event",
        lambda: text(gc.prove_event(gc.branch(gc.MeshModel.of(q0=0.1, eps1=0.05), "eps1=0.05:0.1").isel(event=0))),
    )
    keep("refined", lambda: gc.zones(torsional, "omega=0.8:1.8:8", "eps1=0.02:0.2:8", refine=4))
    design = load_design(EXAMPLES / "spur_50_50.toml")
    keep("speeds to avoid", lambda: repr(gc.speeds_to_avoid(design, "speed=500:8000:16", "100 N*m", starts=4).windows))
    keep("dynamic factor", lambda: gc.dynamic_factor(design, "speed=500:8000:8", "100 N*m"))
    keep("operating map", lambda: gc.physical(gc.operating_map(design, "speed=500:8000:8", "torque=50:150:3")))


COMMANDS = [
    *(f"gear {e}{end}" for e in ("spur_50_50", "fzg_type_c", "iso_tr_6336_30_example_1") for end in ("", " --json")),
    "gear spur_50_50 --speed 500:8000:20 --torque 100",
    "gear fzg_type_c --speed 500:4000:12 --factor 1.4",
    "regime physical_pair --json",
    "regime spur_50_50",
    "regime fig05 --prove --json",
    "regime fig02",
    "simulate physical_pair --physical --periods 20 --json",
    "simulate fig06 --periods 10",
    "attractors fig03 --starts 16",
    "attractors fig03 --starts 16 --json",
    "bifurcation fig04 --axis omega=0.8:1.6:16 --json --out OUT.nc --plot OUT.png",
    "zones fig02 --axis omega=0.4:2:10 --axis eps1=0:0.3:8 --out OUT.nc --plot OUT.png",
    "zones physical_pair --physical --axis omega=0.2:1.6:10 --axis q0=0.02:0.3:8 --out OUT.nc --plot OUT.png",
    "zones fig02 --axis omega=0.4:2:10 --axis eps1=0:0.3:8 --prove --out OUT.nc --json",
    "map spur_50_50 --speed 500:8000:10 --torque 20:400:6 --out OUT.nc --plot OUT.png",
    "basins fig09 --axis x1=-1:1:10 --axis x1_dot=-1:1:8 --out OUT.nc --plot OUT.png",
    "branch --set q0=0.1 --set eps1=0.1 --axis omega=0.8:1.2 --json --out OUT.nc --plot OUT.png",
    "branch --set q0=0.1 --set eps1=0.1 --axis omega=0.8:1.2",
    "run fig02 --axis omega=0.4:2:10 --axis eps1=0:0.3:8 --out OUT.store",
    "curve --set q0=0.1 --set eps1=0.206 --event flip --axis omega=0.8:2 --axis eps1=0.02:0.3 --max-points 30 --json",
    "script fig02 --for scipy",
    "script fig10 --for julia",
    "--help",
    *(
        f"{c} --help"
        for c in ("gear", "map", "regime", "zones", "branch", "curve", "skeleton", "run", "paper", "explore")
    ),
]


def in_commands(keep, folder: Path) -> None:
    """What the commands print, write and draw."""
    from typer.testing import CliRunner

    from gearchaos.cli import app

    for command in COMMANDS:
        words = [str(EXAMPLES / f"{w}.toml") if (EXAMPLES / f"{w}.toml").is_file() else w for w in command.split()]
        words = [str(folder / w) if w.startswith("OUT.") else w for w in words]
        for left in folder.iterdir():
            shutil.rmtree(left) if left.is_dir() else left.unlink()
        result = CliRunner().invoke(app, words)
        text = f"{result.exit_code}\n{result.stdout}\n{result.stderr if result.exit_code else ''}"
        keep(f"{command} | printed", text.replace(str(folder), "").replace(str(EXAMPLES), ""))
        for file in sorted(folder.iterdir()):
            keep_file(keep, f"{command} | {file.name}", file)


def keep_file(keep, name: str, file: Path) -> None:
    import matplotlib.image

    import gearchaos as gc

    if file.suffix in (".nc", ".store"):
        keep(name, gc.load(file))
    elif file.suffix == ".png":
        keep(name, matplotlib.image.imread(file))


def certificates(keep) -> None:
    """Certificates of orbits as text, or why there is none."""
    import gearchaos as gc

    for name, model in models().items():
        keep(f"certificate {name}", lambda model=model: text(gc.prove(model)))


def pictures(keep) -> None:
    """All figures of the gallery, drawn by its scripts."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for script in sorted(GALLERY.glob("plot_*.py")):
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(script.read_text(), script.name, "exec"), {"__name__": "__main__"})
        for number in plt.get_fignums():
            figure = plt.figure(number)
            figure.canvas.draw()
            keep(f"{script.stem} {number}", np.asarray(figure.canvas.buffer_rgba()))
        plt.close("all")


def flattened(name: str, value) -> dict[str, np.ndarray]:
    """A Dataset's variables, or one value, as arrays."""
    if hasattr(value, "variables"):
        return {f"{name} | {v}": np.asarray(value[v]) for v in value.variables}
    return {name: np.asarray(value)}


def compute(out: Path, drawn: bool) -> None:
    from gearchaos.errors import InputError

    arrays: dict[str, np.ndarray] = {}

    def keep(name, value):
        if callable(value):
            try:
                value = value()
            except InputError as error:
                value = str(error)
        arrays.update({k: v if v.dtype != object else v.astype(str) for k, v in flattened(name, value).items()})

    with tempfile.TemporaryDirectory() as folder:
        for step in (in_python, lambda k: in_commands(k, Path(folder)), certificates, *((pictures,) if drawn else ())):
            step(keep)
            print(len(arrays), "arrays", flush=True)
    np.savez_compressed(out, **{k.replace("/", "÷"): v for k, v in arrays.items()})


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()


def compare(old: Path, new: Path) -> int:
    with np.load(old) as a, np.load(new) as b:
        lost, added = sorted(set(a) - set(b)), sorted(set(b) - set(a))
        changed = [k for k in a if k in b and not same(a[k], b[k])]
        for words, names in (("lost", lost), ("added", added), ("changed", changed)):
            for name in names:
                print(f"{words}: {name}")
        print(f"{len(a.files)} arrays, {len(changed)} changed, {len(lost)} lost, {len(added)} added")
    return int(bool(lost or added or changed))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--compare", action="store_true")
    parser.add_argument("--pictures", action="store_true", help="the gallery too: minutes more")
    asked = parser.parse_args()
    if asked.compare:
        return compare(*asked.files)
    compute(asked.files[0], asked.pictures)
    return 0


if __name__ == "__main__":
    sys.exit(main())
