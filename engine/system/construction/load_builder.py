"""Applied forces, torques, spring-dampers and bushings as leaves of the parameter table."""

from __future__ import annotations

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses import sides_of
from trunnion.scene.queries.body_references import named_point, point_of
from trunnion.system.construction.joint_frames import frame
from trunnion.system.construction.point_parameters import Points
from trunnion.system.structure.bodies_and_joints import Load
from trunnion.system.structure.parameter_table import Leaf


def load(points: Points, name: str, f: sm.Applied) -> Load:
    """An applied load of the scene as leaves. A force without a named point acts at the mass centre."""
    if isinstance(f, sm.SpringDamper):
        return _spring(points, name, f)
    if isinstance(f, sm.Bushing):
        return _bushing(points, name, f)
    path = f"forces.{name}.{f.type}"
    values = f.force if isinstance(f, sm.Force) else f.torque
    unit = "N" if isinstance(f, sm.Force) else "N*m"
    vector = tuple(points.devices.component(f"{path}[{k + 1}]", v, unit) for k, v in enumerate(values))
    body, point = point_of(points.scene, f.on)
    if isinstance(f, sm.Force) and not named_point(f.on):
        x, y, z = points.scene.bodies[body].center
        point = (float(x), float(y), float(z))
    leaves = points.relative(body, points.named(body, named_point(f.on)) if named_point(f.on) else f"bodies.{body}.center", point)
    return Load(name, f.type, (points.index[body],), (leaves,), f.frame == "body", vector)


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
    return Load(
        name, "spring_damper", tuple(points.index[b] for b, _ in ends), leaves, numbers=numbers, nonlinear=nonlinear
    )  # fmt: skip


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
    """A joint that stands for a bushing: it has the same points and frames."""
    return sm.Joint("free", *f.between, axis=f.axis, reference=f.reference)
