"""The request of a work-precision measurement, and its results (measured runs and reference solutions)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field

import numpy as np

from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.analysis.work_precision.machine_description import describe_machine
from trunnion.analysis.work_precision.measurement_points import ENGINE, FrictionVariant, Measurement
from trunnion.analysis.work_precision.reference_solution import Reference
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.scene import Scene

Progress = Callable[[str, int, int], None]
"""progress(what is measured now, number of finished measurements, number of all measurements)."""


@dataclass(frozen=True)
class WorkPrecisionRequest:
    """The request of a measurement; an empty tuple selects everything available.

    Attributes:
        methods: names of integration methods.
        rtols: relative tolerances.
        laws: names of friction laws.
        v_eps: regularisation speeds, m/s.
        outputs: patterns of the columns to compare.
        norm: "max" or "rms" over the sample times.
        until: end of the runs, s; None means the scene's own end time.
        samples: number of sample times to compare.
        repeats: number of timed runs of each setting.
        fixed: whether to measure fixed steps also.
        solvers: whether to measure installed reference solvers also.
    """

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
    solvers: bool = True


@dataclass
class WorkPrecision:
    """The results of a measurement.

    Attributes:
        exact: the friction variant of the most exact law, which is the reference for model errors.
        points: all measured runs.
        references: reference solution by friction variant.
        builds: (what was built, build time in s) of each build.
        solvers: (name, version, its omissions, or the reason why it was not run) of each reference solver.
    """

    scene: Scene
    request: WorkPrecisionRequest
    measure: ErrorMeasure
    until: float
    exact: FrictionVariant
    points: list[Measurement] = field(default_factory=list)
    references: dict[FrictionVariant, Reference] = field(default_factory=dict)
    builds: list[tuple[str, float]] = field(default_factory=list)
    solvers: list[tuple[str, str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    machine: dict[str, str] = field(default_factory=describe_machine)

    def engine_points(self) -> list[Measurement]:
        """Points measured with the engine."""
        return [p for p in self.points if p.program == ENGINE]

    def solver_points(self) -> list[Measurement]:
        """Points measured with reference solvers."""
        return [p for p in self.points if p.program != ENGINE]

    def errors(self, variant: FrictionVariant, data: np.ndarray) -> tuple[float, float]:
        """(distance from the reference of the same law, distance from the reference of the exact law); NaN if a reference is
        missing."""
        own, exact = self.references.get(variant), self.references.get(self.exact)
        return (
            self.measure.error(data, own.data) if own else math.nan,
            self.measure.error(data, exact.data) if exact else math.nan,
        )
