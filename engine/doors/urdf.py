"""A scene from a URDF: links are bodies, joints keep their frames; what a URDF says and a scene does not is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.joints import REGISTRY
from engine.scene.load import scene_from_dict
from engine.scene.model import Scene

TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "floating": "free",
    "planar": "planar",
}  # fmt: skip


def scene_of_urdf(file: str | Path) -> tuple[Scene, list[str]]:
    """(scene, notes on what was left out). The root link is the ground when it has no inertia, else fixed to it; gravity along −z.

    SceneError with every joint or link that cannot be represented.
    """
    robot = _read(Path(file))
    reader = _Reader(robot)
    return reader.scene(Path(file).stem), reader.notes


class _Reader:
    def __init__(self, robot: Any):
        self.links = {link.name: link for link in robot.links}
        self.joints = list(robot.joints)
        self.name = robot.name
        children = {j.child for j in self.joints}
        self.roots = [n for n in self.links if n not in children]
        self.notes: list[str] = []
        self.problems: list[Problem] = []

    def scene(self, name: str) -> Scene:
        if len(self.roots) != 1:
            self.problems.append(Problem("links", f"{len(self.roots)} roots instead of one: {', '.join(self.roots)}"))
            raise SceneError(self.problems)
        root = self.roots[0]
        ground = self._massless(root)
        self.place = {n: n for n in self.links} | ({root: "ground"} if ground else {})
        points = self._points()
        bodies = {n: self._body(n, points.get(n, {})) for n in self.links if self.place[n] == n and n not in self.merged}
        joints = {j.name: self._joint(j) for j in self.joints if j.child not in self.merged}
        if not ground:
            joints = {"base": {"type": "fixed", "inboard": "ground", "outboard": root}} | joints
        if self.problems:
            raise SceneError(self.problems)
        data: dict[str, Any] = {
            "schema": 1, "name": _identifier(self.name or name), "gravity": [0, 0, -9.81], "bodies": bodies, "joints": joints,
        }  # fmt: skip
        if ground and points.get(root):
            data["ground"] = {"points": points[root]}
        return scene_from_dict(data)

    def _massless(self, link: str) -> bool:
        inertial = self.links[link].inertial
        return inertial is None or not inertial.mass

    def _points(self) -> dict[str, dict[str, list[float]]]:
        """Massless links at the end of fixed joints are named points of what they are fixed to."""
        parents = {j.parent for j in self.joints}
        ends = [j for j in self.joints if j.type == "fixed" and self._massless(j.child) and j.child not in parents]
        self.merged = {j.child for j in ends}
        out: dict[str, dict[str, list[float]]] = {}
        for j in ends:
            out.setdefault(j.parent, {})[_identifier(j.child)] = _floats(_origin(j)[:3, 3])
        return out

    def _body(self, name: str, points: dict[str, list[float]]) -> dict[str, Any]:
        link = self.links[name]
        if self._massless(name):
            self.problems.append(Problem(name, "moves and has no mass", "give the link an <inertial>"))
            return {}
        frame = np.eye(4) if link.inertial.origin is None else np.asarray(link.inertial.origin)
        inertia = frame[:3, :3] @ np.asarray(link.inertial.inertia, float) @ frame[:3, :3].T
        body: dict[str, Any] = {"mass": float(link.inertial.mass), "center": _floats(frame[:3, 3])}
        body["inertia"] = _floats(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        shapes = [v.geometry for v in link.visuals if v.geometry is not None]
        if shapes and shapes[0].box is not None:
            body["box"] = _floats(shapes[0].box.size)
        elif shapes and shapes[0].sphere is not None:
            body["sphere"] = float(shapes[0].sphere.radius)
        elif shapes and shapes[0].cylinder is not None:
            body["cylinder"] = {"radius": float(shapes[0].cylinder.radius), "length": float(shapes[0].cylinder.length), "axis": "z"}
        return body | ({"points": points} if points else {})

    def _joint(self, j: Any) -> dict[str, Any]:
        """The scene's joint for joint j of the file, with the frames of both sides written out; they coincide at q = 0."""
        if j.type not in TYPES or j.mimic is not None:
            what = "follows another joint (mimic)" if j.mimic is not None else f"has type {j.type!r}"
            self.problems.append(Problem(j.name, f"{what}, which a scene does not have", "take it out of the file"))
            return {}
        origin = _origin(j)
        axis = np.array([1.0, 0.0, 0.0] if j.axis is None else j.axis, float)
        axis /= np.linalg.norm(axis)
        reference = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        reference /= np.linalg.norm(reference)
        R, p = origin[:3, :3], origin[:3, 3]
        kind = TYPES[j.type]
        inboard: dict[str, Any] = {"body": self.place[j.parent], "point": _floats(p)}
        outboard: dict[str, Any] = {"body": j.child}
        if not REGISTRY[kind].needs_axis and np.abs(R - np.eye(3)).max() > 1e-12:
            self.problems.append(Problem(j.name, f"a {j.type} joint turned by rpy", "turn the child link's own numbers instead"))
        if REGISTRY[kind].needs_axis:
            inboard |= {"axis": _floats(R @ axis), "reference": _floats(R @ reference)}
            outboard |= {"axis": _floats(axis), "reference": _floats(reference)}
        out: dict[str, Any] = {"type": kind, "inboard": inboard, "outboard": outboard}
        if j.dynamics is not None and float(j.dynamics.damping or 0):
            out["damping"] = float(j.dynamics.damping)
        if j.dynamics is not None and float(j.dynamics.friction or 0):
            turns = REGISTRY[kind].freely_rubbed
            if len(turns) == 1:
                out["friction"] = {"torque" if turns[0] else "force": float(j.dynamics.friction)}
            else:
                self.notes.append(f"{j.name}: constant friction {float(j.dynamics.friction):g} left out (a {kind} joint has none)")
        if j.type != "continuous" and j.limit is not None and REGISTRY[kind].nv == 1:
            self.notes.append(f"{j.name}: limits left out (stops want a stiffness)")
        return out


def _origin(j: Any) -> np.ndarray:
    return np.eye(4) if j.origin is None else np.asarray(j.origin, float)


def _floats(values: Any) -> list[float]:
    """The values as plain numbers; those that rotations leave a rounding error away from zero become zero."""
    array = np.asarray(values, float).ravel()
    big = max(1.0, float(np.abs(array).max())) if array.size else 1.0
    return [float(f"{x:.15g}") + 0.0 if abs(x) > 1e-16 * big else 0.0 for x in array]


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() or c == "_" else "_" for c in name)


def _read(file: Path) -> Any:
    try:
        from yourdfpy import URDF
    except ImportError as e:
        what = "URDF is read by yourdfpy, which is not installed"
        raise SceneError([Problem(str(file), what, "pip install 'trunnion[cad]'")]) from e
    if not file.is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    try:
        return URDF.load(str(file), build_scene_graph=False, load_meshes=False).robot
    except Exception as e:  # any error of the reader means that the file cannot be read
        raise SceneError([Problem(str(file), f"cannot be read as URDF: {e}")]) from e
