"""``trunnion`` and its groups of commands. A command is imported when the user invokes the command or lists the commands."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from trunnion.basics.errors import Problem, SceneError
from trunnion.cli.command_declaration import click_command, take_as_given
from trunnion.cli.command_registry import COMMANDS, GROUPS, function_of

HELP = "Compute the motion of a mechanism, its friction, contact points and normal forces."


class CommandGroup(TyperGroup):
    """The commands whose names begin with ``prefix``."""

    prefix = ""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names for the help text."""
        return list(dict.fromkeys(n.removeprefix(self.prefix).split()[0] for n in COMMANDS if n.startswith(self.prefix)))

    def get_command(self, ctx: Any, name: str) -> Any:
        """A command by name; None for an unknown name."""
        full = self.prefix + name
        if full in GROUPS:
            return command_group(full)
        return click_command(full, function_of(full)) if full in COMMANDS else None

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write each command with its whole description."""
        with formatter.section("Commands"):
            formatter.write_dl([(n, " ".join(self.description(ctx, n).split())) for n in self.list_commands(ctx)])

    def description(self, ctx: Any, name: str) -> str:
        """The help of a command or group. The function does not build the command, because building would take most of the time of
        ``--help``."""
        full = self.prefix + name
        return GROUPS[full] if full in GROUPS else str(function_of(full).__doc__)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words before the command's name."""
        take_as_given(self.get_params(ctx))
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """(name of the command, the command, the words after its name). SceneError for an unknown command."""
        name, names = args[0], self.list_commands(ctx)
        if name not in names:
            near = get_close_matches(name, names, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"see {ctx.command_path} --help"
            raise SceneError([Problem(ctx.command_path, f"there is no command {name!r}", hint)])
        return name, self.get_command(ctx, name), args[1:]


def command_group(name: str) -> CommandGroup:
    """The group with this name."""
    made = CommandGroup(name=name, help=GROUPS[name], no_args_is_help=True, rich_markup_mode=None)
    made.prefix = f"{name} "
    return made


app = typer.Typer(
    name="trunnion",
    cls=CommandGroup,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    help=HELP,
    epilog="Exit codes: 0 done; 1 failed, with a diagnosis; 2 wrong use. SCENE: a file or the name of a bundled model.",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def print_version(given: bool) -> None:
    """Print the version and end."""
    if given:
        from trunnion.basics.version import version

        typer.echo(f"trunnion {version()}")
        raise typer.Exit


@app.callback()
def top(
    ctx: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=print_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Print the help if no command is named."""
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help())


COMMAND: Any = typer.main.get_command(app)
"""The command ``trunnion`` as an object of click."""
