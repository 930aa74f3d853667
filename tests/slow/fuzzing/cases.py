"""Commands with invalid, unusual and extreme arguments, study files and stores, drawn from a seed.

A case is named by its kind (a key of `KINDS`), a seed and a number. To reproduce one, run
``python -m tests.slow.fuzzing.cases KIND SEED NUMBER FOLDER``, then the command it prints in that folder.
"""

import json
import random
import re
import shlex
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests import EXAMPLES

WORDS = (
    "0", "-0", "1", "-1", "2", "7", "0.5", "-0.5", "1e-3", "1e3", "1e-6", "1e6", "-1e6", "1e-14", "1e12", "1e13",
    "1e-30", "1e-31", "nan", "-nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "1e200", "-1e200", "1e-200",
    "1e400", "9" * 20, "9" * 400, "-" + "9" * 400, "9" * 5000, str(2**31), str(2**53 + 1), str(2**63), str(2**64),
    "1000000", "1000000000", "", " ", "abc", "1,5", "0x10", "1_000", "½", "१", "∞", "µ", "%s", "{}", "a" * 3000, ".",
    "..", "/", "-", "--", "é", "日本", "\udce9", "\u202e", "True", "None", "null", "[1, 2]", "1:2:3", "1:2", ":::",
    "=", "==", "1=2", "'", '"', "\\", "\n", "\t", "single", "torsional", "full", "up", "fixed",
)

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 77777, 2**31, 2**63, 2**70, 10**400, 0.5, -0.5, 1e308, -1e308, 5e-324,
    float("nan"), float("inf"), "", "words",
    "NaN", "1", "../..", "a" * 3000, "\u0000", "日本", [], [1], [0, 0], [-1], [None], [1e308, 3],
    {}, {"a": 1}, {"": None},
)

_TOKEN = re.compile(r"[\w.+-]+|\s+|.", re.DOTALL)


def corrupted_text(text: str, rng: random.Random) -> str:
    """A text with one to four of its tokens replaced, duplicated, swapped or deleted."""
    tokens = _TOKEN.findall(text)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if not tokens:
            break
        i, j = rng.randrange(len(tokens)), rng.randrange(len(tokens))
        match rng.randrange(8):
            case 0:
                del tokens[i]
            case 1:
                tokens.insert(i, tokens[j])
            case 2:
                tokens[i], tokens[j] = tokens[j], tokens[i]
            case 3:
                tokens.insert(i, rng.choice(WORDS))
            case _:
                numbers = [k for k, token in enumerate(tokens) if re.match(r"[\w.+-]", token)] or [i]
                tokens[rng.choice(numbers)] = rng.choice(WORDS)
    return "".join(tokens)


def corrupted_bytes(content: bytes, rng: random.Random) -> bytes:
    """Bytes truncated, partly overwritten with noise, replaced by noise, emptied or given a wrong encoding mark."""
    at = rng.randrange(len(content) + 1)
    noise = bytes(rng.randrange(256) for _ in range(rng.randrange(40)))
    return rng.choice((content[:at], content[:at] + noise + content[at + 1 :], noise, b"", b"\xff\xfe" + content))


def corrupted_json(text: str, rng: random.Random) -> str:
    """A JSON document with one value replaced, renamed or deleted."""
    document = json.loads(text)
    places = list(_places(document))
    if not places:
        return json.dumps(rng.choice(VALUES))
    holder, key = rng.choice(places)
    match rng.randrange(5):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[rng.choice(("", "words", "../../x", str(key).upper()))] = holder.pop(key)
        case _:
            holder[key] = rng.choice(VALUES)
    return json.dumps(document)


def _places(document: Any) -> Any:
    """Every value of a document, as its container and its key or index there."""
    keys = {dict: list, list: lambda entries: range(len(entries))}.get(type(document), lambda _: ())(document)
    for key, value in [(key, document[key]) for key in keys]:
        yield document, key
        yield from _places(value)


STORES = ("zones", "attractors", "simulate", "half done")
"""Names of the stores that `make_stores` writes; `store` copies them, from ``NAME.zarr`` in the parent folder."""

_NAMES = (
    "omega", "zeta", "J1", "J2", "q1", "q2", "beta1", "beta2", "mu1", "mu2", "kappa1", "kappa2", "zeta_support1",
    "zeta_support2", "chi1", "chi2", "contact_ratio", "eps1", "eps2", "theta1", "eps64", "c1", "alpha1", "x1",
    "x1_dot", "z", "z_dot", "y1", "q0", "J", "beta", "mu", "kappa", "zeta_support", "chi0", "kind", "gearpair.speed",
    "gearpair.M10", "nonsense",
)

_COMMANDS = """
simulate --periods 3
simulate --periods 2 --transient 5 --json
simulate --periods 2 --samples 4 --out o.nc
simulate pair.toml --physical --periods 2 --json
simulate --set kind=full --set beta1=0.02 --periods 3 --json
regime
regime --json
regime --set kind=single --json
regime --set kind=full --set kappa1=0.4 --json
regime pair.toml --json
attractors --starts 3 --json
attractors --starts 2 --seed 4
attractors --starts 2 --sweep omega=0.9:1.1:2
attractors --starts 2 --kicks 1 --json
attractors --starts 2 --out a.nc
bifurcation --axis eps1=0:0.2:3 --points 4 --out b.nc --json
bifurcation --axis omega=0.5:1:3 --points 2 --mode up --out b.nc
bifurcation --axis x1=-1:1:2 --points 0 --out b.nc
zones --axis omega=0.5:1:3 --axis eps1=0:0.2:2 --out z.nc --json
zones --axis q0=0:1:2 --axis x1=0:1:2 --out z.nc
zones --axis omega=0.5:1:2 --axis eps1=0:0.2:2 --starts 2 --out z.nc
zones --axis zeta=0:0.1:3 --axis J=1:2:3 --refine 2 --out z.nc
zones pair.toml --axis omega=0.5:1:2 --axis eps1=0:0.2:2 --out z.nc --physical
basins --set kind=single --axis z=-3:3:3 --axis z_dot=-2:2:3 --out b.nc --json
basins --axis x1=-3:3:2 --axis x1_dot=-2:2:2 --out b.nc
info nowhere.zarr
plot nowhere.zarr
plot .
export nowhere.zarr --out e.nc
run nowhere.toml --out r.zarr
--version
regime --help
nonsense
""".strip().splitlines()

_NO_FIGURES = ("0", "16", "-1", "x", "1,,2", "", "1.5", "nan", "9" * 5000, "½", "\udce9")


def command_line(rng: random.Random, folder: Path) -> list[str]:
    """A valid command with some arguments corrupted, or with parameters of unusual size."""
    shutil.copy(EXAMPLES / "physical_pair.toml", folder / "pair.toml")
    if rng.random() < 0.02:  # an invalid list of figures: a valid one would take long
        return ["paper", "--out", "r", "--quality", "draft", "--figures", rng.choice(_NO_FIGURES)]
    command = shlex.split(rng.choice(_COMMANDS))
    for _ in range(rng.choice((0, 1, 1, 2, 3))):
        command += ["--set", f"{rng.choice(_NAMES)}={rng.choice(WORDS) if rng.random() < 0.4 else _odd(rng)}"]
    for _ in range(rng.choice((0, 0, 0, 1, 2))):
        i = rng.randrange(len(command) > 1, len(command))
        match rng.randrange(6):
            case 0 if i:
                del command[i]
            case 1:
                command.insert(i, rng.choice(command))
            case 2:
                command[i] = rng.choice(WORDS)
            case _:
                command[i] = corrupted_text(command[i], rng)
    return command


def _odd(rng: random.Random) -> str:
    return f"{rng.choice((1, 1, 1, -1)) * 10 ** rng.uniform(*rng.choice(((-2, 2), (-7, 7), (-30, 12)))):.3g}"


_TORSIONAL = ("J", "J1", "J2", "beta", "beta1", "beta2")
_LATERAL = ("mu", "mu1", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support2")
_OWN = {"single": ("z", "z_dot"), "torsional": ("x1", "x1_dot", *_TORSIONAL), "full": ("y1", *_TORSIONAL, *_LATERAL)}
_SHARED = ("omega", "zeta", "q0", "q1", "eps1", "eps2", "theta1", "chi1", "chi2", "contact_ratio")
_SPANS = {"contact_ratio": (0.0, 0.3), "chi1": (-4, 4), "chi2": (-4, 0), "omega": (-3, 6), "theta1": (-2, 12)}
_STUDIES = (
    "simulate --periods 4 --json", "simulate --periods 4 --samples 3 --out s.nc", "regime --json", "regime",
    "attractors --starts 3 --json", "bifurcation --axis eps3=0:1:2 --points 2 --out b.nc --json",
    "zones --axis eps3=0:1:2 --axis eps4=0:1:2 --out z.nc --json",
)


def operating_point(rng: random.Random, folder: Path) -> list[str]:
    kind = rng.choice(tuple(_OWN))
    command = [*shlex.split(rng.choice(_STUDIES)), "--set", f"kind={kind}"]
    for name in rng.sample(_SHARED + _OWN[kind], rng.choice((1, 2, 3, 5))):
        low, high = _SPANS.get(name, rng.choice(((-2, 2), (-6, 6), (-30, 12))))
        command += ["--set", f"{name}={10 ** rng.uniform(low, high):.6g}"]
    return command


_BUDGET = "\n[classification]\nlongest_transient = 400\ndoublings = 1\naveraging_periods = 16\n"


def study_file(rng: random.Random, folder: Path) -> list[str]:
    """A corrupted study file, made from an example with few cells, and a command that reads it."""
    text = rng.choice(sorted(EXAMPLES.glob("*.toml"))).read_text()
    kind = (re.search(r'kind = "(simulate|bifurcation|zones|basins|attractors)"', text) or ["", "regime"])[1]
    text = re.sub(r':(\d+)"', ':3"', text)
    if kind != "simulate" and rng.random() < 0.5:
        text += _BUDGET
    content = corrupted_text(text, rng).encode(errors="surrogateescape")
    if rng.random() < 0.1:
        content = corrupted_bytes(content, rng)
    if rng.random() < 0.02:
        content += b"a = " + b"[" * 3000 + b"]" * 3000
    (folder / "s.toml").write_bytes(content)
    out = [] if kind == "regime" else ["--out", "o.nc"]
    own = [kind, "s.toml", *out, *([] if kind in ("simulate",) else ["--json"])]
    return rng.choice((own, own, ["run", "s.toml", "--out", "o.zarr"], ["regime", "s.toml"]))


_NO_NUMBERS = ("77777", "-1", "01", "1e3", "9" * 30, "words", "²")


def store(rng: random.Random, folder: Path) -> list[str]:
    """A copy of a store with one or two files corrupted, and a command that reads it."""
    name = rng.choice(STORES)
    shutil.copytree(folder.parent / f"{name}.zarr", folder / "m.zarr")
    for _ in range(rng.choice((1, 1, 1, 2))):
        _corrupt_file(rng, folder / "m.zarr")
    study = str(folder.parent / f"{name}.toml")
    return rng.choice((
        ["info", "m.zarr"], ["info", "m.zarr", "--json"], ["info", "m.zarr", "--json"], ["plot", "m.zarr"],
        ["export", "m.zarr", "--out", "e.nc"], ["export", "m.zarr", "--out", "e.nc"],
        ["run", study, "--out", "m.zarr"], ["run", study, "--out", "m.zarr", "--json"],
    ))


def _corrupt_file(rng: random.Random, path: Path) -> None:
    files = sorted(p for p in path.rglob("*") if p.is_file())
    state = [p for p in files if "run" in p.parts] or files
    file = rng.choice(state if rng.random() < 0.6 else files)
    match rng.randrange(10):
        case 0:
            file.unlink()
            rng.choice((file.mkdir, lambda: file.symlink_to("nowhere"), lambda: None))()
        case 1 | 2:
            folder = path / "run" / rng.choice(("blocks", "tiles", "tiles/0", "failed"))
            folder.mkdir(parents=True, exist_ok=True)
            if folder.name != "tiles" or rng.random() < 0.5:
                (folder / rng.choice(_NO_NUMBERS)).write_bytes(file.read_bytes())
            else:
                (folder / rng.choice(_NO_NUMBERS)).mkdir()
        case 3 | 4 if file.suffix == ".json":
            file.write_text(corrupted_text(file.read_text(), rng), errors="surrogateescape")
        case _ if file.suffix == ".json":
            file.write_text(_corrupted_document(file.read_text(), rng))
        case _:
            file.write_bytes(corrupted_bytes(file.read_bytes(), rng))


def _corrupted_document(text: str, rng: random.Random) -> str:
    try:
        return corrupted_json(text, rng)
    except ValueError:  # no longer JSON, since it was corrupted before
        return text


KINDS: dict[str, Callable[[random.Random, Path], list[str]]] = {
    "command_line": command_line, "operating_point": operating_point, "study_file": study_file, "store": store,
}


def make(kind: str, seed: int, number: int, folder: Path) -> list[str]:
    """Write the files of a case to a folder and return its command."""
    return KINDS[kind](random.Random(f"{kind} {seed} {number}"), folder)


def make_stores(folder: Path, run: Callable[[list[str]], None]) -> None:
    """Write `STORES` and their study files to a folder; ``run`` executes a gearchaos command there."""
    axes = '[study]\nkind = "zones"\nx = "omega=0.5:1:4"\ny = "eps1=0:0.2:4"\n'
    studies = {
        "zones": axes, "half done": axes, "simulate": '[study]\nkind = "simulate"\nperiods = 3\nsamples = 4\n',
        "attractors": '[study]\nkind = "attractors"\nstarts = 4\n',
    }
    for name, text in studies.items():
        (folder / f"{name}.toml").write_text(text)
        tile = ["--shard", "1/2"] if name == "half done" else []
        run(["run", f"{name}.toml", "--out", f"{name}.zarr", "--tile", "4", *tile])


if __name__ == "__main__":
    place = Path(sys.argv[4])
    place.mkdir(parents=True, exist_ok=True)
    print(shlex.join(["gearchaos", *make(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), place)]))
