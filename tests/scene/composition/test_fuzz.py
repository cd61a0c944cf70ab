"""Any data with parameters, assemblies and copies give a scene or a list of problems. No other exception is raised."""

from __future__ import annotations

import copy
import random
from typing import Any

import pytest
import yaml

from tests.scene.composition.test_mirror_and_turn_copies import CHAIN, SPATIAL
from tests.scene.valid_scene import ARM
from trunnion.basics.errors import Problem, SceneError
from trunnion.scene import scene_from_dict

ODD: list[Any] = [
    None, True, -1, 0, 2, 1e308, 10**400, -0.0, float("nan"), float("inf"), "", "x", "-y", "ground", "ground.x", ".", "a.b.c",
    "1 parsec", [], [[]], {}, {"": {}}, [1, 2], [1, 2, 3], "{a}", "{", "}", "{}", "{1/0}", "{i}", "{{}}", "{" * 30, "{1 m", "SI",
    "{3 SI}", "{1 m}",
]  # fmt: skip
MOVED: list[dict[str, Any]] = [
    {"mirror": "x"}, {"rotate": {"times": 3, "by": "{r}", "axis": "y", "through": [0, 1, 0]}},
    {"line": {"times": 2, "step": [1, 0, 0]}},
]  # fmt: skip
SCENES: list[dict[str, Any]] = [
    *({"assemblies": {"m": {"use": SPATIAL, "copies": c, "position": [1, 2, 3], "orientation": [{"axis": "x", "angle": 0.1}]}},
       "parameters": {"r": "10 deg", "q": "{2*r}"}} for c in MOVED),
    yaml.safe_load(CHAIN), yaml.safe_load(ARM),
]  # fmt: skip
ROUNDS = 150


def spoiled(rng: random.Random, value: Any) -> Any:
    """The data with a few changed or dropped parts."""
    if rng.random() < 0.03:
        return rng.choice(ODD)
    if isinstance(value, dict):
        return {k: spoiled(rng, v) for k, v in value.items() if rng.random() > 0.01}
    return [spoiled(rng, v) for v in value] if isinstance(value, list) else value


def test_rubbish_has_problems_and_nothing_worse() -> None:
    fine = 0
    problems: list[Problem] = []
    for seed in range(ROUNDS):
        rng = random.Random(seed)
        data = spoiled(rng, copy.deepcopy(rng.choice(SCENES)))
        try:
            scene_from_dict(data if isinstance(data, dict) else {"bodies": data})
        except SceneError as e:
            problems += e.problems
        else:
            fine += 1
    assert all(p.where and p.what for p in problems)
    assert 0 < fine < ROUNDS


def test_half_a_surrogate_is_reported_like_any_other_wrong_text() -> None:
    half = "\ud800"
    for body in ({"mass": half}, {half: 1.0, "mass": 1.0}, {"mass": 1.0, "inertia": [half, 1.0, 1.0]}):
        with pytest.raises(SceneError) as told:
            scene_from_dict({"bodies": {"a": body}, "joints": {"j": {"type": "revolute", "outboard": "a"}}})
        assert "\ufffd" in str(told.value)
        assert str(told.value).encode()
