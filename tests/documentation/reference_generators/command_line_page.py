"""``reference/command_line.md``: every command with its arguments and options, from the declarations behind ``--help``."""

from __future__ import annotations

from typing import Any

HEAD = """# Command line

`trunnion COMMAND --help` prints the same text. Exit codes: 0 done, 1 ended with a diagnosis, 2 wrong use. Every command also has
the option `-v`, `--verbose`: it prints the log to standard error, with the details of internal errors.
"""
COMMON = "verbose"
"""The option of every command. The head of the page describes this option once."""


def page_text() -> str:
    """The page as Markdown."""
    from trunnion.cli.command_declaration import click_command
    from trunnion.cli.command_registry import COMMANDS, function_of

    made = {name: click_command(name, function_of(name)) for name in sorted(COMMANDS)}
    return HEAD + "".join(f"\n{section(f'trunnion {name}', command)}" for name, command in made.items())


def help_text() -> str:
    """The text that ``trunnion --help`` prints on terminals of at least 80 columns."""
    from trunnion.cli.command_group import COMMAND
    from trunnion.cli.fast_help_and_completion import WIDTH

    context = COMMAND.make_context("trunnion", [], resilient_parsing=True, terminal_width=WIDTH - 2)
    return f"{context.get_help()}\n"


def section(name: str, command: Any) -> str:
    """One command: usage, help, and a table of its own options."""
    shown = [p for p in command.params if not p.hidden]
    arguments = [p for p in shown if p.param_type_name == "argument"]
    usage = " ".join([name, *(a.metavar if a.required else f"[{a.metavar}]" for a in arguments), "[OPTIONS]"])
    rows = "".join(row(p) for p in shown if p.param_type_name == "option" and p.name != COMMON)
    table = f"\n| option | value | meaning |\n|---|---|---|\n{rows}" if rows else ""
    return f"## `{name}`\n\n{command.help.strip()}\n\n```text\n{usage}\n```\n{table}"


def row(option: Any) -> str:
    """A row of the table of options."""
    from trunnion.cli.command_declaration import meaning

    names = ", ".join(f"`{o}`" for o in sorted([*option.opts, *option.secondary_opts], key=len))
    value = "" if option.is_flag else f"`{option.metavar}`"
    return f"| {names} | {cell(value)} | {cell(' '.join(meaning(option).split()))} |\n"


def cell(text: str) -> str:
    """Text as the content of a table's cell."""
    return text.replace("|", "\\|")
