"""For cases with varied scene parameters, computes the numbers that depend on these parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.basics.errors import SceneError
from trunnion.basics.interrupts import heed
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.parameter_dependence import DependentNumbers, parameter


class DependentParameters:
    """Converts values of varied paths to values of ``self.paths``: the varied numbers of the scene, then the numbers that depend
    on varied parameters. A number that is varied directly does not depend on the scene's parameters."""

    def __init__(self, scene: Scene, paths: Sequence[str]):
        self.following = DependentNumbers(scene)
        self.names = [parameter(p) for p in paths]
        self.own = [i for i, name in enumerate(self.names) if not name]
        named = [name for name in self.names if name]
        self.followers = [p for p in self.following.of(named) if p not in set(paths)] if named else []
        self.paths = [*(paths[i] for i in self.own), *self.followers]

    def values(self, given: np.ndarray) -> tuple[np.ndarray, dict[int, SceneError]]:
        """(values of ``self.paths``, {case: error}), from the values of the varied paths. Both arrays have one row per case. An
        error means that an expression has no value."""
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
