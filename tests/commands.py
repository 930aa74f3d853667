"""The command line, asked in this process."""

import json
from functools import cache
from typing import Any

import pytest
import typer.testing
from typer.testing import Result

from gearchaos.cli import app

typer.testing._get_command = cache(typer.testing._get_command)  # which takes longer than most commands


def ask(*arguments: Any, code: int | None = None, **options: Any) -> Result:
    """What a command prints, and how it ends: with this code, never with an error of the program."""
    result = typer.testing.CliRunner().invoke(app, [str(each) for each in arguments], catch_exceptions=False, **options)
    assert "Traceback" not in result.stderr
    assert code is None or result.exit_code == code, result.output
    return result


def run_json(*arguments: Any) -> Any:
    """What a command prints as JSON."""
    return json.loads(ask(*arguments, "--json", code=0).stdout,
                      parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def refused(*arguments: Any) -> str:
    """The one line that a command prints on stderr which must end with exit code 2."""
    result = ask(*arguments, code=2)
    assert result.stdout == ""
    line, = result.stderr.splitlines()
    assert line.startswith("error: ")
    return line
