"""Computes the parameters of many cases. The results are bit-identical to the parameters of a scene built for each case, at a
fraction of the cost.

The varied paths of one owner (a body, a joint, a joint's start, gravity, …) form a group. For many groups,
``parameters_without_scene_builds`` writes the entries of the rows directly. This is possible in three cases: the value is an entry
of the table of parameters (friction, springs, dampers, drives, …), entries are copies of the value, or a formula gives the entries.
For any other group, a scene is built once for each distinct value, and its changed entries are copied to the rows. If groups share
an entry, a scene is built for every case. A scene is also built for each case with another structure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from threading import Lock

import numpy as np

from trunnion.basics.errors import SceneError
from trunnion.basics.interrupts import heed
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.preparation.dependent_parameters import DependentParameters
from trunnion.batch.preparation.parameter_formulas import total_mass
from trunnion.batch.preparation.parameters_without_scene_builds import Placing
from trunnion.runtime.abi.batch_records import CASE_SETTINGS
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.simulation.execution.missing_inertia import bodies_lack_inertia
from trunnion.simulation.execution.starts_at_cuts_and_points import build_with_starts
from trunnion.simulation.settings.realtime_steps import bounds_of
from trunnion.simulation.settings.realtime_steps import step_problems as bounded
from trunnion.simulation.settings.run_settings import Run
from trunnion.system.construction.start_values_and_scales import turning
from trunnion.system.construction.system_builder import Built
from trunnion.system.signals.signal_tables import ExternalInput, SignalCurve

MANY = 8
"""After a group has had more new values than this, its entries are written directly, without building scenes."""
MOST_CACHED = 20_000
"""Largest number of built scenes in the cache of a group. Each scene takes a few hundred bytes."""


@dataclass(frozen=True)
class Rows:
    """Cases of one structure for the C loop.

    Attributes:
        built: the structure.
        index: indices of the n cases.
        p: parameters (n × np).
        y: start coordinates and rates (n × (nq + nv)).
        given: whether each start coordinate (first nv) and each start rate (last nv) is given (n × 2 nv).
        inputs: start values of inputs (n × inputs).
        settings: fields of ``tr_case_settings`` (n × 7).
    """

    built: Built
    index: np.ndarray
    p: np.ndarray
    y: np.ndarray
    given: np.ndarray
    inputs: np.ndarray
    settings: np.ndarray

    def some(self, at: np.ndarray) -> Rows:
        """The cases at these indices."""
        of = (self.index, self.p, self.y, self.given, self.inputs, self.settings)
        return Rows(self.built, *(np.ascontiguousarray(a[at]) for a in of))


@dataclass(frozen=True)
class _Entry:
    """A built scene as a flat row of numbers: [p | q v | inputs | until every rtol mass | length gravity]. built: the scene if its
    structure differs from the structure of the base scene, otherwise None."""

    built: Built | None
    flat: np.ndarray


class Preparer:
    """Converts values (cases × paths) to rows for the C loop. The preparer caches built scenes. Several threads may use a preparer
    in turn. ends: bounds of the values (2 × paths), if known. start: the result of ``build_with_starts``, if known."""

    def __init__(
        self, scene: Scene, paths: Sequence[str], run: Run, ends: np.ndarray | None = None, start: Built | None = None
    ):
        self.lock = Lock()
        self.followers = DependentParameters(scene, paths)
        paths = self.followers.paths
        self.scene, self.paths, self.run = scene, tuple(paths), run
        self.start = start or build_with_starts(scene)
        self.base = self._flat(self.start)
        self.mass = len(self.base) - 3
        self.bounded = scene.simulation.realtime is not None
        owners = [owner(p) for p in paths]
        self.groups = [[i for i, o in enumerate(owners) if o == own] for own in dict.fromkeys(owners)]
        self.kept: list[dict[bytes, _Entry | SceneError]] = [{} for _ in self.groups]
        self.met = [0] * len(self.groups)
        named = [tuple(self.paths[i] for i in group) for group in self.groups]
        if ends is None or any(self.followers.names):  # bounds are known for the varied numbers only
            ends = np.full((2, len(self.paths)), np.nan)
        self.placing = [
            Placing(self.start, self.base, self.mass, p, partial(self._entry, g), ends[:, self.groups[g]])
            for g, p in enumerate(named)
        ]
        sizes = (o for o, p in zip(owners, paths, strict=True) if o[0] in ("bodies", "ground") or "board" in p or ".at[" in p)
        self.sizing = len(set(sizes))

    def rows(self, values: np.ndarray) -> tuple[list[Rows], dict[int, SceneError]]:
        """(rows of the cases, grouped by structure; {index in ``values``: error} of invalid cases). values: cases × paths."""
        with self.lock:
            return self._rows_and_errors(values)

    def _rows_and_errors(self, values: np.ndarray) -> tuple[list[Rows], dict[int, SceneError]]:
        """The result of ``rows``, computed while this thread holds the lock."""
        values, wrong = self.followers.values(values)
        kept = np.array([i for i in range(len(values)) if i not in wrong], int)
        if not wrong:
            return self._rows(values)
        rows, more = self._rows(values[kept]) if len(kept) else ([], {})
        return [replace(r, index=kept[r.index]) for r in rows], wrong | {int(kept[i]): e for i, e in more.items()}

    def _rows(self, values: np.ndarray) -> tuple[list[Rows], dict[int, SceneError]]:
        """The result of ``rows`` for values of ``self.paths``. ``DependentParameters.values`` computes these values."""
        n = len(values)
        flat = np.repeat(self.base[None, :], n, axis=0)
        alone = np.zeros(n, bool)
        touched = np.zeros(len(self.base), int)
        wrong: dict[int, SceneError] = {}
        for g, columns in enumerate(self.groups):
            self._group(g, values[:, columns], flat, alone, touched, wrong)
        size = len(self.base) - 2
        flat[:, self.mass], touched[self.mass] = total_mass(self.start, flat), 0
        if (touched[:size] > 1).any() or touched[size] > 1 or (touched[size] and self.sizing > 1):
            alone[:] = True
        out = [_rows(self.start, np.flatnonzero(~alone), flat[~alone])] if not alone.all() else []
        return [r for r in out if len(r.index)] + self._singly(np.flatnonzero(alone), values, wrong), wrong


    def _group(self, g: int, values: np.ndarray, flat: np.ndarray, alone: np.ndarray, touched: np.ndarray, wrong: dict) -> None:
        """Write the numbers of one group into ``flat`` (cases × numbers). Mark in ``alone`` (cases) the cases that need a separate
        scene. Count in ``touched`` the groups that write each number."""
        distinct, inverse = np.unique(values, axis=0, return_inverse=True)
        inverse = inverse.reshape(-1)
        new = sum(v.tobytes() not in self.kept[g] for v in distinct)
        self.met[g] += new
        bounded = self.bounded and owner(self.paths[self.groups[g][0]]) == ("simulation",)
        if self.met[g] > MANY and not bounded and (placed := self.placing[g].of(distinct)):
            place, numbers = placed
            flat[:, place] = numbers[inverse]
            alone |= (values == 0.0).any(axis=1)
            touched[place] += 1
            return
        entries = [self._built(g, v) for v in distinct]
        good = np.array([isinstance(e, _Entry) and e.built is None for e in entries])
        changed = np.array([e.flat if ok else self.base for e, ok in zip(entries, good, strict=True)])  # type: ignore[union-attr]
        differs = np.flatnonzero((changed.view(np.uint64) != self.base.view(np.uint64)).any(axis=0))
        flat[:, differs] = changed[np.ix_(inverse, differs)]
        touched[differs] += 1
        alone |= ~good[inverse]

    def _built(self, g: int, values: np.ndarray) -> _Entry | SceneError:
        """The scene built with the values of one group, from a cache. If the scene rejects the values, the result is the
        SceneError."""
        key = values.tobytes()
        kept = self.kept[g]
        if key not in kept:
            if len(kept) > MOST_CACHED:
                kept.clear()
            kept[key] = self._made({self.paths[i]: float(v) for i, v in zip(self.groups[g], values, strict=True)})
        return kept[key]

    def _entry(self, g: int, values: np.ndarray) -> np.ndarray | None:
        """The flat numbers of the scene built with the values of one group. None if the scene rejects the values or has another
        structure."""
        entry = self._built(g, values)
        return entry.flat if isinstance(entry, _Entry) and entry.built is None else None


    def _made(self, changes: dict[str, float]) -> _Entry | SceneError:
        heed()
        try:
            scene = apply(self.scene, changes)
            if wrong := list(bounded(scene, self.run.method_of(scene), self.run.of(scene)[1], 0.0)):
                return SceneError(wrong)
            built = build_with_starts(scene)
        except SceneError as e:
            return e
        return _Entry(None if self._alike(built) else built, self._flat(built))

    def _flat(self, built: Built) -> np.ndarray:
        """The flat numbers of a built scene (``_Entry``)."""
        n, (until, every, rtol) = built.numbers, self.run.of(built.scene)
        pull = float(np.linalg.norm(np.array(built.scene.gravity, float)))
        mass = sum(mass_properties(b)[0] for b in built.scene.bodies.values())
        rest = [until, every, rtol, mass, n.length, pull]
        return np.concatenate([built.parameters.values, n.q, n.v, n.inputs, rest])

    def _alike(self, built: Built) -> bool:
        """Whether a built scene has the structure, tables, breakpoints and given start values of the base scene."""
        a, b = built.numbers, self.start.numbers
        return (
            built.system == self.start.system
            and built.parameters.paths == self.start.parameters.paths
            and a.breaks == b.breaks
            and all(np.array_equal(x, y) for x, y in ((a.q_given_by_rate, b.q_given_by_rate), (a.v_given, b.v_given)))
            and same_tables(a.tables, b.tables)
            and bounds_of(built.scene) == bounds_of(self.scene)
        )


    def _singly(self, index: np.ndarray, values: np.ndarray, wrong: dict[int, SceneError]) -> list[Rows]:
        """The rows of cases whose scenes are built one by one. Errors of invalid cases are added to ``wrong``."""
        same: list[tuple[int, np.ndarray]] = []
        out = []
        for i in index:
            e = self._made(dict(zip(self.paths, map(float, values[i]), strict=True)))
            if isinstance(e, SceneError):
                wrong[int(i)] = e
            elif e.built is None:
                same.append((int(i), e.flat))
            else:
                out.append(_rows(e.built, np.array([i]), e.flat[None, :]))
        if same:
            out.insert(0, _rows(self.start, np.array([i for i, _ in same]), np.array([f for _, f in same])))
        return out


Tables = tuple[SignalCurve | ExternalInput, ...]


def same_tables(a: Tables, b: Tables) -> bool:
    """Whether two cases have equal tables. The start values of their inputs may differ."""
    return len(a) == len(b) and all(x is y or x.alike(y) for x, y in zip(a, b, strict=True))


def owner(path: str) -> tuple[str, ...]:
    """The owner of a path. Paths of different owners act on different numbers of the system."""
    steps = path.replace("[", ".[").split(".")
    if steps[0] in ("gravity", "simulation", "friction"):
        return (steps[0],)
    return ("joints", steps[1], "start") if steps[0] == "joints" and steps[2:3] == ["start"] else tuple(steps[:2])


def _rows(built: Built, index: np.ndarray, flat: np.ndarray) -> Rows:
    """The rows for flat numbers (n × numbers). The rate scale follows from gravity, length and start rates, as in
    ``system.construction.start_values_and_scales``."""
    n, s = built.numbers, built.system
    ends = np.cumsum([len(built.parameters.values), s.nq + s.nv, len(n.inputs)])
    p, y, inputs, rest = np.split(flat, ends, axis=1)
    until, every, rtol, mass, length, pull = rest.T
    base = np.where(pull > 0.0, np.sqrt(pull / length), 1.0)
    rates = np.abs(y[:, s.nq :]) / np.where(turning(s), 1.0, length[:, None])
    rate = np.maximum(base, rates.max(axis=1, initial=0.0))
    given = np.repeat(np.concatenate([n.q_given_by_rate, n.v_given])[None, :], len(flat), axis=0)
    with np.errstate(over="ignore"):
        speed = length * rate
        energy = mass * (speed * speed)
    set_ = CASE_SETTINGS.row(rtol=rtol, length=length, rate=rate, until=until, every=every, energy=energy,
                             light=bodies_lack_inertia(s, p).astype(float))  # fmt: skip
    settings = np.column_stack(set_)
    return Rows(built, index, *(np.ascontiguousarray(a) for a in (p, y, given, inputs, settings)))
