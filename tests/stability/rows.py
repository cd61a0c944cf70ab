"""The nineteen places where methods fail (method, section 6): a scene for each, as a function of how far it is beyond its
threshold,
and what is to be said of it on both sides."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from engine.scene import load_scene
from engine.scene import model as sm
from engine.scene.overrides import apply
from engine.simulation.hold import hold
from engine.simulation.result import Result
from engine.simulation.run import simulate
from tests.engine.plane_loops import FOUR_BAR

STEEL, G = 7800.0, 9.81
MU, RADIUS = 0.6, 0.05
EDGE = 1e-6
"""Relative distance from a threshold on both sides."""


@dataclass(frozen=True)
class Row:
    """title; scene at (1 + beyond) times its threshold; what is said of a scene; what it must be below and beyond."""

    number: int
    name: str
    title: str
    scene: Callable[[float], sm.Scene]
    verdict: Callable[[sm.Scene], str]
    below: str
    beyond: str
    elsewhere: str


def ran(scene: sm.Scene, rtol: float = 1e-8, rows: int = 20) -> Result:
    """A run to the scene's end."""
    until = float(scene.simulation.until)
    return simulate(scene, until=until, every=until / rows, rtol=rtol, max_steps=500_000)


def holding(scene: sm.Scene) -> str:
    """By statics, and by a short run that must say the same."""
    word = "holds" if hold(scene).holds else "slips"
    r = ran(scene)
    still = all(np.all(r[c] == 0.0) for c in r.matching("*.qd[*]")) and not any(e.kind == "slip" for e in r.events)
    return word if (word == "holds") == still and r.outcome.ok else f"{word}, but the run {r.outcome.name}"


def honest(scene: sm.Scene) -> str:
    """Outcome and balance of a run."""
    r = ran(scene)
    if not r.outcome.ok:
        return r.outcome.name
    size = max(np.abs(r["energy.kinetic"]).max(), np.abs(r["energy.potential"] - r["energy.potential"][0]).max())
    lost = np.abs(r["energy.residual"]).max()
    closed = r["audit.constraint"].max() if "audit.constraint" in r else 0.0
    return "right" if lost <= 1e-5 * size and closed <= 1e-9 * _length(scene) else f"energy {lost / size:.1e}, closure {closed:.1e}"


def _length(scene: sm.Scene) -> float:
    from engine.system.build import build

    return float(build(scene).numbers.length)


def bundled(name: str, until: float, **changes: float) -> Callable[[float], sm.Scene]:
    """A bundled model for some time; beyond: changed a little."""

    def make(beyond: float) -> sm.Scene:
        scene = load_scene(name)
        if changes:
            scene = apply(scene, {k.replace("__", "."): v * (1 + beyond) for k, v in changes.items()})
        return replace(scene, simulation=sm.Simulation(until=until), outputs=("*",))

    return make


def pendulum(angle: float, radius: float = RADIUS, rate: float = 0.0, until: float = 0.05, **rub: float | str) -> sm.Scene:
    """8.1 at an angle (rad) from the downward vertical."""
    scene = load_scene("spherical_pendulum")
    joint = scene.joints["ball"]
    friction = sm.Friction(**{"mu": MU, "radius": radius, **rub})  # type: ignore[arg-type]
    start = sm.Start(sm.AxisAngle("y", math.pi / 2 - angle), (0.0, -rate, 0.0))
    joints = {"ball": replace(joint, friction=friction, start=start)}
    return replace(scene, joints=joints, simulation=sm.Simulation(until=until), outputs=("*",))


CONE = math.asin(RADIUS * MU / math.hypot(1, MU) / 0.5)


def regularised_error(scene: sm.Scene) -> str:
    """Against dry friction: in proportion to v_eps, without more steps than 2,000."""
    joint = scene.joints["ball"]
    assert joint.friction is not None
    dry = replace(scene, joints={"ball": replace(joint, friction=replace(joint.friction, law="coulomb", v_eps=None))})
    soft, exact = ran(scene), ran(dry)
    speed = float(joint.friction.v_eps or 0.0) / (0.5 * float(exact["ball.qd[2]"][-1]) or 1.0)
    gap = abs(soft["ball.qd[2]"][-1] / exact["ball.qd[2]"][-1] - 1.0)
    return "right" if gap <= max(3.0 * abs(speed), 1e-6) and soft.stats.steps < 2000 else f"off by {gap:.1e} in {soft.stats.steps}"


def rotor(
    push: float, until: float, rate: float = 20.0, thrust: float = 0.0, thrust_radius: float | None = None, torque: float = 0.0
):
    """A wheel that turns about a level journal: weight, a push upward that grows from 0 to ``push`` weights, an axial thrust."""
    mass = 3.0
    wheel = sm.Body(cylinder=sm.Cylinder(0.1, 0.05, "y"), mass=mass)
    rub = sm.Friction(mu=0.2, radius=0.01, half_length=0.02, thrust_radius=thrust_radius)
    joint = sm.Joint("revolute", "ground", "wheel", axis="y", friction=rub, start=sm.Start(0.0, rate))
    forces: dict[str, sm.Applied] = {}
    if push:
        up = sm.Signal(table=sm.Table((0.0, until), (0.0, push * mass * G)))
        forces["push"] = sm.Force("force", "wheel", (0.0, 0.0, up))
    if thrust:
        forces["thrust"] = sm.Force("force", "wheel", (0.0, thrust, 0.0))
        forces["torque"] = sm.Torque("torque", "wheel", (0.0, torque, 0.0))
    gravity = (0.0, 0.0, -G) if push else (0.0, 0.0, 0.0)
    return sm.Scene(
        {"wheel": wheel}, {"axle": joint}, "rotor", gravity=gravity, forces=forces, simulation=sm.Simulation(until=until)
    )


def normal_turn(scene: sm.Scene) -> str:
    """Whether the contact's normal turns by π while the wheel turns on, every number being finite."""
    r = ran(scene, rows=101)
    n = np.array([r[f"axle.contact[1].normal[{k}]"] for k in (1, 2, 3)])
    turned = float(n[:, 1] @ n[:, -1]) < 0.0
    wild = not np.isfinite(r["axle.friction.torque[1]"]).all()
    return "not finite" if wild or not r.outcome.ok else "separates" if turned else "stays"


def spinner(angle: float) -> sm.Scene:
    """A sphere on a ball joint at its centre, spinning at an angle from the force it carries."""
    body = sm.Body(sphere=0.1, mass=4.0)
    rub = sm.Friction(mu=0.5, radius=0.02)
    start = sm.Start((1.0, 0.0, 0.0, 0.0), (10.0 * math.sin(angle), 0.0, 10.0 * math.cos(angle)))
    joint = sm.Joint("spherical", "ground", "ball", friction=rub, start=start)
    return sm.Scene({"ball": body}, {"socket": joint}, "spinner", gravity=(0.0, 0.0, -G), simulation=sm.Simulation(until=1e-3))


def rubs(scene: sm.Scene) -> str:
    """Friction power at the start."""
    r = ran(scene, rows=1)
    w = np.array([r[f"socket.qd[{k}]"][0] for k in (1, 2, 3)])
    t = np.array([r[f"socket.friction.torque[{k}]"][0] for k in (1, 2, 3)])
    power = float(t @ w) / (np.linalg.norm(t) * np.linalg.norm(w))
    return "rubs" if power > 1e-7 else "spins free" if abs(power) <= 1e-12 else f"power {power:.1e}"


def crossed(angle: float) -> sm.Scene:
    """A universal joint whose second axis leans on the first: at angle 0 they would be parallel."""
    rub = sm.Friction(mu=0.3, radius=0.01, half_length=0.03)
    arm = sm.Body(box=(1.0, 0.1, 0.1), density=STEEL, center=(0.5, 0.0, 0.0))
    joint = sm.Joint("universal", "ground", "arm", axis="y", reference=(0.0, math.cos(angle), math.sin(angle)), friction=rub)
    return sm.Scene({"arm": arm}, {"cross": joint}, "crossed", simulation=sm.Simulation(until=0.2))


def accepted(scene: sm.Scene) -> str:
    """Refused with a reason at the named place, or run."""
    from engine.scene.check import problems

    return "refused" if problems(scene) else honest(scene)


def overhung(half_length: float) -> sm.Scene:
    """A bar on a level journal that also carries its bending moment: the ends press with m/(2c)."""
    bar = sm.Body(box=(0.5, 0.05, 0.05), density=STEEL, center=(0.25, 0.2, 0.0))
    rub = sm.Friction(mu=0.1, radius=1e-3, half_length=half_length)
    joint = sm.Joint("revolute", "ground", "bar", axis="y", friction=rub, start=sm.Start(0.0, 0.0))
    return sm.Scene({"bar": bar}, {"pin": joint}, "overhung", simulation=sm.Simulation(until=0.2))


def carriage(offset: float) -> sm.Scene:
    """A sleeve pushed along its guide beside its axis."""
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=2.0, points={"push": (0.0, offset, 0.0)})
    rub = sm.Friction(mu=0.4, half_length=0.08, half_width=0.03, half_height=0.02)
    joint = sm.Joint("prismatic", "ground", "carriage", axis="x", friction=rub, start=sm.Start(0.0, 0.0))
    push = sm.Force("force", "carriage.push", (50.0, 0.0, 0.0))
    return sm.Scene({"carriage": body}, {"guide": joint}, "wedge", gravity=(0.0, 0.0, 0.0), forces={"push": push},
                    simulation=sm.Simulation(until=0.01))  # fmt: skip


def four_bar(beyond: float) -> sm.Scene:
    """Four rubbing joints in a loop, torque at the most that plane statics allows."""
    scene = FOUR_BAR.scene((1 + beyond) * FOUR_BAR.most(1.0))
    return replace(scene, simulation=sm.Simulation(until=0.01))


def tumbling(spin: float) -> sm.Scene:
    """A free body that spins fast about its middle axis."""
    body = sm.Body(box=(0.3, 0.2, 0.1), mass=1.0)
    start = sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1e-3 * spin, spin, 0.0))
    return sm.Scene({"top": body}, {"free": sm.Joint("free", "ground", "top", start=start)}, "tumbling", gravity=(0.0, 0.0, 0.0),
                    simulation=sm.Simulation(until=50.0 / spin))  # fmt: skip


def normed(scene: sm.Scene) -> str:
    """The quaternion's length and the energy after many turns."""
    r = ran(scene)
    drift = max(abs(sum(r[f"free.q[{k}]"][i] ** 2 for k in (4, 5, 6, 7)) - 1.0) for i in range(len(r)))
    return honest(scene) if drift <= 1e-12 else f"norm off by {drift:.1e}"


def jumps(scene: sm.Scene) -> str:
    """Events of a swing: how many ends of sliding, whether each normal turned by less than 2 atan μ and no wrap was reported."""
    r = ran(scene)
    turns = [t for e in r.events if e.kind == "reversal" for t in e.turn]
    good = all(0.5 * math.atan(MU) < t <= 2 * math.atan(MU) for t in turns) and not any(e.kind == "separation" for e in r.events)
    return f"{len(turns)} reversals" if good else f"turns {np.degrees(turns)}"


FIRST_STOP = 0.944980


def swing(until: float) -> sm.Scene:
    """8.1 from horizontal, for some time."""
    return replace(load_scene("spherical_pendulum"), simulation=sm.Simulation(until=until), outputs=("*",))


def same_end(scene: sm.Scene) -> str:
    """Rows laid any way, and a run cut at the end, say the same as the solver's own steps."""
    until = float(scene.simulation.until)
    ends = [simulate(scene, until=until, every=e, rtol=1e-9).data[-1] for e in (until, until / 7, until / 1000)]
    scale = np.abs(ends[0]).max()
    return "same" if max(np.abs(e - ends[0]).max() for e in ends) <= 1e-9 * scale else "rows change the run"


def massive(mass: float) -> sm.Scene:
    """A body with a mass that may be no number."""
    return sm.Scene({"b": sm.Body(box=(1.0, 1.0, 1.0), mass=mass)}, {"j": sm.Joint("prismatic", "ground", "b", axis="z",
                    start=sm.Start(0.0, 1.0))}, "massive", simulation=sm.Simulation(until=0.1))  # fmt: skip


def counted(scene: sm.Scene) -> str:
    """Roots of the complement equations at the start, or the named outcome."""
    r = ran(scene)
    return r.outcome.name if not r.outcome.ok else "one root" if r.certificate.roots[0] == 1 else "several roots"


PAINLEVE = 26.065 / 78.0 / 0.5 * math.hypot(1, MU) / MU
TORQUE = 0.2 * 40.0 * 0.015

ROWS = (
    Row(1, "zero_speed", "zero sliding speed", lambda b: pendulum(CONE * (1 + b)), holding, "holds", "slips",
        "a law through zero creeps; smooth laws never hold"),
    Row(2, "small_v_eps", "v_eps → 0 (stiffness)", lambda b: pendulum(1.0, law="regularized", v_eps=1e-6 if b < 0 else 1e-9,
        until=0.3),
        regularised_error, "right", "right", "explicit methods need steps ∝ v_eps"),
    Row(3, "no_reaction", "reaction → 0", lambda b: rotor(1 + 50 * b, 0.2), normal_turn, "stays", "separates",
        "contact normal undefined: 0/0"),
    Row(4, "spin_about_force", "reaction ∥ spin axis (ball)", lambda b: spinner(math.atan(0.5) * (1 + b)), rubs,
        "spins free", "rubs",
        "normal from a cross product: 0/0"),
    Row(5, "parallel_cross", "universal cross axes nearly parallel", lambda b: crossed(0.0 if b < 0 else 0.1), accepted, "refused",
        "right", "a singular Jacobian in the middle of a run"),
    Row(6, "short_journal", "half length c → 0", lambda b: overhung(0.0 if b < 0 else 1e-2), accepted, "refused", "right",
        "division by c"),
    Row(7, "painleve", "large μ r: no root or two", lambda b: pendulum(1.0, PAINLEVE * (1 + b), -2.0, 1e-7), counted, "one root",
        "jammed", "fixed point diverges or a root is picked silently"),
    Row(8, "wedge", "wedging of a guide", lambda b: carriage(0.2 * (1 + b)), holding, "slips", "holds",
        "depends on the size of the force"),
    Row(9, "light_cart", "tiny inertias", lambda b: bundled("cart_pole", 2.0)(b), honest, "right", "right",
        "default solvers are silently wrong"),
    Row(10, "loop_drift", "loop drift", lambda b: bundled("crank_slider_free", 100.0)(b), honest, "right", "right",
        "closure drifts, or is only held softly"),
    Row(11, "bifurcation", "dead centre and bifurcation", lambda b: bundled("n_four_bar", 2.0)(b), honest, "right", "right",
        "singular matrix at the dead centre"),
    Row(12, "redundant", "redundant loops", lambda b: bundled("bricard", 2.0)(b), honest, "right", "right",
        "singular constraint matrix from the start"),
    Row(13, "stiff_springs", "stiff springs", lambda b: bundled("governor", 0.2)(b), honest, "right", "right",
        "explicit methods need a step of microseconds"),
    Row(14, "sticking_loop", "several joints sticking in one loop", four_bar, holding, "holds", "slips",
        "minimum norm lets go at 71 % of the true band"),
    Row(15, "fast_spin", "high speed, quaternion norm", lambda b: tumbling(1e4 * (1 + b)), normed, "right", "right",
        "the quaternion's norm drifts"),
    Row(16, "contact_jumps", "contact angle: wrap, reversal, jump", lambda b: swing(FIRST_STOP * (1 + b)), jumps, "0 reversals",
        "1 reversals", "not reported"),
    Row(17, "axial_thrust", "axial thrust on a journal", lambda b: rotor(0.0, 0.01, 0.0, 40.0, 0.015, TORQUE * (1 + b)), holding,
        "holds", "slips", "an end face has no arm"),
    Row(18, "step_over_event", "time step across an event", lambda b: swing(1.0 if b < 0 else FIRST_STOP), same_end, "same", "same",
        "results depend on the output grid"),
    Row(19, "not_finite", "non-finite input, absurd units", lambda b: massive(1e-30 if b < 0 else 1e30), accepted, "right", "right",
        "NaN in the results"),
)  # fmt: skip
