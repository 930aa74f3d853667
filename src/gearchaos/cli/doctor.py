"""The command that checks an installation."""

from __future__ import annotations

from dataclasses import asdict

import typer

from gearchaos.cli.options import Json, app
from gearchaos.cli.output import print_json

FAILED = 1
"""Exit code if something that is required, or an optional part that is installed, does not work."""

_WORDS = {"ok": "ok", "failed": "FAILED", "missing": "missing"}


@app.command(rich_help_panel="Install")
def doctor(json_out: Json = False) -> None:
    """Check this installation: packages, folders, kernels, a known orbit, optional parts; say what to mend."""
    from gearchaos.installation.checks import Check, checks

    found: list[Check] = []
    for check in checks():
        found.append(check)
        if not json_out:
            print(f"{_WORDS[check.status]:8} {check.name}: {check.detail}", flush=True)
            if check.mend:
                print(f"         → {check.mend}", flush=True)
    failed = [check.name for check in found if check.status == "failed"]
    if json_out:
        print_json({"ok": not failed, "checks": [asdict(check) for check in found]})
    else:
        print(f"failed: {', '.join(failed)}" if failed else "all that is required works")
    raise typer.Exit(FAILED if failed else 0)
