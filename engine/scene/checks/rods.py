"""Checks of rods: their length, and keys that only rods have."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.body_references import is_known
from trunnion.scene.queries.rod_lengths import rod_length


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about rods."""
    able = ", ".join(k.name for k in REGISTRY.values() if k.keeps_distance)
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        if not REGISTRY[j.type].keeps_distance:
            if j.length is not None:
                yield Finding((*path, "length"), f"a {j.type} joint has no length", f"remove it; joints with a length: {able}")
            continue
        if j.length is not None or not (is_known(scene, j.inboard) and is_known(scene, j.outboard)):
            continue  # other checks examine a given length and unknown bodies
        length = rod_length(scene, j)
        if length is None:
            hint = "for example length: 200 mm; between bodies with a position the length follows from their poses"
            yield Finding(path, f"the length of a {j.type} between bodies without position is missing", hint)
        elif length == 0.0:
            hint = "move one of the points; for two points that coincide, use type: spherical"
            yield Finding(path, f"the two points coincide: the {j.type} has the length 0", hint)
