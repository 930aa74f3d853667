"""The command that compiles all kernels."""

from __future__ import annotations

from gearchaos.cli.errors import say
from gearchaos.cli.options import app


@app.command()
def warmup() -> None:
    """Compile all kernels now, so that no later run has to."""
    from gearchaos.studies.warmup import MODELS
    from gearchaos.studies.warmup import warmup as run

    say(f"compiling the kernels of models with {min(MODELS)} to {max(MODELS)} coordinates; this happens once")
    for dimension, seconds in run():
        say(f"{dimension} coordinates: ready after {seconds:.0f} s")
