"""The command line: arguments in; files, one JSON document or a readable page out."""

# Commands join the application as they are imported: --help lists them in this order.
from gearchaos.cli import warmup, paper, point, maps, explore, runs  # noqa: F401, I001
from gearchaos.cli.options import app, main

__all__ = ["app", "main"]
