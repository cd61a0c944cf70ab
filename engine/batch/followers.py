"""Cases over parameters as cases over the numbers that follow them, so that a parameter costs what those numbers cost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine.basics.interrupts import heed
from engine.basics.problems import SceneError
from engine.scene.following import Following, parameter
from engine.scene.model import Scene


class Followers:
    """Turns values of the paths that were asked for into values of ``paths``: the scene's own numbers among them, then those that
    follow the parameters among them. A number that was asked for itself follows nothing."""

    def __init__(self, scene: Scene, paths: Sequence[str]):
        self.following = Following(scene)
        self.names = [parameter(p) for p in paths]
        self.own = [i for i, name in enumerate(self.names) if not name]
        named = [name for name in self.names if name]
        self.followers = [p for p in self.following.of(named) if p not in set(paths)] if named else []
        self.paths = [*(paths[i] for i in self.own), *self.followers]

    def values(self, given: np.ndarray) -> tuple[np.ndarray, dict[int, SceneError]]:
        """(values of ``paths``, a row for each case; for each case in which an expression has no value, why)."""
        if not any(self.names):
            return given, {}
        out, wrong = np.zeros((len(given), len(self.paths))), {}
        out[:, : len(self.own)] = given[:, self.own]
        for i, row in enumerate(given.tolist()):
            heed()
            changes = {name: v for name, v in zip(self.names, row, strict=True) if name}
            try:
                out[i, len(self.own) :] = self.following.values(changes, self.followers)
            except SceneError as e:
                wrong[i] = e
        return out, wrong
