"""The state at a scene's start, in absolute coordinates. Given coordinates give the poses, which are closed and made consistent
with all rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.compliant.equations_of_motion import Model
from tests.reference.compliant.positions_and_rates import Motion
from tests.reference.mechanics.joint_constraints import of
from tests.reference.mechanics.kinematics import forward
from tests.reference.mechanics.rotation import matrix_from_quaternion, quaternion_from_matrix, turned
from tests.reference.mechanics.time_signals import drive_motion

NEWTON, CLOSED, DEPENDENT = 60, 1e-13, 1e-9
SLOWER = 1e3
"""Largest ratio of the speeds of two pairs that is taken into account."""
AGREED = 1e-6
"""Rates agree if they differ by less than this, relative to the largest rate."""


def _given(scene, name: str, key: str):
    """A start value as a list, or None."""
    start = scene.joints[name].start
    value = getattr(start, key) if start is not None else None
    if value is None:
        return None
    if hasattr(value, "axis"):
        from tests.reference.mechanics.bodies_and_joint_frames import direction

        half = value.angle / 2
        return [np.cos(half), *(np.sin(half) * direction(value.axis))]
    return list(value) if isinstance(value, (tuple, list)) else [value]


def start(model: Model, offered: dict | None = None) -> np.ndarray:
    """The state at t = 0 from the scene's start values. ``offered``: rates of all joints, used where the scene leaves rates open.
    ValueError if a constraint or a start value forbids the offered rates."""
    scene, held = model.scene, model.held
    given = {n: _given(scene, n, "q") for n in held}
    for name in held:
        drive = scene.joints[name].drive
        if drive is not None and not isinstance(drive, (tuple, list)):
            given[name] = [drive_motion(drive, 0.0)[0]]
    tree = _tree(scene, held, given)
    plain = replace(scene, joints={n: scene.joints[n] for n in held})
    state = forward(plain, {n: given[n] if given[n] is not None else _zero(scene, n) for n in tree})
    y = np.zeros(model.frames.size)
    f = model.frames
    y[f.at["c"]] = np.concatenate([state.c[b] for b in f.parts])
    y[f.at["q"]] = np.concatenate([quaternion_from_matrix(state.R[b]) for b in f.parts])
    model.free.near = np.array([_near(given[n], k) for n, k in model.free.labels])
    y = _closed(model, y, given)
    model.free.near = model.free.coordinates(f.motion(np.zeros(1), y[None]))[0][0]
    y = y.copy()
    y[f.at["v"].start : f.at["w"].stop] = _agreed(model, y, {n: _given(scene, n, "qd") for n in held}, offered)
    return y


def rest_together(model: Model, y: np.ndarray) -> None:
    """Change the speeds below which pairs rest, so that pairs that move together reach them together: in proportion to the speeds
    of motions with a unit of energy at the start. Otherwise fast pairs would begin to slide before slow ones have their full
    friction."""
    scale = _scaled(model)
    _, s, V = np.linalg.svd(_rows(model, y)[0] * scale)
    free = V[int(np.sum(s > DEPENDENT * max(s, default=1.0))) :]
    many = np.tile(y, (len(free), 1))
    many[:, model.frames.at["v"].start : model.frames.at["w"].stop] = scale * free
    if not len(free):
        return
    model.rates(np.zeros(len(free)), many)
    speeds = [np.sqrt((np.broadcast_to(law.share, (len(free), len(law.eps))) ** 2).sum(axis=0)) for law in model.laws]
    slowest = max(v.max(initial=0.0) for v in speeds) / SLOWER
    least = min(np.maximum(v, slowest).min(initial=np.inf) for v in speeds)
    for law, v in zip(model.laws, speeds, strict=True):
        law.eps *= np.maximum(v, slowest) / least


def _near(given, k: int) -> float:
    return float(given[k]) if given is not None and k < len(given) else 0.0


def _zero(scene, name: str) -> list[float]:
    kind = of(scene.joints[name].type)
    return [0.0] * kind.scalars + [1.0, 0.0, 0.0, 0.0] * kind.ball


def _tree(scene, held, given) -> list[str]:
    """A spanning tree. It uses joints with given starts first, and joints that must be cut last."""
    order = sorted(held, key=lambda n: (bool(scene.joints[n].cut), given[n] is None))
    at = {"ground": "ground"} | {b: b for b in scene.bodies}

    def root(b: str) -> str:
        while at[b] != b:
            b = at[b]
        return b

    out = []
    for name in order:
        j = scene.joints[name]
        ends = [root(s.partition(".")[0] if isinstance(s, str) else s.body) for s in (j.inboard, j.outboard)]
        if ends[0] != ends[1]:
            at[ends[0]] = ends[1]
            out.append(name)
    return [n for n in held if n in out]


def _unit(model: Model, y: np.ndarray) -> tuple[Motion, np.ndarray]:
    """States with unit velocities, one after the other, at the pose of y."""
    f = model.frames
    size = 6 * f.count
    many = np.tile(y, (size, 1))
    many[:, f.at["v"].start : f.at["w"].stop] = np.eye(size)
    return f.motion(np.zeros(size), many), many


def _rows(model: Model, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows of all constraints over [velocities, angular velocities], which of these rows belong to wheels and threads, and rates
    and coordinates of freedoms."""
    m, _ = _unit(model, y)
    still = y.copy()
    still[model.frames.at["v"].start : model.frames.at["w"].stop] = 0.0
    rest = model.frames.motion(np.zeros(1), still[None])
    level = model.fits.level
    model.fits.level = replace(level, delay=1.0)
    held = model.fits.violations(m) - model.fits.violations(rest)
    model.fits.level = level
    rows = [held.reshape(len(m.t), -1)]
    for part in model.rolling:
        rows.append(part.rate(m))
    rows.append(model.rods.stretch(m)[1])
    if model.contacts:
        rows.append(model.contacts.relative_motion(m)[1][:, model.contacts.closed])
    q, qd = model.free.coordinates(rest)[0][0], model.free.coordinates(m)[1]
    rows += [(qd[:, i] - c.ratio * qd[:, k])[:, None] for i, k, c in model.devices.mimics]
    rows += [qd[:, [i]] for i, _ in model.devices.drives]
    return np.concatenate(rows, axis=1).T, qd.T, q, m.t


def _scaled(model: Model) -> np.ndarray:
    """Factor that gives a velocity one unit of energy."""
    f = model.frames
    turns = np.sqrt(np.trace(f.inertia, axis1=1, axis2=2) / 3)
    return np.concatenate([np.repeat(1 / np.sqrt(f.mass), 3), np.repeat(1 / turns, 3)])


def _closed(model: Model, y: np.ndarray, given: dict) -> np.ndarray:
    """The pose, closed by Newton's method with the smallest changes. Given coordinates change last."""
    f, scale = model.frames, _scaled(model)
    for _ in range(NEWTON):
        G, free, q, _ = _rows(model, y)
        m = f.motion(np.zeros(1), y[None])
        level = model.fits.level
        model.fits.level = replace(level, delay=0.0)
        gap = [model.fits.violations(m).reshape(-1)]
        model.fits.level = level
        gap += [np.zeros(len(r.names)) for r in model.rolling] + [model.rods.stretch(m)[0][0]]
        if model.contacts:
            gap.append(model.contacts.relative_motion(m)[0][0, model.contacts.closed])
        gap += [np.array([q[i] - c.ratio * q[k] - c.offset for i, k, c in model.devices.mimics])]
        gap += [np.array([q[i] - drive_motion(d, 0.0)[0] for i, d in model.devices.drives])]
        g = np.concatenate(gap)
        if np.abs(g).max(initial=0.0) < CLOSED:
            return y
        keep = [i for i, (n, k) in enumerate(model.free.labels) if given[n] is not None and model.free.number[i]]
        want = np.array([given[model.free.labels[i][0]][model.free.labels[i][1]] - q[i] for i in keep])
        step = scale * _least(G * scale, -g, free[keep] * scale, want)
        y = _moved(model, y, step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-30)))
        model.free.near = model.free.coordinates(f.motion(np.zeros(1), y[None]))[0][0]
    raise ValueError(f"the start cannot be closed: a residual of {np.abs(g).max():.3g} is left")


def _moved(model: Model, y: np.ndarray, step: np.ndarray) -> np.ndarray:
    f, n = model.frames, model.frames.count
    y = y.copy()
    y[f.at["c"]] += step[: 3 * n]
    q = y[f.at["q"]].reshape(n, 4)
    turns = step[3 * n :].reshape(n, 3)
    new = [turned(matrix_from_quaternion(a), b) for a, b in zip(q, turns, strict=True)]
    y[f.at["q"]] = np.concatenate([quaternion_from_matrix(R) for R in new])
    return y


def _least(G, g, E, e) -> np.ndarray:
    """An x with G x = g. Of all such x, E x is as near as possible to e; if several x are equally near, the result is the smallest
    of them."""
    U, s, V = np.linalg.svd(G)
    k = int(np.sum(s > DEPENDENT * max(s, default=1.0)))
    x = V[:k].T @ ((U[:, :k].T @ g) / s[:k])
    N = V[k:].T
    return x + N @ np.linalg.lstsq(E @ N, e - E @ x, rcond=1e-9)[0] if len(E) and N.size else x


def _agreed(model: Model, y: np.ndarray, given: dict, offered: dict | None) -> np.ndarray:
    """The rates of a start. They satisfy all rows, then the given rates, then the offered rates or the smallest rates of joints."""
    scale = _scaled(model)
    G, free, _, _ = _rows(model, y)
    target = np.zeros(len(G))
    drives = model.devices.drives
    if drives:
        target[-len(drives) :] = [drive_motion(d, 0.0)[1] for _, d in drives]
    known = np.array([given[n] is not None for n, _ in model.free.labels])
    wanted = np.array([given[n][k] if given[n] is not None else 0.0 for n, k in model.free.labels])
    x = _nearest(G, target, free, known, wanted, scale)
    held = np.concatenate([G, free[known]]) * scale
    size = 1.0 + np.abs(wanted).max(initial=0.0)
    kept = np.abs(free @ x - wanted)[known].max(initial=0.0) < AGREED * size
    if offered is None or (kept and np.linalg.matrix_rank(held, DEPENDENT * np.abs(held).max()) == held.shape[1]):
        return x
    rates = np.array([np.atleast_1d(offered[n])[k] for n, k in model.free.labels])
    x = _nearest(G, target, free, known | True, rates, scale)
    broken = np.abs(free @ x - rates) + np.where(known & kept, np.abs(rates - wanted), 0.0)
    if broken.max(initial=0.0) > AGREED * (size + np.abs(rates).max(initial=0.0)):
        k = int(np.argmax(broken))
        name = model.free.labels[k][0]
        raise ValueError(f"{name}: the offered start rate {rates[k]:.9g} contradicts a constraint or a start value")
    return x


def _nearest(G, target, free, known, wanted, scale) -> np.ndarray:
    """Velocities that satisfy all rows. Of all such velocities, the result is nearest to the known rates; if several are equally
    near, the result has the smallest rates of joints."""
    weights, want = np.where(known, 1.0, 1e-4), np.where(known, wanted, 0.0)
    x = scale * _least(G * scale, target, weights[:, None] * free * scale, weights * want)
    for _ in range(2):  # the small weights of open rates disturb the given rates; a second pass corrects this
        rest = np.where(known, want - free @ x, 0.0)
        x = x + scale * _least(G * scale, 0 * target, weights[:, None] * free * scale, weights * rest)
    return x
