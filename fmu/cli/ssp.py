"""``trunnion ssp``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.option_declarations import Json
from trunnion.fmu.cli.fmu import Platform

SYSTEM = "A YAML file with components, connections and simulation."


def command(
    system: Annotated[str, typer.Argument(metavar="SYSTEM", help=SYSTEM)],
    platform: Platform,
    save: Annotated[
        str | None, typer.Option("-o", "--output", metavar="FILE", help="Write this .ssp.", show_default="SYSTEM.ssp")
    ] = None,
    as_json: Json = False,
) -> int:
    """Export a system of FMUs and scenes as an SSP file."""
    from dataclasses import asdict
    from pathlib import Path

    from trunnion.cli.output.exit_codes_and_errors import DONE, print_json
    from trunnion.fmu.ssp.system_export import export_system

    made = export_system(system, save or f"{Path(system).stem}.ssp", platform or ["host"])
    if as_json:
        print_json({"exit_code": DONE, **asdict(made), "file": str(made.file)})
    else:
        counts = f"{made.connections} connections, {made.parameters} parameters"
        print(f"{made.file}: {made.bytes / 1024:.0f} kB, components {', '.join(made.components)}; {counts}")
        if made.unused:
            print(f"  parameters that no variable takes: {', '.join(made.unused)}")
    return DONE
