"""The commands: names, modules and functions. A command is the function ``command`` of the module with the command's name. The
parameters of the function are the arguments, and its docstring is the help. A name of two words belongs to a group, whose help is
in ``GROUPS``. ``trunnion --help`` lists the commands in this order. A module is imported when its command is invoked or listed."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from keyword import iskeyword

ENGINE = (
    "new", "models", "check", "simulate", "kinematics", "inverse", "equilibrium", "modes", "wear", "knocks", "sweep", "optimise",
    "refine", "sensitivity", "fit", "chart", "advise", "import", "schema",
)  # fmt: skip
COMMANDS = {
    **{name: f"trunnion.cli.commands.{name}{'_' if iskeyword(name) else ''}" for name in ENGINE},
    **{name: f"trunnion.fmu.cli.{name.replace(' ', '_')}" for name in ("fmu", "ssp", "export c", "export web")},
    **{name: f"trunnion.service.cli.{name.replace(' ', '_')}" for name in ("serve", "jobs submit", "jobs fit")},
    "jobs list": "trunnion.service.cli.jobs:list_",
    **{f"jobs {n}": f"trunnion.service.cli.jobs:{n}" for n in ("show", "watch", "results", "answer", "cancel", "rerun", "delete")},
}
"""{name: module, or module:function}."""
GROUPS = {
    "export": "Export a scene as C code or as a web page.",
    "jobs": "Submit, follow and fetch jobs of a server (trunnion serve).",
}
"""{group: its help}."""


def function_of(name: str) -> Callable[..., int]:
    """The function of a command."""
    module, _, function = COMMANDS[name].partition(":")
    found: Callable[..., int] = getattr(import_module(module), function or "command")
    return found


def extra_of_command(name: str) -> str:
    """The extra that installs the packages of a command or group; "" for commands of the engine."""
    module = next((m for n, m in COMMANDS.items() if n.split()[0] == name), "")
    room = module.partition("trunnion.")[2].partition(".")[0]
    return room if room in ("fmu", "service") else ""
