"""Rotor inertia of a joint: an inertia, in addition to the bodies, that turns only with the motion of this joint. Results are
compared with one dense solve and with closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import trunnion
from tests.engine.checks.reference_comparison import results, worst
from tests.engine.recursion.test_dense_reference import TIME, TOLERANCE, WITHOUT
from tests.reference import solve
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from tests.reference.scenes.random_streams import stream
from tests.reference.scenes.result_table import table
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.basics.errors import SceneError
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.simulation.run import Model
from trunnion.system.construction.spanning_tree import span

TREES, LOOPS = range(8), range(4)


def spun(case: Case, names: set[str]) -> Case:
    """The case with a rotor in each freedom of these joints. The rotor of a quaternion has the same inertia about all axes."""
    joints = dict(case.scene.joints)
    for name in names:
        kind = REGISTRY[joints[name].type]
        if not kind.nv:
            continue
        own = stream(name, "rotor").uniform(0.1, 3.0, kind.nv)
        if kind.quaternion >= 0:
            own[kind.nv - 3 :] = own[-1]
        joints[name] = replace(joints[name], rotor_inertia=tuple(own.tolist()) if kind.nv > 1 else float(own[0]))
    return replace(case, scene=replace(case.scene, joints=joints))


def compared(case: Case, kernel: str) -> None:
    model = Model(case.scene, ("*",), kernel=kernel)
    row = evaluate(model, case.q, case.qd, case.t)
    free = {(n, q) for n, j in case.scene.joints.items() if REGISTRY[j.type].nv == 6 for q in ("reaction.force", "reaction.torque")}
    expected = {k: v for k, v in table(solve(case.state())).items() if k not in free}
    gap, where = worst(expected, results(model, row), WITHOUT)
    assert gap <= TOLERANCE, where


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("seed", TREES)
def test_rotors_of_trees_are_those_of_the_dense_solve(seed: int, kernel: str) -> None:
    """The test compares accelerations, reactions, friction, efforts of drives and energy."""
    case = random_tree(seed, t=TIME, devices=0.5, drives=0.4)
    compared(spun(case, set(case.scene.joints)), kernel)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("seed", LOOPS)
def test_rotors_in_loops_are_those_of_the_dense_solve(seed: int, kernel: str) -> None:
    case = random_loop(seed, t=TIME, devices=0.5)
    tree = {name for name, _, _ in span(case.scene).tree}
    made = spun(case, tree)
    assert {name for name, _, _ in span(made.scene).tree} == tree
    compared(made, kernel)


def chain(n: int, rub: bool, rotor: float | None) -> sm.Scene:
    """Bars hinged to each other about axes of increasing inclination. Each hinge has its own rotor and constant friction."""
    bodies = {f"b{i}": {"mass": 1 + 0.1 * i, "inertia": [0.01, 0.02, 0.03], "center": [0.5, 0, 0]} for i in range(n)}
    joints = {
        f"j{i}": {
            "type": "revolute", "axis": [0.1 * (i % 3), 1, 0.3 * (i % 2)],
            "inboard": "ground" if i == 0 else {"body": f"b{i - 1}", "point": [1, 0, 0]}, "outboard": f"b{i}",
            "start": {"q": 0.1 * (-1) ** i, "qd": 0.2 + 0.05 * i},
            **({} if rotor is None else {"rotor_inertia": rotor * (1 + 0.2 * i)}),
            **({"friction": {"torque": 0.3}} if rub else {}),
        }
        for i in range(n)
    }  # fmt: skip
    return scene_from_dict({"schema": 1, "bodies": bodies, "joints": joints})


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("rub", [False, True])
def test_long_chains_with_rotors_agree_in_both_kernels(rub: bool, kernel: str) -> None:
    """The compiled kernel runs 24 bodies in loops. The parts kernel finds the friction of the bodies along the recursion."""
    scene = chain(24, rub, 0.4)
    q = {n: np.array([j.start.q]) for n, j in scene.joints.items()}
    qd = {n: np.array([j.start.qd]) for n, j in scene.joints.items()}
    row = evaluate(Model(scene, ("*.qdd[*",), kernel=kernel), q, qd, 0.0)
    case = Case(scene, q, qd, 0.0, tuple(scene.joints))
    friction = [0.3 * np.sign(qd[n][0]) for n in scene.joints] if rub else []
    equations = Equations(case.state())
    mine = np.array([row[f"{n}.qdd[1]"] for n in scene.joints])
    want = np.array([(equations.accelerations(n) @ [1.0, *friction])[0] for n in scene.joints])
    # both results are precise to about 1e-14 times the condition number of 24 bodies
    assert np.abs(mine - want).max() <= 1e-10 * np.abs(want).max()


def test_a_rotor_holds_a_joint_at_rest_no_more_than_it_did() -> None:
    """Static friction does not depend on the rotor. At the threshold both joints stay at rest. At one part in a million above the
    threshold, both joints slip."""
    for load, moves in ((1 - 1e-6, False), (1 + 1e-6, True)):
        for rotor in (0.0, 5.0):
            scene = scene_from_dict({
                "schema": 1, "gravity": [0, 0, 0], "bodies": {"wheel": {"mass": 1, "inertia": [0.1, 0.1, 0.1]}},
                "joints": {"axle": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "wheel",
                                    "rotor_inertia": rotor, "effort": 2.0 * load, "friction": {"torque": 2.0}}},
            })  # fmt: skip
            last = trunnion.simulate(scene, 1.0, 0.5)
            expected = 2e-6 / (0.1 + rotor) if moves else 0.0
            assert last["axle.qd[1]"][-1] == pytest.approx(expected, rel=1e-6, abs=1e-300)


def test_energy_of_a_run_counts_rotors() -> None:
    """The rotor adds to the inertia of the wheel in the pendulum's period and energy."""
    own = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": {"body": "bob", "point": [0, 0, 0.5]}}
    own |= {"start": {"q": 1.0}}
    with_rotor = {"bodies": {"bob": {"mass": 2, "inertia": [0.3, 0.1, 0.3]}}, "joints": {"pivot": own | {"rotor_inertia": 0.3}}}
    heavier = {"bodies": {"bob": {"mass": 2, "inertia": [0.3, 0.4, 0.3]}}, "joints": {"pivot": own}}
    runs = [trunnion.simulate(scene_from_dict({"schema": 1, **s}), 3.0, 0.1, rtol=1e-10) for s in (with_rotor, heavier)]
    for name in ("pivot.q[1]", "energy.kinetic"):
        assert runs[0][name] == pytest.approx(runs[1][name], abs=1e-7)
    assert np.abs(runs[0]["energy.residual"]).max() < 1e-8


def test_derivatives_follow_rotors() -> None:
    """q̈ = τ/(I + J): its derivative with respect to J along a run of constant effort, q = ½ q̈ t²."""
    scene = scene_from_dict({
        "schema": 1, "gravity": [0, 0, 0], "bodies": {"wheel": {"mass": 1, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {"axle": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "wheel", "rotor_inertia": 0.4,
                            "effort": 2.0}},
    })  # fmt: skip
    found = trunnion.sensitivity(scene, ["joints.axle.rotor_inertia"], ["axle.q[1]"], until=1.0, every=0.5)
    expected = -0.5 * 2.0 / 0.5**2
    assert found.d("axle.q[1]", "joints.axle.rotor_inertia")[-1] == pytest.approx(expected, rel=1e-6)


def test_an_impossible_rotor_inertia_is_reported() -> None:
    """Impossible cases: a loop of rotors alone, which cannot be cut; different inertias for the turns of a ball; a negative
    inertia."""
    scene = {
        "schema": 1, "bodies": {n: {"mass": 1, "inertia": [1, 1, 1]} for n in ("a", "b")},
        "joints": {
            "one": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "a", "rotor_inertia": 1},
            "two": {"type": "revolute", "axis": "z", "inboard": "a", "outboard": "b", "rotor_inertia": 1},
            "three": {"type": "revolute", "axis": "z", "inboard": "b", "outboard": "ground", "rotor_inertia": 1},
        },
    }  # fmt: skip
    with pytest.raises(SceneError, match="without rotor inertia"):
        scene_from_dict(scene)
    for given, words in (([1, 1, 2], "same rotor inertia"), ([1, 1, -1], "not negative")):
        ball = {"type": "spherical", "inboard": "ground", "outboard": "a", "rotor_inertia": given}
        with pytest.raises(SceneError, match=words):
            scene_from_dict({"schema": 1, "bodies": {"a": {"mass": 1, "inertia": [1, 1, 1]}}, "joints": {"ball": ball}})


def pendulum(rotor: float, **more: object) -> sm.Scene:
    """A rod of 1 m and 2 kg with a rotor at its hinge."""
    joint = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": {"body": "rod", "point": [0, 0, 0.5]}}
    rod = {"mass": 2, "inertia": [1 / 6, 1 / 6, 0.001]}
    return scene_from_dict({"schema": 1, "bodies": {"rod": rod}, "joints": {"hinge": joint | {"rotor_inertia": rotor} | more}})


def test_modes_and_inverse_dynamics_include_rotors() -> None:
    """Small oscillations have the frequency √(m g l/(I + J)). The effort of a motion is (I + J) q̈ + m g l sin q."""
    swing = trunnion.modes(pendulum(0.4)).modes[0]
    assert 2 * np.pi * swing.frequency == pytest.approx(np.sqrt(2 * 9.81 * 0.5 / (2 / 3 + 0.4)), rel=1e-8)
    t = np.linspace(0, 1, 5)
    curves = {"hinge.q[1]": np.sin(t), "hinge.qd[1]": np.cos(t), "hinge.qdd[1]": -np.sin(t)}
    efforts = trunnion.inverse(pendulum(0.4), t, curves)["hinge.drive.effort[1]"]
    assert efforts == pytest.approx(-(2 / 3 + 0.4) * np.sin(t) + 9.81 * np.sin(np.sin(t)), rel=1e-12, abs=1e-12)


def test_every_method_steps_rotors() -> None:
    """All methods give the same swing. Friction stops the swing for a time."""
    scene = pendulum(0.4, start={"q": 1.0}, friction={"torque": 0.5})
    runs = {m: trunnion.simulate(scene, 2.0, 2.0, rtol=1e-8, overrides={"simulation.method": m})["hinge.q[1]"][-1]
            for m in ("rk5", "rk8", "rosenbrock", "moreau")}  # fmt: skip
    for method, found in runs.items():
        close = 3e-5 if method == "moreau" else 1e-6  # time stepping is of order 2, and its error follows the tolerance
        assert found == pytest.approx(runs["rk8"], abs=close), method


def test_rotors_turn_behind_gears() -> None:
    """Two wheels of 20 and 50 teeth have q̈ = τ/(I₁ + J₁ + (20/50)² (I₂ + J₂))."""
    wheel = {"mass": 1, "inertia": [0.1, 0.1, 0.1]}
    hinge = {"type": "revolute", "axis": "z", "inboard": "ground"}
    joints = {
        "one": hinge | {"outboard": "a", "effort": 3.0, "rotor_inertia": 0.2},
        "two": hinge | {"inboard": {"body": "ground", "point": [0.07, 0, 0]}, "outboard": "b", "rotor_inertia": 0.7},
        "mesh": {"type": "gear", "axis": "z", "inboard": "a", "outboard": "b", "teeth": [20, 50], "module": 0.002},
    }
    scene = scene_from_dict({"schema": 1, "gravity": [0, 0, 0], "bodies": {"a": wheel, "b": dict(wheel)}, "joints": joints})
    found = trunnion.simulate(scene, 0.1, 0.1, outputs=["*.qdd[1]"])
    expected = 3.0 / (0.3 + 0.16 * 0.8)
    assert found["one.qdd[1]"][-1] == pytest.approx(expected, rel=1e-12)
    assert found["two.qdd[1]"][-1] == pytest.approx(-0.4 * expected, rel=1e-12)
