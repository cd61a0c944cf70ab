"""``trunnion optimise`` and ``trunnion refine``: words to a study, its rounds on all cores, what it found, a table, a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from engine.basics.interrupts import held
from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import PICTURES, TABLES, loaded, talk
from engine.cli.summary import plain, table
from engine.cli.sweeping import spans

if TYPE_CHECKING:
    from engine.batch.plan import Plan
    from engine.studies.asked import Wanted
    from engine.studies.following import Study
    from engine.studies.running import Studied

SHOWN = 20


@dataclass(frozen=True)
class StudyWish:
    """The words and options of the commands as they were written."""

    kind: str
    scene: list[str]
    settings: Mapping[str, Any]
    vary: Sequence[str] = ()
    goals: Mapping[str, str | None] = field(default_factory=dict)
    within: Sequence[str] = ()
    of: str = "outcome"
    cases: int = 600
    seed: int = 0
    tolerance: float = 1e-3
    reduce: Sequence[str] = ()
    changes: Sequence[str] = ()
    save: str | None = None
    plot: str | None = None
    workers: int | None = None
    as_json: bool = False
    verbose: bool = False


def study_command(wish: StudyWish) -> int:
    """Run the study; the exit code (1 where no case has what was wanted, or when it was interrupted)."""
    from engine.cli.progress import Watch
    from engine.studies.running import run_study

    talk(wish.verbose)
    found = Findings()
    place = options.destination(wish.save, TABLES, "-o", found)
    picture = options.destination(wish.plot, PICTURES, "--plot", found)
    asked = planned(wish, found)
    found.end()
    assert asked is not None
    with Watch(f"{wish.kind}, at most {wish.cases} cases") as watch:
        result = run_study(*asked, wish.workers, lambda done, of: watch.tell(done, of))
    with held():
        if place is not None:
            result.save(place)
        if picture is not None:
            _draw(result, picture)
    files = {n: str(f) for n, f in (("table", place), ("picture", picture)) if f}
    good = result.answer.get("feasible", True) and not result.sweep.stopped
    code = DONE if good else FAILED
    if wish.as_json:
        print_json({"exit_code": code, "problems": [], **result.answer, "outcomes": result.sweep.counts, "files": files})
    else:
        print("\n".join([*map(plain, lines(result)), *(f"wrote {f}" for f in files.values())]))
    return code


def planned(wish: StudyWish, found: Findings) -> tuple[Study, Plan] | None:
    """The study and its plan; None when there are problems, which are kept in ``found``."""
    from engine.batch.plan import Run
    from engine.studies.asked import study_of

    chosen = options.settings("trunnion sweep", wish.settings, found)
    law = chosen.pop("law")
    source = options.one_scene(wish.scene, found)
    wanted = wanted_of(wish, found)
    if wish.workers is not None and wish.workers < 1:
        found.add("--workers", f"{wish.workers} workers do nothing", "give a positive number")
    scene = loaded(source, options.assignments(wish.changes, found), law, found)
    if scene is None or wanted is None:
        return None
    return found.attempt(partial(study_of, scene, wanted, list(wish.reduce), Run(**chosen)))


def wanted_of(wish: StudyWish, found: Findings) -> Wanted | None:
    """The study as written."""
    from engine.studies.asked import Wanted

    bounds = _pairs(wish.vary, "--vary", found)
    if not wish.vary:
        found.add("--vary", "nothing says what varies", "for example --vary joints.ball.friction.mu=0.1:0.6")
    goals: dict[str, Any] = {n: g for n, g in wish.goals.items() if g is not None and n != "reach"}
    if (reach := wish.goals.get("reach")) is not None:
        name, sign, value = (part.strip() for part in reach.rpartition("="))
        if sign and value:
            goals["reach"] = (name, value)
        else:
            found.add("--reach", f"{reach!r} is not KIND:WHAT=VALUE", "such as 'final:guide.q[1]=5 m'")
            goals["reach"] = (reach, "0")
    within = {}
    for text in wish.within:
        name, _, ends = (part.strip() for part in text.rpartition("="))
        low, sign, high = (part.strip() for part in ends.partition(":"))
        if not sign or not name or not (low or high):
            found.add("--within", f"{text!r} is not KIND:WHAT=LOW:HIGH", "one end may be left out: 'max:x=:20 kN'")
        within[name] = (low or None, high or None)
    if not bounds:
        return None
    return Wanted(wish.kind, bounds, goals, within, wish.of, wish.cases, wish.seed, wish.tolerance)


def _pairs(texts: Sequence[str], where: str, found: Findings) -> dict[str, list[str]]:
    """{path: [low, high]} of PATH=low:high words."""
    out = {}
    for path, text in spans(texts, where, found).items():
        ends = [part.strip() for part in text.split(":")]
        if len(ends) == 2 and all(ends):
            out[path] = ends
        else:
            found.add(where, f"{path}={text} is not PATH=low:high", "for example joints.ball.friction.mu=0.1:0.6")
    return out


def lines(result: Studied) -> list[str]:
    """What it found, as text."""
    a, sweep = result.answer, result.sweep
    outcomes = ", ".join(f"{n} {name}" for name, n in sorted(sweep.counts.items(), key=lambda c: -c[1]))
    head = [f"{sweep.plan.scene.name}: {a['cases']} cases ({outcomes}), {sweep.wall_time:.3g} s", str(a["why"]), ""]
    if a["kind"] == "refine":
        return head + boundary_lines(a)
    wanted = f"{a['goal']} {a['of']}" + (f" = {a['target']:g}" if a["target"] is not None else "")
    if not a["feasible"]:
        head.append("no case keeps all constraints; the nearest:" if a["missed"] is not None else "no case has a value")
    numbers = [(n["path"], f"{n['value']:.9g}", n["unit"]) for n in a["numbers"]]
    results = [(n, "–" if v is None else f"{v:.9g}", _unit(sweep, n)) for n, v in a["results"].items()]
    return [*head, *table((wanted, f"case {a['case']}", "unit"), numbers + results)]


def _unit(sweep: Any, name: str) -> str:
    return next((r.unit for r in sweep.plan.reductions if r.name == name), "")


def boundary_lines(a: Mapping[str, Any]) -> list[str]:
    """Where outcomes change and the result jumps."""
    rows = []
    for b in a["boundaries"][:SHOWN]:
        places = (f"{low:.7g} … {high:.7g}" for low, high in zip(b["low"], b["high"], strict=True))
        what = " | ".join(o.replace("_", " ") for o in b["outcomes"]) if b["change"] is None else f"jumps by {b['change']:.4g}"
        rows.append((*places, what))
    more = len(a["boundaries"]) - len(rows) + a["more"]
    if not rows:
        return [f"{a['of']}: neither jumps nor changes of outcome"]
    return [*table((*a["paths"], "between them"), rows), *([f"… and {more} more (--json tells all)"] if more > 0 else [])]


def _draw(result: Studied, path: Any) -> None:
    from engine.plots.files import save_figure
    from engine.plots.studied import convergence, refined

    draw = refined if result.answer["kind"] == "refine" else convergence
    save_figure(draw(result.answer, result.sweep), path)


__all__ = ["DONE", "FAILED", "StudyWish", "study_command"]
