"""The friction element of a joint as leaves of the parameter table, with its friction pairs."""

from __future__ import annotations

import math

from trunnion.basics.monotone_curves import filled
from trunnion.elements.contact.gearbox_losses import table_labels
from trunnion.elements.contact.registry import preloads
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.friction.coulomb import BY_SPEED
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.joint_contact_elements import defaults_to_one, touching
from trunnion.system.construction.device_builder import Builder
from trunnion.system.structure.bodies_and_joints import FrictionElement, Joint, Signal, Slider
from trunnion.system.structure.parameter_table import Leaf, ParameterTable


def _sign(teeth: tuple[Leaf, ...]) -> float:
    """Sign (1 or −1) of the sum of the numbers of teeth."""
    return math.copysign(1.0, sum(z for z in teeth if isinstance(z, float)))


def _by_speed(table: ParameterTable, path: str, c: sm.BySpeed) -> list[tuple[str, Leaf]]:
    """Names and leaves of a coefficient over speed: the coefficient at speed 0, then speed and coefficient of each further
    point."""
    speed = filled([table.own(f"{path}.speed[{i + 1}]", v, "m/s") for i, v in enumerate(c.speed)])
    value = filled([table.own(f"{path}.value[{i + 1}]", v, "1") for i, v in enumerate(c.value)])
    more = zip(BY_SPEED, speed[1:], value[1:], strict=True)
    return [("mu", value[0]), *(pair for names, v, mu in more for pair in zip(names, (v, mu), strict=True))]


def _by_load(table: ParameterTable, path: str, name: str, c: sm.ByLoad) -> list[tuple[str, Leaf]]:
    """Names and leaves of an efficiency over torque or speed: the two numbers of each point."""
    over, unit = ("torque", "N*m") if c.torque is not None else ("speed", "rad/s")
    at = filled([table.own(f"{path}.{over}[{i + 1}]", v, unit) for i, v in enumerate(c.torque or c.speed or ())])
    value = filled([table.own(f"{path}.value[{i + 1}]", v, "1") for i, v in enumerate(c.value)])
    points = zip(table_labels(name, over), at, value, strict=True)
    return [pair for names, x, y in points for pair in zip(names, (x, y), strict=True)]


def element(scene: sm.Scene, devices: Builder, j: Joint, eta: int, flag: int) -> FrictionElement:
    """Friction element of joint j, with the parameters of its law and contact element that the scene gives.

    eta, flag: indices of the element's first friction multiplier and first friction pair."""
    f = scene.joints[j.name].friction
    assert f is not None
    law = scene.law_of(f)
    contact = touching(scene.joints[j.name])
    assert contact is not None
    numbers: list[tuple[str, Leaf | Signal]] = []
    table = devices.table
    for n in (*LAWS[law].numbers, *contact.sizes):
        value = getattr(f, n.name)
        if value is None and n.default is not None:
            value = getattr(scene.friction, n.name)
        if value is None and defaults_to_one(contact, n, law):
            numbers.append((n.name, table.scalar(f"joints.{j.name}.friction.{n.name}", 1.0, n.unit)))
        if value is None:
            if n.derived and j.wheels is not None and j.wheels.wrap is not None:
                numbers.append((n.name, j.wheels.wrap))
            if preloads(n, law, scene.normal_force_of(f) == "adams"):
                numbers += [(label, 0.0) for label in n.labels]
            continue
        if isinstance(value, sm.BySpeed):
            numbers += _by_speed(table, f"joints.{j.name}.friction.{n.name}", value)
            continue
        if isinstance(value, sm.ByLoad):
            numbers += _by_load(table, f"joints.{j.name}.friction.{n.name}", n.name, value)
            continue
        values = value if isinstance(value, tuple) else (value,) * n.count
        put = table.own if isinstance(value, tuple) or n.count == 1 else table.scalar  # one number is the value for both journals
        for label, one in zip(n.labels, values, strict=True):
            if isinstance(one, sm.FromInput | sm.Signal):
                at = label if isinstance(value, tuple) else n.name
                numbers.append((label, devices.load(f"joints.{j.name}.friction.{at}", one, n.unit)))
                continue
            numbers.append((label, put(f"joints.{j.name}.friction.{label}", one, n.unit)))
    if j.pitch is not None:
        numbers.append(("pitch", j.pitch))
    if j.mimic is not None:
        numbers.append(("ratio", j.mimic.ratio))
    if j.wheels is not None:
        numbers += [("module", j.wheels.module), ("side", _sign(j.wheels.teeth)), ("first", _sign(j.wheels.teeth[:1]))]
        numbers += [("lead_angle", j.wheels.lead)] if j.wheels.lead is not None else []
    sliders = tuple(Slider(flag + i, tuple(eta + k for k in pair), str(i + 1)) for i, pair in enumerate(contact.pairs))
    adams = scene.normal_force_of(f) == "adams"
    return FrictionElement(contact.name, law, adams, tuple(numbers), sliders, tuple(eta + k for k in contact.bound))
