"""The measured columns as functions of the parameters, over all runs: values from plain runs, exact derivatives from sensitivities.

Where all laws of friction are set-valued, derivatives come from ``sensitivity``, exact across stops, and plain runs make the same
steps. Laws that are stiff and smooth (bristles, regularised) are run by the scene's own method and differenced.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from engine.basics.interrupts import heed
from engine.basics.problems import SceneError, SimulationError
from engine.fits.known import OF_RUN, ordered
from engine.fits.measured import Measured
from engine.friction import REGISTRY as LAWS
from engine.integrators import RK8
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.sensitivities.api import sensitivity
from engine.sensitivities.record import LEAST_STEPS
from engine.simulation import block as bl
from engine.simulation.outcome import from_status
from engine.simulation.run import Model
from engine.system.build import build

KEPT = 6
"""Parameter values of which curves and derivatives are remembered."""
DIFFERENCE = 1e-3
"""Step of central differences, of a parameter's size: their error is about its square, and rtol over it."""
AT_ONCE = 1000
"""Steps between two instants at which Ctrl-C is heard."""
GO_ON = (bl.MORE, bl.EVENTS_FULL, bl.ROWS_FULL, bl.NEED_JACOBIAN)


class Curves:
    """names (m): the parameters: paths, then, for each run, its own as ``PATH @ RUN``. exact: whether derivatives are, or
    differences. Values (N) are in the order of the runs, of their curves, of their times."""

    def __init__(self, scene: Scene, shared: Sequence[str], own: Sequence[str], runs: Sequence[Measured], rtol: float):
        self.runs, self.rtol = list(runs), rtol
        self.names = [*shared, *(f"{p}{OF_RUN}{r.name}" for r in runs for p in own)]
        self.shared, self.own = list(shared), list(own)
        self.scenes = [apply(scene, dict(r.overrides)) if r.overrides else scene for r in runs]
        laws = [scene.law_of(j.friction) for j in scene.joints.values() if j.friction is not None]
        self.exact = all(LAWS[law].sets for law in laws)
        self.pairs = ordered(self.names, scene)
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self._last: tuple[bytes, np.ndarray] = (b"", np.zeros(0))

    @cached_property
    def plain(self) -> list[_Plain]:
        """The plain runs, made when there is something to run."""
        return [_Plain(s, list(r.curves), r, self.rtol, self.exact) for s, r in zip(self.scenes, self.runs, strict=True)]

    def projected(self, values: np.ndarray) -> np.ndarray:
        """The parameters as they are run: of two of which one must not be below the other, the higher is raised to the lower."""
        out = np.array(values, float)
        for low, high in self.pairs:
            out[high] = max(out[high], out[low])
        return out

    def _places(self, k: int) -> list[int]:
        """Places of run k's parameters among all of them."""
        first = len(self.shared) + k * len(self.own)
        return [*range(len(self.shared)), *range(first, first + len(self.own))]

    def _changed(self, k: int, values: np.ndarray) -> Scene:
        paths = [*self.shared, *self.own]
        return apply(self.scenes[k], dict(zip(paths, values[self._places(k)].tolist(), strict=True)))

    def values(self, values: np.ndarray) -> np.ndarray:
        """The curves (N) with these parameter values (m). SceneError or SimulationError where they cannot be run."""
        values = self.projected(values)
        if values.tobytes() != self._last[0]:
            found = np.concatenate([run(self._changed(k, values)) for k, run in enumerate(self.plain)])
            self._last = values.tobytes(), found
        return self._last[1]

    def slopes(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(curves (N), their derivatives by the parameters (N × m)). Errors as for ``values``."""
        key = np.ascontiguousarray(values).tobytes()
        if key not in self._known:
            at = self.projected(values)
            found = self._exact(at) if self.exact else self._differences(at)
            for low, high in self.pairs:
                if values[high] < values[low]:  # it goes with the other
                    found[1][:, low] += found[1][:, high]
                    found[1][:, high] = 0.0
            while len(self._known) >= KEPT:  # the first stays: it is where searches start
                del self._known[list(self._known)[1]]
            self._known[key] = found
        return self._known[key]

    def _exact(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        curves, slopes = [], []
        for k, r in enumerate(self.runs):
            s = sensitivity(
                self._changed(k, values), [*self.shared, *self.own], list(r.curves), r.until, r.every, self.rtol, None, heed
            )
            at, columns = self._places(k), [s.names.index(c) for c in r.curves]
            part = np.zeros((len(s.time) * len(columns), len(self.names)))
            part[:, at] = np.vstack([s.derivatives[:, c, :] for c in columns])
            curves.append(np.concatenate([s.values[:, c] for c in columns]))
            slopes.append(part)
        return np.concatenate(curves), np.vstack(slopes)

    def _differences(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        middle, columns = self.values(values), []
        for i, v in enumerate(values):
            h = DIFFERENCE * (abs(v) or 1.0)
            ends = []
            for step in (h, -h):
                moved = values.copy()
                moved[i] += step
                try:
                    ends.append((moved[i], self.values(moved)))
                except SceneError:  # beyond the values the number may have
                    ends.append((v, middle))
            (a, up), (b, down) = ends
            columns.append((up - down) / (a - b))
        return middle, np.column_stack(columns)


class _Plain:
    """Runs of one structure, for the chosen columns alone."""

    def __init__(self, scene: Scene, names: list[str], r: Measured, rtol: float, like_sensitivity: bool):
        self.names, self.count, self.every, self.until = names, len(r.time), r.every, r.until
        longest = r.until / LEAST_STEPS if like_sensitivity else np.inf
        method = RK8.name if like_sensitivity else scene.simulation.method
        jams = scene.simulation.jams == "impact"
        more = {"max_step": longest} if like_sensitivity else {"through_jams": jams}
        self.settings = bl.Settings(rtol=rtol, method=method, **more)
        self.model = Model(scene, names)

    def __call__(self, scene: Scene) -> np.ndarray:
        """The chosen columns, one after the other, at the measured times. SimulationError when the run ends early."""
        built = build(scene)
        model = self.model
        if built.system != model.system or built.parameters.paths != model.built.parameters.paths:
            model = self.model = Model(scene, self.names)
        model.block.take(built.numbers, np.array(built.parameters.values, float))
        model.block.configure(self.settings)
        if model.block.assemble() != 1:
            raise SimulationError("the loops do not close at these values")
        row = np.zeros(model.block.width)
        self._check(model.begin(self.settings, 0.0, self.until, 2 * self.until, row))
        rows, scratch = [row.copy()], np.zeros((4, model.block.width))
        for k in range(1, self.count):
            target = self.until if k == self.count - 1 else self.every * k
            status: int = bl.MORE
            while status in GO_ON:
                if status == bl.NEED_JACOBIAN:
                    model.block.attach_jacobian()
                status, _ = model.block.advance(target, AT_ONCE, scratch)
                heed()
                model.block.take_events()
            self._check(status)
            self._check(model.block.row(row))
            rows.append(row.copy())
        place = {c.name: 1 + i for i, c in enumerate(model.columns)}
        return np.array(rows)[:, [place[n] for n in self.names]].T.ravel()

    def _check(self, status: int) -> None:
        if status not in (bl.DONE, bl.OK):
            raise SimulationError(f"the run ends early: {from_status(status, self.model.block.time, '')}")
