"""The command ``gearchaos``, and ``python -m gearchaos``; Ctrl-C while it is imported ends it with one message."""

from __future__ import annotations

import os
import signal
from typing import NoReturn


def main() -> None:
    """Import all commands and run the one that is asked for; from then on `gearchaos.cli` handles signals."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    from gearchaos.cli import main as commands

    commands()


def _end(*_: object) -> NoReturn:
    """End the process at once; an exception would be lost in what is being imported."""
    os.write(2, b"interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    main()
