"""Separations of a driven slider-crank's guide, compared with hand-calculated zeros of its normal force."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from tests.default_case_selection import sampled
from trunnion.scene.data_classes import scene as sm

GRAVITY, HALF_LENGTH, HALF_HEIGHT, TURNS = 9.81, 0.05, 0.02, 6
METHODS = ["auto", "rk5", "rk8", "rosenbrock"]


class SliderCrank:
    """Crank `a` driven at the rate `w`, rod `b` with its centre at `c`, and a slider. The guide has friction; the pins have no
    friction."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.a = rng.uniform(0.05, 0.15)
        self.b = self.a * rng.uniform(2.0, 5.0)
        self.c = self.b * rng.uniform(0.2, 0.8)
        self.rod, self.slider = rng.uniform(0.1, 1.0, 2)
        self.inertia = self.rod * self.b**2 * rng.uniform(0.03, 0.1)
        self.w = rng.uniform(2.0, 20.0)
        self.mu = rng.uniform(0.05, 0.3)

    def scene(self) -> sm.Scene:
        a, b, inertia = self.a, self.b, (self.inertia,) * 3
        friction = sm.Friction(mu=self.mu, half_width=0.02, half_height=HALF_HEIGHT, half_length=HALF_LENGTH)
        return sm.Scene(
            gravity=(0.0, -GRAVITY, 0.0),
            bodies={
                "crank": sm.Body(mass=1.0, inertia=(0.01,) * 3, position=(0.0, 0.0, 0.0)),
                "rod": sm.Body(mass=self.rod, inertia=inertia, position=(a + self.c, 0.0, 0.0)),
                "slider": sm.Body(mass=self.slider, inertia=(0.001,) * 3, position=(a + b, 0.0, 0.0)),
            },
            joints={
                "main": sm.Joint(type="revolute", axis="z", inboard="ground", outboard="crank", at=(0.0, 0.0, 0.0),
                                 drive=sm.Drive(constant=sm.Constant(rate=self.w))),
                "pin": sm.Joint(type="revolute", axis="z", inboard="crank", outboard="rod", at=(a, 0.0, 0.0)),
                "gudgeon": sm.Joint(type="revolute", axis="z", inboard="rod", outboard="slider", at=(a + b, 0.0, 0.0)),
                "guide": sm.Joint(type="prismatic", axis="x", inboard="ground", outboard="slider", at=(a + b, 0.0, 0.0),
                                  friction=friction),
            },
            simulation=sm.Simulation(until=TURNS * 2.0 * math.pi / self.w),
        )  # fmt: skip

    def lacking_moment(self, t: float) -> float:
        """Moment about the crank pin that the rod's balance lacks if the guide does not press. This moment is zero where the
        contact separates.

        Without pressure the guide has no friction, so the rod exerts (m a, m g) on the slider."""
        a, b, c, w = self.a, self.b, self.c, self.w
        crank = np.array([math.cos(w * t), math.sin(w * t)])
        sine = -a * crank[1] / b
        cosine = math.sqrt(1.0 - sine**2)
        rate = -a * w * crank[0] / (b * cosine)
        turning = (a * w**2 * crank[1] / b + rate**2 * sine) / cosine
        along, across = np.array([cosine, sine]), np.array([-sine, cosine])
        pin = -a * w**2 * crank
        of_rod = pin + c * (turning * across - rate**2 * along)
        of_slider = pin + b * (turning * across - rate**2 * along)
        force = self.slider * np.array([of_slider[0], GRAVITY])

        def moment(arm: float, f: np.ndarray) -> float:
            return float(arm * (along[0] * f[1] - along[1] * f[0]))

        weight = np.array([0.0, -self.rod * GRAVITY])
        return moment(c, self.rod * of_rod - weight) + self.inertia * turning + moment(b, force)

    def unloaded_end(self, t: float) -> float:
        """Distance, m, that is zero where the inner end of the guide is unloaded.

        At this position, the line of the slider's force meets the line of its friction, half a height off the axis."""
        angle = self.w * t
        x = self.a * math.cos(angle) + math.sqrt(self.b**2 - (self.a * math.sin(angle)) ** 2)
        inward = 1.0 if math.sin(angle) > 0.0 else -1.0
        return x - (self.a + self.b) + HALF_LENGTH + self.mu * HALF_HEIGHT * inward

    def separations(self) -> np.ndarray:
        grid = np.linspace(0.0, TURNS * 2.0 * math.pi / self.w, 6000 + 1)
        found = []
        for f in (self.lacking_moment, self.unloaded_end):
            values = np.array([f(t) for t in grid])
            found += [brentq(f, grid[i], grid[i + 1], xtol=1e-14) for i in np.flatnonzero(values[1:] * values[:-1] < 0.0)]
        return np.array(sorted(found))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(12), 4))
def test_a_contact_separates_wherever_its_force_passes_zero(seed: int) -> None:
    crank = SliderCrank(seed)
    expected = crank.separations()
    for method in METHODS:
        for rtol in (1e-4, 1e-6, 1e-8):
            result = trunnion.simulate(crank.scene(), method=method, rtol=rtol)
            found = np.array(sorted(e.time for e in result.events if e.kind == "separation"))
            assert len(found) == len(expected), (method, rtol)
            # Secants end when they move by less than rtol of the step. The state is within rtol of the motion.
            assert np.all(np.abs(found - expected) * crank.w <= 10.0 * rtol), (method, rtol)
