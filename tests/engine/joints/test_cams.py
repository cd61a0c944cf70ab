"""A cam's follower stays on the curve, and the contact force balances the motion of the follower. Complex numbers in the cam's
plane and another spline give the reference."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from trunnion import sensitivity
from trunnion.basics.errors import SceneError
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

RATE = 7.0
CASES = [(what, guide, seed) for what in ("point", "face") for guide in ("slides", "rocks") for seed in (0, 1)]

RUNS = [*((*c, "parts") for c in CASES), *((*c, "compiled") for c in CASES[::2])]


@dataclass
class Cam:
    """A cam about the origin, turned by θ, and a follower of one freedom x. along, at: direction of a sliding follower, or pivot of
    a rocking follower. arm, normal: position of the follower's point or face at x = 0 and its normal, relative to the follower."""

    what: str
    guide: str
    curve: CubicSpline
    at: complex
    along: complex
    arm: complex
    normal: complex
    roller: float
    mass: float
    inertia: float

    def turned(self, x: float) -> complex:
        return np.exp(1j * x) if self.guide == "rocks" else 1.0

    def place(self, x: float) -> complex:
        """The follower's point."""
        return self.at + self.turned(x) * self.arm + (x * self.along if self.guide == "slides" else 0.0)

    def off(self, x: float, theta: float) -> float:
        """Distance of the follower from the curve."""
        p = self.place(x)
        if self.what == "point":
            return abs(p) - self.curve(np.angle(p) - theta)
        n = self.turned(x) * self.normal
        return (np.conj(n) * p).real - self.curve(np.angle(n) - theta)

    def touch(self, x: float, theta: float) -> tuple[complex, complex]:
        """The point of contact, and the normal at this point."""
        p = self.place(x)
        if self.what == "point":
            e = p / abs(p)
            phi = np.angle(p) - theta
            n = (self.curve(phi) - 1j * self.curve(phi, 1)) * e
            n /= abs(n)
            return p - self.roller * n, n
        n = self.turned(x) * self.normal
        phi = np.angle(n) - theta
        return (self.curve(phi) + 1j * self.curve(phi, 1)) * n, n

    def moves(self, x: float, c: complex) -> complex:
        """Velocity of the follower's part at a place, for a unit rate of the follower."""
        return self.along if self.guide == "slides" else 1j * (c - self.at)


def made(what: str, guide: str, seed: int, mu: float = 0.0) -> tuple[Cam, sm.Scene]:
    rng = np.random.default_rng([3, seed])
    angles = np.sort(np.append(rng.uniform(0, 2 * np.pi, 20), [0.0, 2 * np.pi]))
    # the spacing of the angles is uneven, within limits
    angles = 0.3 + 0.5 * angles + 0.5 * np.linspace(0, 2 * np.pi, len(angles))
    radius = 0.05 + 0.004 * np.cos(angles - 1) + 0.001 * np.sin(2 * angles)
    radius[-1] = radius[0]
    curve = CubicSpline(angles, radius, bc_type="periodic")
    if guide == "slides":
        d = np.exp(1j * rng.uniform(0, 6))
        cam = Cam(what, guide, curve, 0.01 * 1j * d, d, 0.0, d * np.exp(0.2j), 0.01, 0.7, 0.0)
    else:
        d = np.exp(1j * rng.uniform(0, 6))
        arm = -0.1j * d if what == "point" else -0.05j * d
        cam = Cam(what, guide, curve, 0.05 * d + 0.1j * d, 0.0, arm, d, 0.01, 0.7, 0.003)
    start = brentq(cam.off, *((0.0, 0.12) if guide == "slides" else (-0.5, 0.5)), args=(0.0,))

    def flat(z: complex) -> str:
        return f"[{z.real}, {z.imag}, 0]"

    own = f"body: rod, point: {flat(cam.arm)}" + ("" if what == "point" else f", axis: {flat(cam.normal)}, reference: z")
    guiding = f"type: prismatic, axis: {flat(cam.along)}" if guide == "slides" else "type: revolute, axis: z"
    kind = f"type: cam, roller: {cam.roller}" if what == "point" else "type: flat_cam"
    rubs = f", friction: {{mu: {mu}}}" if mu else ""
    text = f"""
schema: 1
gravity: [0, 0, 0]
bodies:
  cam: {{mass: 1, inertia: [0.001, 0.001, 0.002]}}
  rod: {{mass: {cam.mass}, inertia: [0.003, 0.003, {cam.inertia or 0.003}]}}
joints:
  turn: {{type: revolute, axis: z, inboard: ground, outboard: cam, drive: {{constant: {{rate: {RATE}}}}}}}
  guide: {{{guiding}, inboard: {{body: ground, point: {flat(cam.at)}}}, outboard: rod, effort: -3, start: {{q: {start}}}}}
  follow: {{{kind}, axis: z, reference: x, inboard: cam, outboard: {{{own}}}{rubs},
    profile: {{angle: {angles.tolist()}, radius: {radius.tolist()}}}}}
simulation: {{until: 1.1 s, every: 50 ms}}
"""
    return cam, scene_from_text(text)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize(("what", "guide", "seed", "kernel"), RUNS)
def test_a_follower_keeps_to_the_curve_and_presses_as_its_motion_asks(what: str, guide: str, seed: int, kernel: str) -> None:
    cam, scene = made(what, guide, seed)
    r = simulate(scene, rtol=1e-10, kernel=kernel)
    for i, t in enumerate(r.time):
        theta, x = RATE * t, float(r["guide.q[1]"][i])
        assert abs(cam.off(x, theta)) < 1e-12
        c, n = cam.touch(x, theta)
        asked = (cam.mass if guide == "slides" else cam.inertia) * r["guide.qdd[1]"][i] + 3
        force = asked / (np.conj(n) * cam.moves(x, c)).real * n
        assert r["follow.reaction.force[2]"][i] == pytest.approx(-abs(force), rel=1e-8)
        assert r["turn.drive.effort[1]"][i] == pytest.approx((np.conj(c) * force).imag, rel=1e-8, abs=1e-10)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("what", "guide", "seed"), CASES)
def test_a_follower_that_slides_on_a_cam_is_dragged_by_friction(what: str, guide: str, seed: int) -> None:
    mu = 0.15
    cam, scene = made(what, guide, seed, mu)
    r = simulate(scene, rtol=1e-10)
    for i, t in enumerate(r.time):
        theta, x = RATE * t, float(r["guide.q[1]"][i])
        c, n = cam.touch(x, theta)
        slides = (np.conj(1j * n) * (cam.moves(x, c) * r["guide.qd[1]"][i] - 1j * RATE * c)).real
        assert r["follow.qd[1]"][i] == pytest.approx(slides, rel=1e-9)
        way = n - mu * np.sign(slides) * 1j * n
        asked = (cam.mass if guide == "slides" else cam.inertia) * r["guide.qdd[1]"][i] + 3
        force = asked / (np.conj(way) * cam.moves(x, c)).real
        assert r["follow.contact[1].normal_force"][i] == pytest.approx(force, rel=1e-8)
        assert r["turn.drive.effort[1]"][i] == pytest.approx((np.conj(c) * force * way).imag, rel=1e-8, abs=1e-10)
    assert np.abs(r["energy.residual"]).max() < 1e-8


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("given", ["", ", start: {q: 0}"])
@pytest.mark.parametrize("rubs", ["", ", friction: {force: 0.3}"])
def test_a_follower_whose_frame_lies_on_the_axis_of_its_cam_is_assembled_onto_the_curve(seed: int, given: str, rubs: str) -> None:
    # On the axis the angle of the follower is undefined. A residual with the cosine of the pressure angle would be zero on the
    # axis.
    rng = np.random.default_rng([5, seed])
    angles = np.linspace(0, 2 * np.pi, 13)
    radius = 0.06 + 0.02 * np.sin(angles + rng.uniform(0, 6))
    radius[-1] = radius[0]
    turned = rng.uniform(-3, 3)
    scene = scene_from_text(f"""
schema: 1
gravity: [0, -5, 0]
bodies: {{cam: {{mass: 1, inertia: [0.01, 0.01, 0.01]}}, rod: {{mass: 0.4, inertia: [0.001, 0.001, 0.001]}}}}
joints:
  turn: {{type: revolute, axis: z, reference: x, inboard: ground, outboard: cam, start: {{q: {turned}, qd: 3}}}}
  guide: {{type: prismatic, axis: y, reference: z, inboard: ground, outboard: rod{rubs}{given}}}
  follow: {{type: cam, axis: z, reference: x, inboard: cam, outboard: rod,
    profile: {{angle: {angles.tolist()}, radius: {radius.tolist()}}}}}
simulation: {{until: 0.05, every: 0.05}}
""")
    r = simulate(scene)
    q, theta = float(r["guide.q[1]"][0]), float(r["turn.q[1]"][0])
    curve = CubicSpline(angles, radius, bc_type="periodic")
    assert r.outcome.name == "done"
    assert abs(q) == pytest.approx(curve((np.copysign(np.pi / 2, q) - theta) % (2 * np.pi)), abs=1e-12)
    assert any("guide: start q moved" in n for n in r.notes) == bool(given)


def lifted(more: str, rod: str = "", cam: str = "drive: {constant: {rate: 0}}") -> sm.Scene:
    """An eccentric disc under a flat plate that moves only up and down (y). At the start, the largest radius of the disc is at 1
    rad from x."""
    angles = np.linspace(0, 2 * np.pi, 721)
    radius = (E * np.cos(angles) + R).tolist()
    return scene_from_text(f"""
schema: 1
gravity: [0, 0, 0]
bodies:
  cam: {{mass: 1, inertia: [0.001, 0.001, 0.002]}}
  rod: {{mass: 0.4, inertia: [0.003, 0.003, 0.003]}}
joints:
  turn: {{type: revolute, axis: z, reference: x, inboard: ground, outboard: cam, start: {{q: 1.0, qd: 0}}, {cam}}}
  guide: {{type: prismatic, axis: y, inboard: ground, outboard: rod{rod}}}
  follow: {{type: flat_cam, axis: z, reference: x, inboard: cam, outboard: {{body: rod, axis: y, reference: z}},
    profile: {{angle: {angles.tolist()}, radius: {radius}}}{more}}}
simulation: {{until: 1 s, every: 0.1 s}}
""")


E, R, MU = 0.02, 0.05, 0.2


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_friction_holds_a_cam_under_its_load_up_to_its_arms(side: int, kernel: str) -> None:
    # The normal of the plate and the contact are at the angle π/2 − 1 rad in the cam.
    load, angle = 5.0, np.pi / 2 - 1.0
    beside, over = E * np.sin(angle), R + E * np.cos(angle)
    for most in (beside + MU * over, beside - MU * over):
        for more, holds in ((1e-6, False), (-1e-6, True)):
            torque = (most + np.sign(most - beside) * more * over) * load * side
            scene = lifted(f", friction: {{mu: {MU}}}", f", effort: {-load}", f"effort: {torque * side}")
            r = simulate(scene, kernel=kernel)
            # a torque beyond the limit turns the cam by 1e-5 rad in a second
            assert (np.abs(r["turn.qd[1]"]).max() < 1e-12) == holds, (most, more)


def test_a_spline_through_an_eccentric_moves_a_plate_as_the_eccentric_does() -> None:
    r = simulate(lifted("", "", "drive: {constant: {rate: 5}}"), rtol=1e-10)
    phase = 5 * r.time  # the angle of a drive at constant rate begins at 0
    assert r["guide.q[1]"] == pytest.approx(R + E * np.sin(phase), abs=1e-11)
    push = -0.4 * 25 * E * np.sin(phase)
    near = 1.1 * (2 * np.pi / 720) ** 2 / 12 * 0.4 * 25 * E  # allowed force, from the error of a cubic spline's second derivative
    assert r["follow.reaction.force[2]"] == pytest.approx(-push, abs=near)
    assert r["turn.drive.effort[1]"] == pytest.approx(push * E * np.cos(phase), abs=near * E)


def test_lifting_off_is_reported_at_its_instant() -> None:
    r = simulate(lifted(", friction: {mu: 1e-9}", ", effort: -3", "drive: {constant: {rate: 20}}"), rtol=1e-10)
    times = [e.time for e in r.events if e.joint == "follow" and 0 < e.time < 1]
    # The plate lifts off where m E ω² sin ωt = 3 N; after this instant, the cam would have to pull.
    phase = np.arcsin(3 / (0.4 * E * 400))
    turns = 2 * np.pi * np.arange(4)
    wanted = sorted(t for t in np.concatenate([(turns + phase), (turns + np.pi - phase)]) / 20 if t < 1)
    near = [min(times, key=lambda t, w=w: abs(t - w)) for w in wanted]
    assert near == pytest.approx(wanted, abs=1e-6)


def test_derivatives_of_a_run_with_a_cam_are_those_by_differences() -> None:
    _, scene = made("point", "rocks", 0, 0.15)
    values = {"joints.follow.friction.mu": 0.15, "joints.follow.roller": 0.01, "bodies.rod.mass": 0.7}
    columns = ("guide.qd[1]", "turn.drive.effort[1]", "follow.contact[1].normal_force")
    found = sensitivity(scene, tuple(values), columns, until=0.4, every=0.1, rtol=1e-10)
    h = 1e-5
    for path, value in values.items():
        up, down = (simulate(scene, until=0.4, every=0.1, rtol=1e-11, overrides={path: value + s * h}) for s in (1, -1))
        for column in columns:
            slope = (up[column] - down[column]) / (2 * h)
            assert found.d(column, path)[1:] == pytest.approx(slope[1:], rel=1e-6, abs=1e-6), (column, path)


PROFILE = "profile"
ANGLES = "[0 deg, 120 deg, 240 deg, 360 deg]"
GOOD = f"{{type: cam, axis: z, inboard: a, outboard: b, profile: {{angle: {ANGLES}, radius: [30 mm, 40 mm, 40 mm, 30 mm]}}}}"
WRONG = {
    "a cam needs the profile of its cam": re.sub(", profile.*", "}", GOOD),
    "3 radii for 4 angles": GOOD.replace("40 mm, 40 mm", "40 mm"),
    "a profile of 2 values": GOOD.replace(ANGLES, "[0, 1]").replace("[30 mm, 40 mm, 40 mm, 30 mm]", "[30 mm, 40 mm]"),
    "angles must increase": GOOD.replace("240 deg", "100 deg"),
    "the angles cover 1.11 turns": GOOD.replace("360 deg", "400 deg"),
    "the last radius differs from the first": GOOD.replace("40 mm, 30 mm]", "40 mm, 31 mm]"),
    "the roller is larger than its path": GOOD.replace("profile", "roller: 35 mm, profile"),
    "a revolute joint has no cam": GOOD.replace("cam", "revolute", 1),
    "the follower of a flat_cam is a face": GOOD.replace("cam", "flat_cam", 1).replace(PROFILE, f"roller: 5 mm, {PROFILE}"),
    "a cam has no spring of its own: cam and follower move on other": GOOD.replace(PROFILE, f"spring: {{stiffness: 1}}, {PROFILE}"),
    "a cam joint has no wheels": GOOD.replace(PROFILE, f"teeth: [3], {PROFILE}"),
}


@pytest.mark.parametrize("says", WRONG)
def test_impossible_cams_are_refused_with_the_reason(says: str) -> None:
    joints = "  on_a: {type: revolute, axis: z, inboard: ground, outboard: a}\n"
    joints += "  on_b: {type: prismatic, axis: x, inboard: ground, outboard: b}"
    each = "".join(f"  {b}: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}\n" for b in "ab")
    with pytest.raises(SceneError, match=re.escape(says)):
        build(scene_from_text(f"schema: 1\nbodies:\n{each}joints:\n{joints}\n  m: {WRONG[says]}\nsimulation: {{until: 1 s}}\n"))


def pushed(seed: int) -> tuple[sm.Scene, float | None]:
    """A plate under a constant load on a random cam that turns steadily. Also returns the instant from which the cam would have to
    pull. The plate's height is the support function h of the curve at the plate's normal, so that its acceleration is ω² h''."""
    rng = np.random.default_rng([7, seed])
    angles = np.linspace(0, 2 * np.pi, int(rng.integers(30, 60)))
    radius = 0.05 + 0.004 * np.cos(angles - rng.uniform(0, 6)) + 0.001 * np.cos(2 * angles - rng.uniform(0, 6))
    radius[-1] = radius[0]
    rate, mass, load, until = rng.uniform(5, 30), 0.4, rng.uniform(0.2, 1.2), 0.9
    scene = scene_from_text(f"""
schema: 1
gravity: [0, 0, 0]
bodies: {{cam: {{mass: 1, inertia: [0.001, 0.001, 0.002]}}, rod: {{mass: {mass}, inertia: [0.003, 0.003, 0.003]}}}}
joints:
  turn: {{type: revolute, axis: z, reference: x, inboard: ground, outboard: cam, drive: {{constant: {{rate: {rate}}}}}}}
  guide: {{type: prismatic, axis: y, inboard: ground, outboard: rod, effort: {-load * mass * rate**2 * 0.004}}}
  follow: {{type: flat_cam, axis: z, reference: x, inboard: cam, outboard: {{body: rod, axis: y, reference: z}},
    profile: {{angle: {angles.tolist()}, radius: {radius.tolist()}}}}}
simulation: {{until: {until} s, every: 0.5 s}}
""")
    times = np.linspace(0, until, 20001)
    bend = CubicSpline(angles, radius, bc_type="periodic")

    def push(t: float) -> float:
        return bend((np.pi / 2 - rate * t) % (2 * np.pi), 2) + load * 0.004

    pulls = np.nonzero(push(times) < 0)[0]
    if not len(pulls):
        return scene, None
    first = int(pulls[0])
    return scene, brentq(push, times[first - 1], times[first], xtol=1e-14) if first else 0.0


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("seed", range(110))
def test_without_friction_a_note_reports_the_instant_from_which_a_cam_pulls(seed: int) -> None:
    scene, wanted = pushed(seed)
    r = simulate(scene, rtol=1e-8, outputs=["guide.q*"])
    told = [float(n.split(" s ")[0].rpartition(" ")[2]) for n in r.notes if n.startswith("follow: from t")]
    assert told == ([] if wanted is None else [pytest.approx(wanted, abs=1e-9)])
