"""``simulate``: a scene in, a Result out."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from engine.basics.patterns import MOST_WILD, is_wild, unmatched
from engine.basics.problems import MOST, Problem, SceneError
from engine.kernel.columns import Column, columns, needs_quadratures, select
from engine.kernel.library import Kernel, kernel
from engine.scene.given import Amount, Names, names_given
from engine.scene.model import Scene
from engine.scene.overrides import Given, scene_given
from engine.scene.suggest import shown
from engine.simulation import block as bl
from engine.simulation.asked import check_settings
from engine.simulation.choosing import kernel_for
from engine.simulation.result import Result
from engine.simulation.settings import Run, described, settings_given
from engine.simulation.stepping import OneRun, Progress
from engine.system.build import Built, build
from engine.system.structure import System

log = logging.getLogger("trunnion.simulate")


class Model:
    """A scene made ready to run: structure, kernel and block. Runs of the same structure share the kernel, and the scene's
    numbers may be changed between runs. runs: how many of them were asked for (infinity: it is stepped for long)."""

    def __init__(self, scene: Scene, outputs: Names | None = None, kernel: str | None = None, runs: float = 1):
        started = time.perf_counter()
        self.built: Built = build(scene)
        everything = columns(self.built.system)
        wanted = names_given(outputs if outputs is not None else scene.outputs)
        if problems := pattern_problems(everything, wanted):
            raise SceneError(problems)
        self.columns: list[Column] = select(everything, wanted)
        self.build_seconds = 0.0
        self.kernel_kind = kernel_for(kernel, self.built.system, runs)
        self._load(redundant=False)
        self.setup_seconds = time.perf_counter() - started - self.build_seconds

    def _load(self, redundant: bool) -> None:
        self.kernel = self.variant(redundant)
        self.build_seconds += self.kernel.build_seconds
        self.block = bl.Block(self.kernel, self.built.numbers, np.array(self.built.parameters.values))

    def variant(self, redundant: bool) -> Kernel:
        """Its kernel, or the redundant one."""
        chosen = (self.columns, needs_quadratures(self.columns), redundant)
        return _maker(self.kernel_kind)(self.system, len(self.built.parameters.values), *chosen)

    def begin(self, settings: bl.Settings, t: float, until: float, every: float, row: np.ndarray) -> int:
        """Start a run from an assembled block. When friction turns out to depend on reactions that redundant loops leave open, the
        kernel's redundant variant takes over, in the same state."""
        status = self.block.start(t, until, every, row)
        if status != bl.NEED_REDUNDANT:
            return status
        y = self.block.y.copy()
        self._load(redundant=True)
        self.block.configure(settings)
        self.block.y[:] = y
        return self.block.start(t, until, every, row)

    @property
    def system(self) -> System:
        """The mechanism's structure."""
        return self.built.system


def _maker(kind: str) -> Callable[..., Kernel]:
    """What makes kernels of a kind."""
    if kind == "parts":
        from engine.parts.kernel import parts_kernel

        return parts_kernel
    return kernel


def pattern_problems(everything: list[Column], patterns: tuple[str, ...], where: str = "outputs") -> list[Problem]:
    """A problem for every pattern that matches no column. Close names are looked for only in the problems that are told."""
    from difflib import get_close_matches

    wild = sum(map(is_wild, patterns))
    if wild > MOST_WILD:
        return [Problem(where, f"{wild} patterns with wild cards; {MOST_WILD} at most", "a few patterns with * say the same")]
    problems: list[Problem] = []
    names = [c.name for c in everything]
    for p in unmatched((p for p in patterns if p != "*"), names):
        near = get_close_matches(p[:80], names, 3, 0.4) if len(problems) < MOST else []
        hint = f"did you mean {', '.join(near)}?" if near else "see `trunnion check SCENE --outputs` for the names"
        problems.append(Problem(where, f"pattern {shown(p, 80)} matches no column", hint))
    return problems


@described("engine.simulate")
def simulate(
    scene: Given,
    until: Amount | None = None,
    every: Amount | None = None,
    rtol: Amount | None = None,
    method: str | None = None,
    kernel: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    outputs: Names | None = None,
    step: Amount | None = None,
    max_steps: int = 0,
    progress: Progress | None = None,
) -> Result:
    """Run a scene.

    scene: a Scene, a file, a bundled model's name, or a dict as it would stand in a file. overrides:
    {"joints.ball.friction.mu": 0.5, …}. outputs: a pattern of columns, or several. rtol is absolute too, in the scene's own scales.
    max_steps: give up after so many (0: never). Raises SceneError for wrong input; a run that cannot go on returns a Result with
    what it has and a named outcome. Ctrl-C while it steps does the same: every row and event up to then, outcome ``stopped``; a
    script that should end with it raises KeyboardInterrupt when it finds that outcome. Before the first row, while the kernel is
    built, there is nothing to keep, and KeyboardInterrupt is raised.
    """
    loaded = scene_given(scene, overrides)
    asked = {"until": until, "every": every, "rtol": rtol, "method": method, "step": step, "kernel": kernel}
    chosen = settings_given("engine.simulate", asked)
    fixed = chosen.pop("step") or 0.0
    own = Run(**chosen)
    end, spacing, tolerance = own.of(loaded)
    jams = loaded.simulation.jams == "impact"
    settings = bl.Settings(tolerance, own.method_of(loaded), fixed, max_steps=max_steps, through_jams=jams)
    patterns = names_given(loaded.outputs if outputs is None else outputs)
    check_settings(end, spacing, settings, loaded, patterns)
    return OneRun(Model(loaded, patterns, own.kernel), end, spacing, settings, progress).result()


def run(model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None = None) -> Result:
    """Carry out one run as part of larger work: assemble, start, step to the end; on a failure everything up to it is kept.
    When Ctrl-C stops it, KeyboardInterrupt is raised, because the interrupt is meant for the whole work."""
    result = OneRun(model, until, every, settings, progress).result()
    if result.outcome.name == "stopped":
        raise KeyboardInterrupt
    return result
