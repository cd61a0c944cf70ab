"""The paper's examples as scenes with start coordinates: 8.1 (F1, F4), 8.2 (F2) and 8.3 (F3) (theory, "Reference numbers")."""

from __future__ import annotations

import numpy as np

from trunnion.scene.data_classes import scene as sm

STEEL = 7800.0


def ball_pendulum(mu=0.6, radius=0.05, law="regularized", v_eps=1e-4, normal_force="exact", pin="outboard"):
    """8.1: block 1 x .1 x .1 m on a ball at the centre of its end face. Body x points from the ball to the other end. Gravity
    acts along +x, so the block hangs at q = 1 and swings in the xz plane."""
    rub = sm.Friction(mu=mu, radius=radius, law=law, v_eps=v_eps, normal_force=normal_force)
    joint = sm.Joint(type="spherical", inboard="ground", outboard="block.end", pin=pin, friction=rub)
    block = sm.Body(box=(1.0, 0.1, 0.1), density=STEEL, points={"end": (-0.5, 0.0, 0.0)})
    return sm.Scene(bodies={"block": block}, joints={"ball": joint}, gravity=(9.81, 0.0, 0.0))


def pendulum_start(angle: float, rate: float) -> tuple[dict, dict]:
    """Coordinates of 8.1 at an angle from the downward vertical (radians, about -y of the joint frame)."""
    q = [np.cos(angle / 2), 0.0, -np.sin(angle / 2), 0.0]
    return {"ball": q}, {"ball": [0.0, -rate, 0.0]}


def slider_crank(mu=0.3, law="coulomb", v_eps=1e-4, normal_force="exact", rate=10.0):
    """8.2: crank .5, rod 1, slider a .2 cube, density 7801; R-S-R-P; plane xy, guide along x, gravity along -y."""
    rub = sm.Friction(mu=mu, radius=0.01, half_length=0.05, law=law, v_eps=v_eps, normal_force=normal_force)
    bodies = {
        "crank": sm.Body(box=(0.5, 0.1, 0.1), density=7801.0, points={"a": (-0.25, 0, 0), "b": (0.25, 0, 0)}),
        "rod": sm.Body(box=(1.0, 0.1, 0.1), density=7801.0, points={"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}),
        "slider": sm.Body(box=(0.2, 0.2, 0.2), density=7801.0),
    }
    drive = sm.Drive(constant=sm.Constant(rate=rate))
    joints = {
        "pivot": sm.Joint(type="revolute", inboard="ground", outboard="crank.a", axis="z", reference="x", drive=drive),
        "crank_pin": sm.Joint(type="spherical", inboard="crank.b", outboard="rod.a"),
        "pin": sm.Joint(type="revolute", inboard="slider", outboard="rod.b", axis="z", reference="x", friction=rub),
        "guide": sm.Joint(type="prismatic", inboard="ground", outboard="slider", axis="x"),
    }
    return sm.Scene(bodies=bodies, joints=joints, gravity=(0.0, -9.81, 0.0))


def slider_crank_state(t: float, rate: float = 10.0) -> tuple[dict, dict]:
    """Exact coordinates of 8.2 at time t (spanning tree: pivot, pin, guide)."""
    phi = rate * t
    psi = np.arcsin(0.5 * np.sin(phi))  # rod falls towards the slider: rod angle -psi
    dpsi = 0.5 * np.cos(phi) * rate / np.cos(psi)
    x = 0.5 * np.cos(phi) + np.cos(psi)
    dx = -0.5 * np.sin(phi) * rate - np.sin(psi) * dpsi
    return {"pivot": phi, "guide": x, "pin": -psi}, {"pivot": rate, "guide": dx, "pin": -dpsi}


def double_pendulum(c=0.3, mu=0.3, v_eps=1e-4, shaft_pin="outboard", law="regularized"):
    """8.3: guide along world y, gravity -z, blocks start along x; universal axis 1 (upper link) along the guide."""
    shaft = sm.Friction(mu=mu, radius=0.05, half_length=c, law=law, v_eps=v_eps)
    cross = sm.Friction(mu=mu, radius=0.01, half_length=0.05, law=law, v_eps=v_eps)
    block = sm.Body(box=(1.0, 0.1, 0.1), density=STEEL, points={"a": (-0.5, 0, 0), "b": (0.5, 0, 0)})
    joints = {
        "shaft": sm.Joint("cylindrical", "ground", "upper.a", axis="y", pin=shaft_pin, friction=shaft),
        "cross": sm.Joint("universal", "upper.b", "lower.a", axis="y", reference="z", friction=cross),
    }
    return sm.Scene(bodies={"upper": block, "lower": block}, joints=joints)
