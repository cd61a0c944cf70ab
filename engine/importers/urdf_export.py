"""Export of a scene as URDF. Bodies become links; joints keep their frames. Notes list every key of the scene that URDF cannot
express."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np

from trunnion.basics.errors import Problem, raise_problems
from trunnion.elements.joints import REGISTRY
from trunnion.importers.intermediate_linkage import GROUND, MOMENTS, Names, floats, listed
from trunnion.importers.pose_matrices import Pose, along, inverse, least_turn, pose, roll_pitch_yaw
from trunnion.importers.urdf import TYPES
from trunnion.scene.data_classes.joints import EndStops
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.queries.body_poses_and_joint_sides import sides_of
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.system.construction.joint_frames import frame, matrix
from trunnion.system.construction.spanning_tree import Spanning, span

ENDLESS = "continuous"
"""Joint type of URDF for a hinge without limits."""
SAID = {kind: said for said, kind in TYPES.items() if said != ENDLESS}
"""{joint type of a scene: joint type of URDF}."""
GRAVITY = 9.81
"""Gravity of the importer of URDF, m/s², along -z. A URDF file has no gravity, and other programs have their own values."""
UNLIMITED = 1e16
"""Limit of a prismatic joint without end stops. URDF requires limits, and readers replace missing limits by 0."""
NORMAL = (0.0, 0.0, 1.0)
"""Axis of planar joints. Readers choose the directions in the plane from the axis. Readers choose the same directions only if all
digits of the axis agree."""
WRITTEN = {
    "scene": {"schema", "name", "gravity", "bodies", "joints", "ground"},
    "bodies": {"box", "cylinder", "sphere", "density", "mass", "center", "inertia", "position", "orientation", "points"},
    "joints": {"type", "inboard", "outboard", "axis", "reference", "at", "cut", "mimic"},
}
"""Keys of a scene that the URDF file can hold. The functions that write devices of joints add further keys."""


def urdf_of_scene(scene: Scene) -> tuple[str, list[str]]:
    """(text of the URDF file, notes on omitted keys) of a checked scene. The file's z axis is opposite to gravity. SceneError lists
    every joint that URDF cannot express: a joint that closes a loop, has another type, or measures its motion towards the
    ground."""
    writer = UrdfWriter(scene)
    writer.refuse()
    return writer.text(), writer.notes()


class UrdfWriter:
    """Writes the links and joints of a scene. ``at``: the pose of each link's frame in its body's frame."""

    def __init__(self, scene: Scene):
        self.scene, self.data = scene, scene_to_dict(scene)
        self.spanning: Spanning = span(scene)
        self.root = xml.Element("robot", name=scene.name)
        self.names = Names()
        up = -np.asarray(scene.gravity, float)
        self.at: dict[str, Pose] = {GROUND: pose(rotation=least_turn(up) if up.any() else None)}
        self.held: dict[str, set[str]] = {name: set(WRITTEN["joints"]) for name in scene.joints}

    def refuse(self) -> None:
        """Raise SceneError if URDF cannot express a joint."""
        wrong = [
            Problem(f"joints.{n}", f"is of type {j.type}, which URDF does not have", f"URDF has {', '.join(SAID)}")
            for n, j in self.scene.joints.items()
            if j.type not in SAID
        ]
        wrong += [
            Problem(f"joints.{n}", "closes a loop, and URDF has only trees", "remove the joint")
            for n in self.spanning.cut
            if self.scene.joints[n].type in SAID
        ]
        wrong += [
            Problem(f"joints.{n}", "measures the motion of its inner part", "exchange inboard and outboard")
            for n, _, forward in self.spanning.tree
            if not forward and REGISTRY[self.scene.joints[n].type].nv > 1
        ]
        raise_problems(wrong)

    def text(self) -> str:
        """The text of the file."""
        xml.SubElement(self.root, "link", name=GROUND)
        self._frames(GROUND, self.scene.ground.points)
        for name, child, forward in self.spanning.tree:
            self._joint(name, child, forward)
            self._link(child)
            self._frames(child, self.scene.bodies[child].points)
        xml.indent(self.root, " ")
        return f'<?xml version="1.0"?>\n{xml.tostring(self.root, encoding="unicode")}\n'

    # -- links --------------------------------------------------------------------------------------------------------------

    def _link(self, name: str) -> None:
        body, link = self.scene.bodies[name], xml.SubElement(self.root, "link", name=name)
        mass, center, inertia = mass_properties(body)
        inside = inverse(self.at[name]) @ pose(center)
        turned = inside[:3, :3] @ np.asarray(inertia) @ inside[:3, :3].T
        inertial = xml.SubElement(link, "inertial")
        _origin(inertial, pose(inside[:3, 3]))
        xml.SubElement(inertial, "mass", value=repr(mass))
        six = floats(turned[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        xml.SubElement(inertial, "inertia", {k: repr(x) for k, x in zip(MOMENTS, six, strict=True)})
        solid: tuple[str, dict[str, str]] | None = None
        if body.box is not None:
            solid = "box", {"size": _words(body.box)}
        elif body.sphere is not None:
            solid = "sphere", {"radius": repr(float(body.sphere))}
        elif body.cylinder is not None:
            solid = "cylinder", {"radius": repr(float(body.cylinder.radius)), "length": repr(float(body.cylinder.length))}
            inside = inside @ pose(rotation=least_turn(np.eye(3)["xyz".index(body.cylinder.axis)]))
        if solid:
            visual = xml.SubElement(link, "visual")
            _origin(visual, inside)
            xml.SubElement(xml.SubElement(visual, "geometry"), *solid)

    def _frames(self, body: str, points: Mapping[str, Any]) -> None:
        """A massless link for each named point of a body."""
        for point, place in points.items():
            name = self.names.new(f"{body}_{point}", "point")
            xml.SubElement(self.root, "link", name=name)
            joint = self._begun(f"{name}_fixed", "fixed", body, name)
            _origin(joint, pose((inverse(self.at[body]) @ [*map(float, place), 1.0])[:3]))

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _joint(self, name: str, child: str, forward: bool) -> None:
        """Write a joint of the tree, and place the frame of the link that it carries."""
        j = self.scene.joints[name]
        sides = sides_of(self.scene, j)[:: 1 if forward else -1]
        inner, outer = (pose(s.point, matrix(frame(s.axis, s.reference))) for s in sides)
        kind = REGISTRY[j.type]
        rotation = np.eye(3) if kind.nv <= 1 else outer[:3, :3]
        plane = kind.needs_axis and kind.nv > 1
        if plane:
            rotation = rotation @ along(NORMAL)[:3, :3].T
        self.at[child] = pose(outer[:3, 3], rotation)
        stops = _single(j.end_stops)
        said = ENDLESS if j.type == TYPES[ENDLESS] and not stops else SAID[j.type]
        joint = self._begun(name, said, sides[0].body, child)
        _origin(joint, inverse(self.at[sides[0].body]) @ inner @ inverse(inverse(self.at[child]) @ outer))
        if kind.needs_axis:
            e1 = np.array(NORMAL) if plane else rotation.T @ outer[:3, 0]
            xml.SubElement(joint, "axis", xyz=_words(e1 if forward else -e1))
        if kind.nv == 1:
            self._devices(name, joint, stops)

    def _begun(self, name: str, said: str, parent: str, child: str) -> xml.Element:
        joint = xml.SubElement(self.root, "joint", name=name, type=said)
        xml.SubElement(joint, "parent", link=parent)
        xml.SubElement(joint, "child", link=child)
        return joint

    def _devices(self, name: str, joint: xml.Element, stops: EndStops | None) -> None:
        """Limits, damping, constant friction and mimic of a joint with one freedom."""
        j = self.scene.joints[name]
        self.held[name].add("end_stops")
        if joint.get("type") != ENDLESS:
            given = ((k, getattr(stops, k, None), sign * UNLIMITED) for k, sign in (("lower", -1), ("upper", 1)))
            ends = {k: repr(float(no_end if x is None else x)) for k, x, no_end in given}
            xml.SubElement(joint, "limit", {**ends, "effort": "0", "velocity": "0"})
        dynamics = {}
        if (damping := _single(j.damping)) is not None:
            dynamics["damping"] = repr(float(damping))
            self.held[name].add("damping")
        said = list(self.data["joints"][name].get("friction", ()))
        if said in (["torque"], ["force"]) and isinstance(number := getattr(j.friction, said[0]), int | float):
            dynamics["friction"] = repr(float(number))
            self.held[name].add("friction")
        if dynamics:
            xml.SubElement(joint, "dynamics", dynamics)
        if mimic := j.mimic:
            ratio, offset = repr(float(mimic.ratio)), repr(float(mimic.offset))
            xml.SubElement(joint, "mimic", joint=mimic.joint, multiplier=ratio, offset=offset)

    # -- omitted keys -------------------------------------------------------------------------------------------------------

    def notes(self) -> list[str]:
        """A note for each key of the scene that the file omits, with the names of the joints or bodies that have this key."""
        general = [key for key in self.data if key not in WRITTEN["scene"]]
        out = [f"left out: {', '.join(general)}"] if general else []
        for group in ("bodies", "joints"):
            lost: dict[str, list[str]] = {}
            for name, given in self.data[group].items():
                held = self.held[name] if group == "joints" else WRITTEN[group]
                for key in [k for k in given if k not in held]:
                    lost.setdefault(key, []).append(name)
            out += [f"left out: {key} of {listed(names)}" for key, names in lost.items()]
        size = float(np.linalg.norm(self.scene.gravity))
        if not math.isclose(size, GRAVITY, rel_tol=1e-12):
            out.append(f"left out: gravity of {size:g} m/s^2; URDF has no gravity, and the importer uses {GRAVITY} m/s^2 along -z")
        stopped = [n for n in self.scene.joints if "end_stops" in self.data["joints"][n] and "end_stops" in self.held[n]]
        out += [f"limits without stiffness replace the end stops of {listed(stopped)}"] if stopped else []
        return out


def _single(given: Any) -> Any:
    """The entry of the only freedom, without the list that may hold it."""
    return given[0] if isinstance(given, list | tuple) and len(given) == 1 else given


def _origin(e: xml.Element, at: Pose) -> None:
    xml.SubElement(e, "origin", xyz=_words(floats(at[:3, 3])), rpy=_words(roll_pitch_yaw(at[:3, :3])))


def _words(values: Iterable[float]) -> str:
    """Numbers in text, each with all its digits."""
    return " ".join(repr(float(x) + 0.0) for x in values)
