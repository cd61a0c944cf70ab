"""A scene's own parameters are not an FMU's: the numbers that follow them are, each by itself, and a note says so."""

from __future__ import annotations

from engine.scene import load_scene, scene_from_text
from engine.simulation.run import Model
from fmu.description import variables
from fmu.export import left_out
from tests.scene.making import ARM


def test_numbers_that_follow_a_parameter_are_offered_and_the_parameter_is_named_as_left_out() -> None:
    scene = scene_from_text(ARM)
    names = {v.name for v in variables(Model(scene), 0.0, 1e-6)}
    assert {"joints.pivot.friction.mu", "joints.pivot.friction.radius", "bodies.arm.mass"} <= names
    assert not [n for n in names if n.startswith("parameters.")]
    (note,) = left_out(scene)
    assert all(name in note for name in scene.parameters)
    assert "--set parameters.a=" in note
    assert left_out(load_scene("crank_slider")) == ()
