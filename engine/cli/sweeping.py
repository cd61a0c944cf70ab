"""``trunnion sweep``: words to a plan, the cases on all cores, a table, a summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from engine.basics.interrupts import held
from engine.cli import options
from engine.cli.keeping import Kept
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import PICTURES, TABLES, loaded, talk

if TYPE_CHECKING:
    from engine.batch.plan import Plan
    from engine.batch.sweeping import Sweep
    from engine.cli.sampled import Questions

SHOWN = 12


@dataclass(frozen=True)
class SweepWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any] = field(default_factory=dict)
    over: Sequence[str] = ()
    sample: Sequence[str] = ()
    count: int = 0
    seed: int = 0
    sampling: str = "latin"
    reduce: Sequence[str] = ()
    changes: Sequence[str] = ()
    save: str | None = None
    plot: str | None = None
    quantiles: Sequence[str] = ()
    above: Sequence[str] = ()
    workers: int | None = None
    as_json: bool = False
    verbose: bool = False
    kept: Kept = field(default_factory=Kept)


def sweep_command(wish: SweepWish) -> int:
    """Run the sweep; the exit code (1 when no case could be run to its end, or when it was interrupted)."""
    from engine.batch.sweeping import run_plan
    from engine.cli.progress import Watch
    from engine.cli.sampled import answered, questions

    talk(wish.verbose)
    found = Findings()
    place = options.destination(wish.save, TABLES, "-o", found)
    picture, rows = options.destination(wish.plot, PICTURES, "--plot", found), wish.kept.place(found)
    asked = questions(wish.quantiles, wish.above, picture, found)
    chosen = planned(wish, found)
    if chosen is not None:
        _check_questions(chosen, asked, found)
    found.end()
    assert chosen is not None
    with Watch(f"{chosen.cases.count} cases") as watch:
        result = run_plan(chosen, wish.workers, lambda done, of: watch.tell(done, of))
    if place is not None:
        with held():
            result.save(place)
    if rows is not None:
        with held():
            result.save_trajectories(rows)
    answers = answered(result, asked)
    files = {n: str(f) for n, f in (("table", place), ("rows", rows), ("picture", picture)) if f}
    code = DONE if result.counts.get("done") and not result.stopped else FAILED
    if wish.as_json:
        print_json({"exit_code": code, "problems": []} | document(result) | answers.document() | {"files": files})
    else:
        print("\n".join([*summary(result), *answers.lines(), *(f"wrote {f}" for f in files.values())]))
    return code


def _check_questions(chosen: Plan, asked: Questions, found: Findings) -> None:
    """Refuse questions that the sample will not answer before it is run."""
    from engine.batch.answers import refused

    if asked.any():
        found.problems += refused(chosen.cases, chosen.reductions, (), asked.at, asked.above)


def planned(wish: SweepWish, found: Findings) -> Plan | None:
    """The plan of the cases; None when there are problems, which are kept in ``found``."""
    from engine.batch.plan import Run, plan

    chosen = options.settings("trunnion sweep", wish.settings, found)
    law = chosen.pop("law")
    run = Run(**chosen)
    source = options.one_scene(wish.scene, found)
    over, sample = spans(wish.over, "--over", found), ranges(wish.sample, found)
    if wish.workers is not None and wish.workers < 1:
        found.add("--workers", f"{wish.workers} workers do nothing", "give a positive number")
    if not wish.over and not wish.sample:
        found.add("--over", "nothing says what varies", "for example --over joints.ball.friction.mu=0.1:0.6:26")
    scene = loaded(source, options.assignments(wish.changes, found), law, found)
    if scene is None or not (over or sample):
        return None
    make = partial(plan, scene, over or None, None, sample or None, count=wish.count, seed=wish.seed, sampling=wish.sampling)
    kept = wish.kept.planned(found)
    return found.attempt(partial(make, keep=tuple(wish.reduce), run=run, **kept))


def spans(texts: Sequence[str], where: str, found: Findings) -> dict[str, str]:
    """{path: values} of PATH=VALUES words."""
    out: dict[str, str] = {}
    for text in texts:
        path, sign, values = (part.strip() for part in text.partition("="))
        if not sign or not values:
            found.add(where, f"{text!r} is not PATH=VALUES", "for example joints.ball.friction.mu=0.1:0.6:26, or =0.1,0.2")
        elif path in out:
            found.add(where, f"{path} is given twice", "keep one")
        else:
            out[path] = values
    return out


def ranges(texts: Sequence[str], found: Findings) -> dict[str, list[str] | str]:
    """{path: [low, high], or a distribution} of PATH=low:high and PATH=normal(mean, deviation) words."""
    out: dict[str, list[str] | str] = {}
    for path, text in spans(texts, "--sample", found).items():
        ends = [part.strip() for part in text.split(":")]
        if "(" in text:
            out[path] = text
        elif len(ends) == 2 and all(ends):
            out[path] = ends
        else:
            what = f"{path}={text} is neither PATH=low:high nor a distribution"
            found.add("--sample", what, "for example joints.ball.friction.mu=0.1:0.6, or ='normal(0.3, 0.05)'")
    return out


def document(result: Sweep) -> dict[str, Any]:
    """The sweep without its rows, as plain data."""
    from engine.batch.table import WHY

    times = {"wall": result.wall_time, "stepping": result.stepping_time, "build": result.build_time}
    kept = [{"name": r.name, "unit": r.unit, "description": r.description} for r in result.plan.reductions]
    cases = {"cases": len(result), "of": result.plan.cases.count, "stopped": result.stopped}
    errors = {"errors_unstated": result.unstated} if WHY in result.table.column_names else {}
    return {"scene": result.plan.scene.name, **cases, "outcomes": result.counts, **errors, "seconds": times, "reductions": kept}


def summary(result: Sweep) -> list[str]:
    """Lines of the summary: outcomes, cost, ranges of the reductions."""
    import pyarrow.compute as pc

    from engine.cli.summary import table

    outcomes = ", ".join(f"{n} {name}" for name, n in sorted(result.counts.items(), key=lambda c: -c[1]))
    rows = []
    for r in result.plan.reductions[:SHOWN]:
        values = result.table[r.name]
        ends = pc.min_max(values).as_py()
        low, high = ("–" if ends[end] is None else f"{ends[end]:.6g}" for end in ("min", "max"))
        rows.append((r.name, low, high, str(len(values) - values.null_count), r.unit))
    more = len(result.plan.reductions) - len(rows)
    lines = [
        f"{result.plan.scene.name}: {len(result)} cases over {', '.join(result.plan.cases.paths)}",
        *([f"stopped: {len(result)} of {result.plan.cases.count} cases finished, which are kept"] if result.stopped else []),
        outcomes,
        *_unstated(result.unstated),
        f"{result.wall_time:.3g} s, stepping {result.stepping_time:.3g} s on all cores"
        + (f", built in {result.build_time:.3g} s" if result.build_time else ""),
        "",
        *table(("reduction", "least", "most", "cases", "unit"), rows),
    ]
    return [line.replace("\033[2m", "").replace("\033[0m", "") for line in lines] + ([f"… and {more} more"] if more > 0 else [])


def _unstated(counts: Mapping[str, int]) -> list[str]:
    """How many cases have no errors, and why, in words."""
    from engine.simulation.certainty.stated import REASONS

    return [f"no errors of {n} case{'s' if n > 1 else ''} ({why}): {REASONS[why]}" for why, n in sorted(counts.items())]
