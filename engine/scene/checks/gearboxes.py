"""Checks of gearboxes: their ratio, and the joints that carry their shafts."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import listed, shown
from trunnion.scene.queries.body_references import body_of
from trunnion.scene.queries.cuttable_joints import is_driven
from trunnion.scene.queries.shaft_joints import carriers, couples_shafts, shaft_joints


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about gearboxes."""
    able = ", ".join(k.name for k in REGISTRY.values() if k.follows == "freedom")
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        if not couples_shafts(j):
            if j.ratio is not None:
                yield Finding((*path, "ratio"), f"a {j.type} joint has no ratio", f"remove it; joints with a ratio: {able}")
            continue
        if j.ratio is None:
            yield Finding((*path, "ratio"), f"the ratio of a {j.type} is missing", "for example ratio: 50, from the catalogue")
        yield from _shafts(scene, path, j)


def _shafts(scene: Scene, path: Path, j: Joint) -> Iterator[Finding]:
    for key, side in (("inboard", j.inboard), ("outboard", j.outboard)):
        shaft = body_of(side)
        found = carriers(scene, shaft) if shaft in scene.bodies else [""]
        if not found:
            what = f"no joint carries the shaft {shown(shaft)}; the shaft must be the outboard part of a joint with one rotation"
            yield Finding((*path, key), what, f"add a revolute joint with outboard: {shaft} and the housing as inboard part")
        elif len(found) > 1:
            what = f"several joints carry the shaft {shown(shaft)}: {listed(found)}"
            yield Finding((*path, key), what, "make the shaft the outboard part of only one joint that turns")
    both = shaft_joints(scene, j)
    if all(both) and all(is_driven(scene.joints[n]) for n in both):
        what = f"drives prescribe the motion of both shafts, by {both[0]} and {both[1]}"
        yield Finding(path, what, "remove one of the two drives")
