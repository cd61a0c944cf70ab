"""Results of MuJoCo at rows 1 to 21 of the gallery: constant friction loss of joints, soft loops, and fixed steps. Every
function returns one statement for the table."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from tests.benchmarks.numerical_error.pendulum_error import MU, G, L, M, R
from tests.stability.entries.closed_loops import bricard, hanging
from tests.stability.entries.mass_springs_spin import governor
from tests.stability.entries.rest_and_dead_centres import MASS, SWING, TURNS
from tests.stability.entries.rest_and_dead_centres import MU as MU_TABLE
from tests.stability.gallery_entry import EDGE
from tests.stability.scene_verdicts import bundled
from trunnion.analysis.work_precision.benchmark_model import make_benchmark_model
from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.analysis.work_precision.reference_solvers.mujoco import Mujoco
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import take_snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import Setting
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

mujoco.set_mju_user_warning(lambda _message: None)  # numbers that are not finite show in the results
PENDULUM = f'<inertial pos="0 0 -{L}" mass="{M}" diaginertia="6.5 6.565 .13"/>'


def one(joint: str, inertial: str, gravity: str = f"0 0 -{G}", step: float = 1e-3, rest: str = ""):
    """A model with one body on ground, and its data."""
    xml = (
        f'<mujoco><compiler angle="radian"/><option timestep="{step!r}" gravity="{gravity}"/><worldbody><body>'
        f"{joint}{inertial}{rest}</body></worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def lump(mass: float, across: float = 1.0, along: float = 1.0) -> str:
    """MJCF of a mass at the origin, with one moment of inertia about x and z (across) and one about y (along)."""
    return f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{across} {along} {across}"/>'


def unstable(data) -> bool:
    """True if MuJoCo has found NaN or infinity. (MuJoCo then starts again from the beginning.)"""
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
    return any(data.warning[int(b)].number for b in bad)


def zero_speed() -> str:
    """Row 1: the friction loss is the largest friction of the ball at 2°."""
    most = M * G * R * MU / math.hypot(1.0, MU)
    model, data = one(f'<joint type="hinge" axis="0 1 0" frictionloss="{most}"/>', PENDULUM)
    data.qpos[0] = math.radians(2.0)
    mujoco.mj_step(model, data, nstep=10_000)
    return f"friction loss of joints: 2° becomes {math.degrees(data.qpos[0]):.3f}° in 10 s"


def small_v_eps() -> str:
    """Row 2: a pushed sleeve whose friction loss is slightly larger than the push."""
    model, data = one(f'<joint type="slide" axis="1 0 0" frictionloss="{0.8 * G}"/>', lump(2))
    data.qfrc_applied[0] = 0.8 * G * (1 - EDGE)
    mujoco.mj_step(model, data, nstep=1000)
    return f"pushed with one part in a million less than its friction loss it moves at {data.qvel[0]:.2g} m/s after 1 s"


def no_reaction() -> str:
    """Row 3: the rotor with a friction loss equal to the friction that its weight causes."""
    inertia, weight = 0.5 * 3.0 * 0.01, 3.0 * G
    torque = 0.2 / math.hypot(1, 0.2) * 0.01 * weight
    model, data = one(
        f'<joint type="hinge" axis="0 1 0" frictionloss="{torque}"/>',
        lump(3, 1.0, inertia),
    )
    data.qvel[0] = 20.0
    mujoco.mj_step(model, data, nstep=200)
    right = torque * 0.1 / inertia
    return f"friction loss does not depend on the load: {20 - data.qvel[0]:.2f} rad/s lost instead of {right:.2f}"


def spin_about_force() -> str:
    """Row 4: a sphere spins at an angle to the force on its ball joint."""
    loss = 0.5 * 0.02 * 4.0 * G
    model, data = one(f'<joint type="ball" frictionloss="{loss}"/>', lump(4, 0.016, 0.016))
    data.qvel[:] = 10.0 * np.array([math.sin(math.atan(0.5)), 0.0, math.cos(math.atan(0.5))])
    mujoco.mj_forward(model, data)
    torque, spin = -data.qfrc_constraint[:3], data.qvel[:3]
    off = math.degrees(math.acos(torque @ spin / np.linalg.norm(torque) / np.linalg.norm(spin)))
    return f"friction loss acts on each axis alone: {np.linalg.norm(torque):.2f} N m, {off:.0f}° off the spin, where there is none"


def parallel_cross() -> str:
    """Row 5: two hinges with axes 1e-6 apart; the arm hangs at an angle."""
    joints = f'<joint type="hinge" axis="0 1 0"/><joint type="hinge" axis="0 {math.cos(1e-6)!r} {math.sin(1e-6)!r}"/>'
    inertial = '<inertial pos="0.5 0.1 0" mass="78" diaginertia=".13 6.565 6.565"/>'
    model, data = one(joints, inertial, gravity=f"0 3 -{G}", step=1e-4)
    mujoco.mj_forward(model, data)
    rates = np.abs(data.qacc).max()
    mujoco.mj_step(model, data, nstep=2000)
    after = np.abs(data.qvel).max()
    return f"two hinges 1e-6 rad apart are accepted: {rates:.0e} rad/s² at the start, {after:.0f} rad/s after 0.2 s"


def wedge() -> str:
    """Row 8: the friction loss equals a push of 50 N. The sleeve is pushed with 100 N."""
    model, data = one('<joint type="slide" axis="1 0 0" frictionloss="50"/>', lump(2))
    data.qfrc_applied[0] = 100.0
    mujoco.mj_step(model, data, nstep=100)
    return f"friction loss for a push of 50 N: a push of 100 N, which jams as well, moves it {1000 * data.qpos[0]:.0f} mm in 0.1 s"


def light_cart() -> str:
    """Row 9: the free cart. Point masses have the least inertia that MuJoCo accepts."""
    xml = (
        f'<mujoco><option timestep="{{}}" integrator="RK4" gravity="0 0 -{G}"><flag energy="enable"/></option><worldbody><body>'
        '<joint type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1e-6" diaginertia="1e-14 1e-14 1e-14"/><body>'
        '<joint type="hinge" axis="0 -1 0"/><inertial pos="1 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body></body>'
        "</worldbody></mujoco>"
    )
    out = []
    for step in (2e-3, 1e-4):
        model = mujoco.MjModel.from_xml_string(xml.format(step))
        data = mujoco.MjData(model)
        while data.time < 2.0 and not unstable(data):
            before = float(data.time)
            mujoco.mj_step(model, data)
        out.append(f"not finite at {before:.2f} s" if unstable(data) else f"energy {sum(data.energy) / G:+.2g} m g l")
    return f"RK4: {out[0]} with its step of 2 ms, {out[1]} with 0.1 ms"


def loaded(scene: sm.Scene, until: float, step: float, method: str = "implicitfast"):
    """Step a scene, as MuJoCo's reference solver writes it, to its end. Returns the largest opening of a closure (m), energy gained
    over the largest kinetic energy, and the farthest turn of its first joint."""
    body = next(iter(scene.bodies))
    measure = ErrorMeasure(tuple(f"{body}.position[{k}]" for k in (1, 2, 3)), ((0, 1, 2),), ("m",))
    ready = make_benchmark_model(scene, FrictionVariant("", 0.0), measure, until, 1)
    peer = Mujoco(ready, take_snapshot(ready))
    xml = peer.xml(Setting(method, step=step)).replace('contact="disable"', 'contact="disable" energy="enable"')
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qvel[:] = peer.velocities()
    mujoco.mj_forward(model, data)
    start, most, gap, far = sum(data.energy), 0.0, 0.0, 0.0
    for _ in range(round(until / step)):
        mujoco.mj_step(model, data)
        if unstable(data):
            return math.inf, math.inf, math.inf
        rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        gap = max(gap, float(np.abs(data.efc_pos[rows]).max(initial=0.0)))
        most, far = max(most, float(data.energy[1])), max(far, abs(float(data.qpos[0])))
    return gap, (sum(data.energy) - start) / most, far


def loop_drift() -> str:
    """Row 10: the gap of a soft loop, and its effect on the energy."""
    gap, energy, _ = loaded(bundled("crank_slider_free", 10.0)(0.0), 10.0, 1e-3)
    return f"step 1 ms, 10 s: the loop opens by {gap:.1g} m, energy {100 * energy:+.0f} %"


def bifurcation() -> str:
    """Row 11: both sides of the first threshold."""
    out = []
    for beyond in (-EDGE, EDGE):
        gap, _, far = loaded(hanging(2 * (1 + beyond), 4.0), 4.0, 1e-4, "RK4")
        out.append(f"{'goes over' if far > math.pi else 'turns back'}, open by {gap:.1g} m")
    return f"RK4, step 0.1 ms: {out[0]} below; {out[1]} beyond"


def redundant() -> str:
    """Row 12: MuJoCo closes a misaligned loop softly."""
    gap, energy, _ = loaded(bricard(0.0), 1.0, 1e-3)
    return f"step 1 ms, 1 s: in line the loop opens by {gap:.1g} m, energy {100 * energy:+.1g} %"


def stiff_springs() -> str:
    """Row 13: a governor with stiff springs under two integrators."""
    ours, out = simulate(governor(EDGE), rtol=1e-9), []
    angle = float(ours["spin.q[1]"][-1] - ours["spin.q[1]"][0])
    for method in ("RK4", "implicitfast"):
        far = loaded(governor(EDGE), 0.2, 2e-3, method)[2]
        out.append(f"{method} {f'off by {abs(far - angle):.1g} rad' if math.isfinite(far) else 'not finite'}")
    return "step 2 ms, shaft after 0.2 s: " + ", ".join(out)


def fast_spin() -> str:
    """Row 15: a free box of width b spins by 4000 rad at 1e4 rad/s. At b = 0.3 m, two moments of inertia are equal; b is slightly
    smaller and slightly larger."""
    out = []
    for b in (0.3 * (1 - EDGE), 0.3 * (1 + EDGE)):
        inertia = f"{(b * b + 0.01) / 12!r} {0.1 / 12!r} {(0.09 + b * b) / 12!r}"
        body = f'<freejoint/><inertial pos="0 0 0" mass="1" diaginertia="{inertia}"/>'
        xml = (
            f'<mujoco><option timestep="1e-5" integrator="RK4" gravity="0 0 0"/><worldbody><body>{body}</body></worldbody></mujoco>'
        )
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        data.qvel[3:] = 10.0, 1e4, 0.0
        mujoco.mj_step(model, data, nstep=40_000)
        out.append(abs(float(data.qvel[3])) / 10.0)
    return f"RK4, step 0.1 rad: off the axis {out[0]:.1f} and {out[1]:.1f} times the start"


def axial_thrust() -> str:
    """Row 17: a joint without end faces. The friction loss follows from the thrust, and 0.9 of the loss acts as torque."""
    model, data = one('<joint type="hinge" axis="0 1 0" frictionloss="0.12"/>', lump(3, 1.0, 0.015))
    data.qfrc_applied[0] = 0.108
    mujoco.mj_step(model, data, nstep=10_000)
    angle = math.degrees(data.qpos[0])
    return f"a hinge has no end face; friction loss for the thrust, 0.9 of the torque: creeps {angle:.1f}° in 10 s"


def step_over_event() -> str:
    """Row 18: 8.1 with a constant friction loss, to 1 s, just after its first stop."""
    ends = []
    for step in (2e-3, 1e-3, 1e-5):
        model, data = one('<joint type="hinge" axis="0 1 0" frictionloss="15"/>', PENDULUM, step=step)
        data.qpos[0] = math.pi / 2
        mujoco.mj_step(model, data, nstep=round(1.0 / step))
        ends.append(math.degrees(data.qpos[0]))
    words = f"{ends[0]:.2f}° at 2 ms, {ends[1]:.2f}° at 1 ms, {ends[2]:.2f}° at 10 µs"
    return f"angle of 8.1 with friction loss at 1 s depends on the step: {words}"


def ratchet() -> str:
    """Row 21, one part in a million below the threshold: the friction loss is the static friction of the table."""
    most = MU_TABLE * MASS * G
    model, data = one(f'<joint type="slide" axis="1 0 0" frictionloss="{most}"/>', lump(MASS))
    for k in range(1000 * TURNS):
        data.qfrc_applied[0] = most * (1 - EDGE - SWING + SWING * math.sin(2e-3 * math.pi * k))
        mujoco.mj_step(model, data)
    return f"below the threshold the block is {1e6 * data.qpos[0]:.0f} µm from its place after {TURNS} periods"


def not_finite() -> str:
    """Row 19: impossible values of mass and inertia."""
    out = []
    for name, mass, inertia in (
        ("an impossible inertia", "1", "1 2 3.000003"),
        ("a mass of 1e-300 kg", "1e-300", "1e-300 1e-300 1e-300"),
    ):
        try:
            one("<freejoint/>", f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>')
            out.append(f"{name} is taken")
        except ValueError:
            out.append(f"{name} is refused")
    return ", ".join(out)


STATEMENTS = {
    1: zero_speed, 2: small_v_eps, 3: no_reaction, 4: spin_about_force, 5: parallel_cross, 8: wedge, 9: light_cart, 10: loop_drift,
    11: bifurcation, 12: redundant, 13: stiff_springs, 15: fast_spin, 17: axial_thrust, 18: step_over_event, 19: not_finite,
    21: ratchet,
}  # fmt: skip
