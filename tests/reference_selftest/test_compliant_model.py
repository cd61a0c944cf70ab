"""Results of the compliant model compared with closed forms. The model checks the engine, so these tests do not use the engine.

Tolerances: three levels of stiffness and of the speed of rest, extrapolated, leave errors below 1e-5 in quantities of order one.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from tests.reference.compliant import NotJudged, judged
from tests.reference.compliant.compiled_rates import Compiled
from tests.reference.compliant.equations_of_motion import Model
from tests.reference.compliant.joint_sides_from_poses import resolved
from tests.reference.compliant.runs_and_limit import FINER, level_of, table
from tests.reference.compliant.start_state import start
from tests.reference.mechanics.bodies_and_joint_frames import part
from trunnion import Scene, scene_from_dict

NEAR = 1e-5
BLOCK = {"mass": 2.0, "inertia": [0.05, 0.05, 0.05]}
WHEEL = {"mass": 1.0, "inertia": [0.01, 0.01, 0.02]}


def scene(bodies: dict, joints: dict, gravity=(0.0, 0.0, -9.81), **more) -> Scene:
    """A scene from the content of a file."""
    return scene_from_dict({"schema": 1, "gravity": list(gravity), "bodies": bodies, "joints": joints} | more)


def slider(**more) -> Scene:
    """A single block on a guide along x."""
    gravity = more.pop("gravity", (0.0, 0.0, -9.81))
    guide = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b", **more}
    return scene({"b": BLOCK}, {"p": guide}, gravity)


def wheel(**more) -> Scene:
    """A wheel on a bearing about z, without weight."""
    return scene({"w": WHEEL}, {"r": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "w", **more}}, (0, 0, 0))


def last(case: Scene, until: float, column: str, near: float = NEAR) -> float:
    """The compliant model's value at the end. The model's own error must be below the required error."""
    out = judged(case, until, [column], instants=1)
    assert out.error[column][-1] < near
    return float(out.values[column][-1])


def test_a_pendulum_swings_as_the_elliptic_function_says() -> None:
    body = {"mass": 2.0, "inertia": [0.05, 0.05, 0.05], "center": [0, -0.7, 0]}
    joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "start": {"q": 1.0}}
    frequency, k = np.sqrt(2 * 9.81 * 0.7 / (0.05 + 2 * 0.49)), np.sin(0.5)
    sn = ellipj(frequency * 0.5 + ellipk(k**2), k**2)[0]
    assert last(scene({"b": body}, {"r": joint}, (0, -9.81, 0)), 0.5, "r.q[1]") == pytest.approx(2 * np.arcsin(k * sn), abs=NEAR)


def test_a_block_slides_until_friction_has_taken_its_energy_and_stays() -> None:
    rub = {"mu": 0.2, "mu_static": 0.3, "half_width": 0.02, "half_height": 0.02, "half_length": 0.2}
    case = slider(start={"qd": 1.0}, friction=rub, ends="outboard")
    out = judged(case, 0.8, ["p.q*", "energy.*"], instants=2)
    assert out.values["p.q[1]"][1:] == pytest.approx([0.4 - 0.5 * 0.2 * 9.81 * 0.16, 1 / (2 * 0.2 * 9.81)], abs=NEAR)
    assert out.values["energy.dissipated"][-1] == pytest.approx(1.0, abs=NEAR)


def test_a_block_at_rest_starts_at_its_static_friction() -> None:
    """The push grows by 10 N/s to 6 N (0.6 s). After this time, (10 t - 4) N accelerate 2 kg."""
    case = slider(gravity=(0, 0, 0), friction={"force": 4.0, "mu": 1.0, "mu_static": 1.5},
                  effort={"ramp": {"start": 0, "end": 10, "duration": 1}})  # fmt: skip
    t = 0.4
    assert last(case, 1.0, "p.q[1]") == pytest.approx((2.0 * t**2 / 2 + 10 * t**3 / 6) / 2, abs=NEAR)


def test_a_journal_takes_the_torque_of_its_normal_force() -> None:
    """The contact force is inclined by friction. The torque is radius times load times sin(atan mu)."""
    rub = {"mu": 0.3, "radius": 0.05, "half_length": 0.1}
    joint = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "b", "friction": rub, "start": {"qd": 3.0}}
    out = judged(scene({"b": BLOCK}, {"r": joint}), 0.05, ["r.qd*"], instants=1)
    torque = 0.05 * 2 * 9.81 * np.sin(np.arctan(0.3))
    assert out.values["r.qd[1]"][-1] == pytest.approx(3 - torque / 0.05 * 0.05, abs=10 * NEAR)


def test_a_ball_takes_the_torque_of_its_normal_force() -> None:
    rub = {"mu": 0.3, "radius": 0.05}
    joint = {"type": "spherical", "inboard": "ground", "outboard": "b", "friction": rub, "start": {"qd": [3.0, 0.0, 0.0]}}
    out = judged(scene({"b": BLOCK}, {"r": joint}), 0.05, ["r.qd*"], instants=1)
    torque = 0.05 * 2 * 9.81 * np.sin(np.arctan(0.3))
    assert out.values["r.qd[1]"][-1] == pytest.approx(3 - torque / 0.05 * 0.05, abs=10 * NEAR)


def test_a_block_leaves_an_elastic_stop_as_fast_as_it_came() -> None:
    """The block is on the stop's spring from 0.1 s on, for half a period."""
    case = slider(gravity=(0, 0, 0), start={"qd": 1.0}, end_stops={"stiffness": 2000.0, "upper": 0.1})
    contact = np.pi / np.sqrt(1000)
    assert last(case, 0.3, "p.q[1]") == pytest.approx(0.1 - (0.3 - 0.1 - contact), abs=NEAR)


def test_a_hook_that_falls_behind_a_block_holds_it() -> None:
    """The block passes 0.1 m at 1 m/s, reverses under -4 N, and oscillates on the hook's spring about its new equilibrium."""
    hook = {"at": 0.1, "stiffness": 2000.0}
    case = slider(gravity=(0, 0, 0), start={"qd": 1.0}, latch=hook, effort=-4.0)
    speed = np.sqrt(1 - 2 * 2 * 0.1)
    down = (1 - speed) / 2 + speed  # time to the hook, and time up and back
    w, t = np.sqrt(1000.0), 0.02
    swing = -4 / 2000 * (1 - np.cos(w * t)) - speed / w * np.sin(w * t)
    assert last(case, down + t, "p.q[1]") == pytest.approx(0.1 + swing, abs=NEAR)


def test_a_hook_that_is_lifted_lets_go() -> None:
    lift = {"ramp": {"start": 0, "end": 1, "duration": 0.2, "begin": 0.1}}
    hook = {"at": 0.0, "stiffness": 1e4, "keeps": "below", "down": True, "release": lift}
    case = wheel(effort=2.0, friction={"torque": 0.5}, latch=hook)
    out = judged(case, 0.25, ["r.q*"], instants=5)
    assert abs(out.values["r.q[1]"][1:4] - 2 / 1e4).max() < 1.01 * 0.5 / 1e4  # within this band, friction holds the block
    assert out.values["r.qd[1]"][-1] == pytest.approx(1.5 / 0.02 * 0.05, rel=1e-3)


def test_a_freewheel_drags_one_way_and_grips_the_other() -> None:
    turns = {"table": {"time": [0, 0.5, 0.5001, 1], "value": [0.1, 0.1, -0.3, -0.3]}}
    case = wheel(friction={"torque": 0.02, "back_torque": 0.5}, effort=turns)
    gone = 0.08 / 0.02 * 0.5  # rate at 0.5 s
    stop = gone / (0.32 / 0.02)
    assert last(case, 1.0, "r.q[1]", 1e-3) == pytest.approx(gone * 0.25 + gone * stop / 2, abs=1e-3)


def gears(friction: dict | None) -> Scene:
    """Two gears of 20 and 30 teeth, module 10 mm. The torques about z are 1 N*m on the first gear and 0.3 N*m on the second."""
    mesh = {"type": "gear", "axis": "z", "inboard": "a", "outboard": "b", "teeth": [20, 30], "module": 0.01}
    joints = {"pa": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "a", "at": [0, 0, 0], "effort": 1.0},
              "pb": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "at": [0.25, 0, 0], "effort": 0.3},
              "m": mesh | ({"friction": friction} if friction else {})}  # fmt: skip
    bodies = {"a": WHEEL | {"position": [0, 0, 0]}, "b": WHEEL | {"position": [0.25, 0, 0]}}
    return scene(bodies, joints, (0, 0, 0))


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_gears_turn_in_their_ratio_and_their_teeth_take_what_the_theory_says(mu: float) -> None:
    """F is the tooth force along the pitch circles, and c = mu pi m/4. The torque on the first wheel is F (r1 + c). The torque on
    the second wheel is F (r2 - c)."""
    case = gears({"mu": mu, "pressure_angle": 0.35} if mu else None)
    c = mu * np.pi * 0.01 / 4
    r1, r2 = 0.1 + c, 0.15 - c
    # 0.02 a1 = 1 - F r1;  0.02 a2 = 0.3 - F r2 with turns of opposite sense: a2 = -a1 / 1.5
    force = (1 / 0.02 * (0.1 / 0.15) + 0.3 / 0.02) / ((r1 * 0.1 / 0.15 + r2) / 0.02)
    out = judged(case, 0.3, ["p?.qd*"], instants=1)
    rates = [out.values[f"{n}.qd[1]"][-1] for n in ("pa", "pb")]
    assert rates == pytest.approx([0.3 * (1 - force * r1) / 0.02, 0.3 * (0.3 - force * r2) / 0.02], abs=1e-4)
    assert rates[1] == pytest.approx(-rates[0] / 1.5, abs=1e-4)


def test_cones_that_turn_in_their_ratio_move_no_row_however_their_bearings_give_way() -> None:
    """Two cones are on a carrier that turns at 3 rad/s: 22 teeth at 10 rad/s about -x, and 10 teeth at 22 rad/s about -y. The
    constraint counts teeth, unlike the paths of rolling wheels."""
    bodies = {n: WHEEL | {"position": [0, 0, 0]} for n in ("car", "left", "p")}
    joints = {"rc": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "car"},
              "rl": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "left"},
              "rp": {"type": "revolute", "axis": "y", "inboard": "car", "outboard": "p"},
              "m": {"type": "bevel_gear", "inboard": {"body": "left", "axis": "-x"}, "outboard": {"body": "p", "axis": "y"},
                    "teeth": [22, 10], "module": 0.004}}  # fmt: skip
    case = resolved(scene(bodies, joints, (0, 0, 0)))
    model = Model(case, level_of(case, 0))
    f, carrier, left, planet = model.frames, np.array([3.0, 0, 0]), np.array([-10.0, 0, 0]), np.array([0, -22.0, 0])
    states = np.tile(start(model), (20, 1))
    states[:, f.at["c"]] += 1e-3 * np.random.default_rng(1).normal(size=(20, 9))
    states[:, f.at["v"]] = np.cross(carrier, states[:, f.at["c"]].reshape(20, 3, 3)).reshape(20, 9)
    states[:, f.at["w"]] = np.concatenate([carrier, carrier + left, carrier + planet])
    assert np.abs(model.rolling[0].rate(f.motion(np.zeros(20), states))).max() < 1e-13


def test_pairs_of_one_freedom_let_go_together_though_one_reaches_its_speed_of_rest_late() -> None:
    """A block on a guide (6 N at rest, 4 N moving) turns a wheel of 1 m that takes 1 N at the rack. A push of 10 N/s moves block
    and wheel at 0.7 s. After this time, 10 t - 5 N accelerate 2 kg and 2 kg."""
    bodies = {"b": BLOCK | {"position": [0, 0, 0]}, "w": WHEEL | {"inertia": [2.0, 2.0, 2.0], "position": [0, -1, 0]}}
    push = {"ramp": {"start": 0, "end": 10, "duration": 1}}
    joints = {"p": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "b", "at": [0, 0, 0], "effort": push,
                    "friction": {"force": 4.0, "mu": 1.0, "mu_static": 1.5}},
              "r": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "w", "at": [0, -1, 0],
                    "friction": {"torque": 1.0}},
              "m": {"type": "rack", "inboard": {"body": "w", "axis": "z"}, "outboard": {"body": "b", "axis": "x"},
                    "radii": [1.0]}}  # fmt: skip
    t = 0.3
    case = resolved(scene(bodies, joints, (0, 0, 0)))
    out = [table(case, level_of(case, n), np.array([0.0, 1.0]), rtol=1e-6)[0]["p.q[1]"][-1] for n in (0, 1)]
    limit = out[1] + (out[1] - out[0]) / (FINER - 1)
    assert limit == pytest.approx((2 * t**2 / 2 + 10 * t**3 / 6) / 4, abs=1e-5)


def test_a_joint_follows_another() -> None:
    joints = {f"p{n}": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": n} for n in "ab"}
    joints["pa"]["start"], joints["pb"]["start"] = {"q": 0.0}, {"q": 0.3}
    joints["pb"]["mimic"], joints["pa"]["effort"] = {"joint": "pa", "ratio": -2.0, "offset": 0.3}, 1.0
    case = scene({"a": WHEEL, "b": WHEEL}, joints, (0, 0, 0))
    out = judged(case, 0.4, ["p?.q[*"], instants=1)
    turn = 1 / (0.02 + 4 * 0.02) * 0.16 / 2
    assert [out.values[f"p{n}.q[1]"][-1] for n in "ab"] == pytest.approx([turn, 0.3 - 2 * turn], abs=NEAR)


def test_offered_start_rates_are_taken_only_where_the_scene_leaves_rates_open() -> None:
    """The first of two wheels starts at 3 rad/s. The second wheel drives a third wheel by gears."""
    joints: dict = {f"p{n}": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": n, "at": [x, 0, 0]}
                    for n, x in (("a", 9), ("b", 0), ("c", 0.25))}  # fmt: skip
    joints["pa"]["start"] = {"qd": 3.0}
    joints["m"] = {"type": "gear", "axis": "z", "inboard": "b", "outboard": "c", "teeth": [20, 30], "module": 0.01}
    case = resolved(scene({n: WHEEL | {"position": joints[f"p{n}"]["at"]} for n in "abc"}, joints, (0, 0, 0)))
    model = Model(case, level_of(case, 0))
    for spins in ([3.0, 6.0, -4.0], [3.0, 0.0, 0.0]):
        assert start(model, dict(zip(joints, spins, strict=False)))[model.frames.at["w"]][2::3] == pytest.approx(spins)
    for wrong in ({"pa": 3.0, "pb": 6.0, "pc": 4.0}, {"pa": 2.0, "pb": 6.0, "pc": -4.0}):
        with pytest.raises(ValueError, match="contradicts"):
            start(model, wrong)
    joints["pb"]["start"] = {"qd": 1.5}
    case = resolved(scene({n: WHEEL | {"position": joints[f"p{n}"]["at"]} for n in "abc"}, joints, (0, 0, 0)))
    model = Model(case, level_of(case, 0))
    assert start(model, {"pa": 2.0, "pb": 6.0, "pc": -4.0})[model.frames.at["w"]][2::3] == pytest.approx([3.0, 1.5, -1.0])


def test_the_compliant_model_names_the_law_that_it_refuses() -> None:
    with pytest.raises(NotJudged, match="lugre"):
        judged(slider(friction={"law": "lugre", "mu": 0.1, "force": 1.0, "bristle_stiffness": 1e3}))


def test_the_compliant_model_names_the_body_that_it_refuses() -> None:
    """A rotor with inertia about its axis only has no inertia about lines across the axis. The error names the rotor."""
    rotor = {"mass": 1.0, "inertia": {"axial": 1e-3, "axis": [0.6, 0.0, 0.8]}}
    joints = {"spin": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "rotor"}}
    found = part(resolved(scene({"rotor": rotor}, joints, (0, 0, 0))).bodies["rotor"]).inertia
    assert found == pytest.approx(1e-3 * np.array([[0.36, 0.0, 0.48], [0.0, 0.0, 0.0], [0.48, 0.0, 0.64]]), abs=1e-18)
    with pytest.raises(NotJudged, match="rotor: a body without mass or inertia"):
        judged(scene({"rotor": rotor}, joints, (0, 0, 0)))


def test_the_rates_in_c_are_those_of_the_definition() -> None:
    """Random states of a scene with every kind of row agree to round-off."""
    rub = {"mu": 0.2, "mu_static": 0.3, "radius": 0.01, "half_length": 0.02, "preload": 3.0, "thrust_radius": 0.01}
    at = {"at": [0, 0, 0], "axis": "z"}
    joints = {
        "pa": {"type": "revolute", "inboard": "ground", "outboard": "a", "friction": rub, "pin": "outboard", **at,
               "motor": {"stall": 1.0, "no_load": 9.0}, "end_stops": {"stiffness": 5.0, "upper": -0.1}},
        "pb": {"type": "cylindrical", "inboard": "ground", "outboard": "b", "axis": "z", "at": [0.25, 0, 0], "damping": [0.1, 0.2],
               "friction": {"mu": 0.1, "radius": 0.01, "half_length": 0.1}},
        "m": {"type": "gear", "axis": "z", "inboard": "a", "outboard": "b", "teeth": [20, 30], "module": 0.01,
              "friction": {"mu": 0.1, "pressure_angle": 0.3}},
        "s": {"type": "screw", "inboard": "a", "outboard": "n", "pitch": 0.01, **at,
              "friction": {"mu": 0.1, "radius": 0.01, "flank_angle": 0.2}},
        "g": {"type": "prismatic", "inboard": "ground", "outboard": "n", **at, "spring": {"stiffness": 9.0},
              "friction": {"mu": 0.1, "half_width": 0.02, "half_height": 0.03, "half_length": 0.1}},
        "u": {"type": "universal", "inboard": "n", "outboard": "c", "reference": "x", **at},
        "o": {"type": "spherical", "inboard": "c", "outboard": "d", "at": [0, 0, 0.3], "friction": {"mu": 0.2, "radius": 0.02}},
        "f": {"type": "rack", "inboard": {"body": "a", "axis": "z"}, "outboard": {"body": "d", "axis": "x"}, "radii": [0.02]},
        "v": {"type": "bevel_gear", "inboard": {"body": "n", "axis": "z"}, "outboard": {"body": "c", "axis": "x"},
              "teeth": [20, 10], "module": 0.01, "friction": {"mu": 0.1, "pressure_angle": 0.3}},
    }  # fmt: skip
    places = {"a": [0, 0, 0], "b": [0.25, 0, 0], "n": [0, 0, 0], "c": [0, 0, 0], "d": [0, 0.02, 0.3]}
    bodies = {n: WHEEL | {"position": x} for n, x in places.items()}
    pull = {"p": {"type": "force", "on": "c", "force": [1, 2, 3], "frame": "body"},
            "t": {"type": "torque", "on": "a", "torque": [1, 0, 3]},
            "k": {"type": "spring_damper", "between": ["a", "d"], "stiffness": 5.0, "damping": 0.3, "length": 0.1}}  # fmt: skip
    case = resolved(scene(bodies, joints, forces=pull))
    model = Model(case, level_of(case, 1))
    rng = np.random.default_rng(1)
    states = start(model) + 1e-3 * rng.normal(size=(20, model.frames.size))
    times = np.linspace(0, 1, 20)
    expected = model.defined(times, states)
    assert np.abs(Compiled(model)(times, states) - expected).max() < 1e-12 * np.abs(expected).max()
