"""The command line: commands that write files, and print one JSON document or a table of text."""

# Importing a module adds its commands to the application; --help lists its groups, and what is in them, in this order.
from gearchaos.cli import (  # noqa: F401, I001
    gears, studies, explore, runs, proofs, installation,
)
from gearchaos.cli.options import app, main

__all__ = ["app", "main"]
