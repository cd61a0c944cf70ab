"""The numbers of a scene by path, and their units, which may depend on the joint type."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trunnion.basics.number_declarations import Bound, Order
from trunnion.elements.contact import sizes
from trunnion.elements.friction import numbers as law_numbers
from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.scene.data_classes.joints import ORDERS
from trunnion.scene.data_classes.scene import Force, Scene
from trunnion.scene.data_classes.type_tree import bound_at, shape, unit_at
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.force_laws.registry import REGISTRY as FORCE_LAWS
from trunnion.scene.signals.registry import REGISTRY as SIGNALS
from trunnion.scene.units.dimension_names import unit_of as unit_text
from trunnion.scene.units.numbers_with_units import Quantity

PLAIN = "1"
RUBBING = {name: n for group in (law_numbers(), sizes()) for name, (n, _) in group.items()}
"""The numbers of laws and contact elements."""


def numbers(scene: Scene) -> Iterator[tuple[Path, float, str]]:
    """(path, value, SI unit) of every number of a scene, defaults included."""
    return ((path, value, unit_of(scene, path)) for path, value in number_values(scene))


def number_values(scene: Scene) -> list[tuple[Path, float]]:
    """(path, value) of every number of a scene, defaults included."""
    found: list[tuple[Path, float]] = []
    _collect(scene, (), found)
    return found


def _collect(value: Any, path: Path, found: list[tuple[Path, float]]) -> None:
    """Append the numbers inside a value to ``found``."""
    if isinstance(value, dict):
        inside: Any = value.items()
    elif isinstance(value, tuple):
        inside = enumerate(value)
    else:
        inside = getattr(value, "__dict__", {}).items()  # the fields of a scene class
    for key, v in inside:
        if isinstance(v, float):
            found.append(((*path, key), v))
        elif v is not None and v.__class__ is not str:
            _collect(v, (*path, key), found)


def number_at(scene: Scene, path: Path) -> float | None:
    """The number at a path; None if the path leads to no number of the scene."""
    value: Any = scene
    for step in path:
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, tuple):
            value = value[step] if isinstance(step, int) and step < len(value) else None
        else:
            known = isinstance(step, str) and step in getattr(value, "__dataclass_fields__", ())
            value = getattr(value, str(step)) if known else None
    return value if isinstance(value, float) else None


def unit_of(scene: Scene, path: Path) -> str:
    """SI unit of the number at a path."""
    mark = unit_at(shape(path))
    if mark is not None and mark.unit:
        return mark.unit
    if path[-2:-1] == ("numbers",):
        return _own_unit(number_at(scene, path))
    if path[0] == "joints" and path[2] == "mimic":
        return _mimic_unit(scene, str(path[1]), str(path[-1]))
    if path[0] == "joints":
        return _joint_unit(REGISTRY[scene.joints[str(path[1])].type], path[2:])
    if path[0] == "forces":
        if "nonlinear" in path:
            return _law_unit(path[3:], "m", "N")
        if "at" in path:
            return PLAIN  # the values at ``at`` are in the unit of the input
        return _load_unit(path, "N" if isinstance(scene.forces[str(path[1])], Force) else "N*m")
    if path[0] == "parameters":
        return _own_unit(scene.parameters[str(path[1])])
    return scene.inputs[str(path[1])].unit if path[0] == "inputs" else PLAIN


def _own_unit(given: float | None) -> str:
    """Unit of a number whose place does not determine the unit."""
    return (unit_text(given.dimension) if isinstance(given, Quantity) else "") or PLAIN


def bound_of(path: Path) -> Bound:
    """The allowed values of the number at a path. The allowed values do not depend on the scene."""
    return bound_at(shape(path))


def order_of(path: Path) -> Order | None:
    """The required order of two numbers, if the upper number is at this path; otherwise None."""
    owner = str(path[2]) if path[0] == "joints" and len(path) > 3 else ""
    return next((o for o in ORDERS.get(owner, ()) if o.high == path[-1]), None)


def _joint_unit(kind: JointKind, path: Path) -> str:
    """Unit of a number below a joint, e.g. ("spring", 1, "stiffness")."""
    field, rest = path[0], path[1:]
    if field == "start":
        return _start_unit(kind, rest)
    if field == "friction":
        return _load_unit(path, RUBBING[str(path[1])].unit) if "at" not in path else PLAIN
    if field not in ("spring", "damping", "rotor_inertia", "end_stops", "drive", "effort", "motor", "latch", "nonlinear"):
        return PLAIN  # a plain number, such as a component of a direction
    k = rest[0] if rest and isinstance(rest[0], int) else 0
    keys = tuple(str(key) for key in rest if not isinstance(key, int))
    coordinate, effort = ("m", "N") if slides(kind, k) else ("rad", "N*m")
    if field == "nonlinear":
        return _law_unit(keys, coordinate, effort)
    if field == "drive":
        return _drive_unit(keys, coordinate)
    if (field, *keys[:1]) in (("motor", "signal"), ("latch", "release")):
        return _load_unit(keys, PLAIN) if "end_rates" not in keys else "1/s"
    if field == "effort":
        return _load_unit(keys, effort) if "at" not in keys else PLAIN
    if field == "rotor_inertia":
        return "kg" if slides(kind, k) else "kg*m^2"
    if field == "damping":
        return f"{effort}*s/{coordinate}"
    of_motor = {"holds": effort, "stall": effort, "no_load": f"{coordinate}/s"}
    return {**of_motor, "stiffness": f"{effort}/{coordinate}", "damping": f"s/{coordinate}"}.get(keys[-1], coordinate)


def _law_unit(path: Path, coordinate: str, effort: str) -> str:
    """Unit of a number of a nonlinear spring or damper, whose path begins with the law's key."""
    keys = [str(key) for key in path if not isinstance(key, int)]
    return FORCE_LAWS[keys[0]].unit(keys[-1], coordinate, effort)


def _mimic_unit(scene: Scene, name: str, key: str) -> str:
    """Unit of a number of a mimic. The offset has the unit of the follower's coordinate. The ratio has this unit per unit of the
    leader's coordinate."""
    j = scene.joints[name]
    leader = scene.joints.get(j.mimic.joint) if j.mimic else None
    own, led = ("m" if slides(REGISTRY[x.type], 0) else "rad" for x in (j, leader or j))
    return own if key == "offset" else PLAIN if own == led else f"{own}/{led}"


def slides(kind: JointKind, freedom: int) -> bool:
    """Whether a freedom is a travel and not a rotation; the freedom of a screw is a rotation."""
    return 0 <= freedom < kind.nv and not kind.turns(freedom)


def _start_unit(kind: JointKind, path: Path) -> str:
    entry = path[1] if len(path) > 1 else 0
    k = entry if isinstance(entry, int) else 0
    if "axis" in path:
        return PLAIN
    if path[0] == "qd":
        return "m/s" if slides(kind, k) else "rad/s"
    return {"length": "m", "angle": "rad"}.get(kind.coordinates[k] if k < kind.nq else "", PLAIN)


def _load_unit(keys: tuple[str | int, ...], effort: str) -> str:
    """Unit of a number of a load: the unit of the load or, for the end rates of a table, this unit per second."""
    return f"{effort}/s" if "end_rates" in keys else effort


def _drive_unit(keys: tuple[str, ...], coordinate: str) -> str:
    """Unit of a number of a drive. Rates of a constant or ramp, and the end rates of a table, have the coordinate's unit per
    second. All other numbers have the coordinate's unit."""
    rate = len(keys) > 1 and keys[0] in SIGNALS and keys[1] in SIGNALS[keys[0]].rates
    return f"{coordinate}/s" if rate else coordinate
