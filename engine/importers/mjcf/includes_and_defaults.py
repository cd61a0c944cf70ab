"""Reading of an MJCF file: expansion of includes, compiler settings, and default classes of attributes."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from trunnion.basics.errors import SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.pose_matrices import Pose, about, least_turn, of_quaternion, pose
from trunnion.importers.schema_coverage import schema
from trunnion.importers.xml_reader import DEEPEST, Element, is_file, read_root, read_xml

FILES = 200
"""Largest number of included files."""
TURNS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
"""Attributes that give an orientation. An orientation of the element replaces any orientation from its default class."""
MAIN = "main"
Attributes = dict[str, str]


@dataclass(frozen=True)
class Settings:
    """Settings of <compiler>.

    degrees       whether angles are in degrees
    sequence      axis order of Euler angles
    auto_limits   whether a range implies a limit
    from_geoms    whether inertias come from geoms: "true", "false" or "auto"
    groups        first and last group of the geoms that have mass
    least_mass    lower bound of masses, kg
    least_moment  lower bound of principal moments of inertia, kg m²
    balance       whether impossible moments are replaced by their mean
    total         total mass, kg; 0 means no scaling
    meshes        folder of the meshes
    strip         whether folders in mesh file names are ignored
    align         whether free joints without child bodies are aligned by default
    """

    degrees: bool = True
    sequence: str = "xyz"
    auto_limits: bool = True
    from_geoms: str = "auto"
    groups: tuple[float, float] = (0, 5)
    least_mass: float = 0.0
    least_moment: float = 0.0
    balance: bool = False
    total: float = 0.0
    meshes: str = ""
    strip: bool = False
    align: bool = False

    def angle(self, x: float) -> float:
        """An angle of the file, converted to rad."""
        return float(np.deg2rad(x)) if self.degrees else x


class Model:
    """The sections of a file, with its faults, settings and default classes."""

    def __init__(self, file: Path):
        hint = "MJCF files begin with <mujoco>; files that begin with <robot> are URDF"
        root, self.found = read_root(file, "mujoco", hint)
        self.folder, self.count = file.resolve().parent, 0
        self.name = root.get("model")
        self._expand(root, file.resolve().parent, (file.resolve(),))
        self.root = root
        schema("MJCF").tell(root, self.found)
        self.classes: dict[str, dict[str, Attributes]] = {MAIN: {}}
        for section in self.sections("default"):
            self._read_class(section, "")
        self.settings = self._settings()
        self.disabled = self._disabled()

    def sections(self, tag: str) -> list[Element]:
        """All sections with a tag. A file may contain several sections with one tag."""
        return self.root.all(tag)

    # -- files --------------------------------------------------------------------------------------------------------------

    def entries(self, tag: str) -> list[Element]:
        """The elements inside all sections with this tag."""
        return [e for section in self.sections(tag) for e in section.children]

    def _expand(self, e: Element, folder: Path, files: tuple[Path, ...]) -> None:
        """Replace each <include> by the content of its file."""
        out: list[Element] = []
        for c in e.children:
            if c.tag != "include":
                self._expand(c, folder, files)
                out.append(c)
                continue
            name = c.get("file")
            path = next((p.resolve() for p in (f / name for f in (self.folder, folder)) if is_file(p)), None)
            self.count += 1
            wrong = self._include_fault(name, path, files)
            if wrong or path is None:
                self.found.add(c, "include", *(wrong or ("", "")))
                continue
            try:
                inside = read_xml(path, os.path.relpath(path, self.folder))
            except SceneError as error:
                self.found.problems += error.problems
                continue
            self._expand(inside, path.parent, (*files, path))
            out += inside.children
        e.children = out

    def _include_fault(self, name: str, path: Path | None, files: tuple[Path, ...]) -> tuple[str, str] | None:
        if path is None:
            return f"there is no file {name!r}", "paths are relative to the main file"
        if path in files:
            return f"{name!r} includes itself", "remove one of the includes"
        if self.count > FILES or len(files) > DEEPEST:
            return f"more than {FILES} files are included", "merge some of the files"
        return None

    def asset(self, at: Element, name: str) -> Path | None:
        """The file of a mesh. If the file is missing, the result is None and a problem is added."""
        plain = Path(name).name if self.settings.strip else name
        path = self.folder / self.settings.meshes / plain
        if is_file(path):
            return path.resolve()
        what = "there is no such mesh, which is needed for masses of bodies"
        self.found.add(at, name, what, "meshdir gives the folder of the meshes")
        return None

    # -- settings and classes -----------------------------------------------------------------------------------------------

    def _settings(self) -> Settings:
        given: Attributes = {}
        at = self.root
        for at in self.sections("compiler"):
            given |= at.attributes
        at = (self.sections("compiler") or [self.root])[-1]
        if given.get("coordinate", "local") != "local":
            hint = "save the model again from MuJoCo, which writes local coordinates"
            self.found.add(at, "compiler.coordinate", "global coordinates are not read", hint)
        sequence = given.get("eulerseq", "xyz")
        if len(sequence) != 3 or set(sequence.lower()) - set("xyz"):
            self.found.add(at, "compiler.eulerseq", f"{sequence!r} is not an order of axes", "three letters of x, y, z, X, Y, Z")
            sequence = "xyz"
        number = lambda key, default=0.0: self.found.number(at, key, given.get(key), default)  # noqa: E731
        groups = self.found.numbers(at, "inertiagrouprange", given.get("inertiagrouprange", "0 5"), (2,)) or [0, 5]
        return Settings(
            given.get("angle", "degree") == "degree", sequence, given.get("autolimits", "true") == "true",
            given.get("inertiafromgeom", "auto"), (groups[0], groups[1]), number("boundmass"), number("boundinertia"),
            given.get("balanceinertia") == "true", number("settotalmass"), given.get("meshdir", given.get("assetdir", "")),
            given.get("strippath") == "true", given.get("alignfree") == "true",
        )  # fmt: skip

    def _disabled(self) -> set[str]:
        """The names of the features that <flag> disables. Features without effect on the motion of a scene are omitted."""
        flags: Attributes = {}
        for option in self.sections("option"):
            for e in option.all("flag"):
                flags |= e.attributes
        off = {name for name, said in flags.items() if said == "disable"}
        off |= {"frictionloss", "limit", "equality"} if "constraint" in off else set()
        off |= {"spring", "damper"} if "passive" in off else set()
        return off & {"gravity", "spring", "damper", "frictionloss", "limit", "equality"}

    def _read_class(self, section: Element, parent: str) -> None:
        """Read a default class, which inherits the attributes of its parent class."""
        name = section.get("class") or (MAIN if not parent else "")
        if not name:
            self.found.add(section, "default", "a default class inside another class needs a name", "add class=")
            return
        own = self.classes.setdefault(name, {})
        for tag, said in (self.classes[parent] if parent else {}).items():
            own.setdefault(tag, dict(said))
        for c in section.children:
            if c.tag != "default":
                own[c.tag] = _override(own.get(c.tag, {}), c.attributes)
        for c in section.all("default"):
            self._read_class(c, name)

    def attributes(self, e: Element, around: str, tag: str = "") -> Attributes:
        """Attributes of an element, with defaults from its class. ``around`` is the default class of the enclosing body."""
        name = e.get("class") or around or MAIN
        if name not in self.classes:
            self.found.add(e, e.get("name") or e.tag, f"there is no class {name!r}", f"classes: {', '.join(self.classes)}"[:200])
            return dict(e.attributes)
        return _override(self.classes[name].get(tag or e.tag, {}), e.attributes)

    # -- numbers ------------------------------------------------------------------------------------------------------------

    def three(self, e: Element, said: Attributes, name: str, default: str) -> np.ndarray:
        """The three numbers of attribute ``name``, or of ``default``."""
        found = self.found.numbers(e, name, said.get(name, default), (3,))
        return np.array(found if found is not None else [float(x) for x in default.split()])

    def pose(self, e: Element, said: Attributes) -> Pose:
        """The pose of an element in its parent."""
        return pose(self.three(e, said, "pos", "0 0 0"), self.rotation(e, said))

    def rotation(self, e: Element, said: Attributes) -> np.ndarray:
        """The rotation matrix of an element (3×3) in its parent."""
        given = [t for t in TURNS if t in said]
        if not given:
            return np.eye(3)
        if len(given) > 1:
            self.found.add(e, e.get("name") or e.tag, f"several orientations: {' and '.join(given)}", "give only one")
        how = given[0]
        count = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}[how]
        x = self.found.numbers(e, how, said[how], (count,))
        if x is None or (how != "euler" and not np.any(x[:3] if how == "axisangle" else x)):
            return np.eye(3)
        turned = self._rotation_of(how, np.array(x))
        if not np.isfinite(turned).all():
            what = f"{how}={said[how]!r} is not an orientation"
            self.found.add(e, e.get("name") or e.tag, what, "its axes are parallel or zero")
            return np.eye(3)
        return turned

    def _rotation_of(self, how: str, x: np.ndarray) -> np.ndarray:
        if how == "quat":
            return of_quaternion(x)
        if how == "axisangle":
            return about(x[:3], self.settings.angle(x[3]))
        if how == "zaxis":
            return least_turn(x)
        if how == "xyaxes":
            with np.errstate(invalid="ignore", divide="ignore"):
                e1 = x[:3] / np.linalg.norm(x[:3])
                e2 = x[3:] - (x[3:] @ e1) * e1
                e2 /= np.linalg.norm(e2)
            return np.column_stack([e1, e2, np.cross(e1, e2)])
        out = np.eye(3)
        for letter, angle in zip(self.settings.sequence, x, strict=True):
            turn = about(np.eye(3)["xyz".index(letter.lower())], self.settings.angle(angle))
            out = out @ turn if letter.islower() else turn @ out
        return out


def _override(less: Attributes, more: Attributes) -> Attributes:
    """Attributes of a class, overridden by the attributes of an element."""
    turned = any(t in more for t in TURNS)
    return {k: v for k, v in less.items() if not (turned and k in TURNS)} | more
