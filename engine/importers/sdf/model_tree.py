"""Models of SDF, including nested and included models, with their links, joints and frames by full name."""

from __future__ import annotations

from pathlib import Path

from trunnion.basics.errors import SceneError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.schema_coverage import schema
from trunnion.importers.sdf.frames import OWN, WORLD, Frames
from trunnion.importers.xml_reader import Element, Findings, is_file, read_xml

FILES = 100
"""Largest number of included files."""


@dataclass
class ModelItem:
    """A link or a joint, the full name of its model (``scope``), and whether its model is static (``still``)."""

    element: Element
    scope: str
    still: bool


class Models:
    """The content of a file: gravity (m/s²), links by full name, joints, and all frames. ``old`` means that the format version
    expresses axes in the frame of the model."""

    def __init__(self, root: Element, folder: Path, found: Findings):
        self.root, self.folder, self.found, self.count = root, folder, found, 0
        self.frames, self.links, self.joints = Frames(found), dict[str, ModelItem](), list[ModelItem]()
        schema("SDF").tell(root, found)
        self.old = root.get("version") in ("1.0", "1.2", "1.3", "1.4")
        worlds = root.all("world")
        self.gravity = (0.0, 0.0, -9.81) if not worlds else (0.0, 0.0, -9.8)
        for w in worlds:
            given = w.first("gravity")
            if given is not None:
                g = found.numbers(given, "text", given.text, (3,)) or [0.0, 0.0, -9.8]
                self.gravity = (g[0], g[1], g[2])
            self._read_children(w, "", False)
        self._read_children(root, "", False)
        self.frames.check()

    # -- models -------------------------------------------------------------------------------------------------------------

    def _read_children(self, e: Element, scope: str, still: bool) -> None:
        """Add the includes, models, links, frames and joints of a world or model."""
        for c in e.children:
            if c.tag == "include":
                self._add_include(c, scope, still)
            elif c.tag == "model":
                self._add_model(c, scope, still)
            elif c.tag == "link":
                self.links[self.frames.add(c, scope, scope or WORLD)] = ModelItem(c, scope, still)
            elif c.tag == "frame":
                holder = self.frames.full(scope, c.get("attached_to") or OWN)
                self.frames.add(c, scope, holder, holder)
            elif c.tag == "joint":
                child = self.frames.full(scope, c.text_of("child"))
                self.frames.add(c, scope, child, child)
                self.joints.append(ModelItem(c, scope, still))

    def _add_model(self, e: Element, scope: str, still: bool, placed: Element | None = None) -> None:
        """Add a model. ``placed`` is the <include> that names the model. The pose, name and static flag of the <include> override
        the pose, name and static flag of the model."""
        sayers = [x for x in (placed, e) if x is not None]
        named = [n for n in (x.text_of("name") for x in sayers[:-1]) if n]
        static = next((x.text_of("static") for x in sayers if x.first("static") is not None), "")
        full = self.frames.full(scope, named[0] if named else e.get("name"))
        canonical = e.get("canonical_link") or next((x.get("name") for x in e.all("link")), "")
        placement = placed.text_of("placement_frame") if placed is not None else ""
        placement = placement or e.get("placement_frame")
        where = next((x for x in sayers if x.first("pose") is not None), e)
        shown = Element("model", {"name": named[0] if named else e.get("name")}, where.file, where.line, where.children)
        made = self.frames.add(
            shown, scope, scope or WORLD, self.frames.full(full, canonical) if canonical else WORLD,
            self.frames.full(full, placement) if placement else "",
        )  # fmt: skip
        self._read_children(e, made, still or static in ("true", "1"))

    def _add_include(self, e: Element, scope: str, still: bool) -> None:
        """Add a model from another file, which must be inside the folder of this file."""
        uri = e.text_of("uri")
        name = uri.removeprefix("model://").removeprefix("file://")
        tries = [self.folder / name / "model.sdf", self.folder / name, self.folder / Path(name).name / "model.sdf"]
        path = next((p.resolve() for p in tries if is_file(p)), None)
        self.count += 1
        if path is None or not path.is_relative_to(self.folder) or self.count > FILES or e.get("merge") == "true":
            what = f"{uri!r} is merged, which is not supported" if e.get("merge") == "true" else f"there is no model {uri!r} here"
            self.found.add(e, "include", what, f"put it in a folder beside the file, with a model.sdf (at most {FILES})")
            return
        try:
            inside = read_xml(path, str(path.relative_to(self.folder)))
        except SceneError as error:
            self.found.problems += error.problems
            return
        schema("SDF").tell(inside, self.found)
        for model in inside.all("model")[:1]:
            self._add_model(model, scope, still, e)
