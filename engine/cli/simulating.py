"""``trunnion simulate``: words to settings, the run, its files, the summary."""

from __future__ import annotations

import logging
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.basics.interrupts import held
from engine.basics.problems import Problem
from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json

if TYPE_CHECKING:
    from engine.scene.model import Scene
    from engine.simulation.result import Result

TABLES, PICTURES = (".csv", ".parquet"), (".png", ".svg", ".pdf")
MOVING = (".html", ".htm", ".gif", ".webp", ".mp4")
MATRICES = (".json", ".npz")


@dataclass(frozen=True)
class Wish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any] = field(default_factory=dict)
    changes: Sequence[str] = ()
    outputs: list[str] | None = None
    save: str | None = None
    plot: str | None = None
    animate: str | None = None
    as_json: bool = False
    verbose: bool = False
    linearize: str | None = None
    kinematic: bool = False
    """Motion alone, by what drives prescribe."""
    certify: bool = False
    accuracy: str | None = None
    """Whether errors are stated, and how large they may be."""


@dataclass(frozen=True)
class Job:
    """A wish as it was understood: the scene with its changes, arguments of ``simulate``, patterns asked for, files."""

    scene: Scene
    arguments: dict[str, Any]
    patterns: tuple[str, ...]
    files: dict[str, Path]


def simulate_command(wish: Wish) -> int:
    """Run the scene, write its files and print the summary; the exit code."""
    talk(wish.verbose)
    job = understood(wish)
    result = simulated(job)
    files, late = write_files(result, job)
    shown = result.keeping(job.patterns)
    well = result.outcome.ok and not late and (shown.certainty is None or shown.certainty.met)
    if wish.as_json:
        from engine.simulation.summary import document

        end = {"exit_code": DONE if well else FAILED}
        print_json(end | document(shown) | {"files": files, "problems": [p.as_dict() for p in late]})
    else:
        from engine.cli.summary import print_summary

        print_summary(shown, files, late)
    return DONE if well else FAILED


def talk(verbose: bool) -> None:
    """Send the engine's log to standard error."""
    if verbose:
        logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(name)s: %(message)s")
        logging.getLogger("trunnion").setLevel(logging.DEBUG)


def understood(wish: Wish) -> Job:
    """The job that the options ask for; SceneError with every problem among them."""
    found = Findings()
    source = options.one_scene(wish.scene, found)
    arguments = options.settings("trunnion kinematics" if wish.kinematic else "trunnion simulate", wish.settings, found)
    law = arguments.pop("law", None)
    arguments |= {"certify": wish.certify, "accuracy": wish.accuracy} if not wish.kinematic else {}
    places = {
        "table": options.destination(wish.save, TABLES, "-o", found),
        "plot": options.destination(wish.plot, PICTURES, "--plot", found),
        "animation": options.destination(wish.animate, MOVING, "--animate", found),
        "linearization": options.destination(wish.linearize, MATRICES, "--linearize", found),
    }
    changes = options.assignments(wish.changes, found)
    scene = loaded(source, changes, law, found, wish.kinematic)
    if scene is not None and wish.kinematic:
        scene = found.attempt(partial(_prescribed, scene))
    patterns = tuple(wish.outputs) if wish.outputs else scene.outputs if scene is not None else ()
    if scene is not None:
        found.problems += unknown_outputs(scene, wish.outputs or ())
    found.end()
    assert scene is not None
    return Job(scene, arguments, patterns, {k: p for k, p in places.items() if p is not None})


def _prescribed(scene: Scene) -> Scene:
    """The scene without all that is no motion, its outputs those of motion."""
    from engine.questions.kinematics import moving_columns, prescribed

    bare = prescribed(scene)
    return replace(bare, outputs=moving_columns(bare))


def loaded(source: str | None, changes: dict[str, Any], law: str | None, found: Findings, massless: bool = False) -> Scene | None:
    """The scene with its changes; None when there are problems, which are kept."""
    from engine.scene.laws import law_changes
    from engine.scene.load import load_scene
    from engine.scene.overrides import apply

    if source is None:
        return None
    scene = found.attempt(partial(load_scene, source, massless))
    if scene is None:
        return None
    if law is not None:
        scene = found.attempt(partial(apply, scene, law_changes(scene, law)), "--law") or scene
    if changes:
        scene = found.attempt(partial(apply, scene, changes), "--set") or scene
    return scene


def unknown_outputs(scene: Scene, patterns: Sequence[str]) -> list[Problem]:
    """Patterns that match no column."""
    from engine.kernel.columns import columns
    from engine.simulation.run import pattern_problems
    from engine.system.build import build

    if not patterns:
        return []
    return pattern_problems(columns(build(scene).system), tuple(p for p in patterns if p != "time"), "--outputs")


def simulated(job: Job) -> Result:
    """Run the job with a progress bar; the columns a moving picture needs are added to those asked for."""
    from engine.cli.progress import Watch
    from engine.simulation.run import simulate

    patterns = [p for p in job.patterns if p != "time"]
    if "animation" in job.files and "*" not in patterns:
        from engine.plots.mechanism import needed

        patterns += needed(job.scene)
    with Watch(job.scene.name) as watch:
        return simulate(job.scene, outputs=patterns, progress=watch.tell, **job.arguments)


def write_files(result: Result, job: Job) -> tuple[dict[str, str], list[Problem]]:
    """Write what was asked for, also from a run that failed; files written, and what stood in the way of others. The table comes
    first and whole, even when Ctrl-C is pressed meanwhile; pictures are given up then."""
    found = Findings()
    written: dict[str, str] = {}
    try:
        if "table" in job.files:
            with held() as interrupt:
                _write_kinds(result, job, ("table",), written, found)
            if interrupt.asked:
                raise KeyboardInterrupt
        _write_kinds(result, job, [k for k in job.files if k != "table"], written, found)
    except KeyboardInterrupt:
        found.add("files", "interrupted before all were written", f"written: {', '.join(written.values()) or 'none'}")
    return written, found.problems


def _write_kinds(result: Result, job: Job, kinds: Sequence[str], written: dict[str, str], found: Findings) -> None:
    """Write files of these kinds; note those written, and what stood in the way of others."""
    from engine.simulation.summary import started

    for kind in kinds:
        path = job.files[kind]
        if not started(result) and kind != "table":
            found.add(kind, "nothing to draw: the run did not get further than its start", "see the outcome")
        elif kind == "linearization" and not result.outcome.ok:
            found.add("--linearize", "the run did not get to its end, where it would be linearised", "see the outcome")
        elif found.attempt(partial(_write, result, job, kind, path)):
            written[kind] = str(path)


def _write(result: Result, job: Job, kind: str, path: Path) -> Path:
    if kind == "table":
        return result.keeping(job.patterns).save(path)
    if kind == "plot":
        from engine.plots import figure, save_figure

        return save_figure(figure(result.keeping(job.patterns)), path)
    if kind == "linearization":
        from engine.simulation.linearize import linearize

        used = result.settings
        return linearize(job.scene, used["until"], [p for p in job.patterns if p != "time"], rtol=used["rtol"]).save(path)
    from engine.cli.progress import Watch
    from engine.plots import animate

    with Watch(path.name) as watch:
        return animate(result, path, watch.tell)
