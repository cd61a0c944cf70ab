"""The variables of an FMU: parameters and their limits. A stop time does not change the run."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from fmpy import read_model_description

import trunnion
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmpy_host import Host
from tests.reference.scenes.random_device_scenes import crossed
from trunnion.fmu.scene_export import export
from trunnion.fmu.variables.outputs_inputs_parameters import variables
from trunnion.scene import scene_from_dict
from trunnion.scene.overrides import apply
from trunnion.simulation.run import Model

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])


@BOTH
def test_a_stop_time_does_not_change_a_single_bit(flavour: str) -> None:
    file = exported("double_pendulum", flavour)
    names = Host(file).all_outputs()
    free, bound = (np.array(Host(file, stop=stop).run(0.0, 100, 0.01, *names)) for stop in (None, 1.0))
    assert np.array_equal(free, bound)


def test_states_of_contacts_are_discrete() -> None:
    md = read_model_description(exported("double_pendulum"))
    states = [v for v in md.modelVariables if v.name.endswith(".state") or ".state[" in v.name]
    assert len(states) == 9
    assert {v.variability for v in states} == {"discrete"}


def test_a_number_that_stands_for_two_axes_is_one_parameter() -> None:
    """Radius and half length of a universal joint apply to both its axes, as with --set."""
    paths = ["joints.cross.friction.radius", "joints.cross.friction.half_length"]
    names = {v.name for v in read_model_description(exported("double_pendulum")).modelVariables}
    assert set(paths) <= names
    assert not [n for n in names if n.startswith(tuple(f"{p}[" for p in paths))]
    changes = dict(zip(paths, (0.02, 0.1), strict=True))
    host = Host(exported("double_pendulum"), **changes)
    file = FOLDER / "wider-cross.fmu"
    export("double_pendulum", file, overrides=changes)
    assert host.run(0.0, 20, 0.01, "cross.q[1]", "cross.q[2]") == Host(file).run(0.0, 20, 0.01, "cross.q[1]", "cross.q[2]")


def test_two_numbers_for_two_axes_are_two_parameters() -> None:
    listed = variables(Model(apply_radii()), 0.0, 1e-6)
    names = {v.name: v.start for v in listed}
    assert (names["joints.cross.friction.radius[1]"], names["joints.cross.friction.radius[2]"]) == (0.01, 0.02)
    assert "joints.cross.friction.radius" not in names


def apply_radii() -> trunnion.Scene:
    """Example 8.3 with a cross of two radii."""
    return apply(trunnion.load_scene("double_pendulum"), {"joints.cross.friction.radius": [0.01, 0.02]})


@pytest.mark.parametrize("law", ["coulomb", "stribeck", "regularized", "lugre", "viscous"])
def test_no_number_of_friction_may_be_negative(law: str) -> None:
    """A negative number could create energy."""
    more: dict[str, dict[str, object]] = {
        "stribeck": {"mu_static": 0.8, "v_stribeck": 0.01}, "lugre": {"bristle_stiffness": 1e3, "bristle_damping": 0.03},
        "viscous": {"viscosity": 0.1},
    }  # fmt: skip
    rub = {"law": law, "radius": 0.05, **({} if law == "viscous" else {"mu": 0.6}), **more.get(law, {})}
    scene = scene_from_dict({
        "name": "bounds", "bodies": {"bar": {"box": [1, 0.1, 0.1], "density": 7800, "points": {"a": [-0.5, 0, 0]}}},
        "joints": {"ball": {"type": "spherical", "inboard": "ground", "outboard": "bar.a", "friction": rub}},
    })  # fmt: skip
    own = [v for v in variables(Model(scene), 0.0, 1e-6) if ".friction." in v.name and v.causality == "parameter"]
    assert len(own) >= 2
    assert not [v.name for v in own if v.bound.holds(-1e-9)]


def test_vectors_are_whole_where_that_is_asked_for() -> None:
    """Vectors include components that are zero in the scene: a turned gravity gives the motion of a scene with this gravity."""
    file = FOLDER / "whole.fmu"
    export("spherical_pendulum", file, whole_vectors=True)
    names = {v.name for v in read_model_description(file).modelVariables}
    vectors = ("gravity", "bodies.pendulum.center", "bodies.pendulum.points.tip")
    assert {f"{v}[{k}]" for v, k in itertools.product(vectors, (1, 2, 3))} <= names
    host = Host(file, **{"gravity[1]": 2.0, "gravity[2]": -3.0})
    turned = trunnion.simulate("spherical_pendulum", overrides={"gravity": [2.0, -3.0, -9.81]}, until=1.0, every=0.1)
    found = np.array(host.run(0.0, 5, 0.1, "pendulum.position[1]", "pendulum.position[2]"))
    for k in (1, 2):
        # the limit is ten times the tolerance of the run
        assert found[:, k - 1] == pytest.approx(turned[f"pendulum.position[{k}]"][1:6], abs=1e-5)


def test_numbers_of_a_brake_whose_torque_is_a_signal_are_parameters() -> None:
    model = Model(crossed("planets", 67))
    told = {v.name: v.description for v in variables(model, 1e-3, 1e-6, True, False, False)}
    assert told["joints.rring.friction.torque.ramp.start"].endswith("ramp start of joint rring")

