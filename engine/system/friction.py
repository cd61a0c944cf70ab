"""The friction element of a joint as leaves, with its sliding pairs."""

from __future__ import annotations

import math

from engine.contact.registry import preloads
from engine.friction import REGISTRY as LAWS
from engine.scene import model as sm
from engine.scene.touching import given, touching
from engine.system.leaves import Leaf, ParameterTable
from engine.system.structure import FrictionElement, Joint, Slider


def _sign(teeth: tuple[Leaf, ...]) -> float:
    """1 or −1, the sign of the sum of numbers of teeth."""
    return math.copysign(1.0, sum(z for z in teeth if isinstance(z, float)))


def element(scene: sm.Scene, table: ParameterTable, j: Joint, eta: int, flag: int) -> FrictionElement:
    """Element of joint j whose multipliers start at ``eta`` and sliding pairs at ``flag``: the numbers that its law and its contact
    element declare, as far as the scene gives them."""
    f = scene.joints[j.name].friction
    assert f is not None
    law = scene.law_of(f)
    contact = touching(scene.joints[j.name])
    assert contact is not None
    numbers: list[tuple[str, Leaf]] = []
    for n in (*LAWS[law].numbers, *contact.sizes):
        value = getattr(f, n.name)
        if value is None and n.default is not None:
            value = getattr(scene.friction, n.name)
        if value is None and given(contact, n, law):
            numbers.append((n.name, table.scalar(f"joints.{j.name}.friction.{n.name}", 1.0, n.unit)))
        if value is None:
            if preloads(n, law, scene.normal_force_of(f) == "adams"):
                numbers += [(label, 0.0) for label in n.labels]
            continue
        values = value if isinstance(value, tuple) else (value,) * n.count
        put = table.own if isinstance(value, tuple) or n.count == 1 else table.scalar  # one number may stand for both journals
        for label, one in zip(n.labels, values, strict=True):
            numbers.append((label, put(f"joints.{j.name}.friction.{label}", one, n.unit)))
    if j.pitch is not None:
        numbers.append(("pitch", j.pitch))
    if j.wheels is not None:
        numbers += [("module", j.wheels.module), ("side", _sign(j.wheels.teeth)), ("first", _sign(j.wheels.teeth[:1]))]
    sliders = tuple(Slider(flag + i, tuple(eta + k for k in pair), str(i + 1)) for i, pair in enumerate(contact.pairs))
    adams = scene.normal_force_of(f) == "adams"
    return FrictionElement(contact.name, law, adams, tuple(numbers), sliders, tuple(eta + k for k in contact.bound))
