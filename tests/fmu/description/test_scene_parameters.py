"""A parameter of a scene is a parameter of the FMU if the FMU can change everything that depends on it. The FMU's run then equals
the run of the scene. The export lists all other parameters as left out."""

from __future__ import annotations

import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from tests.scene.valid_scene import ARM
from trunnion.fmu.binaries.platform_builds import NATIVE
from trunnion.fmu.scene_export import export
from trunnion.fmu.variables.outputs_inputs_parameters import variables
from trunnion.fmu.variables.scene_parameters import BINARY, OPERATIONS, arranged, depth, left_out
from trunnion.scene import load_scene, scene_from_text
from trunnion.scene.overrides import apply
from trunnion.simulation.run import Model

TEXT = ARM.replace("mu: 0.12,", 'mu: 0.12, ratio: 2, spread: "{ratio*pin - 1 mm + min(mu*1 mm, 1 mm)^2/(1 mm)}",').replace(
    '"{2*pin - 1 mm}"', '"{spread}"'
)
CHANGES = {"parameters.mu": 0.31, "parameters.pin": 0.009, "parameters.ratio": 1.7, "parameters.lift": 0.7}


def test_parameters_of_shapes_are_left_out_and_numbers_that_follow_parameters_are_none() -> None:
    scene = scene_from_text(TEXT)
    found = arranged(scene, variables(Model(scene), 0.0, 1e-6))
    names = {v.name: v for v in found.listed}
    assert {n for n in names if n.startswith("parameters.")} == set(CHANGES)
    assert [v.name for v in found.followers] == [
        "joints.pivot.friction.mu", "joints.pivot.friction.radius", "joints.pivot.friction.half_length", "joints.pivot.start.q[1]",
    ]  # fmt: skip
    assert not {v.name for v in found.followers} & set(names)
    assert "bodies.arm.mass" in names
    assert (names["parameters.mu"].variability, names["parameters.lift"].variability) == ("tunable", "fixed")
    assert (names["parameters.pin"].unit, names["parameters.pin"].start) == ("m", 0.008)
    (note,) = left_out(found)
    assert "not parameters of the FMU: a: they have no effect, or change shapes" in note
    assert "--set parameters.a=" in note


def test_a_scene_without_parameters_gets_no_further_variables() -> None:
    listed = variables(Model(load_scene("crank_slider")), 0.0, 1e-6)
    found = arranged(load_scene("crank_slider"), listed)
    assert (found.listed, found.followers, left_out(found)) == (listed, [], ())


def test_c_knows_every_operation_by_name() -> None:
    text = (NATIVE / "instance" / "model_and_instance.h").read_text(encoding="utf-8")
    assert all(f" FMU_{name}" in text for name in OPERATIONS.values())
    assert depth(["FMU_VALUE", "1", "FMU_SETTING", "0", "FMU_VALUE", "2", "FMU_ADD", "FMU_ADD", "FMU_NEGATE"]) == 3
    assert len(BINARY) == 8


def test_an_fmu_with_changed_parameters_equals_the_fmu_of_the_changed_scene() -> None:
    scene = scene_from_text(TEXT)
    files = FOLDER / "own.fmu", FOLDER / "set.fmu"
    export(scene, files[0], kernel="parts")
    export(apply(scene, CHANGES), files[1], kernel="parts")
    own, other = Host(files[0], begin=False), Host(files[1], begin=False)
    with pytest.raises(FMICallException) as refused:
        own.put("parameters.mu", -0.2)
    assert refused.value.status == 2
    assert own.log[-1][1] == "joints.pivot.friction.mu: mu must not be negative (it is -0.2)"
    assert own.get("parameters.mu") == [0.12]
    for name, value in CHANGES.items():
        own.put(name, value)
    names = [v.name for v in own.md.modelVariables if v.causality == "output"]
    for host in (own, other):
        host.fmu.exitInitializationMode()
        host.run(0.0, 20, 0.01)
    assert [own.get(n) for n in names] == [other.get(n) for n in names]
    for host in (own, other):
        host.put("parameters.mu", 0.05)
        host.run(0.2, 20, 0.01)
    assert [own.get(n) for n in names] == [other.get(n) for n in names]
    with pytest.raises(FMICallException):
        own.put("parameters.lift", 0.1)
