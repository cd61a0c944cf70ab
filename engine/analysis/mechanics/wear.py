"""``wear``: sliding distance, friction load and worn volume of a run's contacts, from Archard's law V = k ∫ N |v| dt."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.dense_output_rows import with_rows_inside_steps
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.contact_element import ContactElement, Place
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.joint_contact_elements import sizes_given, touching
from trunnion.scene.queries.wheel_sizes import sizes as wheel_sizes
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.c_signatures import library

BINS = 72
"""Number of directions around a pin for which the depth of wear is computed (5° each)."""


@dataclass(frozen=True)
class ContactWear:
    """Wear of one contact of a joint in a run.

    Attributes:
        joint: name of the joint.
        contact: number of the contact, from 1.
        distance: sliding distance, m.
        load: ∫ N |v| dt (normal force N, sliding speed v), J.
        volume: worn volume, m³; NaN without wear coefficient k.
        depth: largest depths on pin and bearing, m; NaN without wear coefficient k or for an unknown contact area.
        pv: largest product of pressure (projected area) and sliding speed, W/m².
        energy: work of friction per projected area, J/m².
        angles: directions around the pin (n), rad; empty if the contact does not extend around the pin.
        on_pin: depths on the pin (n), m.
        on_bearing: depths on the bearing (n), m, in the directions ``angles`` of the pin's frame at q = 0.
    """

    joint: str
    contact: int
    distance: float
    load: float
    volume: float
    depth: tuple[float, float]
    pv: float
    energy: float
    angles: np.ndarray
    on_pin: np.ndarray
    on_bearing: np.ndarray

    def cycles(self, depth: float) -> float:
        """Number of runs after which the deepest place is worn by ``depth``, m; infinite if there is no wear."""
        deepest = max(self.depth)
        return depth / deepest if deepest > 0.0 else math.inf

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers."""
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in asdict(self).items()} | {"depth": list(self.depth)}


@dataclass(frozen=True)
class Wear:
    """Wear of all contacts of a run.

    Attributes:
        contacts: the contacts.
        time: the n times, s.
        columns: by column name, the worn volume up to each time (n), m³; without wear coefficient k the load, J.
    """

    contacts: tuple[ContactWear, ...]
    time: np.ndarray
    columns: dict[str, np.ndarray]

    def __getitem__(self, name: str) -> ContactWear:
        """The contact with the name "joint.contact[i]"."""
        return next(c for c in self.contacts if f"{c.joint}.contact[{c.contact}]" == name)


def wear(result: Result, k: Mapping[str, float] | float | None = None) -> Wear:
    """Wear of every contact of a run.

    The result needs normal forces, angles, coordinates and rates of the joints with friction, which the default outputs contain.
    The run is repeated with rows inside its steps, so that its own rows have no effect. ``time`` has the times of these rows. Axial
    thrust and a preload are not normal forces of contacts, so they add no wear.

    Args:
        result: the run.
        k: wear coefficient, m²/N: one value for all joints, or {joint: value}; default: the coefficients of the scene
            (``wear: {k: …}``).

    Raises:
        SceneError: for missing columns.
    """
    joints = {n: j for n, j in result.scene.joints.items() if j.friction is not None}
    lacking = [f"{n}.{c}" for n, j in joints.items() for c in _needed(n, j) if f"{n}.{c}" not in result]
    if lacking:
        hint = "run with all outputs of the joint"
        raise SceneError([Problem("outputs", f"wear needs the column {c}", hint) for c in lacking[:8]])
    patterns = (f"{n}.{c}" for n, j in joints.items() for c in _columns(n, j))
    result, ends = with_rows_inside_steps(result, tuple(p for p in patterns if result.matching(p)))
    contacts, columns = [], {}
    for name, j in joints.items():
        element = touching(j)
        if element is None or not element.count:
            continue
        own = k.get(name) if isinstance(k, Mapping) else k
        own = own if own is not None else (j.wear.k if j.wear else None)
        for i, found, grown in _joint(result, name, j, element, own, ends):
            contacts.append(found)
            columns[f"{name}.wear.{'volume' if own is not None else 'load'}[{i}]"] = grown
    return Wear(tuple(contacts), result.time, columns)


def _columns(name: str, j: sm.Joint) -> list[str]:
    """The columns from which wear is computed. The list is empty if there are no contacts."""
    needed = _needed(name, j)
    return [*needed, "q[*]", "contact[*].normal[*]"] if needed else []


def _needed(name: str, j: sm.Joint) -> list[str]:
    element, kind = touching(j), REGISTRY[j.type]
    count = element.count if element else 0
    forces = [f"contact[{i + 1}].{what}" for i in range(count) for what in ("normal_force", "angle", "normal[1]")]
    return [*forces, *(f"qd[{i + 1}]" for i in range(kind.nv if count else 0))]


Found = list[tuple[int, ContactWear, np.ndarray]]


def _joint(r: Result, name: str, j: sm.Joint, element: ContactElement, k: float | None, ends: np.ndarray) -> Found:
    """For each contact: (number, wear, worn volume (n) up to each row, m³; if k is None, the load, J). ends: times, s, across which
    no polynomial extends."""
    assert j.friction is not None
    rubbed, speeds, pairs = _load_rates(r, name, j, element)
    places = element.places(_sizes(j, element))
    grown = integral(r.time, np.array([*rubbed, *speeds]), ends)
    mu = j.friction.mu if isinstance(j.friction.mu, float) else math.nan
    out = []
    for i in range(element.count):
        place = places[i] if i < len(places) else Place("pin", 0, 0.0, 0.0)
        load, way = grown[i], float(grown[element.count + pairs[i], -1])
        volume = load * (math.nan if k is None else k)
        area = place.area or math.nan
        around = _around(r, name, i + 1, volume, place) if place.arc and element.anywhere else (np.zeros(0),) * 3
        depth = tuple(float(x.max()) if len(x) else float(volume[-1] / area) for x in around[1:])
        pressed, energy = float(rubbed[i].max() / area), mu * float(load[-1]) / area
        found = ContactWear(
            name, i + 1, way, float(load[-1]), float(volume[-1]), (depth[0], depth[1]), pressed, energy, *around
        )  # fmt: skip
        out.append((i + 1, found, load if k is None else volume))
    return out


def _load_rates(r: Result, name: str, j: sm.Joint, element: ContactElement) -> tuple[np.ndarray, list[np.ndarray], list[int]]:
    """(N |v| of every contact in every row (contacts × rows), W; sliding speed of every pair in every row, m/s; pair of each
    contact)."""
    speeds = _speeds(r, name, element, _sizes(j, element))
    pairs = [i * len(element.pairs) // element.count for i in range(element.count)]
    forces = [r[f"{name}.contact[{i + 1}].normal_force"] for i in range(element.count)]
    return np.array([f * speeds[p] for f, p in zip(forces, pairs, strict=True)]), speeds, pairs


def _sizes(j: sm.Joint, element: ContactElement) -> dict[str, float]:
    """Sizes of the contacts, by name."""
    assert j.friction is not None
    sizes = sizes_given(j.friction, element) | {"pitch": float(j.pitch or 0.0)}
    if REGISTRY[j.type].rolls is not None:
        sizes["module"] = wheel_sizes(j).module
    return sizes


def _speeds(r: Result, name: str, element: ContactElement, sizes: dict[str, float]) -> list[np.ndarray]:
    """Sliding speed of every pair in every row, m/s."""
    rates = [r[f"{name}.qd[{i + 1}]"] for i in range(sum(map(len, element.pairs)))]
    if element.elevates:  # a ball: its sliding speed is r |ω × n|
        normal = np.array([r[f"{name}.contact[1].normal[{i}]"] for i in (1, 2, 3)])
        return [sizes["radius"] * np.linalg.norm(np.cross(np.array(rates).T, normal.T), axis=1)]
    pairs: Any = element.velocity(rates, sizes)  # type: ignore[arg-type]  # ``velocity`` also accepts arrays
    return [np.sqrt(sum(np.asarray(x, float) ** 2 for x in pair)) for pair in pairs]


def _around(r: Result, name: str, i: int, volume: np.ndarray, place: Place) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(centre angles of the sectors around a pin, rad; worn depth of the pin in each sector; worn depth of the bearing in each
    sector). volume: worn volume up to each row, m³."""
    joint = r.scene.joints[name]
    kind = REGISTRY[joint.type]
    spin = next(x for x in range(kind.nv) if kind.turns(x)) if kind.second_axis < 0 else (i - 1) // 2
    angle, turned = (r[f"{name}.{c}"] for c in (f"contact[{i}].angle", f"q[{spin + 1}]"))
    sense = (1.0 if joint.pin == "inboard" else -1.0) * (1.0 if spin == 0 or kind.second_axis < 0 else -1.0)
    around = np.zeros((2, BINS))
    for on, turns in zip(around, (0.0, sense), strict=True):
        library().tr_bin_around(len(r), angle.strides[0] // angle.itemsize, angle.ctypes.data, turned.ctypes.data, turns,
                            volume.ctypes.data, BINS, on.ctypes.data)  # fmt: skip
    middles = (np.arange(BINS) + 0.5) * 2 * np.pi / BINS - np.pi
    return middles, *around / (place.arc * 2 * np.pi / BINS)


def integral(time: np.ndarray, values: np.ndarray, events: Iterable[float]) -> np.ndarray:
    """∫ values dt up to each row (columns × rows, as for ``values``). time (rows): increasing times, s; events: times of events,
    s.

    Polynomials of degree 5 through neighbouring rows are integrated. No polynomial extends across an event.
    """
    time, values = np.ascontiguousarray(time), np.ascontiguousarray(values)
    ends = np.array(sorted({float(time[0]), float(time[-1]), *(e for e in events if time[0] < e < time[-1])}))
    out, total = np.zeros_like(values), np.zeros(len(values))
    library().tr_integrate_rows(len(time), time.ctypes.data, len(values), values.ctypes.data, len(ends), ends.ctypes.data,
                          total.ctypes.data, out.ctypes.data)  # fmt: skip
    return out
