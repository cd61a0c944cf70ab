"""``trunnion sensitivity``: derivatives of outputs by parameters, as a table and a file."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, print_json

if TYPE_CHECKING:
    from engine.sensitivities import Sensitivity


@dataclass(frozen=True)
class SensitivityWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any]
    parameters: Sequence[str] = ()
    outputs: Sequence[str] = ()
    changes: Sequence[str] = ()
    save: str | None = None
    as_json: bool = False
    verbose: bool = False


def sensitivity_command(wish: SensitivityWish) -> int:
    """Compute the derivatives, print them and write their table; the exit code."""
    from engine.cli.charting import print_lines
    from engine.cli.simulating import loaded, talk, unknown_outputs
    from engine.sensitivities import sensitivity

    talk(wish.verbose)
    found = Findings()
    source = options.one_scene(wish.scene, found)
    chosen = options.settings("trunnion sensitivity", wish.settings, found)
    law = chosen.pop("law")
    path = options.destination(wish.save, (".csv",), "-o", found)
    scene = loaded(source, options.assignments(wish.changes, found), law, found)
    if scene is not None:
        found.problems += unknown_outputs(scene, wish.outputs)
    for what, given in (("--to", wish.parameters), ("--outputs", wish.outputs)):
        if not given:
            found.add(what, "none is given", "for example --to joints.ball.friction.mu --outputs 'ball.qd*'")
    found.end()
    assert scene is not None
    result = sensitivity(scene, tuple(wish.parameters), tuple(wish.outputs), **chosen)
    if path:
        write_table(result, path)
    if wish.as_json:
        print_json({"exit_code": DONE, **result.document(), "file": wish.save})
    else:
        print_lines([*lines(scene.name, result), *([f"wrote {path}"] if path else [])])
    return DONE


def lines(name: str, s: Sensitivity) -> list[str]:
    """Lines that say the values and derivatives at the end of the run, and how events move with the parameters."""
    from engine.cli.summary import table

    rows = [
        (o, f"{s.values[-1, i]:.6g}", p, f"{s.derivatives[-1, i, k]:.6g}")
        for i, o in enumerate(s.names) for k, p in enumerate(s.parameters)
    ]
    out = [f"{name}, at t = {s.time[-1]:g} s", *table(("output", "value", "by", "derivative"), rows)]
    if s.events:
        shown = [(f"{e.time:.6f}", e.joint, ", ".join(f"{x:.4g}" for x in e.shift)) for e in s.events[:8]]
        out += ["", *table(("event at, s", "joint", "moves by, s per unit"), shown)]
    return [*out, *s.notes]


def write_table(s: Sensitivity, path: Path) -> None:
    """Write a CSV table with columns for time, the outputs, then every d(output)/d(parameter)."""
    from engine.basics.files import writing

    heads = ["time", *s.names, *(f"d({o})/d({p})" for o in s.names for p in s.parameters)]
    with writing(path, (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(heads)
        for t, v, d in zip(s.time, s.values, s.derivatives, strict=True):
            out.writerow([repr(float(x)) for x in (t, *v, *d.ravel())])
