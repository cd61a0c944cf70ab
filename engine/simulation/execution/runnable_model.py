"""Runnable models: structure, kernel and block of a scene."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from trunnion.basics.errors import MOST, Problem, raise_problems
from trunnion.basics.name_patterns import MOST_WILD, is_wild, suggestion, unmatched
from trunnion.kernel.interface.output_columns import Column, columns, current_patterns, needs_quadratures, select
from trunnion.kernel.shared_libraries import Kernel, kernel
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.units.python_arguments import Names, names_given
from trunnion.simulation.execution.starts_at_cuts_and_points import build_with_starts
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.kernel_choice import kernel_for
from trunnion.system.construction.system_builder import Built
from trunnion.system.structure.bodies_and_joints import System


class Model:
    """A scene with its structure, kernel and block, ready to run. Parameters may change between runs of the same structure.

    scene: a checked scene. outputs: patterns of columns; default: those of the scene. kernel: kind of kernel; None: chosen by the
    structure and ``runs``. runs: expected number of runs; infinite if the model will be stepped for a long time. built: the result
    of ``build_with_starts``, if it is known. Raises SceneError for unknown columns."""

    def __init__(
        self, scene: Scene, outputs: Names | None = None, kernel: str | None = None, runs: float = 1, built: Built | None = None
    ):
        started = time.perf_counter()
        self.built: Built = built or build_with_starts(scene)
        self.available: list[Column] = columns(self.built.system)
        wanted = names_given(outputs if outputs is not None else scene.outputs)
        raise_problems(pattern_problems(self.available, wanted))
        self.columns: list[Column] = select(self.available, wanted)
        self.build_seconds = 0.0
        self.kernel_kind = kernel_for(kernel, self.built.system, runs)
        self._load(redundant=False)
        self._reactions: Model | None = None
        self.columns_of_loops: dict[tuple[str, ...], Any] = {}  # values that ``open_reactions`` caches
        self.perhaps_open: dict[tuple[str, ...], list[Column]] = {}
        self.with_inertia_at = b""  # data of the last start that passed the check of missing inertia
        self.setup_seconds = time.perf_counter() - started - self.build_seconds

    def _load(self, redundant: bool) -> None:
        self.kernel = self.variant(redundant)
        self.build_seconds += self.kernel.build_seconds
        self.block = bl.Block(self.kernel, self.built.numbers, np.array(self.built.parameters.values))

    def variant(self, redundant: bool) -> Kernel:
        """The kernel, or a variant. redundant: whether to return the variant for friction that depends on reactions of redundant
        loops."""
        make: Callable[..., Kernel] = kernel
        if self.kernel_kind == "parts":
            from trunnion.parts.kernels.scene_kernel import parts_kernel

            make = parts_kernel
        return make(self.system, len(self.built.parameters.values), self.columns, needs_quadratures(self.columns), redundant)

    def with_reactions(self, names: list[str]) -> Model:
        """A model of the same scene whose columns are ``names``, which show reactions. Later calls return the same model."""
        if self._reactions is None or self._reactions.system != self.system:
            self._reactions = Model(self.built.scene, names, "parts", built=self.built)
        if len(self._reactions.built.numbers.breaks) != len(self.built.numbers.breaks):
            self._reactions.built = self.built
            self._reactions._load(redundant=False)
        other = self._reactions.block
        if other.numbers is not self.built.numbers or not np.array_equal(other.parameters, self.block.parameters):
            other.take(self.built.numbers, np.array(self.block.parameters))
        return self._reactions

    def begin(self, settings: bl.Settings, t: float, until: float, every: float, row: np.ndarray | None = None) -> int:
        """Start a run from an assembled block. t, until, every: s. Fills ``row`` (columns + 1), if any, and returns the ``Status``.

        If friction depends on reactions of redundant loops, the model loads the redundant kernel and starts in the same state."""
        status = self.block.start(t, until, every, row)
        if status != bl.NEED_REDUNDANT:
            return status
        y, x = self.block.y.copy(), self.block.x.copy()  # x is copied for the flags of open contacts
        self._load(redundant=True)
        self.block.configure(settings)
        self.block.y[:], self.block.x[:] = y, x
        return self.block.start(t, until, every, row)

    @property
    def system(self) -> System:
        """The structure of the mechanism."""
        return self.built.system


def pattern_problems(everything: list[Column], patterns: tuple[str, ...], where: str = "outputs") -> list[Problem]:
    """A problem for every pattern that matches no column. The first MOST problems suggest similar names."""
    patterns = tuple(current_patterns(patterns, everything))
    wild = sum(map(is_wild, patterns))
    if wild > MOST_WILD:
        return [Problem(where, f"{wild} patterns with wild cards; {MOST_WILD} at most", "use fewer; * matches many columns")]
    problems: list[Problem] = []
    names = [c.name for c in everything]
    for p in unmatched((p for p in patterns if p != "*"), names):
        near = names if len(problems) < MOST else ()
        hint = suggestion(p[:80], near, "see `trunnion check SCENE --columns` for the names", 3, 0.4)
        problems.append(Problem(where, f"pattern {shown(p, 80)} matches no column", hint))
    return problems
