"""A mechanism in other units. Every number is scaled according to its dimension."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from tests.reference.mechanics.joint_constraints import TYPES, Reference
from tests.reference.mechanics.time_signals import load_value, per_freedom
from tests.reference.scenes.random_scenes import Case, _started
from tests.reference.scenes.result_table import Moved
from trunnion.scene.data_classes import scene as sm


@dataclass(frozen=True)
class Units:
    """Number of new units of length, mass and time in one old unit."""

    L: float
    M: float
    T: float

    def __call__(self, length: float = 0, mass: float = 0, time: float = 0) -> float:
        """Factor of a quantity of these powers."""
        return self.L**length * self.M**mass * self.T**time

    @property
    def force(self) -> float:
        """Number of new units of force in one old unit."""
        return self(1, 1, -2)

    @property
    def torque(self) -> float:
        """Number of new units of torque in one old unit."""
        return self(2, 1, -2)


def rescaled(case: Case, length: float, mass: float, time: float) -> Moved:
    """The case with every length, mass and time multiplied by the given factors."""
    u, s = Units(length, mass, time), case.scene
    travel = {n: np.array([length if d < 3 else 1.0 for d in kind_of(j.type).free]) for n, j in s.joints.items()}
    q = {n: _scaled_q(s.joints[n].type, x, travel[n]) for n, x in case.q.items()}
    qd = {n: np.asarray(x) * travel[n] / time for n, x in case.qd.items()}
    joints = {}
    for name, joint in s.joints.items():
        new = _joint(s, joint, travel[name], u)
        started = joint.start is not None and name in q
        joints[name] = _started(new, q[name], qd[name]) if started else replace(new, start=None)
    scene = replace(
        s,
        bodies={n: _body(b, u) for n, b in s.bodies.items()},
        joints=joints,
        forces={n: _applied(s, f, u) for n, f in s.forces.items()},
        gravity=_times(s.gravity, u(1, 0, -2)),
        ground=sm.Ground({n: _times(p, length) for n, p in s.ground.points.items()}),
        friction=replace(s.friction, v_eps=s.friction.v_eps * u(1, 0, -1)),
    )
    return Moved(Case(scene, q, qd, case.t * time, case.tree), _undo(u, travel))


def kind_of(kind: str) -> Reference:
    """The reference's declaration of a joint type. Couplings of two shafts have no freedoms."""
    return TYPES.get(kind, Reference())


def _undo(u: Units, travel: dict):
    """A map from a table of results in the new units to a table in the old units. travel: scale of each joint's freedoms."""

    def factor(key):
        item, quantity = key
        if quantity in ("friction", "drive.effort"):
            return u.torque / travel[item]
        return {
            "qdd": lambda: travel[item] * u.T**-2,
            "reaction.force": lambda: u.force,
            "reaction.torque": lambda: u.torque,
            "normal_force": lambda: u.force,
            "acceleration": lambda: u(1, 0, -2),
            "angular_acceleration": lambda: u(0, 0, -2),
            "kinetic": lambda: u.torque,
        }.get(quantity, lambda: 1.0)()

    return lambda t: {k: v / factor(k) for k, v in t.items()}


def _times(x, f: float):
    """A number, or each of several numbers, times f. None stays None."""
    if x is None:
        return None
    return tuple(v * f for v in x) if isinstance(x, (tuple, list)) else x * f


def _scaled_q(kind: str, q, travel) -> np.ndarray:
    q, n = np.array(q, float), kind_of(kind).scalars
    q[:n] *= travel[:n]
    return q


def _body(b: sm.Body, u: Units) -> sm.Body:
    cylinder = b.cylinder and replace(b.cylinder, radius=b.cylinder.radius * u.L, length=b.cylinder.length * u.L)
    return replace(
        b,
        box=_times(b.box, u.L),
        cylinder=cylinder,
        sphere=_times(b.sphere, u.L),
        density=_times(b.density, u(-3, 1)),
        mass=_times(b.mass, u.M),
        center=_times(b.center, u.L),
        inertia=_inertia(b.inertia, u(2, 1)),
        points={n: _times(p, u.L) for n, p in b.points.items()},
    )


def _inertia(given, f: float):
    return replace(given, axial=given.axial * f) if hasattr(given, "axial") else _times(given, f)


def _joint(scene, j: sm.Joint, travel, u: Units) -> sm.Joint:
    """A joint in the new units; travel: factor of each of its coordinates (the length factor where it slides, else 1)."""
    n, effort = len(kind_of(j.type).free), u.torque / travel

    def each(value, make):
        if value is None:
            return None
        out = tuple(None if x is None else make(x, k) for k, x in enumerate(per_freedom(value, n)))
        return out[0] if n == 1 else out

    def side(x):
        return x if isinstance(x, str) or isinstance(x.point, str) else replace(x, point=_times(x.point, u.L))

    def stops(x, k):
        f = travel[k]
        damping = x.damping * u.T / f
        return sm.EndStops(x.stiffness * effort[k] / f, _times(x.lower, f), _times(x.upper, f), damping)

    return replace(
        j,
        inboard=side(j.inboard),
        outboard=side(j.outboard),
        pitch=_times(j.pitch, u.L),
        module=_times(j.module, u.L),
        length=_times(j.length, u.L),
        nonlinear=each(j.nonlinear, lambda x, k: _nonlinear(x, float(travel[k]), float(effort[k]), u.T)),
        stiffness=_times(j.stiffness, u(0, 1, -2)),
        friction=j.friction and _friction(j.friction, u),
        spring=each(j.spring, lambda x, k: sm.Spring(x.stiffness * effort[k] / travel[k], x.rest * travel[k])),
        damping=each(j.damping, lambda x, k: x * effort[k] / travel[k] * u.T),
        end_stops=each(j.end_stops, stops),
        drive=each(j.drive, lambda x, k: _drive(x, float(travel[k]), u)),
        effort=each(j.effort, lambda x, k: _load(scene, x, float(effort[k]), u)),
    )


def _friction(g: sm.Friction, u: Units) -> sm.Friction:
    lengths = ("radius", "half_length", "half_width", "half_height", "thrust_radius")
    new = {key: _times(getattr(g, key), u.L) for key in lengths}
    new |= {key: _times(getattr(g, key), u.force) for key in ("force", "back_force")}
    new |= {key: _times(getattr(g, key), u.torque) for key in ("torque", "back_torque", "no_load_torque")}
    return replace(g, **new, viscosity=_times(g.viscosity, u(-1, 0, 1)), v_eps=_times(g.v_eps, u(1, 0, -1)))


def _nonlinear(group: sm.Nonlinear, f: float, effort: float, time: float) -> sm.Nonlinear:
    """A nonlinear spring or damper in the new units; f: factor of the coordinate; time: factor of times."""
    if group.quadratic_damping is not None:
        raise NotImplementedError("quadratic dampers in other units")
    spring, damper = group.spring_curve, group.damping_curve
    return sm.Nonlinear(
        spring_curve=spring and replace(spring, at=_times(spring.at, f), effort=_times(spring.effort, effort)),
        damping_curve=damper and replace(damper, speed=_times(damper.speed, f / time), effort=_times(damper.effort, effort)),
    )


def _formula(x, u: Units):
    """A formula of position in the new units; its numbers are in SI units."""
    if x is None:
        return None
    places = re.sub(r"\b([xyz])\b", rf"(\1/{u.L})", x.formula)
    text = f"{u.force}*({places})"
    return replace(x, formula=text, numbers=tuple(float(n.strip("{}").split()[0]) for n in type(x).__separate__(text)[1]))


def _ramp(r: sm.Ramp, f: float, origin: float, u: Units) -> sm.Ramp:
    return sm.Ramp(r.start * f, r.end * f, r.duration * u.T, r.begin * u.T, r.origin * origin)


def _harmonic(h: sm.Harmonic, f: float, u: Units) -> sm.Harmonic:
    return sm.Harmonic(h.amplitude * f, h.frequency / u.T, h.phase, h.offset * f)


def _table(t: sm.Table, f: float, u: Units) -> sm.Table:
    rates = t.end_rates and _times(t.end_rates, f / u.T)
    return replace(t, time=_times(t.time, u.T), value=_times(t.value, f), end_rates=rates)


def _drive(d: sm.Drive, f: float, u: Units) -> sm.Drive:
    if d.constant is not None:
        return sm.Drive(constant=sm.Constant(d.constant.rate * f / u.T, d.constant.start * f))
    if d.ramp is not None:
        return sm.Drive(ramp=_ramp(d.ramp, f / u.T, f, u))
    if d.harmonic is not None:
        return sm.Drive(harmonic=_harmonic(d.harmonic, f, u))
    return sm.Drive(table=_table(d.table, f, u))


def _load(scene, x, f: float, u: Units):
    """A load in the new units; an input becomes its start value."""
    if hasattr(x, "input") or isinstance(x, (int, float)):
        return f * load_value(scene, x, 0.0)
    if x.ramp is not None:
        return sm.Signal(ramp=_ramp(x.ramp, f, 1.0, u))
    if x.harmonic is not None:
        return sm.Signal(harmonic=_harmonic(x.harmonic, f, u))
    if x.pulse is not None:
        p = x.pulse
        return sm.Signal(pulse=replace(p, peak=p.peak * f, base=p.base * f, begin=p.begin * u.T, duration=p.duration * u.T))
    return sm.Signal(table=_table(x.table, f, u))


def _applied(scene, load, u: Units):
    if load.type == "spring_damper":
        stiff, damp = load.stiffness * u(0, 1, -2), load.damping * u(0, 1, -1)
        return replace(load, stiffness=stiff, damping=damp, length=load.length * u.L)
    if load.type == "point_gravity":
        return replace(load, gm=load.gm * u(3, 0, -2))
    if load.type == "drag":
        return replace(load, area=load.area * u(2), density=load.density * u(-3, 1))
    if load.type == "field":
        width = None if load.width is None else load.width * u.L
        return replace(load, width=width, **{f"f{x}": _formula(getattr(load, f"f{x}"), u) for x in "xyz"})
    f = u.force if load.type == "force" else u.torque
    return replace(load, **{load.type: tuple(_load(scene, x, f, u) for x in getattr(load, load.type))})
