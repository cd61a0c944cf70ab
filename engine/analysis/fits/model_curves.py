"""The measured columns as functions of the parameters over all runs: values from plain runs, and their derivatives.

For set-valued friction laws, ``sensitivity`` gives the derivatives, which are exact even across stick events; plain runs make the
same steps. For smooth stiff laws (bristles, regularised), runs use the scene's own method, and finite differences give the
derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from trunnion.analysis.fits.bounds_and_priors import RUN_SEPARATOR, order_constraints
from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.analysis.sensitivities.initial_data_derivatives import parameter_values
from trunnion.analysis.sensitivities.sensitivity import DifferentiatedRuns
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.interrupts import heed
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.integrators import RK8
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply
from trunnion.simulation.execution.starts_at_cuts_and_points import build_with_starts
from trunnion.simulation.results.outcome import from_status
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl

MOST_CACHED = 6
"""Number of parameter vectors for which curves and derivatives are cached."""
DIFFERENCE_STEP = 1e-3
"""Step of central differences, relative to the parameter. The relative error is about step² + rtol/step."""
STEPS_PER_CALL = 1000
"""Number of steps between two checks for Ctrl-C."""
GO_ON = (bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.NEED_JACOBIAN)


def parameter_names(shared: Sequence[str], own: Sequence[str], runs: Sequence[MeasuredRun]) -> list[str]:
    """Names of the m parameters: paths of the shared parameters, then ``PATH @ RUN`` for separate parameters of each run."""
    return [*shared, *(f"{p}{RUN_SEPARATOR}{r.name}" for r in runs for p in own)]


def start_values(scenes: Sequence[Scene], shared: Sequence[str], own: Sequence[str]) -> np.ndarray:
    """The start values (m) of the parameters: numbers of the runs' scenes. Raises SceneError for a path that is not a number."""
    starts = [dict(zip([*shared, *own], parameter_values(s, [*shared, *own]), strict=True)) for s in scenes]
    return np.array([*(starts[0][p] for p in shared), *(s[p] for s in starts for p in own)])


class ModelCurves:
    """The curves of all runs as one vector of N values, ordered by run, curve and time.

    Attributes:
        names: ``parameter_names``.
        exact: whether the derivatives are exact; otherwise they are central differences.
        pairs: (low, high): index pairs of parameters that must be in order.
    """

    def __init__(self, scene: Scene, shared: Sequence[str], own: Sequence[str], runs: Sequence[MeasuredRun], rtol: float):
        self.runs, self.rtol = list(runs), rtol
        self.names = parameter_names(shared, own, runs)
        self.shared, self.own = list(shared), list(own)
        self.scenes = [apply(scene, dict(r.overrides)) if r.overrides else scene for r in runs]
        laws = [scene.law_of(j.friction) for j in scene.joints.values() if j.friction is not None]
        self.exact = all(LAWS[law].sets for law in laws)
        self.pairs = order_constraints(self.names, scene)
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self._last: tuple[bytes, np.ndarray] = (b"", np.zeros(0))

    @cached_property
    def plain(self) -> list[_PlainRuns]:
        """For each measured run, an object that makes plain runs of the run's scene."""
        return [_PlainRuns(s, list(r.curves), r, self.rtol, self.exact) for s, r in zip(self.scenes, self.runs, strict=True)]

    @cached_property
    def differentiated(self) -> list[DifferentiatedRuns]:
        """For each measured run, an object that makes runs with derivatives of the run's scene."""
        paths = [*self.shared, *self.own]
        given = zip(self.scenes, self.runs, strict=True)
        return [DifferentiatedRuns(s, paths, list(r.curves), r.until, r.every, self.rtol) for s, r in given]

    def apply_order(self, values: np.ndarray) -> np.ndarray:
        """Parameter values (m) in the required order. If the upper parameter of a pair is below the lower one, the upper parameter
        gets the value of the lower one."""
        out = np.array(values, float)
        for low, high in self.pairs:
            out[high] = max(out[high], out[low])
        return out

    def _indices(self, k: int) -> list[int]:
        """Indices of the parameters of run k."""
        first = len(self.shared) + k * len(self.own)
        return [*range(len(self.shared)), *range(first, first + len(self.own))]

    def _scene_with(self, k: int, values: np.ndarray) -> Scene:
        paths = [*self.shared, *self.own]
        return apply(self.scenes[k], dict(zip(paths, values[self._indices(k)].tolist(), strict=True)))

    def values(self, values: np.ndarray) -> np.ndarray:
        """The curves (N) at the parameter values (m). Raises SceneError or SimulationError if the runs fail."""
        if (known := self._known.get(np.ascontiguousarray(values).tobytes())) is not None:
            return known[0]
        values = self.apply_order(values)
        if values.tobytes() != self._last[0]:
            found = np.concatenate([run(self._scene_with(k, values)) for k, run in enumerate(self.plain)])
            self._last = values.tobytes(), found
        return self._last[1]

    def slopes(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(curves (N), derivatives of the curves by the parameters (N × m)). Errors as for ``values``."""
        key = np.ascontiguousarray(values).tobytes()
        if key not in self._known:
            at = self.apply_order(values)
            found = self._exact(at) if self.exact else self._differences(at)
            for low, high in self.pairs:
                if values[high] < values[low]:  # apply_order set ``high`` to the value of ``low``
                    found[1][:, low] += found[1][:, high]
                    found[1][:, high] = 0.0
            while len(self._known) >= MOST_CACHED:  # the first entry stays, because searches start there
                del self._known[list(self._known)[1]]
            self._known[key] = found
        return self._known[key]

    def _exact(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        curves, slopes = [], []
        for k, r in enumerate(self.runs):
            s = self.differentiated[k](self._scene_with(k, values), heed)
            at, columns = self._indices(k), [s.names.index(c) for c in r.curves]
            part = np.zeros((len(s.time) * len(columns), len(self.names)))
            part[:, at] = np.vstack([s.derivatives[:, c, :] for c in columns])
            curves.append(np.concatenate([s.values[:, c] for c in columns]))
            slopes.append(part)
        return np.concatenate(curves), np.vstack(slopes)

    def _differences(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        middle, columns = self.values(values), []
        for i, v in enumerate(values):
            h = DIFFERENCE_STEP * (abs(v) or 1.0)
            ends = []
            for step in (h, -h):
                moved = values.copy()
                moved[i] += step
                try:
                    ends.append((moved[i], self.values(moved)))
                except SceneError:  # a bound prevents this step: use a one-sided difference
                    ends.append((v, middle))
            (a, up), (b, down) = ends
            columns.append((up - down) / (a - b))
        return middle, np.column_stack(columns)


class _PlainRuns:
    """Runs of one structure that compute only the chosen columns."""

    def __init__(self, scene: Scene, names: list[str], r: MeasuredRun, rtol: float, like_sensitivity: bool):
        self.names, self.count, self.every, self.until = names, len(r.time), r.every, r.until
        method = RK8.name if like_sensitivity else scene.simulation.method
        jams = not like_sensitivity and scene.simulation.jams == "impact"
        self.settings = bl.Settings(rtol=rtol, method=method, through_jams=jams)
        self.model = Model(scene, names)

    def __call__(self, scene: Scene) -> np.ndarray:
        """The chosen columns at the measured times, concatenated to one vector. Raises SimulationError if the run ends early."""
        built = build_with_starts(scene)
        model = self.model
        if built.system != model.system or built.parameters.paths != model.built.parameters.paths:
            model = self.model = Model(scene, self.names)
        model.block.take(built.numbers, np.array(built.parameters.values, float))
        model.block.configure(self.settings)
        if model.block.assemble() != 1:
            raise SimulationError("the loops do not close at these parameter values")
        rows, made = np.zeros((self.count + 1, model.block.width)), 1
        status = model.begin(self.settings, 0.0, self.until, self.every, rows[0])
        self._check(status)
        while status != bl.DONE:
            if status == bl.NEED_JACOBIAN:
                model.block.attach_jacobian()
            status, count = model.block.advance(self.until, STEPS_PER_CALL, rows[made:])
            made += count
            heed()
            model.block.take_events()
            if status not in GO_ON:
                self._check(status)
        if made < self.count:
            self._check(model.block.row(rows[self.count - 1]))
        place = {c.name: 1 + i for i, c in enumerate(model.columns)}
        return rows[: self.count, [place[n] for n in self.names]].T.ravel()

    def _check(self, status: int) -> None:
        if status not in (bl.DONE, bl.OK):
            raise SimulationError(f"the run ends early: {from_status(status, self.model.block.time, '')}")
