"""``inverse``: the drive efforts that produce a given motion, including friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, SimulationError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.optional_packages import brought
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.queries.joint_contact_elements import touching
from trunnion.scene.queries.loads_and_signals import each
from trunnion.scene.queries.unilateral_joints import refuse_unilateral
from trunnion.scene.units.python_arguments import Names
from trunnion.simulation.execution.undetermined_reactions import open_reactions
from trunnion.simulation.results.redundant_reactions import redundancy_notes
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import OK, Settings
from trunnion.system.construction.spanning_tree import closing_joints
from trunnion.system.construction.start_values_and_scales import Numbers

DEGREE = 5
"""Degree of the splines through coordinates whose rates or accelerations are not given. The error of the splines is of fourth
order in the spacing of the times."""
ORDERS = ("q", "qd", "qdd")
LED = 1e-3
"""The rates at one time predict the pose at the next time. If the assembled pose differs from the prediction by more than this
value, rad or m, the pose is assembled again from the prediction. (The smallest tooth of a wheel spans 6e-3 rad.)"""


@dataclass(frozen=True)
class InverseDynamics:
    """The computed columns over time.

    Attributes:
        time: the n times, s.
        names: names of the c columns.
        units: units of the c columns.
        values: values (n × c) in these units; NaN at times at which the pose or its forces have no solution.
        missing: one text for each time without a solution, with the reason.
        notes: reactions and efforts that are not unique at the first time with a solution.
    """

    time: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a column (n)."""
        return self.values[:, self.names.index(name)]

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        return {
            "time": self.time.tolist(), "names": list(self.names), "units": list(self.units), "values": self.values.tolist(),
            "missing": list(self.missing), "notes": list(self.notes),
        }  # fmt: skip


def inverse(
    scene: Given, time: Sequence[float] | np.ndarray, motion: Mapping[str, Any], outputs: Names | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> InverseDynamics:  # fmt: skip
    """The drive efforts that move the joints through a prescribed motion.

    The motion of the other joints follows from the equations. In a closed loop all degrees of freedom must be prescribed.
    Springs, dampers, end stops, loads and friction act as in a run. The scene's own effort on a prescribed freedom is ignored.
    Latches stay as they are at the start of the scene, because each instant is solved independently.

    Args:
        scene: as for ``simulate``.
        time: n increasing times, s.
        motion: coordinates ``JOINT.q[k]`` (n) of the prescribed freedoms, and optionally rates ``JOINT.qd[k]`` and accelerations
            ``JOINT.qdd[k]``; rad or m, s. Rates and accelerations that are not given are taken from a spline of degree 5.
        outputs: patterns of columns; default: efforts of the drives, and all columns of contacts.
        overrides: changes of the scene, {path: value}.

    Raises:
        SceneError: for wrong input.
        SimulationError: if there is no solution at any time.
    """
    loaded = scene_given(scene, overrides)
    refuse_unilateral(loaded, "inverse dynamics: a prescribed motion may close a contact, but no impact is computed")
    t = np.asarray(time, float)
    curves = _curves(loaded, t, motion)
    model = Model(_driven(loaded, curves), outputs if outputs is not None else _usual(loaded, curves))
    found = _rows(model, t, curves)
    return replace(found, notes=(*found.notes, *_notes_at_rest(loaded, curves)))


Freedom = tuple[str, int]


def _curves(scene: sm.Scene, t: np.ndarray, motion: Mapping[str, Any]) -> dict[Freedom, np.ndarray]:
    """The coordinate, rate and acceleration (3 × n) of each prescribed freedom."""
    problems = []
    if t.ndim != 1 or len(t) < 2 or not np.all(np.diff(t) > 0.0):
        problems.append(Problem("time", "at least two increasing times are needed"))
    given: dict[Freedom, dict[str, np.ndarray]] = {}
    for name, values in motion.items():
        joint, _, rest = name.rpartition(".")
        what, _, number = rest.rstrip("]").partition("[")
        if joint not in scene.joints or what not in ORDERS or not number.isdigit():
            problems.append(Problem(f"motion.{name}", "is not a coordinate, rate or acceleration of a joint", "such as arm.q[1]"))
            continue
        kind, k = REGISTRY[scene.joints[joint].type], int(number) - 1
        if not kind.can_be_prescribed(k):
            problems.append(Problem(f"motion.{name}", f"no such freedom of a {kind.name} joint can be prescribed"))
        elif np.shape(values) != t.shape:
            problems.append(Problem(f"motion.{name}", f"{len(np.ravel(values))} values for {t.size} times"))
        else:
            given.setdefault((joint, k), {})[what] = np.asarray(values, float)
    for (joint, k), have in given.items():
        if "q" not in have:
            problems.append(Problem(f"motion.{joint}.q[{k + 1}]", "its rate is given, but the coordinate itself is missing"))
        elif len(have) < len(ORDERS) and len(t) <= DEGREE:
            problems.append(Problem(f"motion.{joint}.q[{k + 1}]", f"a curve needs at least {DEGREE + 1} times, not {len(t)}"))
    if not given and not problems:
        problems.append(Problem("motion", "no freedom is prescribed", "for example {'arm.q[1]': …}"))
    for joint in closing_joints(scene, {name for name, _ in given}):
        problems.append(Problem(f"motion.{joint}", "all joints of its loop are prescribed", "omit it: the others determine it"))
    raise_problems(problems)
    return {freedom: _completed(t, have) for freedom, have in given.items()}


def _completed(t: np.ndarray, have: Mapping[str, np.ndarray]) -> np.ndarray:
    if len(have) == len(ORDERS):
        return np.array([have[order] for order in ORDERS])
    make_interp_spline = brought("scipy.interpolate", "analysis", "a motion given by coordinates alone").make_interp_spline

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
    """The scene with a drive on each prescribed freedom. The drive is a ramp; ``_rows`` sets the ramp to the coordinate, rate and
    acceleration of each time."""
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


def _rows(model: Model, t: np.ndarray, curves: Mapping[Freedom, np.ndarray]) -> InverseDynamics:
    """The columns at each time. The assembly of the other joints starts from the pose that their rates at the previous time
    predict. Another start could lead to another solution: gears mesh at every tooth, and loops close in several poses."""
    table = model.built.parameters
    places = {}
    for freedom in curves:
        name, k = freedom
        several = isinstance(model.built.scene.joints[name].drive, tuple)
        ramp = f"joints.{name}.drive{f'[{k + 1}]' if several else ''}.ramp"
        places[freedom] = [table.paths.index(f"{ramp}.{n}") for n in ("begin", "origin", "start", "end")]
    numbers, parameters = model.built.numbers, np.array(table.values)
    values, missing, notes = np.full((len(t), len(model.columns)), np.nan), list[str](), list[str]()
    nq, pose, rate, before = len(numbers.q), numbers.q, np.zeros_like(numbers.q), t[0]
    for row in range(len(t)):
        now, spell = t[row], t[row] - before
        for freedom, where in places.items():
            q, v, a = curves[freedom][:, row]
            parameters[where] = now, q - v * now, v, v + a
        status, out = _instant(model, replace(numbers, q=pose + spell * rate), parameters, now)
        if status is None:
            missing.append(f"t = {now:g} s: the loops cannot be closed")
            continue
        found, rate_now = _pose_and_rate(model, nq, rate)
        led = pose + 0.5 * spell * (rate + rate_now)
        if row and np.abs(found - led).max(initial=0.0) > LED:
            status, out = _instant(model, replace(numbers, q=led), parameters, now)
            found, rate_now = _pose_and_rate(model, nq, rate)
        if status == OK:
            if np.isnan(values).all():
                notes = redundancy_notes(open_reactions(model, Settings(rtol=1e-9)))
            values[row] = out[1:]
        else:
            missing.append(f"t = {now:g} s: the forces have no solution (runtime status {status})")
        pose, rate, before = found, rate_now, now
    if np.isnan(values).all():
        raise SimulationError(f"there is no solution at any time; first failure: {missing[0]}")
    names, units = tuple(c.name for c in model.columns), tuple(c.unit for c in model.columns)
    return InverseDynamics(t, names, units, values, tuple(missing), tuple(notes))


def _pose_and_rate(model: Model, nq: int, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The coordinates (nq) of the assembled state and their rates. If the forces have no solution, the rates are the last ones."""
    pose = model.block.y[:nq].copy()
    try:
        return pose, model.block.evaluate()[0][:nq]
    except RuntimeError:
        return pose, last


def _notes_at_rest(scene: sm.Scene, curves: Mapping[Freedom, np.ndarray]) -> list[str]:
    """A note if, at some instants, the whole mechanism rests, or a prescribed joint rests whose law has friction at rest."""
    rubbing = {n for n, j in scene.joints.items() if j.friction is not None and LAWS[scene.law_of(j.friction)].sets}
    rates = {name: np.array([c[1] for (n, _), c in curves.items() if n == name]) for name, _ in curves}
    still = [~rates[n].any(axis=0) for n in rates.keys() & rubbing]
    still += [~np.vstack(list(rates.values())).any(axis=0)] if rubbing else []
    at_rest = np.any(still, axis=0) if still else np.zeros(0, bool)
    where = f"at rest at {np.count_nonzero(at_rest)} of {len(at_rest)} instants"
    what = "there friction could carry a part of the efforts; the efforts without this part are reported"
    return [f"{where}: {what}"] if at_rest.any() else []


def _instant(model: Model, numbers: Numbers, parameters: np.ndarray, now: float) -> tuple[int | None, np.ndarray]:
    """(status, row) of a run that starts at time ``now``. The start is assembled from the pose of ``numbers``. The status is None
    if the loops do not close."""
    model.block.take(numbers, parameters)
    model.block.configure(Settings(rtol=1e-9))
    out = np.zeros(model.block.width)
    return (model.begin(Settings(rtol=1e-9), now, now + 1.0, 1.0, out) if model.block.assemble(now) == 1 else None), out
