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

_NAMED = 20
"""Largest number of ranges of tiles that are named."""


@app.command()
def check(store: StorePath, json_out: Json = False) -> None:
    """Verify all checksums of a store; exit code 0 if it is undamaged, 1 if anything is damaged.

    Damaged results are noted in the store, unless a run writes to it or it is read-only: the next run, or gearchaos
    finish, computes them again.
    """
    from gearchaos.store.reading.check import check as verify
    from gearchaos.store.store import open_store

    opened = open_store(store)
    found = verify(opened)
    for file in found.files:
        say(f"damaged: {file}")
    if found.tiles:
        say(f"tiles to be computed again, {len(found.tiles)} in all: {_ranges(found.tiles)}")
    if found.tiles and not found.noted:
        say("This is not noted in the store, since a run writes to it or it is read-only.")
    elif found.files:
        say(f"To repair it: {opened.repair_command(opened.progress())}")
    if json_out:
        print_json({"store": str(store), "damaged": bool(found.files), **asdict(found)})
    elif not found.files:
        print(f"{store}: all checksums are right")
    raise typer.Exit(DAMAGED if found.files else 0)


def _ranges(tiles: list[int]) -> str:
    """Numbers of tiles in ascending order, consecutive ones as "3–7", of which the first ranges are named."""
    from gearchaos.store.reading.missing import consecutive

    ranges = [str(first) if first == last else f"{first}–{last}" for first, last in consecutive(tiles)]
    more = [f"and {len(ranges) - _NAMED} more ranges"] if len(ranges) > _NAMED else []
    return ", ".join([*ranges[:_NAMED], *more])
