"""Drives from rest to rest. Their positions, rates and accelerations agree with textbook formulas of each profile."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion.scene.checks import problems
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

START, END, BEGIN, TIME = 0.2, -1.3, 0.3, 1.2
WAY = END - START
KERNELS = ("parts", "compiled")
PROFILES = ("polynomial", "trapezoid", "s_curve")


def moved(profile: str, kernel: str = "parts", kind: str = "revolute", **more: float) -> Result:
    rub = sm.Friction(torque=0.5) if kind == "revolute" else sm.Friction(force=0.5)
    move = sm.Move(**{"start": START, "end": END, "begin": BEGIN, "duration": TIME, "profile": profile, **more})
    joint = sm.Joint(kind, "ground", "arm", axis="z", friction=rub, drive=sm.Drive(move=move))
    body = sm.Body(box=(0.6, 0.05, 0.05), mass=2.0, center=(0.3, 0.0, 0.0))
    return simulate(sm.Scene({"arm": body}, {"joint": joint}, "arm"), until=2.0, every=2e-3, rtol=1e-9, kernel=kernel)


def first_half(profile: str, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of the distance, its rate and acceleration up to u = 1/2, written out for each phase."""
    if profile == "polynomial":
        return u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)
    if profile == "trapezoid":  # the peak speed is 3/2, the acceleration 9/2
        early = u < 1 / 3
        return np.where(early, 2.25 * u**2, 0.25 + 1.5 * (u - 1 / 3)), np.where(early, 4.5 * u, 1.5), np.where(early, 4.5, 0.0)
    # the area of the accelerations, 6 · 1/4, is the peak speed of 3/2
    corners, accelerations = np.array([0, 1 / 12, 1 / 4, 1 / 3, 1.0]), [0, 6, 6, 0, 0]
    fine = np.linspace(0.0, 0.5, 600_001)
    a = np.interp(fine, corners, accelerations)
    v = np.concatenate([[0.0], np.cumsum((a[1:] + a[:-1]) / 2 * np.diff(fine))])
    x = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(fine))])
    return np.interp(u, fine, x), np.interp(u, fine, v), np.interp(u, corners, accelerations)


def textbook(profile: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The whole motion; the second half mirrors the first half."""
    u = np.clip((t - BEGIN) / TIME, 0.0, 1.0)
    early, inside = u <= 0.5, (t > BEGIN) & (t < BEGIN + TIME)
    x, v, a = first_half(profile, np.where(early, u, 1 - u))
    return np.where(early, x, 1 - x), np.where(inside, v, 0.0), np.where(inside, np.where(early, a, -a), 0.0)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("profile", PROFILES)
def test_a_motion_from_rest_to_rest_follows_its_profile(profile: str, kind: str, kernel: str) -> None:
    r = moved(profile, kernel, kind)
    x, v, a = textbook(profile, r.time)
    twelfths = (r.time - BEGIN) / TIME * 12
    apart = np.abs(twelfths - np.round(twelfths)) > 1e-6  # at a knot, the values of both sides are correct
    assert r["joint.q[1]"] == pytest.approx(START + WAY * x, abs=1e-9)
    assert r["joint.qd[1]"] == pytest.approx(WAY / TIME * v, abs=1e-9)
    assert r["joint.qdd[1]"][apart] == pytest.approx((WAY / TIME**2 * a)[apart], abs=1e-8)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_drives_work_equals_the_work_of_friction(profile: str) -> None:
    """The motion is level and goes from rest to rest. The work of the drive therefore equals the work of the given friction
    torque."""
    r = moved(profile)
    assert r["energy.dissipated"][-1] == pytest.approx(0.5 * abs(WAY), rel=1e-6)
    assert abs(r["energy.residual"]).max() < 1e-6
    assert r["energy.kinetic"][[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_profile_that_began_before_the_start_continues() -> None:
    whole, begun = (moved("s_curve", begin=b) for b in (BEGIN, BEGIN - 0.5))
    shift = int(0.5 / 2e-3)
    assert begun["joint.q[1]"][:-shift] == pytest.approx(whole["joint.q[1]"][shift:], abs=1e-9)


def test_a_profile_needs_a_duration_and_excludes_other_kinds_of_drive() -> None:
    body, move = sm.Body(box=(0.1, 0.1, 0.1), mass=1.0), sm.Move(start=0.0, end=1.0, duration=1.0)

    def driven(drive: sm.Drive) -> sm.Scene:
        return sm.Scene({"b": body}, {"j": sm.Joint("revolute", "ground", "b", axis="z", drive=drive)}, "one")

    assert not problems(driven(sm.Drive(move=move)))
    assert problems(driven(sm.Drive(move=move, constant=sm.Constant(rate=1.0))))
    assert problems(driven(sm.Drive(move=sm.Move(start=0.0, end=1.0, duration=0.0))))
