"""A friction law for all joints of a scene at once."""

from __future__ import annotations

from engine.scene.model import Scene


def law_changes(scene: Scene, law: str) -> dict[str, str]:
    """The changes that give every frictional joint this law."""
    own = [n for n, j in scene.joints.items() if j.friction is not None and j.friction.law is not None]
    return {"friction.law": law, **{f"joints.{n}.friction.law": law for n in own}}
