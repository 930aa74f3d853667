"""What `gearchaos --version` prints."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any


def print_version(verbose: bool, json_out: bool) -> None:
    """Print the version on stdout; ``verbose`` adds what a report of an error should say of the installation."""
    from gearchaos.installation.report import report

    found = report() if verbose else {"gearchaos": version("gearchaos")}
    if json_out:
        print(json.dumps(found))
    elif verbose:
        print("\n".join(_lines(found)))
    else:
        print(f"gearchaos {found['gearchaos']}")


def _lines(found: dict[str, Any]) -> list[str]:
    """A report of the installation as lines of text."""
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
    return [f"{name:{width}}  {value}" for name, value in rows.items()]
