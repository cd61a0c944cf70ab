"""``advise``: compares models of a scene with increasing friction detail, from ideal joints to the full scene. Such a model, with
its error and cost, is a *rung*. The answer is the cheapest rung that meets the requested error."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from trunnion.analysis.advice.device_cautions import device_cautions
from trunnion.analysis.advice.friction_influence import FrictionInfluence, rank_influences
from trunnion.analysis.advice.simplified_models import (
    FrictionForm,
    apply_form,
    friction_forms,
    frictional_joints,
    keep_friction,
    make_planar,
)
from trunnion.analysis.work_precision.benchmark_model import (
    MOST_STEPS,
    BenchmarkModel,
    estimate_integration_error,
    methods,
    time_repeats,
)
from trunnion.analysis.work_precision.error_measure import ErrorMeasure, make_error_measure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.analysis.work_precision.reference_solution import Reference, find_reference
from trunnion.analysis.work_precision.request_and_results import Progress
from trunnion.basics.errors import Problem, SceneError, SimulationError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.system_builder import build

TIGHT = 1e-10
"""Relative tolerance of runs that measure the error of a model itself. At this tolerance the integration error is negligible."""
RTOLS = tuple(10.0**-k for k in range(2, 13))
SURE = 30.0
"""A rung is excluded without a run if its predicted error exceeds the requested error by this factor."""
TOO_SLOW = 10.0
"""A method counts as slower if its time exceeds the best time by this factor. Other work of the machine may cause smaller
differences."""


@dataclass(frozen=True)
class Setting:
    """A method at a tolerance. error: total error; minimum, median: stepping time, s.

    integration: the part of the error that comes from integration, as the run estimates this part (theory, "Global error").
    """

    method: str
    rtol: float
    error: float
    minimum: float
    median: float
    integration: float = math.nan


@dataclass(frozen=True)
class Rung:
    """A rung of ``advise``: a model with its error and its cheapest setting.

    Attributes:
        joints: joints with friction.
        form: form of friction in these joints; None if no joint has friction.
        flat: ideal ball joints that are replaced by revolutes.
        model_error: error of the model itself.
        setting: the cheapest setting that meets the requested error; None if no setting does.
        predicted: whether ``model_error`` comes from sensitivities alone.
    """

    joints: tuple[str, ...]
    form: FrictionForm | None
    flat: tuple[str, ...]
    model_error: float
    setting: Setting | None
    outcome: str = "done"
    predicted: bool = False

    def describe(self) -> str:
        """The model in words."""
        text = f"friction in {', '.join(self.joints)}: {self.form}" if self.joints else "all joints ideal"
        return text + (f"; {', '.join(self.flat)} planar" if self.flat else "")


@dataclass(frozen=True)
class Advice:
    """The answer of ``advise``. error: the requested error; chosen: the cheapest sufficient rung, None if no rung meets the error;
    scene: the scene reduced to the chosen rung, with its method and tolerance."""

    error: float
    measure: ErrorMeasure
    reference: Reference
    influences: tuple[FrictionInfluence, ...]
    rungs: tuple[Rung, ...]
    chosen: Rung | None
    scene: Scene | None
    notes: tuple[str, ...]


class _Partial(BenchmarkModel):
    """A reduced model. A compared column that the model lacks counts as zero."""

    def samples(self, result) -> np.ndarray:
        return np.column_stack([result[n] if n in result else np.zeros(len(result)) for n in self.measure.names])


def advise(
    scene: Scene, error: float, outputs: tuple[str, ...], until: float | None = None, norm: str = "rms", repeats: int = 7,
    samples: int = 200, progress: Progress = lambda *_: None,
) -> Advice:
    """Find the cheapest model, method and tolerance whose outputs stay within ``error`` of the outputs of the full scene.

    error: relative error (``ErrorMeasure``); until: end of the runs, s. Raises SceneError for wrong input. Raises SimulationError
    if fewer than two methods run the scene to its end.
    """
    _check(error, outputs)
    what, end = make_error_measure(scene, outputs, norm), float(until or scene.simulation.until)
    return _Ladder(scene, error, what, end, repeats, samples, progress).climb()


def _check(error: float, outputs: tuple[str, ...]) -> None:
    problems = []
    if not 1e-9 <= error < 1:
        problems.append(Problem("error", f"{error:g} is out of range", "relative, between 1e-9 and 1; for example 1e-3"))
    if not outputs:
        problems.append(Problem("outputs", "no output is given", "name outputs that must be accurate, such as slider.position[1]"))
    raise_problems(problems)


class _Ladder:
    def __init__(
        self, scene: Scene, error: float, what: ErrorMeasure, until: float, repeats: int, samples: int, progress: Progress
    ):
        self.error, self.what, self.until, self.repeats, self.count, self.progress = error, what, until, repeats, samples, progress
        self.notes: list[str] = device_cautions(scene)
        self.forms = self._possible_forms(scene) if frictional_joints(scene) else []
        self.scene = apply_form(scene, self.forms[-1]) if self.forms else scene
        self.rungs: list[Rung] = []
        self.scenes: list[Scene] = []

    def _possible_forms(self, scene: Scene) -> list[FrictionForm]:
        """The forms of friction that the scene can have; a note names the others."""
        out = []
        for form in friction_forms(scene):
            try:
                apply_form(scene, form)
            except SceneError as e:
                self.notes.append(f"not tried: {form}: {e.problems[0].what}")
            else:
                out.append(form)
        return out

    def climb(self) -> Advice:
        """Add all rungs, from ideal joints up to the first sufficient model."""
        self.progress("reference", 0, 0)
        found = find_reference(self._compile(self.scene))
        if found is None:
            raise SimulationError("no two methods run the scene to its end, so there is no reference to measure errors against")
        self.reference = found
        if found.error > 0.1 * self.error:
            self.notes.append(f"the reference solution itself has an error of {found.error:.1e}")
        joints = frictional_joints(self.scene)
        self.progress("sensitivities", 0, 0)
        order, note = rank_influences(self.scene, joints, self.what, self.until, self.count) if joints else ([], "")
        self.notes += [note] if note else []
        names = [i.joint for i in order]
        for k in range(len(names) + 1):
            if self._add_rungs(tuple(names[:k]), order[k:]):
                break
        self._try_planar_joints()
        best = self._cheapest()
        chosen, reduced = (None, None) if best is None else (self.rungs[best], self._reduced_scene(best))
        return Advice(self.error, self.what, found, tuple(order), tuple(self.rungs), chosen, reduced, tuple(self.notes))

    def _add_rungs(self, keep: tuple[str, ...], dropped: list[FrictionInfluence]) -> bool:
        """Add the rungs with friction in the joints ``keep``; returns whether a rung meets the requested error. If the predicted
        error is far above the requested one (``SURE``), no model is run, and the rung gets the predicted error."""
        worst = max((i.predicted for i in dropped if math.isfinite(i.predicted)), default=0.0)
        if worst > SURE * self.error:
            self.rungs.append(Rung(keep, self.forms[-1] if keep else None, (), worst, None, predicted=True))
            self.scenes.append(self.scene)
            return False
        some = keep_friction(self.scene, keep)
        good = False
        for form in self.forms if keep else [None]:
            changed = apply_form(some, form) if form else some
            good |= self._add_rung(keep, form, (), changed).setting is not None
        return good

    def _try_planar_joints(self) -> None:
        """Add the cheapest sufficient rung with planar joints, if its motion is planar."""
        best = self._cheapest()
        if best is None:
            return
        changed, flat = make_planar(self.scenes[best], self.until)
        if flat:
            self._add_rung(self.rungs[best].joints, self.rungs[best].form, tuple(flat), changed)

    def _cheapest(self) -> int | None:
        """Index of the cheapest sufficient rung."""
        medians = {k: r.setting.median for k, r in enumerate(self.rungs) if r.setting}
        return min(medians, key=medians.__getitem__, default=None)

    def _add_rung(self, keep: tuple[str, ...], form: FrictionForm | None, flat: tuple[str, ...], scene: Scene) -> Rung:
        """Run a model, measure the error of the model itself, find its cheapest setting, and add the rung. Returns the rung."""
        rung = Rung(keep, form, flat, math.nan, None)
        self.progress(rung.describe(), len(self.rungs), 0)
        try:
            ready = self._compile(scene)
        except SceneError as e:
            rung = replace(rung, outcome=str(e).splitlines()[0])
        else:
            result, outcome = ready.once(Settings(rtol=TIGHT, max_steps=MOST_STEPS))
            if result is None or outcome != "done":
                rung = replace(rung, outcome=outcome)
            else:
                own = self.what.error(ready.samples(result), self.reference.data)
                rung = replace(rung, model_error=own, setting=self._choose_setting(ready) if own <= self.error else None)
        self.rungs.append(rung)
        self.scenes.append(scene)
        return rung

    def _choose_setting(self, ready: BenchmarkModel) -> Setting | None:
        """The cheapest setting, with the part of its error that comes from integration."""
        chosen = self._find_cheapest(ready)
        if chosen is None:
            return None
        settings = Settings(rtol=chosen.rtol, method=chosen.method, max_steps=MOST_STEPS)
        result, _ = ready.once(settings)
        if result is None:
            return chosen
        return replace(chosen, integration=estimate_integration_error(ready, settings, result, self.what))

    def _find_cheapest(self, ready: BenchmarkModel) -> Setting | None:
        """The method that reaches the requested error in the least time. For each method, tolerances are tried from the loosest on.
        A method's trials end when a tolerance suffices, or when the method takes TOO_SLOW times the best time."""
        found: list[Setting] = []
        for method in methods(ready.scene):
            best = min((s.median for s in found), default=math.inf)
            for rtol in RTOLS:
                settings = Settings(rtol=rtol, method=method, max_steps=MOST_STEPS)
                result, outcome = ready.once(settings)
                if result is None or outcome != "done":
                    continue
                if result.stats.wall_time > TOO_SLOW * best:
                    break
                total = self.what.error(ready.samples(result), self.reference.data)
                if total <= self.error:
                    low, middle, _ = time_repeats(partial(ready.seconds, settings), self.repeats)
                    found.append(Setting(method, rtol, total, low, middle))
                    break
        return min(found, key=lambda s: s.median, default=None)

    def _compile(self, scene: Scene) -> BenchmarkModel:
        """The scene, compiled with those compared columns that the scene has."""
        there = {c.name for c in columns(build(scene).system)}
        model = Model(scene, tuple(n for n in self.what.names if n in there) or None)
        model.block.attach_jacobian()
        return _Partial(scene, FrictionVariant(), model, self.what, self.until, self.until / self.count)

    def _reduced_scene(self, k: int) -> Scene:
        scene, setting = self.scenes[k], self.rungs[k].setting
        assert setting is not None
        return replace(scene, simulation=replace(scene.simulation, method=setting.method, rtol=setting.rtol))
