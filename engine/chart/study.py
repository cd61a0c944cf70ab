"""``chart``: measure a scene with every method, tolerance, step and law, and every installed peer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from engine.chart.machine import describe
from engine.chart.measures import Measure, measure
from engine.chart.points import OURS, Point, Variant
from engine.chart.reference import Reference, reference
from engine.chart.runs import MOST_STEPS, Prepared, exact_law, methods, predicted, prepare, repeated, variants
from engine.scene.model import Scene
from engine.simulation.block import Settings

TOLERANCES = tuple(10.0**-k for k in range(2, 13))
FIXED = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
"""Fixed steps as multiples of the mean step that the automatic choice takes at rtol 1e-6."""
Tell = Callable[[str, int, int], None]
"""tell(what is measured now, how many are done, how many there are)."""


@dataclass(frozen=True)
class Choice:
    """What to chart; an empty tuple means everything there is. until: end of the runs in s (None: the scene's); samples: number of
    times compared; repeats: runs of each setting, for its time."""

    methods: tuple[str, ...] = ()
    rtols: tuple[float, ...] = ()
    laws: tuple[str, ...] = ()
    v_eps: tuple[float, ...] = ()
    outputs: tuple[str, ...] = ()
    norm: str = "max"
    until: float | None = None
    samples: int = 100
    repeats: int = 7
    fixed: bool = True
    peers: bool = True


@dataclass
class Study:
    """Everything that was measured. references: by law and v_eps; builds: (what, seconds); peers: (name, version, what it leaves
    out or why it was not run)."""

    scene: Scene
    choice: Choice
    measure: Measure
    until: float
    exact: Variant
    points: list[Point] = field(default_factory=list)
    references: dict[Variant, Reference] = field(default_factory=dict)
    builds: list[tuple[str, float]] = field(default_factory=list)
    peers: list[tuple[str, str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    machine: dict[str, str] = field(default_factory=describe)

    def ours(self) -> list[Point]:
        """Points measured with the engine."""
        return [p for p in self.points if p.program == OURS]

    def theirs(self) -> list[Point]:
        """Points measured with other programs."""
        return [p for p in self.points if p.program != OURS]

    def errors(self, variant: Variant, data: np.ndarray) -> tuple[float, float]:
        """(distance from the reference of the same law, from that of the exact law); NaN where there is no reference."""
        own, exact = self.references.get(variant), self.references.get(self.exact)
        return (
            self.measure.error(data, own.data) if own else math.nan,
            self.measure.error(data, exact.data) if exact else math.nan,
        )


def chart(scene: Scene, choice: Choice | None = None, tell: Tell = lambda *_: None) -> Study:
    """Measure a scene. A run that fails becomes a point with its outcome; nothing is raised for it.

    scene: checked. choice: restrictions. tell: progress. SceneError for outputs that do not exist.
    """
    choice = choice or Choice()
    what = measure(scene, choice.outputs, choice.norm)
    until = float(choice.until or scene.simulation.until)
    laws, notes = variants(scene, choice.laws, choice.v_eps)
    study = Study(scene, choice, what, until, _exact(scene, laws), notes=notes)
    ready = _prepared(study, laws, tell)
    settings = _settings(study, ready)
    total = sum(map(len, settings.values()))
    done = 0
    for variant, wanted in settings.items():
        for s in wanted:
            tell(f"{variant} {s.method}".strip(), done, total)
            study.points.append(_point(study, ready[variant], s))
            done += 1
    if choice.peers:
        from engine.chart.peers import measure_peers

        measure_peers(study, ready, tell)
    return study


def _exact(scene: Scene, laws: list[Variant]) -> Variant:
    """The variant that stands for the truth: the exact law, or the sharpest v_eps of the scene's own law."""
    named = [v for v in laws if v.law == exact_law(scene)] or laws
    return min(named, key=lambda v: v.v_eps)


def _prepared(study: Study, laws: list[Variant], tell: Tell) -> dict[Variant, Prepared]:
    """The scene compiled with each of these laws; their references and the times of building are added to the study."""
    out = {}
    for k, v in enumerate(laws):
        tell(f"reference {v}".strip(), k, len(laws))
        out[v] = prepare(study.scene, v, study.measure, study.until, study.choice.samples)
        found = reference(out[v])
        if found is None:
            study.notes.append(f"{v}: no two methods reach the end at tight tolerance, so no errors are given")
        else:
            study.references[v] = found
    for law in dict.fromkeys(v.law for v in laws):
        study.builds += _builds(next(out[v] for v in laws if v.law == law))
    return out


def _builds(ready: Prepared) -> list[tuple[str, float]]:
    """Symbolic and compile seconds of a kernel as recorded when it was built, and of its Jacobian unit, built again to measure."""
    import tempfile
    import time
    from pathlib import Path

    from engine.kernel.library import build_jacobian

    facts, law = ready.model.kernel.facts, f" ({ready.variant.law})" if ready.variant.law else ""
    out = [(f"equations{law}", facts["symbolic_seconds"]), (f"compile{law}", facts["compile_seconds"])]
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        build_jacobian(Path(folder), ready.model.kernel.structure)
        out.append((f"Jacobian{law}, only for stiff methods", time.perf_counter() - started))
    return out


def _settings(study: Study, ready: dict[Variant, Prepared]) -> dict[Variant, list[Settings]]:
    """For every law, the settings to run: each method at each tolerance and, if asked for, with fixed steps."""
    choice, out = study.choice, {}
    for variant, prepared in ready.items():
        chosen = [m for m in methods() if not choice.methods or m in choice.methods]
        some = [Settings(rtol=r, method=m, max_steps=MOST_STEPS) for m in chosen for r in choice.rtols or TOLERANCES]
        if choice.fixed:
            mean = _mean_step(prepared)
            steps = [study.until / max(1, math.ceil(study.until / (f * mean))) for f in FIXED] if mean else []
            some += [Settings(method=m, step=h, max_steps=MOST_STEPS) for m in chosen if m != "auto" for h in steps]
        out[variant] = some
    return out


def _mean_step(ready: Prepared) -> float:
    """Mean step of the automatic choice at rtol 1e-6, s; 0 when it fails."""
    result, outcome = ready.once(Settings(rtol=1e-6, max_steps=MOST_STEPS))
    return ready.until / max(1, result.stats.steps) if result is not None and outcome == "done" else 0.0


def _point(study: Study, ready: Prepared, settings: Settings) -> Point:
    """Run a setting, repeat it for its time, and compare it with the references."""
    result, outcome = ready.once(settings)
    rtol = 0.0 if settings.step else settings.rtol
    where = (OURS, settings.method, rtol, settings.step, ready.variant.law, ready.variant.v_eps)
    if result is None:
        return Point(*where, math.nan, math.nan, math.nan, math.nan, 0, outcome=outcome)
    s = result.stats
    counts = {"steps": s.steps, "rejected": s.rejected, "evaluations": s.rhs_evaluations, "events": s.events, "outcome": outcome}
    if outcome != "done":
        return Point(*where, math.nan, math.nan, s.wall_time, s.wall_time, 1, **counts)  # type: ignore[arg-type]

    def again() -> float:
        other, _ = ready.once(settings)
        return other.stats.wall_time if other is not None else math.inf

    low, middle, count = repeated(again, study.choice.repeats)
    counts["predicted"] = predicted(ready, settings, result, study.measure)
    return Point(*where, *study.errors(ready.variant, ready.samples(result)), low, middle, count, **counts)  # type: ignore[arg-type]
