"""The command that verifies the checksums of a store."""

from __future__ import annotations

from dataclasses import asdict

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, app
from gearchaos.cli.output import print_json
from gearchaos.cli.runs import StorePath

DAMAGED = 1
"""Exit code if anything is damaged."""


@app.command()
def check(store: StorePath, json_out: Json = False) -> None:
    """Verify all checksums of a store; exit code 0 if it is undamaged, 1 if anything is damaged."""
    from gearchaos.store.check import check as verify
    from gearchaos.store.store import open_store

    found = verify(open_store(store))
    for file in found.files:
        say(f"damaged: {file}")
    if found.tiles:
        say(f"tiles to be computed again: {', '.join(map(str, found.tiles))}")
    if found.noted:
        say("The next run repairs it.")
    if json_out:
        print_json({"store": str(store), "damaged": bool(found.files), **asdict(found)})
    elif not found.files:
        print(f"{store}: all checksums are right")
    raise typer.Exit(DAMAGED if found.files else 0)
