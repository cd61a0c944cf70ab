"""``trunnion chart --scaling``: cost against bodies, friction joints, loops and cases."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from engine.basics.problems import Problem, SceneError
from engine.cli.running import DONE, print_json

if TYPE_CHECKING:
    from engine.cli.charting import ChartWish


def scaling_command(wish: ChartWish) -> int:
    """Measure how cost grows with size and write the files; the exit code."""
    from engine.chart.files import folder_of
    from engine.chart.machine import one_core
    from engine.chart.scaling import scaling, write_scaling
    from engine.cli.meter import Meter
    from engine.cli.summary import plain, table

    problems = [Problem("-o", "no folder is given", "for example -o charts")] if wish.folder is None else []
    problems += [Problem("SCENE", f"{w!r} is not used by --scaling", "its scenes are generated") for w in wish.scene]
    if problems:
        raise SceneError(problems)
    folder = folder_of(wish.folder or "")
    with one_core(), Meter("scaling") as meter:
        families = scaling(wish.repeats, tell=meter.tell)
    files = [str(p) for p in write_scaling(families, folder)]
    if wish.as_json:
        found = [asdict(f) | {"exponent": f.exponent} for f in families]
        print_json({"exit_code": DONE, "families": found, "files": files})
        return DONE
    for f in families:
        print(f"{f.name}: {f.what}; cost ∝ n^{f.exponent:.2f}")
        rows = [(str(s.n), f"{1e6 * s.minimum:.3g}", f"{1e6 * s.median:.3g}", f"{s.build:.2f}") for s in f.sizes]
        print("\n".join(map(plain, table(("n", "min µs", "median µs", "build s"), rows))) + "\n")
    print("\n".join(f"wrote {f}" for f in files))
    return DONE
