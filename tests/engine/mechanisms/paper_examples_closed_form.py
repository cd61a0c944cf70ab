"""Example 8.1 as a system of one freedom and example 8.2 in closed form, derived by hand. The derivations use no recursion and no
contact code."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

G = 9.81


@dataclass(frozen=True)
class Pendulum:
    """Example 8.1 in its plane: a block 1 × 0.1 × 0.1 m on a ball. The angle is from the downward vertical. The friction torque
    is R |f| against the rotation, with R = r μ_e/√(1+μ_e²) (Adams: r μ_e) and μ_e = μ min(r |ω|/v_eps, 1)."""

    mu: float = 0.6
    v_eps: float = 1e-4
    adams: bool = False
    mass: float = 78.0
    arm: float = 0.5
    radius: float = 0.05

    @property
    def inertia(self) -> float:
        """Moment of inertia about the ball, kg m²."""
        return self.mass * ((1.0 + 0.01) / 12 + self.arm**2)

    def acceleration(self, theta: float, omega: float) -> float:
        """The root of I α = −m g l sin θ − sign(ω) R |f(α)|, by contraction (factor R m l/I = 0.04)."""
        m, x = self.mass, self.mu * min(self.radius * abs(omega) / self.v_eps, 1.0)
        R = self.radius * x / (1.0 if self.adams else np.sqrt(1 + x * x))
        along, alpha = m * (self.arm * omega**2 + G * np.cos(theta)), 0.0
        for _ in range(40):
            across = m * (self.arm * alpha + G * np.sin(theta))
            new = -(m * G * self.arm * np.sin(theta) + np.sign(omega) * R * np.hypot(across, along)) / self.inertia
            if abs(new - alpha) <= 1e-16 * (1 + abs(new)):
                break
            alpha = new
        return new

    def swing(self, until: float, theta: float = np.pi / 2, omega: float = 0.0):
        """(stops as rows of time and angle, function of time → angle). The kinks of the law are located as events."""

        def kink(t, y):
            return self.radius * abs(y[1]) - self.v_eps

        def stop(t, y):
            return y[1]

        kink.terminal = True
        t, y, pieces, stops = 0.0, np.array([theta, omega]), [], []
        while t < until:
            piece = solve_ivp(
                lambda t, y: [y[1], self.acceleration(*y)],
                (t, until),
                y,
                "DOP853",
                rtol=1e-12,
                atol=1e-14,
                events=(kink, stop),
                dense_output=True,
            )
            stops += [(s, piece.sol(s)[0]) for s in piece.t_events[1] if s > 1e-9]
            pieces.append((t, piece.sol))
            t, y = piece.t[-1], piece.y[:, -1]
            if t < until:  # the next piece starts after the kink, so the kink is not found again
                t, y = t + 1e-9, y + 1e-9 * np.array([y[1], self.acceleration(*y)])

        def angle(when: float) -> float:
            return next(sol for start, sol in reversed(pieces) if start <= when)(when)[0]

        return np.array(stops), angle


@cache
def pendulum_run(**how):
    """The result of ``Pendulum(**how).swing(10)``, computed once for each choice of numbers."""
    return Pendulum(**how).swing(10.0)


CRANK, ROD, WIDTH, DENSITY = 0.5, 1.0, 0.1, 7801.0
SLIDER_MASS, ROD_MASS = DENSITY * 0.2**3, DENSITY * ROD * WIDTH**2
ROD_INERTIA = ROD_MASS * (ROD**2 + WIDTH**2) / 12


@dataclass(frozen=True)
class Slider:
    """Example 8.2 at one crank angle: angles of the rod (from the slider), positions, and the load of the slider pin.

    force: of the rod on the slider, along the guide and vertical; torque: friction on the rod; normal_force: of each contact."""

    rod: float
    rod_rate: float
    x: float
    speed: float
    force: np.ndarray
    torque: float
    normal_force: float


def slider_crank(
    phi: float, rate: float = 10.0, mu: float = 0.3, radius: float = 0.01, v_eps: float = 1e-4, adams: bool = False
) -> Slider:
    """Plane statics of slider and rod in their prescribed motion. From the crank pin A to the slider pin B, the rod descends at the
    angle −psi."""
    s = CRANK / ROD * np.sin(phi)
    psi = np.arcsin(s)
    psi1 = CRANK / ROD * np.cos(phi) * rate / np.cos(psi)
    psi2 = (-s * rate**2 + s * psi1**2) / np.cos(psi)
    x = CRANK * np.cos(phi) + ROD * np.cos(psi)
    speed = -CRANK * np.sin(phi) * rate - ROD * np.sin(psi) * psi1
    accel = -CRANK * np.cos(phi) * rate**2 - ROD * (np.cos(psi) * psi1**2 + np.sin(psi) * psi2)
    u = np.array([np.cos(psi), -np.sin(psi)])  # direction from A to B
    v = np.array([np.sin(psi), np.cos(psi)])  # the direction u, turned by 90 degrees
    a_A = -CRANK * rate**2 * np.array([np.cos(phi), np.sin(phi)])
    alpha = -psi2  # the rod turns clockwise as psi grows
    a_C = a_A + ROD / 2 * (alpha * v - psi1**2 * u)
    fx = SLIDER_MASS * accel
    x_mu = mu * min(radius * abs(psi1) / v_eps, 1.0)
    share = radius * x_mu / (1.0 if adams else np.sqrt(1 + x_mu * x_mu))
    spin = -psi1  # rate of the rod relative to the slider

    def moment(fy: float) -> float:
        """Sum of moments about A on the rod: of −f at B, friction, weight and inertia."""
        friction = -np.sign(spin) * share * np.hypot(fx, fy)
        at_B = ROD * (u[0] * -fy - u[1] * -fx)
        load = np.array([0.0, -ROD_MASS * G]) - ROD_MASS * a_C
        return at_B + friction + ROD / 2 * (u[0] * load[1] - u[1] * load[0]) - ROD_INERTIA * alpha

    fy = brentq(moment, -1e6, 1e6, xtol=1e-13, rtol=8.9e-16)
    size = np.hypot(fx, fy)
    return Slider(-psi, -psi1, x, speed, np.array([fx, fy]), -np.sign(spin) * share * size, size / (2 * np.sqrt(1 + x_mu * x_mu)))
