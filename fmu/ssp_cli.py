"""``trunnion ssp``: a system of FMUs as one SSP file."""

from __future__ import annotations

from typing import Annotated

import typer

SYSTEM = typer.Argument(metavar="SYSTEM", help="A YAML file: components:, connections:, simulation:.", show_default=False)


def command(
    system: Annotated[str, SYSTEM],
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="The .ssp to write (SYSTEM.ssp).")] = None,
    platform: Annotated[list[str] | None, typer.Option(metavar="P", help="For which scenes are exported, as in fmu.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")] = False,
) -> None:
    """Write a system of FMUs and scenes as an SSP file."""
    from dataclasses import asdict
    from pathlib import Path

    from engine.cli.running import print_json
    from fmu.ssp import export_system

    made = export_system(system, save or f"{Path(system).stem}.ssp", platform or ["host"])
    if as_json:
        print_json({"exit_code": 0, **asdict(made), "file": str(made.file)})
        return
    counts = f"{made.connections} connections, {made.parameters} parameters"
    typer.echo(f"{made.file}: {made.bytes / 1024:.0f} kB, components {', '.join(made.components)}; {counts}")


ssp = typer.Typer(add_completion=False)
ssp.command("ssp")(command)
