"""Motions of a mechanism that move no inertia (theory, "Light bodies"). No force determines the acceleration of such a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trunnion.elements.joints.declaration_checks import Numeric
from trunnion.parts.layout.signal_evaluation import motion
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.outcome import NO_INERTIA, Outcome
from trunnion.system.construction.system_builder import MASSLESS
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, System, state_coordinates
from trunnion.system.structure.parameter_table import Leaf, Param

NOTHING = 1e-9
"""Largest singular value, relative to the largest one, that counts as round-off. Lengths are divided by the length scale. Masses
and inertias above 0 count as 1."""
SQUARE = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
"""Places of the six moments of inertia of a body in its matrix."""
VANISHING = 1e-6
"""Largest relative singular value that counts as zero after a run whose steps became too small. Steps become too small where a
motion loses its inertia, such as a massless crank at a dead centre. Such steps reach the round-off of time at a singular value of
about 1e-7."""
IDLE = 1e-12
"""A constraint row whose entries are below this value is round-off, rad or lengths."""

Moved = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""A body: orientation (3×3) and origin (3), m, in the world; velocity of the origin and angular velocity for unit rates (3×nv)."""


def missing_inertia(model: Model) -> Outcome | None:
    """The outcome of a mechanism in which a motion that the joints allow moves no inertia; None if there is no such motion.
    Requires an assembled state."""
    block = model.block
    state = b"".join(map(np.ndarray.tobytes, (block.parameters, block.y, block.x)))
    if state == model.with_inertia_at:
        return None
    found = inertia_outcome(model, NOTHING)
    if not found:
        model.with_inertia_at = state
    return found


def inertia_outcome(model: Model, nothing: float) -> Outcome | None:
    """The result of ``missing_inertia`` if relative singular values up to ``nothing`` count as zero."""
    lacks = bodies_lack_inertia(model.system, model.block.parameters[None])[0]
    names = freedoms_without_inertia(model, nothing) if lacks else []
    if not names:
        return None
    plain = Outcome.named(NO_INERTIA, model.block.time, names[0][0].name)
    told = "; ".join(j.freedom(k) for j, k in names)
    return replace(plain, advice=f"{plain.advice}. Without inertia: {told}")


def bodies_lack_inertia(system: System, p: np.ndarray) -> np.ndarray:
    """For each row of parameters (n × np): whether a body has no mass, or no inertia about some axis (n)."""
    lack = np.zeros(len(p), bool)
    for b, has_mass in zip(system.bodies, _have_mass(system, p), strict=True):
        six = np.unique(np.nan_to_num([_column(x, p) for x in b.inertia]).T, axis=0, return_inverse=True)
        sizes = np.linalg.eigvalsh(six[0][:, SQUARE])
        lack |= ~has_mass | (sizes[:, 0] <= NOTHING * sizes[:, 2])[six[1].reshape(-1)]
    return lack


def _have_mass(system: System, p: np.ndarray) -> np.ndarray:
    """Whether bodies have mass (bodies × n)."""
    masses = np.array([_column(b.mass, p) for b in system.bodies]).reshape(-1, len(p))
    return masses > 2.0 * MASSLESS * masses.max(axis=0, initial=0.0)


def _column(x: Leaf, p: np.ndarray) -> np.ndarray:
    """A leaf's values in rows of parameters (n × np)."""
    return p[:, x.index] if isinstance(x, Param) else np.full(len(p), x)


def freedoms_without_inertia(model: Model, nothing: float = NOTHING) -> list[tuple[Joint, int]]:
    """For each independent motion without inertia, the freedom (joint, index) that takes part most. Requires an assembled state."""
    system, length = model.system, model.built.numbers.length
    units = np.array([1.0 if j.kind.turns(k) else length for j in system.tree for k in j.free])
    if not system.nv:
        return []
    rows = np.vstack([*_inertial_rows(model, units), _constraint_rows(model, units)])
    _, sizes, basis = np.linalg.svd(np.linalg.qr(rows, mode="r"), full_matrices=True)
    idle = basis[int(np.sum(sizes > nothing * max(sizes, default=1.0))) :]
    freedoms = [(j, k) for j in system.tree for k in j.free]
    found = []
    while len(idle):
        most = int(np.argmax(np.linalg.norm(idle, axis=0)))
        found.append(freedoms[most])
        column = idle[:, most] / np.linalg.norm(idle[:, most])
        idle = np.linalg.svd(np.eye(len(idle)) - np.outer(column, column))[2][: len(idle) - 1] @ idle
    return found


def _constraint_rows(model: Model, units: np.ndarray) -> np.ndarray:
    """Rates of all constraint residuals for the rates ``units`` (rows × nv), each row divided by its largest entry."""
    system, block = model.system, model.block
    before = block.y[system.nq : system.nq + system.nv].copy()
    columns = []
    for rates in np.vstack([np.zeros(system.nv), np.diag(units)]):
        block.y[system.nq : system.nq + system.nv] = rates
        columns.append(block.gap()[1])
    block.y[system.nq : system.nq + system.nv] = before
    rows = np.array(columns[1:]).T - columns[0][:, None]
    most = np.abs(rows).max(axis=1, initial=0.0)
    real = most > IDLE * min(model.built.numbers.length, 1.0)
    return rows[real] / most[real, None]


def _inertial_rows(model: Model, units: np.ndarray) -> Iterator[np.ndarray]:
    """Velocities that move inertia, for the rates ``units`` of the tree (rows × nv). For each body: velocity of its mass centre in
    length scales, angular velocity about the principal axes with inertia. For each rotor: its rate."""
    system, values, length = model.system, model.block.parameters, model.built.numbers.length
    poses: dict[int, Moved] = {GROUND: (np.eye(3), np.zeros(3), np.zeros((3, system.nv)), np.zeros((3, system.nv)))}
    massive = _have_mass(system, values[None])[:, 0]
    for i, (b, j) in enumerate(zip(system.bodies, system.tree, strict=True)):
        poses[i] = R, _, v, w = _carried(model, j, poses[b.parent], values)
        if massive[i]:
            yield (v + np.cross(w, (R @ _numbers(b.center, values))[:, None], axis=0)) * units / length
        if massive[i] or not b.per_mass:
            sizes, axes = np.linalg.eigh(_numbers(b.inertia, values)[SQUARE])
            yield axes.T[sizes > NOTHING * max(sizes[-1], 0.0)] @ R.T @ w * units
    for j in system.tree:
        for at, k in enumerate(j.free):
            rotor = j.devices[k].inertia
            if rotor is not None and _numbers((rotor,), values)[0] > 0.0:
                yield np.eye(system.nv)[j.v0 + at : j.v0 + at + 1]


def _carried(model: Model, j: Joint, carrier: Moved, values: np.ndarray) -> Moved:
    """The body that a tree joint carries. carrier: the body that carries the joint."""
    R, r, v, w = carrier
    kind, sign = j.kind, 1.0 if j.forward else -1.0
    q = _coordinates(model, j, values)
    pitch = float(_numbers((j.pitch,), values)[0]) / (2 * np.pi) if j.pitch is not None else 1.0
    turned, travel = np.array(kind.rotation(q, Numeric), float), np.array(kind.travel(q), float) * pitch
    near, far = (j.inb_frame, j.inb_point), (j.out_frame, j.out_point)
    (E, p), (own, there) = ((np.reshape(f, (3, 3)), _numbers(x, values)) for f, x in ((near, far) if j.forward else (far, near)))
    base = R @ E if j.forward else R @ E @ turned.T  # orientation of the inboard frame
    Rc = (base @ turned if j.forward else base) @ own.T
    at = r + R @ p
    spot = at + sign * base @ travel
    fixed = spot if j.forward else at  # the outboard definition point p_out
    v_p, w_c = v + np.cross(w, (fixed - r)[:, None], axis=0), w.copy()
    for k, f in enumerate(j.free):
        for axis in kind.axes[f]:
            along = (base if axis.side == "in" else base @ turned)[:, axis.index] * (pitch if axis.by_pitch else 1.0)
            (w_c if axis.rot else v_p)[:, j.v0 + k] += sign * along
    rc = spot - Rc @ there
    return Rc, rc, v_p + np.cross(w_c, (rc - fixed)[:, None], axis=0), w_c


def _coordinates(model: Model, j: Joint, values: np.ndarray) -> list[float]:
    """All coordinates of a tree joint. Drives prescribe some of these coordinates, at the time of the state."""
    block, states = model.block, state_coordinates(j)
    q = [0.0] * j.kind.nq
    for i, at in enumerate(states):
        q[at] = float(block.y[j.q0 + i])
    for k in j.driven:
        drive = j.devices[k].drive
        assert drive is not None
        q[j.kind.coordinate_of(k)] = float(motion(drive, model.system.external, values, np.array(block.x))[0])
    return q


def _numbers(leaves: tuple[Leaf, ...], values: np.ndarray) -> np.ndarray:
    return np.array([values[x.index] if isinstance(x, Param) else x for x in leaves], float)
