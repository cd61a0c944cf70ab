"""FMUs of the bundled models without loops, and of every friction law, give the engine's results."""

from __future__ import annotations

import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu.engine_comparison import claim_equal_to_engine
from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host
from tests.fmu.refused_parameter_values import claim_refuses_what_the_scene_refuses, said_by_the_scene
from trunnion.fmu.variables.outputs_inputs_parameters import variables
from trunnion.scene import scene_from_dict
from trunnion.scene.overrides import list_parameters
from trunnion.simulation.run import Model


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", ["simple_pendulum", "cart_pole", "governor", "spherical_pendulum", "double_pendulum"])
def test_both_flavours_are_the_engine(model: str) -> None:
    claim_equal_to_engine(model)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("model", ["simple_pendulum", "cart_pole", "governor", "spherical_pendulum", "double_pendulum"])
def test_the_fmu_refuses_values_that_the_scene_refuses(model: str) -> None:
    claim_refuses_what_the_scene_refuses(model)


def test_numbers_that_no_bundled_model_has_are_bounded_as_in_a_scene() -> None:
    """The scene has stops, a screw, a harmonic load, a motion that follows an input, and an axial thrust."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0]}}
    hinge = {"type": "revolute", "axis": "z", "inboard": "ground"}
    rub = {"mu": 0.1, "mu_static": 0.2, "radius": 0.01, "half_length": 0.1, "thrust_radius": 0.01}
    along = {"spring": {"stiffness": 1}, "effort": {"harmonic": {"amplitude": 1, "frequency": 1}}}
    scene = scene_from_dict({
        "name": "rare", "inputs": {"w": {"unit": "rad", "bandwidth": 50}}, "bodies": {"one": bar, "two": bar, "three": bar},
        "joints": {
            "hip": {**hinge, "outboard": "one.a", "end_stops": {"stiffness": 10, "upper": 1}, **along},
            "lead": {"type": "screw", "axis": "x", "pitch": 0.1, "inboard": "ground", "outboard": "two.a"},
            "turn": {**hinge, "outboard": "three.a", "drive": {"input": "w"}, "friction": rub},
        },
    })  # fmt: skip
    plain = {p.path for p in list_parameters(scene)}
    offered = [v for v in variables(Model(scene), 0.0, 1e-6) if v.name in plain and ".start." not in v.name]
    refused = {(v.name, x) for v in offered for x in (-1.0, 0.0) if not v.bound.holds(x)}
    assert refused == {(v.name, x) for v in offered for x in (-1.0, 0.0) if said_by_the_scene(scene, v.name, x)}
    assert {("joints.hip.end_stops.stiffness", 0.0), ("joints.lead.pitch", 0.0), ("inputs.w.bandwidth", 0.0)} <= refused
    assert {("joints.hip.effort.harmonic.frequency", -1.0), ("joints.turn.friction.thrust_radius", 0.0)} <= refused


def test_numbers_that_do_not_go_together_are_refused_when_they_take_effect_and_the_run_continues() -> None:
    """Hosts set parameters one by one, so that intermediate values may be in the wrong order."""
    host, same = (Host(exported("spherical_pendulum:stribeck")) for _ in range(2))
    mu, static = "joints.ball.friction.mu", "joints.ball.friction.mu_static"
    host.run(0.0, 3, 0.01)
    host.put(mu, 0.9)
    with pytest.raises(FMICallException) as refused:
        host.fmu.doStep(0.03, 0.01)
    assert refused.value.status == 2
    assert host.log[-1][1] == f"{static}: mu_static must not be below mu: 0.8 is below 0.9"
    host.put(static, 0.95)
    same.run(0.0, 3, 0.01)
    same.put(static, 0.95)
    same.put(mu, 0.9)
    assert host.run(0.03, 3, 0.01, "ball.qd[2]") == same.run(0.03, 3, 0.01, "ball.qd[2]")


def test_a_quaternion_of_zeros_is_refused_until_it_is_a_rotation() -> None:
    host = Host(exported("spherical_pendulum:stribeck"), begin=False)
    host.put("joints.ball.start.q[1]", 0.0)
    with pytest.raises(FMICallException) as refused:
        host.fmu.exitInitializationMode()
    assert refused.value.status == 2
    assert host.log[-1][1] == "joints.ball.start.q[1]: a quaternion of four zeros is not a rotation: set at least one component"
    host.put("joints.ball.start.q[3]", 1.0)
    host.fmu.exitInitializationMode()
    host.run(0.0, 3, 0.01)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("law", ["lugre", "stribeck", "regularized"])
def test_an_fmu_with_another_friction_law_is_the_engine(law: str) -> None:
    claim_equal_to_engine(f"spherical_pendulum:{law}")
