"""Applied forces, torques, drag, fields, spring-dampers, attractions and bushings as leaves of the parameter table."""

from __future__ import annotations

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.data_classes.force_field import COMPONENTS
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.body_references import named_point, point_of
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.scene.signals.position_formulas import separate
from trunnion.system.construction.joint_frames import frame
from trunnion.system.construction.point_parameters import Points
from trunnion.system.structure.bodies_and_joints import LawForce, Load, Signal
from trunnion.system.structure.parameter_table import Leaf, Leaves


def load(points: Points, name: str, f: sm.Applied) -> Load:
    """An applied load of the scene as leaves. A force without a named point acts at the mass centre."""
    if isinstance(f, sm.SpringDamper):
        return _spring(points, name, f)
    if isinstance(f, sm.Bushing):
        return _bushing(points, name, f)
    if isinstance(f, sm.PointGravity):
        return _attraction(points, name, f)
    if isinstance(f, sm.Drag):
        body, at = _place(points, f.on)
        factors = (("density", f.density, "kg/m^3"), ("coefficient", f.coefficient, "1"), ("area", f.area, "m^2"))
        own = tuple(Signal("value", (points.table.own(f"forces.{name}.{key}", x, unit),)) for key, x, unit in factors)
        return Load(name, "drag", (points.index[body],), (at,), vector=own)
    if isinstance(f, sm.Field):
        body, at = _place(points, f.on)
        given = tuple((key, getattr(f, key)) for key in COMPONENTS)
        fields = tuple(None if x is None else _field(points, f"forces.{name}.{key}", x) for key, x in given)
        width = () if f.width is None else (points.table.own(f"forces.{name}.width", f.width, "m"),)
        return Load(name, "field", (points.index[body],), (at,), vector=fields, numbers=width)
    path = f"forces.{name}.{f.type}"
    values = f.force if isinstance(f, sm.Force) else f.torque
    unit = "N" if isinstance(f, sm.Force) else "N*m"
    vector = tuple(points.devices.component(f"{path}[{k + 1}]", v, unit) for k, v in enumerate(values))
    body, at = _place(points, f.on)
    return Load(name, f.type, (points.index[body],), (at,), f.frame == "body", vector)


def _field(points: Points, path: str, f: sm.PlaceFormula) -> Signal:
    """A component of a field."""
    return Signal("place", points.devices.constants(path, f.numbers), formula=separate(f.formula)[0])


def _place(points: Points, on: str) -> tuple[str, Leaves]:
    """The body, and the point as leaves, that the text "body.point" names. The text "body" names the body's mass centre."""
    body, point = point_of(points.scene, on)
    if not named_point(on):
        x, y, z = points.scene.bodies[body].center
        point = (float(x), float(y), float(z))
    label = points.named(body, named_point(on)) if named_point(on) else f"bodies.{body}.center"
    return body, points.relative(body, label, point)


def _attraction(points: Points, name: str, f: sm.PointGravity) -> Load:
    """The attraction of a body by a point: a spring-damper without stiffness and damping, with a force law that depends on the
    length."""
    body, at = _place(points, f.on)
    other, point = point_of(points.scene, f.towards)
    end = points.relative(other, points.label(f.towards, f"bodies.{other}.origin.point"), point)
    mass = points.table.scalar(f"bodies.{body}.mass", mass_properties(points.scene.bodies[body])[0], "kg")
    law = LawForce("attraction", (points.table.own(f"forces.{name}.gm", f.gm, "m^3/s^2"), mass))
    bodies = (points.index[body], points.index[other])
    return Load(name, "spring_damper", bodies, (at, end), numbers=(0.0, 0.0, 0.0), nonlinear=(law,))


def _spring(points: Points, name: str, f: sm.SpringDamper) -> Load:
    s = points.table.own
    ends = [point_of(points.scene, b) for b in f.between]
    labels = [points.label(side, f"bodies.{b}.origin.point") for side, (b, _) in zip(f.between, ends, strict=True)]
    leaves = tuple(points.relative(b, label, p) for label, (b, p) in zip(labels, ends, strict=True))
    numbers = (
        s(f"forces.{name}.stiffness", f.stiffness, "N/m"), s(f"forces.{name}.damping", f.damping, "N*s/m"),
        s(f"forces.{name}.length", f.length, "m"),
    )
    nonlinear = () if f.nonlinear is None else points.devices.nonlinear(f"forces.{name}.nonlinear", f.nonlinear, "m", "N")
    bodies = tuple(points.index[b] for b, _ in ends)
    return Load(name, "spring_damper", bodies, leaves, numbers=numbers, nonlinear=nonlinear)


BUSHING = (("stiffness", "N/m"), ("damping", "N*s/m"), ("turning_stiffness", "N*m/rad"), ("turning_damping", "N*m*s/rad"))
"""(field, unit) of each parameter of a bushing. Each parameter has three values."""


def _bushing(points: Points, name: str, f: sm.Bushing) -> Load:
    sides = sides_of(points.scene, as_joint(f))
    labels = [s.named or f"forces.{name}.{side}.point" for s, side in zip(sides, ("first", "second"), strict=True)]
    leaves = tuple(points.relative(s.body, label, s.point) for label, s in zip(labels, sides, strict=True))
    numbers: list[Leaf] = []
    for field, unit in BUSHING:
        value, path = getattr(f, field), f"forces.{name}.{field}"
        if isinstance(value, tuple):
            numbers += [points.table.own(f"{path}[{i + 1}]", v, unit) for i, v in enumerate(value)]
        else:
            numbers += [points.table.own(path, value, unit)] * 3
    frames = tuple(frame(s.axis, s.reference) for s in sides)
    return Load(name, "bushing", tuple(points.index[s.body] for s in sides), leaves, numbers=tuple(numbers), frames=frames)


def as_joint(f: sm.Bushing) -> sm.Joint:
    """A joint with the points and frames of a bushing, in place of the bushing."""
    return sm.Joint("free", *f.between, axis=f.axis, reference=f.reference)
