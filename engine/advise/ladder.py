"""``advise``: from ideal joints up, the error and cost of every rung, and the cheapest that is good enough."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from engine.advise.influence import Influence, influences
from engine.advise.reduce import Form, forms, in_form, planar, rubbing, with_friction_in
from engine.basics.problems import Problem, SceneError, SimulationError
from engine.chart.measures import Measure, measure
from engine.chart.points import Variant
from engine.chart.reference import Reference, reference
from engine.chart.runs import Prepared, methods, predicted, repeated
from engine.kernel.columns import columns
from engine.scene.model import Scene
from engine.simulation.block import Settings
from engine.simulation.run import Model
from engine.system.build import build

TIGHT = 1e-10
"""Relative tolerance of runs that measure a model's own error: what the method adds to it is negligible."""
RTOLS = tuple(10.0**-k for k in range(2, 13))
SURE = 30.0
"""A first-order prediction this many times the wanted error is believed without a run."""
HOPELESS = 10.0
"""A method that takes this many times the best time is slower by itself, not because the machine was busy for a moment."""
Tell = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Setting:
    """Method and tolerance, the total error reached with them, stepping time (minimum and median, s); integration: the part of the
    error that is none of the model's, as the run states it of itself (METHOD, "Global error")."""

    method: str
    rtol: float
    error: float
    minimum: float
    median: float
    integration: float = math.nan


@dataclass(frozen=True)
class Rung:
    """A model: joints that rub, form of their friction (None without any), joints made planar; its own error, and the cheapest
    setting that meets the wanted error (None when none does). predicted: its error by sensitivities alone, when no run was made."""

    joints: tuple[str, ...]
    form: Form | None
    flat: tuple[str, ...]
    model_error: float
    setting: Setting | None
    outcome: str = "done"
    predicted: bool = False

    def describe(self) -> str:
        """The rung in words, for tables and progress."""
        text = f"friction in {', '.join(self.joints)}: {self.form}" if self.joints else "all joints ideal"
        return text + (f"; {', '.join(self.flat)} planar" if self.flat else "")


@dataclass(frozen=True)
class Advice:
    """error wanted, outputs compared, the reference's own error, influences of the joints' friction, all rungs, the chosen one, and
    the scene reduced to it (with its method and tolerance); ``chosen`` is None when no rung meets the error."""

    error: float
    measure: Measure
    reference: Reference
    influences: tuple[Influence, ...]
    rungs: tuple[Rung, ...]
    chosen: Rung | None
    scene: Scene | None
    notes: tuple[str, ...]


@dataclass
class _Partial(Prepared):
    """A lesser model, in which some compared columns may not exist: they count as zero."""

    names: tuple[str, ...] = ()

    def samples(self, result) -> np.ndarray:
        out = np.zeros((len(result.data), len(self.names)))
        at = {c.name: k for k, c in enumerate(result.columns)}
        for i, n in enumerate(self.names):
            if n in at:
                out[:, i] = result.data[:, 1 + at[n]]
        return out


def advise(
    scene: Scene, error: float, outputs: tuple[str, ...], until: float | None = None, norm: str = "rms", repeats: int = 7,
    samples: int = 200, tell: Tell = lambda *_: None,
) -> Advice:
    """Find the cheapest model, method and tolerance whose outputs stay within ``error`` (relative, see ``measures``) of the
    scene's.

    SceneError for wrong input; SimulationError when the scene itself cannot be run by two methods that agree.
    """
    _check(error, outputs)
    what, end = measure(scene, outputs, norm), float(until or scene.simulation.until)
    return _Ladder(scene, error, what, end, repeats, samples, tell).climb()


def _check(error: float, outputs: tuple[str, ...]) -> None:
    problems = []
    if not 1e-9 <= error < 1:
        problems.append(Problem("error", f"{error:g} is out of range", "relative, between 1e-9 and 1; for example 1e-3"))
    if not outputs:
        problems.append(Problem("outputs", "none is given", "what must be right? for example slider.position[1]"))
    if problems:
        raise SceneError(problems)


class _Ladder:
    def __init__(self, scene: Scene, error: float, what: Measure, until: float, repeats: int, samples: int, tell: Tell):
        self.error, self.what, self.until, self.repeats, self.count, self.tell = error, what, until, repeats, samples, tell
        self.forms = forms(scene) if rubbing(scene) else []
        self.scene = in_form(scene, self.forms[-1]) if self.forms else scene
        self.rungs: list[Rung] = []
        self.scenes: list[Scene] = []
        self.notes: list[str] = []

    def climb(self) -> Advice:
        """All rungs from ideal joints up to the one whose model is good enough in its best form."""
        self.tell("reference", 0, 0)
        found = reference(self._ready(self.scene))
        if found is None:
            raise SimulationError("the scene cannot be run to its end by two methods, so that nothing can be measured against it")
        self.reference = found
        if found.error > 0.1 * self.error:
            self.notes.append(f"the reference itself is only known to {found.error:.1e}")
        joints = rubbing(self.scene)
        self.tell("sensitivities", 0, 0)
        order, note = influences(self.scene, joints, self.what, self.until, self.count) if joints else ([], "")
        self.notes += [note] if note else []
        names = [i.joint for i in order]
        for k in range(len(names) + 1):
            if self._level(tuple(names[:k]), order[k:]):
                break
        self._flat()
        chosen = min((r for r in self.rungs if r.setting), key=lambda r: r.setting.median if r.setting else math.inf, default=None)
        reduced = self._final(chosen) if chosen else None
        return Advice(self.error, self.what, found, tuple(order), tuple(self.rungs), chosen, reduced, tuple(self.notes))

    def _level(self, keep: tuple[str, ...], dropped: list[Influence]) -> bool:
        """Add the rungs with friction in these joints; whether one meets the error. What sensitivities rule out is not run."""
        worst = max((i.predicted for i in dropped if math.isfinite(i.predicted)), default=0.0)
        if worst > SURE * self.error:
            self.rungs.append(Rung(keep, self.forms[-1] if keep else None, (), worst, None, predicted=True))
            self.scenes.append(self.scene)
            return False
        some = with_friction_in(self.scene, keep)
        good = False
        for form in self.forms if keep else [None]:
            changed = in_form(some, form) if form else some
            good |= self._rung(keep, form, (), changed).setting is not None
        return good

    def _flat(self) -> None:
        """Try the cheapest good rung again with planar joints, when its motion is planar."""
        best = min((k for k, r in enumerate(self.rungs) if r.setting), key=lambda k: self._cost(k), default=None)
        if best is None:
            return
        changed, flat = planar(self.scenes[best], self.until)
        if flat:
            self._rung(self.rungs[best].joints, self.rungs[best].form, tuple(flat), changed)

    def _cost(self, k: int) -> float:
        setting = self.rungs[k].setting
        return setting.median if setting else math.inf

    def _rung(self, keep: tuple[str, ...], form: Form | None, flat: tuple[str, ...], scene: Scene) -> Rung:
        """Run a model, measure its own error, then look for its cheapest setting; the rung is kept and returned."""
        rung = Rung(keep, form, flat, math.nan, None)
        self.tell(rung.describe(), len(self.rungs), 0)
        try:
            ready = self._ready(scene)
        except SceneError as e:
            rung = replace(rung, outcome=str(e).splitlines()[0])
        else:
            result, outcome = ready.once(Settings(rtol=TIGHT, max_steps=1_000_000))
            if result is None or outcome != "done":
                rung = replace(rung, outcome=outcome)
            else:
                own = self.what.error(ready.samples(result), self.reference.data)
                rung = replace(rung, model_error=own, setting=self._setting(ready) if own <= self.error else None)
        self.rungs.append(rung)
        self.scenes.append(scene)
        return rung

    def _setting(self, ready: Prepared) -> Setting | None:
        """The cheapest setting, and what integration adds to its error."""
        chosen = self._cheapest(ready)
        if chosen is None:
            return None
        settings = Settings(rtol=chosen.rtol, method=chosen.method, max_steps=1_000_000)
        result, _ = ready.once(settings)
        return replace(chosen, integration=predicted(ready, settings, result, self.what)) if result is not None else chosen

    def _cheapest(self, ready: Prepared) -> Setting | None:
        """The method that reaches the wanted error in the least time, at the loosest tolerance that does. A method that takes
        ``HOPELESS`` times as long as the best so far is tightened no further: it would only take longer."""
        found: list[Setting] = []
        for method in methods():
            best = min((s.median for s in found), default=math.inf)
            for rtol in RTOLS:
                settings = Settings(rtol=rtol, method=method, max_steps=1_000_000)
                result, outcome = ready.once(settings)
                if result is None or outcome != "done":
                    continue
                if result.stats.wall_time > HOPELESS * best:
                    break
                total = self.what.error(ready.samples(result), self.reference.data)
                if total <= self.error:
                    low, middle, _ = repeated(lambda s=settings: self._again(ready, s), self.repeats)  # type: ignore[misc]
                    found.append(Setting(method, rtol, total, low, middle))
                    break
        return min(found, key=lambda s: s.median, default=None)

    def _again(self, ready: Prepared, settings: Settings) -> float:
        result, _ = ready.once(settings)
        return result.stats.wall_time if result is not None else math.inf

    def _ready(self, scene: Scene) -> Prepared:
        """The scene compiled, with those of the compared columns that it has."""
        there = {c.name for c in columns(build(scene).system)}
        model = Model(scene, tuple(n for n in self.what.names if n in there) or None)
        model.block.attach_jacobian()
        return _Partial(scene, Variant(), model, self.what, self.until, self.until / self.count, self.what.names)

    def _final(self, chosen: Rung) -> Scene:
        scene = self.scenes[self.rungs.index(chosen)]
        assert chosen.setting is not None
        simulation = replace(scene.simulation, method=chosen.setting.method, rtol=chosen.setting.rtol)
        return replace(scene, simulation=simulation)
