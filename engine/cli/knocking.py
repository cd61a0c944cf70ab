"""``trunnion knocks``: where clearance would let pins cross their bearings, as text or JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import loaded, talk
from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.questions.knocks import Knock

COLUMNS = ("joint", "time, s", "way, µm", "flight, ms", "hits at, mm/s", "at, deg", "mass, kg", "energy, µJ")


@dataclass(frozen=True)
class KnocksWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any]
    clearance: Sequence[str]
    changes: Sequence[str]
    as_json: bool
    verbose: bool


def knocks_command(wish: KnocksWish) -> int:
    """Run, find the knocks, print them; the exit code."""
    from engine.cli.charting import print_lines
    from engine.questions.knocks import knocks
    from engine.simulation.run import simulate

    talk(wish.verbose)
    found = Findings()
    source = options.one_scene(wish.scene, found)
    chosen = options.settings("trunnion knocks", wish.settings, found)
    law = chosen.pop("law")
    clearance = found.attempt(lambda: _clearance(wish.clearance))
    scene = loaded(source, options.assignments(wish.changes, found), law, found)
    found.end()
    assert scene is not None
    assert clearance is not None
    result = simulate(scene, outputs=("*",), **chosen)
    told = knocks(result, clearance)
    code = DONE if result.outcome.ok else FAILED
    if wish.as_json:
        print_json({"exit_code": code, "outcome": result.outcome.name, "knocks": [k.document() for k in told]})
        return code
    lines = table([*COLUMNS], [_row(k) for k in told]) if told else ["no pin crosses its bearing"]
    print_lines([f"{scene.name}: {result.outcome}", *lines])
    return code


def _clearance(texts: Sequence[str]) -> dict[str, float] | float:
    """One clearance, m, or that of each joint named. SceneError where none is given, or none can be read."""
    from engine.basics.problems import Problem, SceneError
    from engine.scene.quantities import Per
    from engine.scene.units import UnitError

    where, hint = "--clearance", "for example --clearance '20 um', or --clearance pin='20 um'"
    try:
        pairs = [text.rpartition("=") for text in texts]
        read = {name.strip(): float(Per("m")(value.strip())) for name, _, value in pairs}
    except UnitError as e:
        raise SceneError([Problem(where, e.what, e.hint or hint)]) from e
    if not read or ("" in read and len(texts) > 1):
        what = "of which size is not said" if not read else "one size for all joints, or one for each: not both"
        raise SceneError([Problem(where, what, hint)])
    return read.get("", read)


def _row(k: Knock) -> list[str]:
    numbers = (k.way * 1e6, k.flight * 1e3, k.speed * 1e3, math.degrees(k.angle), k.mass, k.energy * 1e6)
    return [k.joint, f"{k.time:.6g}", *(f"{x:.4g}" for x in numbers)]
