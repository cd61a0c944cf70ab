"""The friction element of a joint as leaves, with its sliding pairs."""

from __future__ import annotations

from engine.scene import model as sm
from engine.system.leaves import Leaf, ParameterTable
from engine.system.structure import FrictionElement, Joint, Slider

NUMBERS = {
    "mu": "1", "mu_static": "1", "radius": "m", "half_length": "m", "half_width": "m", "half_height": "m",
    "viscosity": "s/m", "thrust_radius": "m", "v_eps": "m/s", "v_stribeck": "m/s",
    "bristle_stiffness": "1/m", "bristle_damping": "s/m",
}


def element(scene: sm.Scene, table: ParameterTable, j: Joint, eta: int, flag: int) -> FrictionElement:
    """Element of joint j whose multipliers start at ``eta`` and sliding pairs at ``flag``."""
    f = scene.joints[j.name].friction
    assert f is not None
    law = f.law or scene.friction.law
    numbers: list[tuple[str, Leaf]] = []
    for name, unit in NUMBERS.items():
        value = getattr(f, name)
        if name == "v_eps":
            value = (value or scene.friction.v_eps) if law == "regularized" else None
        if value is None or (name.startswith("bristle") and law != "lugre"):
            continue
        pair = value if isinstance(value, tuple) else (value, value) if _doubled(j, name) else None
        if pair is None:
            numbers.append((name, table.scalar(f"joints.{j.name}.friction.{name}", value, unit)))
        else:
            for k in (0, 1):
                label = f"{name}[{k + 1}]"
                numbers.append((label, table.scalar(f"joints.{j.name}.friction.{label}", pair[k], unit)))
    n = j.kind.nv
    if j.kind.friction == "universal":
        sliders = tuple(Slider(flag + k, (eta + k,), str(k + 1)) for k in range(2))
    else:
        sliders = (Slider(flag, tuple(range(eta, eta + n)), "1"),)
    adams = (f.normal_force or scene.friction.normal_force) == "adams"
    return FrictionElement(j.kind.friction, law, adams, tuple(numbers), sliders)


def _doubled(j: Joint, name: str) -> bool:
    """A universal joint has two journals, each with its own radius and half length."""
    return j.kind.friction == "universal" and name in ("radius", "half_length")
