"""Data of the animation's page: meshes, joints, events, and the rows of the motion. The number of rows is limited."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from trunnion.elements.joints import REGISTRY
from trunnion.plots.curves.angle_curves import rotation_vector
from trunnion.plots.geometry.mechanism_geometry import Ends, JointMark, Scenery, scenery
from trunnion.plots.geometry.meshes import FINE, Mesh
from trunnion.plots.geometry.motion_and_view import (
    Motion,
    arrow_scale,
    frame_motion,
    motion,
    pressure_scale,
    rails,
    round_force,
)
from trunnion.plots.style import palette
from trunnion.plots.style.captions import caption, event_text, outcome_text
from trunnion.simulation.results.result import Result

MOST_BYTES = 1_800_000
"""Largest size of the rows, bytes. As text, the rows are a third longer."""
MOST_ROWS = 3000
MOST_EVENTS = 300
MOST_PANELS = 4


POSE = (("position", 3), ("orientation", 4))
"""(name of a column of a body's pose, number of its components)."""


class _Channels:
    """Columns of the page's rows, without repetition."""

    def __init__(self, result: Result):
        self.result = result
        self.columns: list[np.ndarray] = []
        self.sources: list[str] = []
        self.places: dict[str, int] = {}

    def add(self, *values: np.ndarray, sources: Sequence[str] = ()) -> int:
        """Append columns. sources: names by which a host of the scene's C library finds the values. A source is a column of the
        result, or "0". Three columns of a rotation have one source, ``rotation:`` with the name of a quaternion. Returns the index
        of the first appended column."""
        self.columns += values
        self.sources += [*sources, *[""] * (len(values) - len(sources))]
        return len(self.columns) - len(values)

    def named(self, *names: str) -> int | None:
        """Append columns of the result. Returns the index of the first appended column, or None if the result lacks a column."""
        if any(n not in self.result for n in names):
            return None
        if names[0] not in self.places:
            self.places[names[0]] = self.add(*(self.result[n] for n in names), sources=names)
        return self.places[names[0]]


def content(result: Result, held: bool = False) -> dict[str, Any]:
    """All data that the viewer draws, as plain data. held: whether to omit the view and the scales, for a viewer that keeps its
    present view and scales."""
    scene = scenery(result.scene, FINE)
    moved = motion(result, [p.name for p in scene.parts])
    channels, meshes = _Channels(result), _Meshes()
    parts = [
        {
            "name": p.name,
            "color": palette.hex_color(p.color),
            "mesh": meshes.place(p.mesh),
            "channel": channels.add(*_pose(moved, i), sources=[f"{p.name}.{of}[{k}]" for of, n in POSE for k in range(1, n + 1)]),
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
    return _described(result, scene) | ({} if held else _frame(result, scene, moved)) | {
        "parts": parts, "joints": joints, "meshes": meshes.data, "width": block.shape[1], "sources": channels.sources,
        "times": base64.b64encode(result.time[rows].astype("<f8").tobytes()).decode(),
        "rows": base64.b64encode(np.ascontiguousarray(block).tobytes()).decode(),
    }  # fmt: skip


def _pose(moved: Motion, part: int) -> tuple[np.ndarray, ...]:
    return (*moved.positions[:, part].T, *moved.turns[:, part].T)


class _Meshes:
    """Meshes as flat lists of numbers, without repetition."""

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
    """Data of joint j: its pins, its contacts, and the values in the panel."""
    contacts = []
    for c in j.contacts:
        force = channels.named(f"{c.columns}.normal_force")
        normal = channels.named(*(f"{c.columns}.normal[{k}]" for k in (1, 2, 3)))
        state = channels.named(c.state)
        if force is not None and normal is not None:
            state = channels.add(np.zeros(len(result)), sources=["0"]) if state is None else state
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


SHOWN = (
    "q[*]", "offset[*]", "turn[*]", "friction.torque[*]", "friction.force", "friction.force[*]", "contact[*].normal_force",
    "contact[*].angle",
)  # fmt: skip
"""Columns of a joint or bushing in the panel of values."""


def _values(j: JointMark, result: Result, channels: _Channels) -> list[dict[str, Any]]:
    """Coordinates, friction and contacts of a joint. Angles are in degrees."""
    names = [n for p in SHOWN for n in result.matching(f"{j.name}.{p}") if result.units[n] != "1"]
    out = []
    quaternion = [f"{j.name}.q[{k}]" for k in (1, 2, 3, 4)]
    if j.type in REGISTRY and REGISTRY[j.type].quaternion == 0 and all(n in result for n in quaternion):
        turn = rotation_vector(np.column_stack([result[n] for n in quaternion]))
        first = channels.add(*turn.T, sources=[f"rotation:{j.name}.q"])
        out = [{"label": f"angle e{k + 1}", "unit": "°", "factor": 180 / np.pi, "channel": first + k} for k in range(3)]
    for n in names:
        degrees = result.units[n] == "rad"
        unit = "°" if degrees else result.units[n].replace("*", " ")
        label = n.removeprefix(f"{j.name}.")
        out.append({"label": label, "unit": unit, "factor": 180 / np.pi if degrees else 1.0, "channel": channels.named(n)})
    return out


def thinned(result: Result, width: int) -> np.ndarray:
    """Indices of the rows for the page. The rows are evenly spaced, within limits of their number. The rows before and after each
    event are added."""
    most = max(50, min(MOST_ROWS, MOST_BYTES // (4 * max(1, width))))
    if len(result) <= most:
        return np.arange(len(result))
    after = np.searchsorted(result.time, [e.time for e in result.events][: most // 8])
    near = np.concatenate([after - 1, after]).astype(int)
    even = np.linspace(0, len(result) - 1, most - len(near)).round().astype(int)
    return np.unique(np.clip(np.concatenate([even, near]), 0, len(result) - 1))


def _described(result: Result, scene: Scenery) -> dict[str, Any]:
    """Data that all rows share: names, lines, events, colours."""
    events = result.events[:: max(1, -(-len(result.events) // MOST_EVENTS))]
    return {
        "title": result.scene.title or result.scene.name, "caption": caption(result), "outcome": outcome_text(result),
        "until": result.settings["until"], "every": result.settings["every"],
        "events": [{"t": e.time, "text": event_text(e)} for e in events],
        "springs": _ends(scene.springs), "rods": _ends(scene.rods),
        "states": {str(k): v for k, v in palette.STATES.items()} | {"other": palette.OPEN},
        "colors": {"joint": palette.JOINT, "ramp": palette.PRESSURE},
    }  # fmt: skip


def _frame(result: Result, scene: Scenery, moved: Motion) -> dict[str, Any]:
    """The first view and the scales."""
    framing, scale = frame_motion(scene, moved), arrow_scale(result, scene)
    return {
        "up": scene.up.tolist(), "view": framing.view.tolist(), "center": framing.centre.tolist(),
        "extent": {"all": framing.wide.tolist(), "near": framing.near.tolist()}, "follow": framing.follows,
        "size": scene.size, "arrow": scale, "force": round_force(scale, scene.size),
        "floor": framing.floor,
        "grid": float(10.0 ** np.floor(np.log10(2 * scene.size)) / 2),
        "rails": [{"part": p, "from": a.tolist(), "to": b.tolist()} for p, a, b in rails(result, scene)],
        "pressure": pressure_scale(result, scene), **_speeds(result),
    }  # fmt: skip


def _ends(lines: tuple[Ends, ...]) -> list[list[dict[str, Any]]]:
    """The ends of springs or rods."""
    return [[{"part": part, "point": point.tolist()} for part, point in ends] for ends in lines]


def _speeds(result: Result) -> dict[str, Any]:
    """The speeds that the viewer offers, and the initial speed. The initial speed is 1 for a run of 2 s to 60 s. For any other run,
    the initial speed makes the playback take about 10 s."""
    ladder = [k * 10.0**n for n in range(-6, 4) for k in (1, 2, 5)]
    length = float(result.time[-1] - result.time[0]) or 1.0
    wanted = 1.0 if 2.0 <= length <= 60.0 else length / 10.0
    begin = min(ladder, key=lambda s: abs(np.log(s / wanted)))
    at = ladder.index(begin)
    return {"speeds": [float(f"{s:g}") for s in ladder[max(0, at - 7) : at + 5]], "speed": float(f"{begin:g}")}
