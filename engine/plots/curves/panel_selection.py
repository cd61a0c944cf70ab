"""The curves of a run as data: sections of panels, which ``curve_page`` draws."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact import ContactElement
from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.plots.curves.angle_curves import broken, rotation_vector
from trunnion.scene.queries.joint_contact_elements import touching
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.result import Result

NEGLIGIBLE = 1e-7
"""A component below this fraction of the largest component in its family is not drawn. In plane motion, most components are
zero."""
MOST_CURVES = 8
MOST_JOINTS = 4
NAMED = 3
"""Largest number of omitted joints that a figure names."""


@dataclass(frozen=True)
class Curve:
    """One curve of a panel. The times of the curve may differ from the rows of the result, because gaps add points."""

    label: str
    time: np.ndarray
    values: np.ndarray
    error: np.ndarray | None = None
    """Errors of the values, or None. NaN where no error is stated."""


@dataclass(frozen=True)
class Panel:
    """One pair of axes with its curves, events and jumps."""

    title: str
    quantity: str
    unit: str
    curves: tuple[Curve, ...]
    events: tuple[Event, ...] = ()
    jumps: tuple[tuple[int, float, float, float], ...] = ()
    """Pairs of dots: (index of the curve, time in s, value before, value after)."""
    hidden: int = 0
    """Number of curves that are left out because there are too many."""


@dataclass(frozen=True)
class Section:
    """A titled group of panels about one joint, or about the whole mechanism."""

    heading: str
    panels: tuple[Panel, ...] = field(default=())


def sections(result: Result, joints: Sequence[str] | None = None) -> list[Section]:
    """The sections of ``figure``: each joint with friction, devices, then motion and energy.

    joints: names of the joints that have a section (default: the first with friction and columns).
    """
    rubbing = [j for j in frictional(result) if result.matching(f"{j}.*")]
    chosen = rubbing[:MOST_JOINTS] if joints is None else [j for j in joints if j in result.scene.joints]
    out = [Section(_heading(result, j), tuple(_joint_panels(result, j))) for j in chosen]
    out.append(Section("Drives, springs, dampers, end stops, rods", tuple(_devices(result))))
    others = [j for j in moving(result) if j not in chosen]
    left = rubbing[MOST_JOINTS:] if joints is None else []
    note = f"   (friction of {_listed(left)} is not drawn: --outputs '{left[0]}.*', figure(joints=…))" if left else ""
    out.append(Section(f"Motion and energy{note}", (*_motion(result, others), *_energy(result))))
    return [s for s in out if s.panels]


def _listed(names: Sequence[str]) -> str:
    """The first names as text, and the number of further names."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _devices(result: Result) -> Iterator[Panel]:
    """Efforts of devices along freedoms; axial forces of rods; forces and lengths of springs; forces, torques and offsets of
    bushings."""
    devices = ("drive", "motor", "spring", "damper", "nonlinear", "end_stop", "latch")
    words = ("effort", *(f"{d}.effort" for d in devices))
    efforts = [n for w in words for j in result.scene.joints for n in result.matching(f"{j}.{w}[*]")]
    springs = [n for n, f in result.scene.forces.items() if f"{n}.length" in result]
    held = [n for n, f in result.scene.forces.items() if f.type == "bushing"]
    around, pushed, away, turned = (
        [c for n in held for c in result.matching(f"{n}.{w}[*]")] for w in ("torque", "force", "offset", "turn")
    )
    torques = [n for n in efforts if result.units[n] == "N*m"]
    forces = [*(n for n in efforts if result.units[n] == "N"), *(f"{n}.force" for n in springs), *pushed]
    yield from _panel(result, "Torques along the joints' freedoms", "torque", [*torques, *around])
    yield from _panel(result, "Forces along the joints' freedoms and of springs", "force", forces)
    rods = [c for j in result.scene.joints for c in result.matching(f"{j}.axial_force")]
    yield from _panel(result, "Axial forces of rods", "force", rods)
    yield from _panel(result, "Lengths of springs", "length", [f"{n}.length" for n in springs])
    yield from _panel(result, "Offsets of bushings", "length", away)
    yield from _panel(result, "Turns of bushings", "angle", turned)


def frictional(result: Result) -> list[str]:
    """Names of the joints with friction, in the order of the scene."""
    return [name for name, j in result.scene.joints.items() if j.friction is not None]


def moving(result: Result) -> list[str]:
    """Names of the joints without a drive. Cut joints without friction are omitted, because their motion follows from the other
    joints."""
    from trunnion.system.construction.spanning_tree import span

    cut = span(result.scene).cut
    return [n for n, j in result.scene.joints.items() if j.drive is None and (n not in cut or j.friction is not None)]


def _heading(result: Result, joint: str) -> str:
    return f"{joint} ({result.scene.joints[joint].type})"


def family(result: Result, names: Iterable[str], scale: float = 1.0) -> tuple[list[Curve], int]:
    """(curves, number of omitted curves) for columns that belong together. Columns with negligible values get no curve."""
    here = [n for n in names if n in result]
    sizes = [float(np.max(np.abs(result[n][np.isfinite(result[n])]), initial=0.0)) for n in here]
    largest = max(sizes, default=0.0)
    kept = [n for n, s in zip(here, sizes, strict=True) if s > NEGLIGIBLE * largest] or here[:1]
    curves = [Curve(n, result.time, result[n] * scale, _error(result, n, scale)) for n in kept[:MOST_CURVES]]
    return curves, len(kept[MOST_CURVES:])


def _error(result: Result, name: str, scale: float) -> np.ndarray | None:
    """The scaled error of a column, or None if the column has no error."""
    c = result.certainty
    return c[name] * scale if c is not None and np.isfinite(c[name]).any() else None


def _panel(
    result: Result, title: str, quantity: str, names: Iterable[str], events: Sequence[Event] = (), degrees: bool = False
) -> Iterator[Panel]:
    """Yields one panel of columns that share a unit, if the result has such columns."""
    curves, hidden = family(result, names, float(np.degrees(1.0)) if degrees else 1.0)
    if curves:
        unit = result.units[curves[0].label]
        unit = unit.replace("rad", "°", 1) if degrees else unit
        yield Panel(title, quantity, pretty(unit), tuple(curves), tuple(events), (), hidden)


def pretty(unit: str) -> str:
    return unit.replace("^2", "²").replace("^3", "³").replace("*", " ")


def _joint_panels(result: Result, joint: str) -> Iterator[Panel]:
    """Friction, acceleration, contact angles and normal forces of one frictional joint."""
    events = [e for e in result.events if e.joint == joint]
    numbered = [f"{joint}.friction.torque[{k}]" for k in (1, 2, 3)]
    yield from _panel(result, f"Friction torque of {joint}", "friction torque", numbered, events)
    forces = [f"{joint}.friction.force{k}" for k in ("", "[1]", "[2]")]
    yield from _panel(result, f"Friction force of {joint}", "friction force", forces, events)
    rates = result.matching(f"{joint}.qdd[*]")
    for unit, quantity in (("rad/s^2", "angular acceleration"), ("m/s^2", "acceleration")):
        names = [n for n in rates if result.units[n] == unit]
        yield from _panel(result, f"{quantity.capitalize()} of {joint}", quantity, names, events)
    yield from _angles(result, joint, events)
    forces = result.matching(f"{joint}.contact[*].normal_force")
    yield from _panel(result, f"Normal contact forces in {joint}", "normal force", forces, events)


def _angles(result: Result, joint: str, events: list[Event]) -> Iterator[Panel]:
    """Panels of contact angles in degrees. The jump at a reversal is drawn as a pair of dots."""
    names = [n for n in result.matching(f"{joint}.contact[*].angle") if _turns(result, n)]
    curves: list[Curve] = []
    jumps: list[tuple[int, float, float, float]] = []
    for i, name in enumerate(names[:MOST_CURVES]):
        mine = [(e, at) for e in events if (at := _contact_of(result, e, name)) is not None]
        angle = np.where(_touching(result, name), result[name], np.nan)
        curves.append(Curve(name, *broken(result.time, angle, [e.time for e, _ in mine])))
        jumps += [(i, e.time, float(np.degrees(e.before[at])), float(np.degrees(e.after[at]))) for e, at in mine]
    if curves:
        title = f"Where pin and bearing touch in {joint}"
        yield Panel(title, "contact angle", "°", tuple(curves), tuple(events), tuple(jumps), len(names[MOST_CURVES:]))


def _turns(result: Result, name: str) -> bool:
    """Whether the contact can be anywhere on a circle. Any other contact has only two places, one on each side."""
    return _element(result, name.split(".contact[")[0]).anywhere


def _touching(result: Result, angle: str) -> np.ndarray:
    state = angle.removesuffix("angle") + "state"
    return result[state] > 0.5 if state in result else np.ones(len(result), bool)


def contacts_per_part(result: Result, joint: str) -> int:
    """Number of contacts of each friction pair of a joint."""
    element = _element(result, joint)
    return element.count // len(element.pairs)


def _element(result: Result, joint: str) -> ContactElement:
    """The contact element of a joint with friction."""
    element = touching(result.scene.joints[joint])
    assert element is not None
    return element


def _contact_of(result: Result, event: Event, column: str) -> int | None:
    """Index of a column's contact in ``event.before`` and ``event.after``; None if the contact belongs to another friction pair
    than the event."""
    number = int(column.split(".contact[")[1].split("]")[0]) - 1
    per = contacts_per_part(result, event.joint)
    at = number - (event.part - 1) * per
    return at if 0 <= at < min(per, len(event.before), len(event.after)) else None


def _motion(result: Result, others: list[str]) -> Iterator[Panel]:
    """Panels with coordinates and rates of the moving joints, and with accelerations of the joints ``others``, which have no
    section."""
    free = moving(result)
    flat = [j for j in free if JOINTS[result.scene.joints[j].type].quaternion < 0]
    yield from _panel(result, "Joint angles", "angle", _of(result, flat, "q", "rad"), degrees=True)
    yield from _balls(result)
    yield from _panel(result, "Joint travels", "travel", _of(result, free, "q", "m"))
    yield from _panel(result, "Angular rates of the joints", "angular rate", _of(result, free, "qd", "rad/s"))
    yield from _panel(result, "Speeds of the joints", "speed", _of(result, free, "qd", "m/s"))
    yield from _panel(result, "Angular accelerations", "angular acceleration", _of(result, others, "qdd", "rad/s^2"))
    yield from _panel(result, "Accelerations", "acceleration", _of(result, others, "qdd", "m/s^2"))


def _of(result: Result, joints: list[str], what: str, unit: str) -> list[str]:
    return [n for j in joints for n in result.matching(f"{j}.{what}[*]") if result.units[n] == unit]


def _balls(result: Result) -> Iterator[Panel]:
    """Rotation vectors of spherical joints with friction. In plane motion the vector is the swing angle."""
    for name in frictional(result):
        columns = [f"{name}.q[{k}]" for k in (1, 2, 3, 4)]
        if JOINTS[result.scene.joints[name].type].quaternion != 0 or not all(c in result for c in columns) or not len(result):
            continue
        turn = np.degrees(rotation_vector(np.column_stack([result[c] for c in columns])))
        sizes = np.abs(turn).max(axis=0)
        kept = [k for k in range(3) if sizes[k] > NEGLIGIBLE * sizes.max()] or [0]
        curves = [Curve(f"{name} about e{k + 1}", result.time, turn[:, k]) for k in kept]
        yield Panel(f"Rotation in {name} (rotation vector)", "angle", "°", tuple(curves))


def _energy(result: Result) -> Iterator[Panel]:
    """A panel of the energies, and a panel of the residual of their balance."""
    names = [f"energy.{n}" for n in ("kinetic", "potential", "dissipated")]
    yield from _panel(result, "Energy", "energy", names)
    yield from _panel(result, "Residual of the energy balance", "residual", ["energy.residual"])
