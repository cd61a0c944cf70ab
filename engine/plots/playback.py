"""What the viewer of a run is given: meshes, joints, events, and the rows of the motion, thinned to a sensible size."""

from __future__ import annotations

import base64
from dataclasses import asdict
from typing import Any

import numpy as np

from engine.joints import REGISTRY
from engine.plots import palette
from engine.plots.angles import rotation_vector
from engine.plots.captions import caption, event_text
from engine.plots.meshes import FINE, Mesh
from engine.plots.motion import Motion, arrow_scale, bounds, first_view, motion, pressure_scale, rails, reach, round_force
from engine.plots.scenery import JointMark, Scenery, scenery
from engine.simulation.result import Result

MOST_BYTES = 1_800_000
"""Bytes of rows before they are written as text (a third longer)."""
MOST_ROWS = 3000
MOST_EVENTS = 300
MOST_PANELS = 4


class _Channels:
    """Columns of the rows the page carries, each kept once."""

    def __init__(self, result: Result):
        self.result = result
        self.columns: list[np.ndarray] = []
        self.places: dict[str, int] = {}

    def add(self, *values: np.ndarray) -> int:
        """Keep columns side by side; the index of the first."""
        self.columns += values
        return len(self.columns) - len(values)

    def named(self, *names: str) -> int | None:
        """Keep columns of the result side by side; the index of the first, or None when one of them is missing."""
        if any(n not in self.result for n in names):
            return None
        if names[0] not in self.places:
            self.places[names[0]] = self.add(*(self.result[n] for n in names))
        return self.places[names[0]]


def content(result: Result) -> dict[str, Any]:
    """Everything the viewer draws from, as plain data."""
    scene = scenery(result.scene, FINE)
    moved = motion(result, [p.name for p in scene.parts])
    channels, meshes = _Channels(result), _Meshes()
    parts = [
        {
            "name": p.name,
            "color": _hex(p.color),
            "mesh": meshes.place(p.mesh),
            "channel": channels.add(*_pose(moved, i)),
            "traced": [{"name": n, "at": x.tolist()} for n, x in (p.points or {p.name: np.zeros(3)}).items()],
        }
        for i, p in enumerate(scene.parts)
    ]
    joints = [_joint(j, result, channels, meshes) for j in scene.joints]
    rubbing = [j for j in joints if j["contacts"]] or [j for j in joints if j["values"]]
    for j in joints:
        j["panel"] = j in rubbing[:MOST_PANELS]
    rows = thinned(result, len(channels.columns))
    block = np.column_stack(channels.columns)[rows].astype("<f4")
    return _frame(result, scene, moved) | {
        "parts": parts, "joints": joints, "meshes": meshes.data, "width": block.shape[1],
        "times": base64.b64encode(result.time[rows].astype("<f8").tobytes()).decode(),
        "rows": base64.b64encode(np.ascontiguousarray(block).tobytes()).decode(),
    }  # fmt: skip


def _pose(moved: Motion, part: int) -> tuple[np.ndarray, ...]:
    return (*moved.positions[:, part].T, *moved.turns[:, part].T)


def _hex(color: str) -> str:
    """#rrggbb of a colour's name."""
    if color.startswith("#") and len(color) == 7:
        return color
    from matplotlib.colors import to_hex

    try:
        return to_hex(color)
    except ValueError:
        return palette.BODIES[0]


class _Meshes:
    """The meshes as flat lists of numbers; equal ones are kept once."""

    def __init__(self) -> None:
        self.data: list[dict[str, Any]] = []
        self.places: dict[bytes, int] = {}

    def place(self, mesh: Mesh) -> int:
        """Index of a mesh in the list."""
        flat = np.round(mesh.vertices, 6).ravel()
        key = flat.tobytes() + repr(mesh.faces).encode()
        if key not in self.places:
            self.places[key] = len(self.data)
            self.data.append({"v": flat.tolist(), "f": mesh.faces, "e": mesh.edges})
        return self.places[key]


def _joint(j: JointMark, result: Result, channels: _Channels, meshes: _Meshes) -> dict[str, Any]:
    """What the viewer is told of joint j: its pins, its contacts and the values its label shows."""
    contacts = []
    for c in j.contacts:
        force = channels.named(f"{c.columns}.normal_force")
        normal = channels.named(*(f"{c.columns}.normal[{k}]" for k in (1, 2, 3)))
        state = channels.named(c.state)
        if force is not None and normal is not None:
            state = channels.add(np.zeros(len(result))) if state is None else state
            where: dict[str, Any] = {"part": c.part, "base": c.base.tolist(), "arm": c.arm, "axis": c.axis.tolist()}
            where |= asdict(c.patch)
            if c.follows is not None:
                where["bases"] = channels.add(*c.bases(result).T)
            contacts.append(where | {"force": force, "normal": normal, "state": state})
    return {
        "name": j.name, "type": j.type, "parts": j.parts,
        "point": j.points[1].tolist(), "frame": j.frames[0].ravel().tolist(),
        "pins": [{"part": part, "mesh": meshes.place(mesh)} for part, mesh in j.pins],
        "contacts": contacts, "values": _values(j, result, channels),
    }  # fmt: skip


SHOWN = ("q[*]", "offset[*]", "turn[*]", "friction.torque[*]", "friction.force", "contact[*].normal_force", "contact[*].angle")
"""Columns of a joint or bushing whose values are shown beside it."""


def _values(j: JointMark, result: Result, channels: _Channels) -> list[dict[str, Any]]:
    """Coordinates, friction and contacts of a joint, in degrees where they are angles."""
    names = [
        n
        for p in SHOWN
        for n in result.matching(f"{j.name}.{p}")
    ]
    names = [n for n in names if result.units[n] != "1"]
    out = []
    quaternion = [f"{j.name}.q[{k}]" for k in (1, 2, 3, 4)]
    if j.type in REGISTRY and REGISTRY[j.type].quaternion == 0 and all(n in result for n in quaternion):
        turn = rotation_vector(np.column_stack([result[n] for n in quaternion]))
        first = channels.add(*turn.T)
        out = [{"label": f"angle e{k + 1}", "unit": "°", "factor": 180 / np.pi, "channel": first + k} for k in range(3)]
    for n in names:
        degrees = result.units[n] == "rad"
        unit = "°" if degrees else result.units[n].replace("*", " ")
        label = n.removeprefix(f"{j.name}.")
        out.append({"label": label, "unit": unit, "factor": 180 / np.pi if degrees else 1.0, "channel": channels.named(n)})
    return out


def thinned(result: Result, width: int) -> np.ndarray:
    """Rows kept: evenly chosen within the size wanted, with those on both sides of every event."""
    most = max(50, min(MOST_ROWS, MOST_BYTES // (4 * max(1, width))))
    if len(result) <= most:
        return np.arange(len(result))
    after = np.searchsorted(result.time, [e.time for e in result.events][: most // 8])
    near = np.concatenate([after - 1, after]).astype(int)
    even = np.linspace(0, len(result) - 1, most - len(near)).round().astype(int)
    return np.unique(np.clip(np.concatenate([even, near]), 0, len(result) - 1))


def _frame(result: Result, scene: Scenery, moved: Motion) -> dict[str, Any]:
    """What does not change from row to row: names, first view, scales, events."""
    low, high = bounds(scene, moved)
    view = first_view(scene.up, low, high)
    center, wide, near = reach(scene, moved, view)
    scale = arrow_scale(result, scene)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    events = result.events[:: max(1, -(-len(result.events) // MOST_EVENTS))]
    return {
        "title": result.scene.title or result.scene.name, "caption": caption(result),
        "up": scene.up.tolist(), "view": view.tolist(), "center": center.tolist(),
        "extent": {"all": wide.tolist(), "near": near.tolist()}, "follow": bool(max(wide) > 3.0 * max(near)),
        "size": scene.size, "arrow": scale, "force": round_force(scale, scene.size),
        "floor": float((corners @ scene.up).min() - 0.08 * scene.size),
        "grid": float(10.0 ** np.floor(np.log10(2 * scene.size)) / 2),
        "events": [{"t": e.time, "text": event_text(e)} for e in events],
        "springs": [[{"part": part, "point": point.tolist()} for part, point in ends] for ends in scene.springs],
        "rails": [{"part": p, "from": a.tolist(), "to": b.tolist()} for p, a, b in rails(result, scene)],
        "states": {str(k): v for k, v in palette.STATES.items()} | {"other": palette.OPEN},
        "colors": {"joint": palette.JOINT, "ramp": palette.PRESSURE}, "pressure": pressure_scale(result, scene), **_speeds(result),
    }  # fmt: skip


def _speeds(result: Result) -> dict[str, Any]:
    """Speeds to choose from, and the first: the run as it is when it lasts 2 s to a minute, else in about 10 s."""
    ladder = [k * 10.0**n for n in range(-6, 4) for k in (1, 2, 5)]
    length = float(result.time[-1] - result.time[0]) or 1.0
    wanted = 1.0 if 2.0 <= length <= 60.0 else length / 10.0
    begin = min(ladder, key=lambda s: abs(np.log(s / wanted)))
    at = ladder.index(begin)
    return {"speeds": [float(f"{s:g}") for s in ladder[max(0, at - 7) : at + 5]], "speed": float(f"{begin:g}")}
