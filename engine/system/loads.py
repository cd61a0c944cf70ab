"""Applied forces, torques, spring-dampers and bushings as leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from engine.scene import model as sm
from engine.scene.poses import sides_of
from engine.scene.refs import named_point, point_of
from engine.system.frames import frame
from engine.system.leaves import Leaf
from engine.system.structure import Load

if TYPE_CHECKING:
    from engine.system.build import _Maker


def load(maker: _Maker, name: str, f: sm.Applied) -> Load:
    """One applied load of the scene as leaves. A force without a named point acts at the mass centre."""
    if isinstance(f, sm.SpringDamper):
        return _spring(maker, name, f)
    if isinstance(f, sm.Bushing):
        return _bushing(maker, name, f)
    path = f"forces.{name}.{f.type}"
    values = f.force if isinstance(f, sm.Force) else f.torque
    unit = "N" if isinstance(f, sm.Force) else "N*m"
    vector = tuple(maker.devices.component(f"{path}[{k + 1}]", v, unit) for k, v in enumerate(values))
    body, point = point_of(maker.scene, f.on)
    if isinstance(f, sm.Force) and not named_point(f.on):
        x, y, z = maker.scene.bodies[body].center
        point = (float(x), float(y), float(z))
    leaves = maker.relative(body, maker.named(body, named_point(f.on)) if named_point(f.on) else f"bodies.{body}.center", point)
    return Load(name, f.type, (maker.index[body],), (leaves,), f.frame == "body", vector)


def _spring(maker: _Maker, name: str, f: sm.SpringDamper) -> Load:
    s = maker.table.own
    ends = [point_of(maker.scene, b) for b in f.between]
    labels = [maker.label(side, f"bodies.{b}.origin.point") for side, (b, _) in zip(f.between, ends, strict=True)]
    leaves = tuple(maker.relative(b, label, p) for label, (b, p) in zip(labels, ends, strict=True))
    numbers = (
        s(f"forces.{name}.stiffness", f.stiffness, "N/m"), s(f"forces.{name}.damping", f.damping, "N*s/m"),
        s(f"forces.{name}.length", f.length, "m"),
    )
    return Load(name, "spring_damper", tuple(maker.index[b] for b, _ in ends), leaves, False, (), numbers)


BUSHING = (("stiffness", "N/m"), ("damping", "N*s/m"), ("turning_stiffness", "N*m/rad"), ("turning_damping", "N*m*s/rad"))
"""Numbers of a bushing, three each."""


def _bushing(maker: _Maker, name: str, f: sm.Bushing) -> Load:
    sides = sides_of(maker.scene, as_joint(f))
    labels = [s.named or f"forces.{name}.{side}.point" for s, side in zip(sides, ("first", "second"), strict=True)]
    leaves = tuple(maker.relative(s.body, label, s.point) for label, s in zip(labels, sides, strict=True))
    numbers: list[Leaf] = []
    for field, unit in BUSHING:
        value, path = getattr(f, field), f"forces.{name}.{field}"
        if isinstance(value, tuple):
            numbers += [maker.table.own(f"{path}[{i + 1}]", v, unit) for i, v in enumerate(value)]
        else:
            numbers += [maker.table.own(path, value, unit)] * 3
    frames = tuple(frame(s.axis, s.reference) for s in sides)
    return Load(name, "bushing", tuple(maker.index[s.body] for s in sides), leaves, numbers=tuple(numbers), frames=frames)


def as_joint(f: sm.Bushing) -> sm.Joint:
    """The joint whose points and frames are a bushing's."""
    return sm.Joint("free", *f.between, axis=f.axis, reference=f.reference)
