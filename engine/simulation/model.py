"""A scene made ready to run."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from engine.basics.patterns import MOST_WILD, is_wild, unmatched
from engine.basics.problems import MOST, Problem, SceneError
from engine.kernel.columns import Column, columns, needs_quadratures, select
from engine.kernel.library import Kernel, kernel
from engine.scene.given import Names, names_given
from engine.scene.model import Scene
from engine.scene.suggest import shown
from engine.simulation import block as bl
from engine.simulation.choosing import kernel_for
from engine.system.build import Built, build
from engine.system.structure import System


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
