"""Importer of assemblies that FreeCAD exports as ASMT, the text format of FreeCAD's solver. A file has parts with markers, and
joints between markers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.importers.intermediate_linkage import GROUND, Link, Linkage, LinkageJoint, Names, listed, plain_name
from trunnion.importers.mesh_mass_properties import UNITS
from trunnion.importers.pose_matrices import Pose, inverse, pose
from trunnion.importers.xml_reader import LARGEST, MOST, Element, Findings, existing
from trunnion.scene.data_classes.scene import Scene

JOINTS = {
    "RevoluteJoint": "revolute", "CylindricalJoint": "cylindrical", "TranslationalJoint": "prismatic", "FixedJoint": "fixed",
    "SphericalJoint": "spherical", "PlanarJoint": "planar", "UniversalJoint": "universal", "ScrewJoint": "screw",
}  # fmt: skip
SLIDING = {"CylindricalJoint": (2,), "TranslationalJoint": (2,), "PlanarJoint": (0, 1, 2), "ScrewJoint": (2,)}
"""Axes of a marker along which the two points of a joint may differ. In a planar joint, the distance between the planes is
constant."""
TURNED = ("FixedJoint", "TranslationalJoint")
"""Joints that keep all three axes of their markers parallel."""


def scene_of_asmt(file: str | Path, unit: str = "mm") -> tuple[Scene, list[str]]:
    """(scene, notes on omissions). ``unit`` is the unit of length in the file; masses are in kg. The assembly is the ground; the
    scene starts in the exported pose. SceneError lists everything that a scene cannot represent, each with its line."""
    path = existing(file)
    if unit not in UNITS:
        raise SceneError([Problem("unit", f"{unit!r} is unknown", f"one of {', '.join(UNITS)}")])
    reader = AsmtReader(tree_of(path), UNITS[unit])
    return reader.linkage(path.stem).scene(), reader.found.notes


def tree_of(path: Path) -> Element:
    """The assembly of a file: the indented lines as a tree. The results of FreeCAD's last run, at the end of the file, are
    omitted."""
    with path.open("rb") as f:
        content = f.read(LARGEST + 1)
    lines = content.decode("utf-8", "replace").splitlines()
    if len(content) > LARGEST or len(lines) > MOST:
        raise SceneError([Problem(str(path), f"is larger than {LARGEST // 1_000_000} MB or {MOST} lines")])
    stack: list[Element] = [Element("", {}, str(path), 0)]
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        if line.startswith("TimeSeries"):
            break
        depth = len(line) - len(line.lstrip("\t"))
        if depth >= len(stack):
            raise SceneError([Problem("file", "a line that is indented too far", "is it an ASMT assembly?", str(path), number)])
        e = Element(line.strip(), {}, str(path), number)
        stack[depth].children.append(e)
        stack[depth + 1 :] = [e]
    found = next((e for e in stack[0].children if e.tag == "Assembly"), None)
    if found is None:
        raise SceneError([Problem("file", "has no Assembly", "FreeCAD writes one: Assembly, Export ASMT", str(path), 1)])
    return found


class AsmtReader:
    def __init__(self, assembly: Element, unit: float):
        self.assembly, self.unit, self.found, self.names = assembly, unit, Findings(), Names()
        self.name = self._text(assembly, "Name")
        self.world, self.sets = self._pose(assembly), assembly.first("ConstraintSets") or Element("", {})
        self.markers: dict[str, tuple[str, Pose]] = {}
        self.places: dict[str, Pose] = {GROUND: np.eye(4)}
        self._store_markers(assembly, f"/{self.name}", GROUND, self.world)

    # -- reading of lines ---------------------------------------------------------------------------------------------------

    def _text(self, e: Element, tag: str) -> str:
        """The first line below the child ``tag`` of a line; '' if there is none."""
        return next((c.tag for c in e.within(tag)), "")

    def _numbers(self, e: Element, tag: str, count: int, default: float = 0.0) -> list[float]:
        """The ``count`` numbers on the lines below the child ``tag`` of a line."""
        c = e.first(tag)
        if c is None:
            return [default] * count
        return self.found.numbers(c, tag, " ".join(x.tag for x in c.children), (count,)) or [default] * count

    def _pose(self, e: Element) -> Pose:
        R = np.array(self._numbers(e, "RotationMatrix", 9)).reshape(3, 3) if e.first("RotationMatrix") is not None else np.eye(3)
        if np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
            self.found.add(e.first("RotationMatrix") or e, self._text(e, "Name") or e.tag, "its matrix is not a rotation")
            R = np.eye(3)
        U, _, V = np.linalg.svd(R)
        exact = R if np.abs(R @ R.T - np.eye(3)).max() < 1e-15 else U @ V
        return pose(self.unit * np.array(self._numbers(e, "Position3D", 3)), exact)

    def _store_markers(self, e: Element, path: str, link: str, at: Pose) -> None:
        """Store the markers of a part by path; each value is the part's link and the marker's pose in this link."""
        for p in (p for p in e.within("RefPoints") if p.tag == "RefPoint"):
            for m in (m for m in p.within("Markers") if m.tag == "Marker"):
                self.markers[f"{path}/{self._text(m, 'Name')}"] = (link, at @ self._pose(p) @ self._pose(m))

    # -- parts --------------------------------------------------------------------------------------------------------------

    def linkage(self, name: str) -> Linkage:
        """The linkage of all parts and joints. ``found`` collects the faults of the file."""
        g = np.array(self._numbers(self.assembly, "ConstantGravity", 3))
        called = plain_name(self.name) or name
        out = Linkage(called, self.found, (float(self.unit * g[0]), float(self.unit * g[1]), float(self.unit * g[2])))
        if not np.any(g):
            self.found.notes.append("gravity is zero in the file")
        unknown_masses, moving = [], []
        for e in (e for e in self.assembly.within("Parts") if e.tag == "Part"):
            link = self.names.new(self._text(e, "Name").rpartition("#")[2], "part")
            self.places[link] = self.world @ self._pose(e)
            out.links[link], told = self._link(e)
            unknown_masses += [] if told else [link]
            moving += [link] if any(self._numbers(e, "Velocity3D", 3)) or any(self._numbers(e, "Omega3D", 3)) else []
            self._store_markers(e, f"/{self.name}/{self._text(e, 'Name')}", link, np.eye(4))
        self._joints(out)
        self._note_omissions(unknown_masses, moving)
        if not out.links:
            self.found.add(self.assembly, "Parts", "there are none")
        return out

    def _link(self, e: Element) -> tuple[Link, bool]:
        """(link of a part, whether the file gives its mass). FreeCAD writes 1 for unknown masses."""
        m = e.first("PrincipalMassMarker")
        if m is None:
            self.found.add(e, self._text(e, "Name"), "has no PrincipalMassMarker", "export it again")
            return Link(1.0, np.zeros(3), np.zeros((3, 3))), True
        mass, moments = self._numbers(m, "Mass", 1, 1.0)[0], self._numbers(m, "MomentOfInertias", 3, 1.0)
        at = self._pose(m) if m.first("Position3D") is not None else np.eye(4)
        inertia = at[:3, :3] @ np.diag(self.unit**2 * np.array(moments)) @ at[:3, :3].T
        if mass <= 0:
            self.found.add(m.first("Mass") or m, self._text(e, "Name"), f"a mass of {mass:g} kg", "give the part a positive mass")
        return Link(mass, at[:3, 3], inertia), not (mass == 1.0 and moments == [1.0, 1.0, 1.0])

    def _note_omissions(self, unknown_masses: list[str], moving: list[str]) -> None:
        """Add notes on default masses and on omissions."""
        if unknown_masses:
            what = "the file has FreeCAD's default masses (1 kg, moments of inertia 1 kg m²), which determine all forces"
            self.found.notes.append(f"{what}: {listed(unknown_masses)}")
        if moving:
            self.found.notes.append(f"velocities at the start left out: {listed(moving)}")
        for owner, tag in ((self.sets, "Motions"), (self.sets, "Limits"), (self.assembly, "ForceTorques")):
            if named := [self._text(c, "Name") or c.tag for c in owner.within(tag)]:
                self.found.notes.append(f"{tag} left out: {listed(named)}")

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _joints(self, out: Linkage) -> None:
        tied: set[str] = set()
        for e in self.sets.within("Joints"):
            name, ends = self._text(e, "Name"), [self._marker(e, tag) for tag in ("MarkerI", "MarkerJ")]
            if e.tag not in JOINTS:
                known = ", ".join(JOINTS)
                self.found.add(e, name or e.tag, f"a {e.tag}, which scenes do not support", f"supported: {known}")
            elif ends[0] is not None and ends[1] is not None and ends[0][0] != ends[1][0]:
                tied |= {ends[0][0], ends[1][0]}
                out.joints[self.names.new(name.rpartition("#")[2], "joint")] = self._joint(e, ends[0], ends[1])
        for link in out.links:
            if link not in tied:
                out.release(self.names.new(f"{link}_flies", "joint"), link, self.places[link])

    def _marker(self, e: Element, tag: str) -> tuple[str, Pose] | None:
        path = self._text(e, tag)
        if path not in self.markers:
            self.found.add(e, self._text(e, "Name") or e.tag, f"its {tag} {path!r} is not a marker of a part", "export it again")
            return None
        return self.markers[path]

    def _joint(self, e: Element, one: tuple[str, Pose], two: tuple[str, Pose]) -> LinkageJoint:
        """The joint of two markers; marker I is on the inboard part. The joint's coordinates are zero in the exported pose."""
        first, second = self.places[one[0]] @ one[1], self.places[two[0]] @ two[1]
        more: dict[str, Any] = {}
        if e.tag == "PlanarJoint":
            self._note_distance(e, abs(float(second[:3, 2] @ (first[:3, 3] - second[:3, 3]))))
        if e.tag == "ScrewJoint":
            more["pitch"] = self.unit * self._numbers(e, "pitch", 1, 1.0)[0]
        along = second[:3, list(SLIDING.get(e.tag, ()))]
        spot = second[:3, 3] + along @ (along.T @ (first[:3, 3] - second[:3, 3]))
        if e.tag == "UniversalJoint":
            frames = [_crossed_frame(first[:3, 2], second[:3, 2], keep) for keep in (True, False)]
        elif e.tag == "SphericalJoint":
            frames = [np.eye(3), np.eye(3)]
        elif e.tag in TURNED:
            frames = [_frame_along(first[:3, 2], first[:3, 0]), _frame_along(second[:3, 2], second[:3, 0])]
        else:
            frames = [_frame_along(first[:3, 2], first[:3, 0]), _frame_along(second[:3, 2], first[:3, 0])]
        ends = ((one[0], first[:3, 3], frames[0]), (two[0], spot, frames[1]))
        sides = [inverse(self.places[link]) @ pose(p, R) for link, p, R in ends]
        if two[0] == GROUND:  # the ground is always the inboard part
            return LinkageJoint(JOINTS[e.tag], two[0], one[0], sides[1], sides[0], more)
        return LinkageJoint(JOINTS[e.tag], one[0], two[0], sides[0], sides[1], more)

    def _note_distance(self, e: Element, distance: float) -> None:
        """Add a note if the distance between the planes of a planar joint differs from the joint's offset."""
        said = abs(self.unit * self._numbers(e, "offset", 1)[0])
        if abs(distance - said) > 1e-6 + 1e-6 * said:
            what = f"its planes are {distance:.6g} m apart, but its offset says {said:.6g} m; the distance of the planes is used"
            self.found.notes.append(f"{self._text(e, 'Name')}: {what}")


def _frame_along(axis: np.ndarray, across: np.ndarray) -> np.ndarray:
    """A joint's frame (3×3): e1 is the axis, e2 the normalised component of ``across`` normal to the axis."""
    e2 = across - (across @ axis) * axis
    e2 = e2 / np.linalg.norm(e2)
    return np.column_stack([axis, e2, np.cross(axis, e2)])


def _crossed_frame(first: np.ndarray, second: np.ndarray, keep_first: bool) -> np.ndarray:
    """A universal joint's frame: e1 along the first axis, e2 along the second axis. If the axes are not orthogonal, the second axis
    is turned; without ``keep_first``, the first axis is turned."""
    return _frame_along(first, second) if keep_first else _frame_along(second, -first)[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
