"""Checks of nonlinear springs and dampers, along the freedoms of joints and between points."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Nonlinear, Scene, SpringDamper
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.force_laws import registry
from trunnion.scene.queries.loads_and_signals import entries


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about nonlinear springs and dampers."""
    for name, j in scene.joints.items():
        kind = REGISTRY[j.type]
        for path, group in entries(j.nonlinear, ("joints", name, "nonlinear")):
            k = path[-1] if isinstance(path[-1], int) else 0
            for law, _ in registry.given(group):
                if law.elastic and k < kind.nv and kind.coordinate_of(k) < 0:
                    what = f"{law.key} cannot act on the rotation of a {kind.name} joint"
                    yield Finding((*path, law.key), what, "use a damper or effort, or build the joint from revolutes")
            yield from _group(path, group)
    for name, f in scene.forces.items():
        if isinstance(f, SpringDamper) and f.nonlinear is not None:
            yield from _group(("forces", name, "nonlinear"), f.nonlinear)


def _group(path: Path, group: Nonlinear) -> Iterator[Finding]:
    given = list(registry.given(group))
    if not given:
        known = ", ".join(key for key, law in registry.REGISTRY.items() if law.data)
        yield Finding(path, "no spring or damper is given", f"give one or more of: {known}, or remove the key")
    for law, data in given:
        yield from law.findings((*path, law.key), data)
