"""Bands and belts: while they slide, the ratio of tensions is exp(μ φ). At rest, the ratio is at most exp(μ φ) (theory, "Bands and
belts")."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.engine.mechanisms.band_brakes_and_belt_drives import Band, Brake, Drive, random_brake, random_drive
from tests.engine.mechanisms.gear_pairs import Row, flying, unit
from tests.engine.parts.test_compiled_kernel_equivalence import agree
from tests.reference.contact_and_friction.band_in_flat_pieces import band
from trunnion import SceneError, hold, sensitivity, simulate, sweep
from trunnion.elements.contact.wrapped_band import difference
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_text

USUAL = Brake(Band(0.3, 4.0, 100.0), 0.1, 0.2, 30.0, 5.0)
DRIVE = Drive(Band(0.3, 0.0, None, 200.0), (0.05, 0.12), 0.4, (0.01, 0.05), (30.0, -2.0))


def kernel(seed: int) -> str:
    """The kernel of a case."""
    return "compiled" if seed % 40 == 2 else "parts"


@pytest.mark.parametrize("k", [-0.4, 0.05, 0.3])
def test_the_law_is_that_of_a_band_in_flat_pieces(k: float) -> None:
    """The tensions agree with a band of flat pieces. The force on the drum agrees, too; it is the sum of the forces at both
    ends."""
    for wrap in (1.0, 3.0, 8.0):
        end, force = band(k, wrap)
        more = {"wrap_angle": wrap}
        assert difference(more | {"tension": 1.0}, k, np) == pytest.approx(end - 1, rel=1e-9)
        assert difference(more | {"pretension": 0.5 * (1 + end)}, k, np) == pytest.approx(end - 1, rel=1e-9)
        assert difference({"wrap_angle": -wrap, "tension": end}, k, np) == pytest.approx(end - 1, rel=1e-9)
        ends = np.array([0.0, -1.0]) + end * np.array([-math.sin(wrap), math.cos(wrap)])
        assert force == pytest.approx(ends, abs=1e-8 * end)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_drum_turns_and_rests_by_the_closed_form_in_both_senses(seed: int) -> None:
    d = random_brake(seed)
    r = simulate(d.scene(), rtol=1e-10, kernel=kernel(seed))
    angle, friction = d.angles(r.time)
    assert r.outcome.name == "done"
    assert r["brake.q[1]"] == pytest.approx(angle, abs=1e-9)
    assert r["brake.friction.torque[1]"] == pytest.approx(d.radius * friction, rel=1e-9)
    tensions = np.array([d.band.tensions(f) for f in friction])
    for k in (0, 1):
        assert r[f"brake.tension[{k + 1}]"] == pytest.approx(tensions[:, k], rel=1e-9)
    assert np.abs(r["energy.residual"]).max() < 1e-8 * max(1.0, r["energy.kinetic"].max())


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_drum_starts_just_beyond_the_limit_of_the_capstan_and_hold_agrees(seed: int) -> None:
    for sense in (1, -1):
        for more in (1e-6, -1e-6):
            d = replace(random_brake(seed), rate=0.0)
            d = replace(d, torque=d.limit(sense) * (1 + more))
            found = hold(d.scene())
            assert found.holds == (more < 0)
            assert found.pairs[0].share == pytest.approx(1 + more, rel=1e-12)
            r = simulate(d.scene(), kernel=kernel(seed), outputs=["brake.q[1]"])
            assert bool(abs(r["brake.q[1]"][-1]) > 1e-9) == (more > 0)


def test_bounds_at_rest_of_a_band_brake_are_the_limits_of_both_senses() -> None:
    found = hold(replace(USUAL, torque=5.0, rate=0.0).scene(), bounds=True)
    (load,) = found.loads
    assert found.holds == "certain"
    assert load.more.guaranteed.value == pytest.approx(USUAL.limit(1), rel=1e-9)
    assert load.less.guaranteed.value == pytest.approx(USUAL.limit(-1), rel=1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(20))
def test_bounds_at_rest_of_a_belt_are_its_limits_and_include_the_pull_at_the_bearing(seed: int) -> None:
    """The friction of its bearing holds the outboard pulley. Both strands press this bearing."""
    d = random_drive(seed)
    needed = 0.3 * d.wrapped.friction(1)
    scene = replace(d, torques=(d.arms[0] * needed, 0.0), rates=(0.0, 0.0)).scene()
    bearing = sm.Friction(mu=0.9, radius=2 * d.radii[1], half_length=0.1)
    on_b = replace(scene.joints["on_b"], effort=None, start=None, friction=bearing)
    found = hold(replace(scene, joints=scene.joints | {"on_b": on_b}), bounds=True)
    b, belt = found.pairs
    across, along = (sum(d.wrapped.tensions(needed)) * math.sin(d.wrap / 2), needed * math.cos(d.wrap / 2))
    most = 0.9 / math.hypot(1, 0.9) * math.hypot(across, along) * 2 * d.radii[1]
    assert b.share.largest.value == pytest.approx(d.radii[1] * needed / most, rel=1e-7)
    assert belt.share.largest.value == pytest.approx(0.3, abs=1e-8)
    motor = next(x for x in found.loads if "on_a" in x.name)
    limits = sorted(x.possible.value for x in (motor.less, motor.more))
    belts = sorted(d.arms[0] * d.wrapped.friction(sense) for sense in (1, -1))
    assert all(abs(x) <= abs(y) * (1 + 1e-7) for x, y in zip(limits, belts, strict=True))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_belt_slides_and_holds_by_the_closed_form(seed: int) -> None:
    """Open and crossed belts. The angle of wrap follows from the geometry or is given."""
    d = random_drive(seed)
    r = simulate(d.scene(), rtol=1e-10, kernel=kernel(seed))
    one, two, friction = d.states(r.time)
    assert r.outcome.name == "done"
    assert r["on_a.q[1]"] == pytest.approx(one, abs=1e-9)
    assert r["on_b.q[1]"] == pytest.approx(two, abs=1e-9)
    assert r["belt.friction.force"] == pytest.approx(friction, rel=1e-9)
    assert r["belt.qd[1]"] == pytest.approx(d.arms[0] * r["on_a.qd[1]"] + d.arms[1] * r["on_b.qd[1]"], abs=1e-9)
    tensions = np.array([d.wrapped.tensions(f) for f in friction])
    for k in (0, 1):
        assert r[f"belt.tension[{k + 1}]"] == pytest.approx(tensions[:, k], rel=1e-9)
    pull = tensions.sum(1) * math.sin(d.wrap / 2)
    assert r["on_b.reaction.force[2]"] == pytest.approx(-pull, rel=1e-9)
    assert np.abs(r["energy.residual"]).max() < 1e-8 * max(1.0, r["energy.kinetic"].max())


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(120))
def test_a_belt_slides_just_beyond_the_limit_of_the_capstan_and_hold_agrees(seed: int) -> None:
    """The outboard pulley is held at rest."""
    d = random_drive(seed)
    for sense in (1, -1):
        for more in (1e-6, -1e-6):
            torque = d.arms[0] * d.wrapped.friction(sense) * (1 + more)
            scene = replace(d, torques=(torque, 0.0), rates=(0.0, 0.0)).scene()
            held = replace(scene.joints["on_b"], effort=None, start=None, drive=sm.Drive(constant=sm.Constant(rate=0.0)))
            scene = replace(scene, joints=scene.joints | {"on_b": held})
            found = hold(scene)
            assert found.holds == (more < 0)
            assert found.pairs[0].share == pytest.approx(1 + more, rel=1e-12)
            r = simulate(scene, kernel=kernel(seed), outputs=["on_a.q[1]"])
            assert bool(abs(r["on_a.q[1]"][-1]) > 1e-9) == (more > 0)


def belts_in_flight(seed: int, **more: object) -> tuple[sm.Scene, object]:
    """An open and a crossed belt on a carrier in free flight. The pulleys are out of balance."""
    f = flying(seed, ("belt", "crossed"))
    joints = dict(f.scene.joints)
    for k, one in enumerate(f.pairs):
        rubs = sm.Friction(**({"mu": 0.3, "tension": 5.0} | more))  # type: ignore[arg-type]
        joints[f"m{k}"] = replace(joints[f"m{k}"], type="friction_belt", teeth=None, pitch=None, radii=(one.r1, abs(one.r2)),
                                  friction=rubs)  # fmt: skip
        joints[f"on_w{2 * k + 1}"] = replace(joints[f"on_w{2 * k + 1}"], start=sm.Start(qd=1.0))
    return replace(f.scene, joints=joints), f


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(12))
def test_each_strand_pulls_both_pulleys_along_the_line_that_touches_them(seed: int) -> None:
    """The reported force and torque on the inboard pulley are the force and torque of both tensions. The forces on every part are
    in balance."""
    scene, f = belts_in_flight(seed, **({} if seed % 2 else {"tension": None, "pretension": 3.0}))
    f = replace(f, scene=scene)
    r = simulate(scene, rtol=1e-10)
    for i in range(len(r)):
        row = Row(f, r, i)
        for body in f.inertia:
            assert np.abs(np.concatenate(row.balance(body))).max() < 1e-9 * 10.0 * f.inertia[body][0], body
        for k, one in enumerate(f.pairs):
            force, torque, _ = row.reported(f"m{k}")
            R = row.turned("carrier")
            a, s = R @ one.a1, R @ (one.p2 - one.p1)
            away = s - a * (s @ a)
            e, n, far = unit(away), np.cross(a, unit(away)), np.linalg.norm(away)
            sine = (one.r1 - abs(one.r2) * (1 if one.what == "belt" else -1)) / far
            total, moment = np.zeros(3), np.zeros(3)
            # If a pulley that turns about a drives, the tight strand runs onto the pulley at +n.
            for side, tension in ((-1, r[f"m{k}.tension[1]"][i]), (1, r[f"m{k}.tension[2]"][i])):
                out = sine * e + side * math.sqrt(1 - sine**2) * n  # radius to the point at which the strand leaves the pulley
                along = math.sqrt(1 - sine**2) * e - side * sine * n
                total, moment = total + tension * along, moment + tension * np.cross(one.r1 * out, along)
            assert force == pytest.approx(total, abs=1e-8)
            assert torque == pytest.approx(moment, abs=1e-9)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(4))
def test_both_kernels_write_the_same_with_a_friction_belt(seed: int) -> None:
    agree(belts_in_flight(seed, **({} if seed % 2 else {"tension": None, "pretension": 3.0}))[0], redundant=seed > 1)


def test_derivatives_of_a_run_with_a_band_brake_are_those_of_the_closed_form() -> None:
    keys = {"mu": "mu", "tension": "tension", "wrap_angle": "wrap"}
    found = sensitivity(USUAL.scene(), tuple(f"joints.brake.friction.{k}" for k in keys), ("brake.q[1]",), rtol=1e-10)
    for key, name in keys.items():
        step = 1e-6 * getattr(USUAL.band, name)
        up, down = (replace(USUAL, band=replace(USUAL.band, **{name: getattr(USUAL.band, name) + x})).angles(found.time)[0]
                    for x in (step, -step))  # fmt: skip
        assert found.d("brake.q[1]", f"joints.brake.friction.{key}")[1:] == pytest.approx((up - down)[1:] / (2 * step), rel=1e-6)


def test_derivatives_of_a_run_with_a_belt_include_those_of_its_angle_of_wrap() -> None:
    keys = ("joints.belt.radii[1]", "bodies.b.position[2]", "joints.belt.friction.mu")
    found = sensitivity(DRIVE.scene(), keys, ("on_b.q[1]",), rtol=1e-10)
    h = 1e-6

    def at(radius: float = 0.0, apart: float = 0.0, mu: float = 0.0) -> np.ndarray:
        more = Band(0.3 + mu, 0.0, None, 200.0)
        return replace(DRIVE, band=more, radii=(0.05 + radius, 0.12), apart=0.4 + apart).states(found.time)[1]

    for key, name in zip(keys, ("radius", "apart", "mu"), strict=True):
        slope = (at(**{name: h}) - at(**{name: -h})) / (2 * h)
        assert found.d("on_b.q[1]", key)[1:] == pytest.approx(slope[1:], rel=1e-6), key


def test_a_sweep_over_friction_and_place_is_the_closed_form() -> None:
    place, mu = "bodies.b.position[2]", "joints.belt.friction.mu"
    s = sweep(DRIVE.scene(), {place: [0.3, 0.5], mu: [0.2, 0.4]}, reductions=["final:on_b.q[1]"], rtol=1e-10).to_pandas()
    for case in s.to_dict("records"):
        d = replace(DRIVE, apart=case[place], band=replace(DRIVE.band, mu=case[mu]))
        assert case["final:on_b.q[1]"] == pytest.approx(d.states(np.array([1.0]))[1][0], rel=1e-9)


@pytest.mark.parametrize("law", ["coulomb", "stribeck"])
def test_the_static_coefficient_is_in_the_exponent(law: str) -> None:
    more = {"mu_static": 0.4, "law": law} | ({"v_stribeck": 0.1} if law == "stribeck" else {})
    for sense in (1, -1):
        limit = replace(USUAL, band=replace(USUAL.band, mu=0.4)).limit(sense)
        for factor in (1 - 1e-6, 1 + 1e-6):
            assert hold(replace(USUAL, torque=limit * factor, rate=0.0).scene(**more)).holds == (factor < 1)


def test_a_brake_that_is_released_slowly_lets_go_at_the_instant_of_the_closed_form() -> None:
    """The tension falls from 100 N by 100 N/s. At 40 N the drum's torque equals the limit."""
    d = replace(USUAL, torque=0.4 * USUAL.limit(1), rate=0.0)
    scene = d.scene(tension={"ramp": {"start": "100 N", "end": "0 N", "duration": 1}})
    for method in ("parts", "compiled"):
        r = simulate(scene, rtol=1e-10, kernel=method)
        (slip,) = [e for e in r.events if e.kind == "slip"]
        assert slip.time == pytest.approx(0.6, abs=1e-9)
        t = r.time[-1] - 0.6
        assert r["brake.q[1]"][-1] == pytest.approx(USUAL.limit(1) * t**3 / 6 / d.inertia, rel=1e-9)


WRONG = {
    "friction of a revolute joint needs either tension or pretension": ("tension: 1 N", "pretension: 1 N, tension: 1 N"),
    "needs wrap_angle and drum_radius: drum_radius is missing": (", drum_radius: 0.1", ""),
    'law "coulomb" needs mu': ("mu: 0.3, tension: 1 N", "tension: 1 N"),
    "wrap_angle must not be 0": ("wrap_angle: 4", "wrap_angle: 0"),
    "friction of a revolute joint has no radius": ("drum_radius: 0.1", "drum_radius: 0.1, radius: 0.1"),
    "no band or belt is wrapped around parts of a prismatic joint": ("type: revolute", "type: prismatic"),
    "holds by friction alone, which is missing": (", friction: {mu: 0.4, pretension: 3 N}", ""),
    "a friction_belt has no teeth: it needs its radii": ("radii: [0.1, 0.2]", "teeth: [10, 20], pitch: 0.1"),
    "friction of a friction_belt joint needs either tension or pretension": ("0.4, pretension: 3 N", "0.4"),
    "friction of a friction_belt joint has no drum_radius": ("0.4,", "0.4, drum_radius: 0.1,"),
    "no band or belt is wrapped around parts of a belt joint": ("type: friction_belt", "type: belt"),
}  # fmt: skip
RIGHT = """\
schema: 1
bodies: {a: {mass: 1, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1], position: [0, 1, 0]}}
joints:
  on_a: {type: revolute, axis: x, inboard: ground, outboard: a, friction: {mu: 0.3, tension: 1 N, wrap_angle: 4, drum_radius: 0.1}}
  on_b: {type: revolute, axis: x, inboard: ground, outboard: b}
  belt: {type: friction_belt, axis: x, inboard: a, outboard: b, radii: [0.1, 0.2], friction: {mu: 0.4, pretension: 3 N}}
"""


@pytest.mark.parametrize("says", WRONG)
def test_impossible_bands_and_belts_are_refused_with_the_reason(says: str) -> None:
    scene_from_text(RIGHT)
    old, new = WRONG[says]
    assert old in RIGHT
    with pytest.raises(SceneError, match=re.escape(says)):
        scene_from_text(RIGHT.replace(old, new))


def of_the_guide(name: str) -> sm.Scene:
    """A scene on the guide's page of friction."""
    page = (Path(trunnion.__file__).parent / "docs/guide/friction.md").read_text(encoding="utf-8")
    (text,) = [x.split("```")[0] for x in page.split("```yaml\n") if f"name: {name}\n" in x.split("```")[0]]
    return scene_from_text(text)


def test_the_band_brake_and_the_fan_drive_of_the_guide_are_those_by_hand() -> None:
    brake, fan = of_the_guide("band_brake"), of_the_guide("fan_drive")
    assert hold(brake).pairs[0].share == pytest.approx(100 / (60 * (math.exp(0.3 * 1.5 * math.pi) - 1)), rel=1e-12)
    back = replace(brake, joints={"brake": replace(brake.joints["brake"], effort=-100.0)})
    assert hold(back).pairs[0].share == pytest.approx(100 / (60 * (1 - math.exp(-0.45 * math.pi))), rel=1e-12)
    r = simulate(fan, until=2, every=1, rtol=1e-9)
    most = 600 * math.tanh(0.15 * (math.pi - 2 * math.asin(75 / 400)))
    (stuck,) = [e for e in r.events if e.kind == "stick"]
    assert stuck.time == pytest.approx(0.5 * 20 * math.pi / (0.125 * most), rel=1e-9)
    assert r["belt.friction.work"][-1] == pytest.approx(-0.25 * (20 * math.pi) ** 2, rel=1e-8)
    assert most * 0.125 == pytest.approx(29.43, abs=0.005)
