"""``inverse``: the efforts that a given motion takes, friction included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine.basics.extras import brought
from engine.basics.problems import Problem, SceneError, SimulationError
from engine.joints import REGISTRY
from engine.scene import model as sm
from engine.scene.given import Names
from engine.scene.overrides import Given, scene_given
from engine.scene.touching import touching
from engine.scene.walk import each
from engine.simulation.block import OK, Settings
from engine.simulation.run import Model

DEGREE = 5
"""Of the splines through coordinates whose rates or accelerations are not given: these are then right to the fourth power of the
spacing."""
ORDERS = ("q", "qd", "qdd")


@dataclass(frozen=True)
class Table:
    """Columns over time. time (n), s; values (n × c), NaN where the pose or its forces have no answer, which ``missing`` says."""

    time: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    missing: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """A column (n)."""
        return self.values[:, self.names.index(name)]

    def document(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "time": self.time.tolist(), "names": list(self.names), "units": list(self.units), "values": self.values.tolist(),
            "missing": list(self.missing),
        }  # fmt: skip


def inverse(
    scene: Given, time: Sequence[float] | np.ndarray, motion: Mapping[str, Any], outputs: Names | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> Table:  # fmt: skip
    """What drives the joints through a motion.

    time (n, increasing), s; motion: for each freedom that is prescribed its coordinate ``<joint>.q[k]`` (n), and if known its
    rate ``.qd[k]`` and acceleration ``.qdd[k]`` (else from a spline of degree 5 through the coordinates), rad or m, s. The other
    joints follow; in loops as many freedoms are prescribed as move. Springs, dampers, stops, loads and friction act as they do in
    a run; the effort that a scene gives to a prescribed freedom does not. outputs: columns (default: efforts of the drives, and
    all of the contacts). SceneError for wrong input."""
    loaded = scene_given(scene, overrides)
    t = np.asarray(time, float)
    curves = _curves(loaded, t, motion)
    model = Model(_driven(loaded, curves), outputs if outputs is not None else _usual(loaded, curves))
    return _rows(model, t, curves)


Freedom = tuple[str, int]


def _curves(scene: sm.Scene, t: np.ndarray, motion: Mapping[str, Any]) -> dict[Freedom, np.ndarray]:
    """For each prescribed freedom its coordinate, rate and acceleration (3 × n)."""
    problems = []
    if t.ndim != 1 or len(t) < 2 or not np.all(np.diff(t) > 0.0):
        problems.append(Problem("time", "two times at least, increasing"))
    given: dict[Freedom, dict[str, np.ndarray]] = {}
    for name, values in motion.items():
        joint, _, rest = name.rpartition(".")
        what, _, number = rest.rstrip("]").partition("[")
        if joint not in scene.joints or what not in ORDERS or not number.isdigit():
            problems.append(Problem(f"motion.{name}", "no coordinate, rate or acceleration of a joint", "for example arm.q[1]"))
            continue
        kind, k = REGISTRY[scene.joints[joint].type], int(number) - 1
        if not 0 <= k < kind.nv or kind.coordinate_of(k) < 0:
            problems.append(Problem(f"motion.{name}", f"a {kind.name} joint has no such freedom that can be prescribed"))
        elif np.shape(values) != t.shape:
            problems.append(Problem(f"motion.{name}", f"{len(np.ravel(values))} values for {t.size} times"))
        else:
            given.setdefault((joint, k), {})[what] = np.asarray(values, float)
    for (joint, k), have in given.items():
        if "q" not in have:
            problems.append(Problem(f"motion.{joint}.q[{k + 1}]", "its rate is given, not the coordinate itself"))
        elif len(have) < len(ORDERS) and len(t) <= DEGREE:
            problems.append(Problem(f"motion.{joint}.q[{k + 1}]", f"{len(t)} times are too few for a curve: {DEGREE + 1} at least"))
    if not given and not problems:
        problems.append(Problem("motion", "no freedom is prescribed", "for example {'arm.q[1]': …}"))
    if problems:
        raise SceneError(problems)
    return {freedom: _completed(t, have) for freedom, have in given.items()}


def _completed(t: np.ndarray, have: Mapping[str, np.ndarray]) -> np.ndarray:
    if len(have) == len(ORDERS):
        return np.array([have[order] for order in ORDERS])
    make_interp_spline = brought("scipy.interpolate", "analysis", "what is given as coordinates alone").make_interp_spline

    out = [have["q"]]
    for order in ORDERS[1:]:
        if order in have:
            out.append(have[order])
        else:
            known = len(out) - 1 if order == "qdd" and "qd" in have else 0
            spline = make_interp_spline(t, out[known], k=DEGREE)
            out.append(spline.derivative(ORDERS.index(order) - known)(t))
    return np.array(out)


def _driven(scene: sm.Scene, curves: Mapping[Freedom, np.ndarray]) -> sm.Scene:
    """The scene with a drive of given coordinate, rate and acceleration at t = 0 in each of these freedoms."""
    joints = dict(scene.joints)
    for (name, k), (q, v, a) in ((f, c[:, 0]) for f, c in curves.items()):
        j = joints[name]
        count = REGISTRY[j.type].nv
        ramp = sm.Drive(ramp=sm.Ramp(start=float(v), end=float(v + a), duration=1.0, begin=0.0, origin=float(q)))
        drives, efforts = each(j.drive, count), each(j.effort, count)
        drives[k], efforts[k] = ramp, None
        left = tuple(efforts) if any(e is not None for e in efforts) else None
        joints[name] = replace(j, drive=drives[0] if count == 1 else tuple(drives), effort=left)
    return replace(scene, joints=joints)


def _usual(scene: sm.Scene, curves: Mapping[Freedom, np.ndarray]) -> tuple[str, ...]:
    rubbing = [(n, touching(j)) for n, j in scene.joints.items() if j.friction is not None]
    contacts = [f"{n}.contact[*].*" for n, element in rubbing if element is not None and element.count]
    return (*(f"{name}.drive.effort[{k + 1}]" for name, k in curves), *contacts)


def _rows(model: Model, t: np.ndarray, curves: Mapping[Freedom, np.ndarray]) -> Table:
    """The columns at each time, each from the pose before: its joints that are not prescribed follow."""
    table = model.built.parameters
    places = {}
    for freedom in curves:
        ramp = f"joints.{freedom[0]}.drive{_entry(model, freedom)}.ramp"
        places[freedom] = [table.paths.index(f"{ramp}.{n}") for n in ("origin", "start", "end")]
    numbers, parameters = model.built.numbers, np.array(table.values)
    values, missing = np.full((len(t), len(model.columns)), np.nan), []
    for row in range(len(t)):
        for freedom, (origin, start, end) in places.items():
            q, v, a = curves[freedom][:, row]
            parameters[origin], parameters[start], parameters[end] = q, v, v + a
        model.block.take(numbers, parameters)
        model.block.configure(Settings(rtol=1e-9))
        if model.block.assemble() != 1:
            missing.append(f"t = {t[row]:g} s: the loops cannot be closed")
            continue
        out = np.zeros(model.block.width)
        status = model.begin(Settings(rtol=1e-9), 0.0, 1.0, 1.0, out)
        if status == OK:
            values[row] = out[1:]
        else:
            missing.append(f"t = {t[row]:g} s: forces have no answer (runtime status {status})")
        y = model.block.y
        numbers = replace(numbers, q=y[: len(numbers.q)].copy())
    if np.isnan(values).all():
        raise SimulationError(f"no instant has an answer; {missing[0]}")
    return Table(t, tuple(c.name for c in model.columns), tuple(c.unit for c in model.columns), values, tuple(missing))


def _entry(model: Model, freedom: Freedom) -> str:
    """The index of a freedom's drive in the scene; "" where the joint has but one."""
    name, k = freedom
    return f"[{k + 1}]" if isinstance(model.built.scene.joints[name].drive, tuple) else ""
