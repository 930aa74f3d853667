"""The page of all commands, generated from the Typer application itself."""

from __future__ import annotations

from typing import Any

import typer.main
from pages import code, generated, table

from gearchaos.cli import app as application


def commands() -> dict[str, tuple[Any, Any]]:
    """Each command and its context by name, in the order of ``gearchaos --help``."""
    group = typer.main.get_command(application)
    context = group.context_class(group, info_name="gearchaos")
    names = [name for name in group.list_commands(context) if not group.commands[name].hidden]
    found = ((name, group.commands[name]) for name in names)
    return {name: (command, command.context_class(command, info_name=name, parent=context)) for name, command in found}


def _parameter(parameter: Any, context: Any) -> list[str]:
    """The cells of one argument or option: how it is written, and its help with default or bounds."""
    written, words = parameter.get_help_record(context)
    return [code(written), words.replace("<", r"\<").replace("[", r"\[").replace("*", r"\*")]


def command_section(name: str, command: Any, context: Any) -> str:
    """Title, usage, help text and options of one command."""
    shown = [p for p in command.get_params(context) if not getattr(p, "hidden", False) and p.get_help_record(context)]
    usage = context.get_usage() if hasattr(context, "get_usage") else command.get_usage(context)
    help_text = (command.help or "").replace("\b", "")
    return "\n".join([
        f"(command-{name})=", f"## {name}", "", help_text, "",
        "```", usage.removeprefix("Usage: "), "```", "",
        table(["argument or option", "meaning"], [_parameter(p, context) for p in shown])])


PAGE = """# Commands

All commands with all their arguments and options, as the program itself describes them: this page is generated from it.
[The command line](/cli.md) explains names, formats and JSON documents, and has examples.

"""


def page() -> str:
    """All commands, one section each."""
    found = commands()
    overview = table(["command", "what it does"], [
        [f"[`{name}`](#command-{name})", command.get_short_help_str(200)] for name, (command, _) in found.items()])
    return PAGE + overview + "\n" + "\n".join(command_section(name, *entry) for name, entry in found.items())


def setup(app: Any) -> dict[str, Any]:
    """Write the page before Sphinx reads the sources."""
    generated(app, "commands", page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
