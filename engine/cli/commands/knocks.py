"""``trunnion knocks``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene, SettingWords, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import number, print_answer, table

if TYPE_CHECKING:
    from trunnion.analysis.mechanics.clearance_impacts import ClearanceImpact

COLUMNS = ("joint", "part", "time, s", "way, µm", "flight, ms", "hits at, mm/s", "at, deg", "mass, kg", "energy, µJ")
CLEARANCE = "Radial clearance, or half the play of a sleeve: '20 um' for all joints with contacts, or JOINT='20 um' for one joint."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    clearance: Annotated[list[str], repeatable("--clearance", metavar="C", help=CLEARANCE)],
    changes: Changes,
    as_json: Json = False,
) -> int:
    """List the crossings of parts through the clearance of their joint: time, duration, and speed at the end.

    The column "part" numbers the clearances of a joint: the faces across e2 and e3 of a sleeve, or the journals of a universal
    joint."""
    from trunnion.analysis.mechanics.clearance_impacts import knocks
    from trunnion.simulation.run import simulate

    reader = ArgumentReader()
    chosen = settings.values(reader)
    clearances = clearances_by_joint(clearance, reader)
    loaded = reader.checked(reader.scene(scene, ctx, changes, chosen.pop("law")))
    result = simulate(loaded, outputs=("*",), **chosen)
    hits = knocks(result, clearances)
    code = DONE if result.outcome.ok else FAILED
    lines = table(COLUMNS, [row(k) for k in hits]) if hits else ["no part crosses its clearance"]
    document = {"outcome": result.outcome.name, "knocks": [k.document() for k in hits]}
    return print_answer(as_json, code, document, [f"{loaded.name}: {result.outcome}", *lines], [])


def clearances_by_joint(texts: Sequence[str], reader: ArgumentReader) -> dict[str, float] | float:
    """The clearance of all joints, m, or the clearances by joint. Mistakes are added to ``reader``."""
    pairs = [text.rpartition("=") for text in texts]
    read = {name.strip(): reader.quantity(value.strip(), "m", "--clearance") or 0.0 for name, _, value in pairs}
    if not read or ("" in read and len(texts) > 1):
        what = "give one clearance for all joints, or one for each joint, not both" if read else "no clearance is given"
        reader.add("--clearance", what, "for example --clearance '20 um', or --clearance pin='20 um'")
    return read.get("", read)


def row(k: ClearanceImpact) -> list[str]:
    """A row of the table."""
    numbers = (k.way * 1e6, k.flight * 1e3, k.speed * 1e3, math.degrees(k.angle), k.mass, k.energy * 1e6)
    return [k.joint, str(k.part), number(k.time), *(number(x, 4) for x in numbers)]
