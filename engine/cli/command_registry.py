"""The commands. Each command has one line with its name and its module. The module's function ``command``, or the function that the
line names, is the command. Its parameters are the arguments, and its docstring is the help. A name of two words belongs to a group,
whose help is in ``GROUPS``. ``trunnion --help`` lists the commands in this order. A module is imported when its command is invoked
or listed."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

COMMANDS = {
    "new": "trunnion.cli.commands.new",
    "models": "trunnion.cli.commands.models",
    "check": "trunnion.cli.commands.check",
    "simulate": "trunnion.cli.commands.simulate",
    "kinematics": "trunnion.cli.commands.kinematics",
    "inverse": "trunnion.cli.commands.inverse",
    "equilibrium": "trunnion.cli.commands.equilibrium",
    "modes": "trunnion.cli.commands.modes",
    "wear": "trunnion.cli.commands.wear",
    "knocks": "trunnion.cli.commands.knocks",
    "sweep": "trunnion.cli.commands.sweep",
    "optimise": "trunnion.cli.commands.optimise",
    "refine": "trunnion.cli.commands.refine",
    "sensitivity": "trunnion.cli.commands.sensitivity",
    "fit": "trunnion.cli.commands.fit",
    "chart": "trunnion.cli.commands.chart",
    "advise": "trunnion.cli.commands.advise",
    "import": "trunnion.cli.commands.import_",
    "schema": "trunnion.cli.commands.schema",
    "fmu": "trunnion.fmu.cli.fmu",
    "ssp": "trunnion.fmu.cli.ssp",
    "export c": "trunnion.fmu.cli.export:export_c",
    "export urdf": "trunnion.cli.commands.export_urdf",
    "export web": "trunnion.fmu.cli.export:export_web",
    "serve": "trunnion.service.cli.serve",
    "jobs submit": "trunnion.service.cli.jobs_submit:submit",
    "jobs fit": "trunnion.service.cli.jobs_submit:fit",
    "jobs list": "trunnion.service.cli.jobs:list_",
    "jobs show": "trunnion.service.cli.jobs:show",
    "jobs watch": "trunnion.service.cli.jobs:watch",
    "jobs results": "trunnion.service.cli.jobs:results",
    "jobs answer": "trunnion.service.cli.jobs:answer",
    "jobs cancel": "trunnion.service.cli.jobs:cancel",
    "jobs rerun": "trunnion.service.cli.jobs:rerun",
    "jobs delete": "trunnion.service.cli.jobs:delete",
}
"""{name: module, or module:function}."""
GROUPS = {
    "export": "Export a scene as C code, URDF or a web page.",
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
