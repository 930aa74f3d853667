"""The commands of an installation: its version, example study files, compiled kernels, and a check of what works."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from gearchaos import files
from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, app
from gearchaos.cli.output import print_json
from gearchaos.errors import InputError, unknown_name
from gearchaos.files import check_target, read_bytes, write_bytes

FAILED = 1
"""Exit code if something that is required, or an optional part that is installed, does not work."""

@app.command(rich_help_panel="Install")
def examples(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Where they are written; made if it does not exist.")
    ] = Path("examples"),
) -> None:
    """Write the study files that the manual uses: figures of the paper, and gear pairs."""
    if out.exists() and not out.is_dir():
        raise InputError("--out", "must be a folder", str(out), "Choose another name.")
    out.mkdir(parents=True, exist_ok=True)
    contents = {out / source.name: source.read_bytes() for source in files.examples()}
    for file, content in contents.items():
        check_target("--out", file)
        if file.exists() and read_bytes(file) != content:  # its user may have changed it
            raise InputError("--out", "must not have other files of the same names", str(file),
                             "Rename it, or choose another folder.")
    for file, content in contents.items():
        write_bytes(file, content)
    say(f"wrote {len(contents)} files into {out}")


@app.command(rich_help_panel="Install")
def warmup(
    damping_law: Annotated[
        str | None, typer.Option(metavar="LAW", help="Of models with this damping law alone.")] = None,
) -> None:
    """Compile all kernels now, so that no later command has to."""
    from gearchaos.model import DAMPING_LAWS
    from gearchaos.studies.core.warmup import MODELS
    from gearchaos.studies.core.warmup import warmup as run

    if damping_law is not None and damping_law not in DAMPING_LAWS.own:
        raise unknown_name("--damping-law", damping_law, DAMPING_LAWS.own)
    say(f"compiling the kernels of models with {min(MODELS)} to {max(MODELS)} coordinates; this happens once")
    for dimension, law, seconds in run() if damping_law is None else run(damping_laws=(damping_law,)):
        say(f"{dimension} coordinates, damping {law}: ready after {seconds:.0f} s")


@app.command(rich_help_panel="Install")
def doctor(json_out: Json = False) -> None:
    """Check this installation: packages, folders, kernels, a known orbit, optional parts; say what to mend."""
    from gearchaos.installation import Check, checks

    found: list[Check] = []
    for check in checks():
        found.append(check)
        if not json_out:
            word = "FAILED" if check.status == "failed" else check.status
            print(f"{word:8} {check.name}: {check.detail}", flush=True)
            if check.mend:
                print(f"         → {check.mend}", flush=True)
    failed = [check.name for check in found if check.status == "failed"]
    if json_out:
        print_json({"ok": not failed, "checks": [asdict(check) for check in found]})
    else:
        print(f"failed: {', '.join(failed)}" if failed else "all that is required works")
    raise typer.Exit(FAILED if failed else 0)


def print_version(verbose: bool, json_out: bool) -> None:
    """Print the version on stdout; ``verbose`` adds what a report of an error should say of the installation."""
    from importlib.metadata import version

    from gearchaos.installation import report

    found: dict[str, Any] = report() if verbose else {"gearchaos": version("gearchaos")}
    if json_out:
        print(json.dumps(found))
        return
    if not verbose:
        print(f"gearchaos {found['gearchaos']}")
        return
    cpu, cache = found["processor"], found["kernel_cache"]
    fma = "with" if cpu["fma"] else "without"
    rows = {
        "gearchaos": found["gearchaos"], "Python": found["python"], "platform": found["platform"],
        "processor": f"{cpu['name']}, {cpu['instruction_set']} ({cpu['vector_bits']} bits), {fma} fused multiply-add",
        "cores": str(found["cores"]), "memory": f"{found['memory'] / 2**30:.1f} GiB",
        "kernel cache": f"{cache['folder']} ({cache['kernels']} kernels, {cache['bytes'] / 2**20:.0f} MiB)",
        **{f"${name}": value for name, value in found["environment"].items()},
        **{name: value or "missing" for name, value in found["packages"].items()},
    }
    width = max(map(len, rows))
    print("\n".join(f"{name:{width}}  {value}" for name, value in rows.items()))
