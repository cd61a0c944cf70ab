"""Between the user's input and the built system, the code traverses a scene's data once. For the cases of a batch, it traverses
only their differences."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.scene.valid_scene import VALID, edited
from trunnion import simulate, sweep
from trunnion.scene import load_scene, model_names, models_dir, scene_from_dict, scene_loader, scene_to_yaml, validation
from trunnion.scene.overrides import apply, list_parameters, scene_given
from trunnion.simulation.execution import starts_at_cuts_and_points

STAGES = {"compose": scene_loader, "evaluate": scene_loader, "build": scene_loader, "findings": validation}
"""Stages of this traversal, each with the module that calls it: composition of parts, expressions, types, checks."""
ROD = {
    "parameters": {"a": "1 m"},
    "bodies": {"rod": {"mass": 1, "center": ["{a/2}", 0, 0], "inertia": [0.1, 0.1, 0.1]}},
    "joints": {"hinge": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "rod"}},
}
LEGS = {"assemblies": {"leg": {"use": ROD, "copies": {"line": {"times": 3, "step": [1, 0, 0]}}}}}
PENDULUM = models_dir() / "simple_pendulum"
GIVEN = {
    "a model": ("simple_pendulum", None),
    "a file": (PENDULUM / "scene.yaml", None),
    "a model with a changed number": ("simple_pendulum", {"bodies.bob.mass": 2}),
    "parameters and expressions": (ROD, None),
    "a changed parameter": (ROD, {"parameters.a": "1.1 m"}),
    "copies of an assembly": (LEGS, None),
    "copies with a changed parameter": (LEGS, {"parameters.leg2_a": "1.1 m"}),
    "several changes": (ROD, {"parameters.a": 2, "gravity[2]": -1, "joints.hinge.start.q": "3 deg", "simulation.rtol": 1e-7}),
}


@pytest.fixture
def counts(monkeypatch):
    """Number of calls of each stage and of the building of a system."""
    found: Counter[str] = Counter()

    def counted(owner, name, label):
        true = getattr(owner, name)

        def work(*args, **kwargs):
            found[label] += 1
            return true(*args, **kwargs)

        monkeypatch.setattr(owner, name, work)

    for stage, caller in STAGES.items():
        counted(caller, stage, stage)
    counted(starts_at_cuts_and_points, "build", "system")
    return found


@pytest.mark.parametrize("name", GIVEN)
def test_a_scene_is_walked_once_from_what_is_given_to_its_system(name, counts):
    scene, changes = GIVEN[name]
    simulate(scene, until=0.01, overrides=changes)
    assert counts == dict.fromkeys((*STAGES, "system"), 1)


def test_an_included_file_is_part_of_the_one_walk(tmp_path, counts):
    (tmp_path / "rod.yaml").write_text(scene_to_yaml(scene_from_dict(ROD)))
    (tmp_path / "scene.yaml").write_text("include: rod.yaml\ntitle: a rod\n")
    counts.clear()
    scene_given(tmp_path, {"parameters.a": "2 m"})
    assert counts == dict.fromkeys(STAGES, 1)


def test_a_batch_walks_once_for_the_scene_and_once_for_each_distinct_value(counts):
    masses, pulls = [1 + 0.1 * i for i in range(5)], [-9.0, -10.0]
    sweep(ROD, {"bodies.rod.mass": masses, "gravity[3]": pulls}, reductions=["max:hinge.q[1]"], until=0.01)
    assert all(counts[stage] <= 1 + len(masses) + len(pulls) for stage in STAGES)


SOURCES = {**{name: name for name in model_names()}, "one of everything": VALID, "legs": LEGS}


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("name", SOURCES)
def test_a_scene_with_changes_is_the_scene_changed(name):
    loaded = scene_given(SOURCES[name])
    same = {p.path: p.value for p in list_parameters(loaded)}
    assert scene_given(SOURCES[name], same) == apply(loaded, same)
    for change in ({"gravity[1]": "1 m/s^2"}, {"simulation.realtime.step": "1 ms"}, {"title": "new"}, {"friction.v_eps": "2 mm/s"}):
        assert scene_given(SOURCES[name], change) == apply(loaded, change)


def test_mistakes_of_the_scene_and_of_the_changes_are_reported_separately(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(scene_to_yaml(scene_from_dict(edited({}))).replace("density", "densty", 1))
    said = []
    for work in (lambda: load_scene(file), lambda: scene_given(file, {"gravity[4]": 1})):
        with pytest.raises(Exception, match="densty") as e:
            work()
        said.append(str(e.value))
    assert said[0] == said[1]
