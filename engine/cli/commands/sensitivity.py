"""``trunnion sensitivity``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.options import completion
from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, CsvTable, Json, Scene, SettingWords, columns_option, repeatable
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import number, print_result, table

if TYPE_CHECKING:
    from trunnion.analysis.sensitivities.sensitivity import Sensitivity

SHOWN = 8
"""Largest count of events in the summary."""


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    settings: SettingWords,
    vary: Annotated[
        list[str],
        repeatable("--vary", metavar="PATH", help="Parameter of the derivatives.", autocompletion=completion.parameters),
    ],
    changes: Changes,
    outputs: Annotated[list[str], columns_option("Differentiate these columns, such as 'ball.*'.")],
    save: CsvTable = None,
    as_json: Json = False,
) -> int:
    """Compute exact derivatives of outputs with respect to parameters, along a run and across its events."""
    import numpy as np

    from trunnion.analysis.sensitivities.sensitivity import sensitivity
    from trunnion.cli.output.csv_table import write_csv

    reader = ArgumentReader()
    chosen = settings.values(reader)
    path = reader.destination(save, (".csv",))
    loaded = reader.scene(scene, ctx, changes, chosen.pop("law"))
    reader.check_columns(loaded, outputs)
    for what, given in (("--vary", vary), ("--outputs", outputs)):
        if not given:
            reader.add(what, "no value is given", "for example --vary joints.ball.friction.mu --outputs 'ball.qd*'")
    loaded = reader.checked(loaded)
    result = sensitivity(loaded, tuple(vary), tuple(outputs), **chosen)
    if path:
        heads = [*result.names, *(f"d({o})/d({p})" for o in result.names for p in result.parameters)]
        write_csv(path, heads, result.time, np.column_stack([result.values, result.derivatives.reshape(len(result.time), -1)]))
    text = [*lines(loaded.name, result), *([f"wrote {path}"] if path else [])]
    return print_result(as_json, DONE, result.document() | {"file": save}, text)


def lines(name: str, s: Sensitivity) -> list[str]:
    """Values and derivatives at the end of the run, and derivatives of event times, as text."""
    rows = [
        (o, number(s.values[-1, i]), p, number(s.derivatives[-1, i, k]))
        for i, o in enumerate(s.names) for k, p in enumerate(s.parameters)
    ]  # fmt: skip
    out = [f"{name}, at t = {s.time[-1]:g} s", *table(("output", "value", "by", "derivative"), rows)]
    if s.events:
        shown = [(f"{e.time:.6f}", e.joint, ", ".join(number(x, 4) for x in e.shift)) for e in s.events[:SHOWN]]
        out += ["", *table(("event at, s", "joint", "time shift, s per unit"), shown)]
    return [*out, *s.notes]
