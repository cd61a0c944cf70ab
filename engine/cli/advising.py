"""``trunnion advise``: the ladder from ideal joints up, and the scene reduced to what is good enough."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json

if TYPE_CHECKING:
    from engine.advise import Advice, Rung


@dataclass(frozen=True)
class AdviseWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any]
    error: str | None = None
    outputs: Sequence[str] = ()
    changes: Sequence[str] = ()
    norm: str | None = None
    repeats: int = 7
    save: str | None = None
    as_json: bool = False
    verbose: bool = False


def advise_command(wish: AdviseWish) -> int:
    """Seek the least model and print it; the exit code (failure when no model meets the error)."""
    from engine.advise import advise
    from engine.chart.machine import one_core
    from engine.chart.measures import NORMS
    from engine.cli.charting import print_lines
    from engine.cli.meter import Meter
    from engine.cli.simulating import loaded, talk, unknown_outputs

    talk(wish.verbose)
    found = Findings()
    source = options.one_scene(wish.scene, found)
    error = _error(wish.error, found)
    until = options.settings("trunnion advise", wish.settings, found)["until"]
    norm = options.choice(wish.norm, NORMS, "--norm", found) or "rms"
    path = options.destination(wish.save, (".yaml", ".yml"), "-o", found)
    scene = loaded(source, options.assignments(wish.changes, found), None, found)
    if scene is not None:
        found.problems += unknown_outputs(scene, wish.outputs)
    if not wish.outputs:
        found.add("--outputs", "none is given", "what must be right? for example --outputs 'slider.position[1]'")
    found.end()
    assert scene is not None
    assert error is not None
    with one_core(), Meter(f"advise {scene.name}") as meter:
        advice = advise(scene, error, tuple(wish.outputs), until, norm, wish.repeats, tell=meter.tell)
    written = write_scene(advice, path) if path else []
    code = DONE if advice.chosen else FAILED
    if wish.as_json:
        print_json({"exit_code": code, **document(advice), "files": written})
    else:
        print_lines([*lines(scene.name, advice), *(f"wrote {w}" for w in written)])
    return code


def _error(text: str | None, found: Findings) -> float | None:
    if text is None:
        found.add("--error", "is not given", "the relative error the outputs may have, for example --error 1e-3")
        return None
    value = options.quantity(text, "1", "--error", found)
    if value is not None and not 1e-9 <= value < 1:
        found.add("--error", f"{text} is out of range", "relative, between 1e-9 and 1; for example 1e-3")
    return value


def write_scene(advice: Advice, path) -> list[str]:
    """The reduced scene as YAML; nothing when there is none."""
    from engine.basics.files import writing
    from engine.scene.dump import scene_to_yaml

    if advice.scene is None:
        return []
    with writing(path, (".yaml", ".yml")) as work:
        work.write_text(scene_to_yaml(advice.scene), encoding="utf-8")
    return [str(path)]


def document(a: Advice) -> dict:
    """The advice as plain data, for JSON."""
    from engine.scene.dump import scene_to_dict

    return {
        "error": a.error, "measure": a.measure.describe(),
        "reference": {"made_by": a.reference.made_by, "error": a.reference.error},
        "influences": [asdict(i) for i in a.influences], "rungs": [asdict(r) | {"model": r.describe()} for r in a.rungs],
        "chosen": a.rungs.index(a.chosen) if a.chosen else None, "scene": scene_to_dict(a.scene) if a.scene else None,
        "notes": list(a.notes),
    }  # fmt: skip


def lines(name: str, a: Advice) -> list[str]:
    """The ladder of models as lines of text."""
    from engine.cli.summary import table

    out = [f"{name}: {a.measure.describe()}", f"reference: {a.reference.made_by}, which differ by {a.reference.error:.1e}"]
    if a.influences:
        rows = [(i.joint, f"{i.predicted:.1e}" if math.isfinite(i.predicted) else "unknown") for i in a.influences]
        out += ["", *table(("joint", "change without its friction (first order)"), rows)]
    head = ("  rung", "model's error", "total", "median ms", "cheapest setting")
    out += ["", *table(head, [_row(r, r is a.chosen) for r in a.rungs])]
    if a.chosen and a.chosen.setting:
        s = a.chosen.setting
        part = f" (integration alone: {s.integration:.1e})" if math.isfinite(s.integration) else ""
        reached = f"error {s.error:.1e}{part} in {1e3 * s.median:.3g} ms"
        out += ["", f"advice: {a.chosen.describe()}; method {s.method}, rtol {s.rtol:.0e}: {reached}"]
    else:
        out += ["", f"no model reaches {a.error:g}: the scene as it is has to be run more tightly, or the error be larger"]
    return [*out, *a.notes]


def _row(r: Rung, chosen: bool) -> tuple[str, ...]:
    mark = "→ " if chosen else "  "
    own = f"{r.model_error:.1e}{' by sensitivity' if r.predicted else ''}" if math.isfinite(r.model_error) else r.outcome
    if r.setting is None:
        return (mark + r.describe(), own, "", "", "")
    s = r.setting
    return (mark + r.describe(), own, f"{s.error:.1e}", f"{1e3 * s.median:.3f}", f"{s.method}, rtol {s.rtol:.0e}")
