"""The table of a store: its state, and what is missing."""

from __future__ import annotations

import time
from datetime import timedelta
from typing import Any

from rich.table import Table

from gearchaos.cli.tables.text import print_table


def print_run(found: dict[str, Any]) -> None:
    """Print the progress of a run.

    ``found`` is from `gearchaos.store.reading.info.summary`; its ``pieces`` are work items.
    """
    table = Table(show_header=False)
    table.add_row("study", found["study"])
    table.add_row("state", _state(found))
    lost, share, missing = found["tiles_lost"], found["pieces_done"] / found["pieces"], found["missing"]
    whole = f"; {found['tiles_done']} are whole" if lost else ""
    done = f"{found['tiles_done'] + lost} of {found['tiles']}"
    table.add_row("tiles done", f"{done}{whole} ({share:.1%} of the work items)")
    if lost:
        from gearchaos.store.reading.missing_words import listed

        arrays = listed(missing["arrays"])
        table.add_row("to be computed again", f"{lost} tiles that were done: files of {arrays} are missing or damaged")
    if found["pieces_per_second"] is not None and found["seconds_left"]:
        table.add_row("rate", f"{found['pieces_per_second']:,.0f} work items a second")
        table.add_row("left, at that rate", f"{timedelta(seconds=round(found['seconds_left']))}")
    table.add_row("computed", f"{timedelta(seconds=round(found['seconds']))}, added up over all workers")
    table.add_row("machines", ", ".join(found["machines"]) or "none yet")
    table.add_row("on disk", f"{found['bytes'] / 1e6:,.1f} MB")
    for number, error in found["failed"].items():
        table.add_row(f"tile {number} failed", error)
    if found["tiles_done"] and missing["pieces"]:
        table.add_row("without results,\nby position from 0", "\n".join(
            ", ".join(f"{name} {first}:{stop}" for name, (first, stop) in block.items())
            for block in missing["pieces"]))
    if missing["files"]:
        more = missing["file_count"] - len(missing["files"])
        table.add_row("missing or damaged", "\n".join([*missing["files"], *[f"and {more} more files"] * (more > 0)]))
    for name, writer in ({} if found["finished"] else found["writers"]).items():
        if not writer["ended"]:
            table.add_row(f"writer {name}", _activity(writer))
    print_table(table)


def _state(found: dict[str, Any]) -> str:
    """Whether a run is finished or running, and otherwise the command that continues it."""
    store, writers, damaged = found["store"], found["writers"], bool(found["missing"]["files"])
    if found["finished"]:
        return "finished"
    if any(writer["running"] for writer in writers.values()):
        return "running"
    if found["tiles_done"] + found["tiles_lost"] == found["tiles"]:
        return f"{'damaged' if damaged else 'not finished'}; to continue: gearchaos finish {store}"
    shard = " --shard I/N" if writers and "all" not in writers else ""
    return f"not finished; to continue: gearchaos run STUDY.toml --out {store}{shard}"


def _activity(writer: dict[str, Any]) -> str:
    """Whether a writer that has not ended is running."""
    if writer["running"] is None:
        return "has begun and not ended; its lock does not tell whether it is running"
    if not writer["running"]:
        return "not running; it stopped before its end, e.g. since it was killed"
    return f"running, last entry in its journal {timedelta(seconds=max(0, round(time.time() - writer['at'])))} ago"
