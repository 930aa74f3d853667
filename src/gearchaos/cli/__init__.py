"""The command line: arguments in; files, one JSON document or a readable page out."""

from gearchaos.cli import explore, point, runs  # noqa: F401 - their commands join the app
from gearchaos.cli.commands import app, main

__all__ = ["app", "main"]
