"""Messages on stderr during a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from gearchaos.paper import proofs
from gearchaos.paper.claims import Claim
from gearchaos.paper.settings import FigureSettings


class Log:
    """Writes messages to stderr if ``on``."""

    def __init__(self, on: bool) -> None:
        self._console = Console(stderr=True, quiet=not on, highlight=False)

    def figure(self, figure: FigureSettings) -> None:
        """The computation of a figure begins."""
        self._console.print(f"[bold]Figure {figure.number}[/bold]  {figure.title}")

    def finishing(self) -> None:
        """All figures are computed."""
        self._console.print("[bold]Last statements and drawings[/bold]")

    def end(self, folder: Path, claims: Sequence[Claim], failed: Sequence[Claim]) -> int:
        """Print how many claims have each verdict, which failed, and the path of the report; return the exit code."""
        tally = ", ".join(f"{count} {verdict}" for verdict, count in Counter(c.verdict for c in claims).items())
        self._console.print(f"{len(claims)} statements checked: {tally or 'none'}.")
        if proved := proofs.summary(claims):
            self._console.print(proved, markup=False)
        for claim in failed:
            self._console.print(f"[bold red]{claim.id}: {claim.verdict}[/bold red]  {claim.statement}")
        self._console.print(f"Report: {folder / 'index.html'}")
        return 1 if failed else 0
