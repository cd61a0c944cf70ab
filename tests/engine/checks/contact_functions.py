"""The engine's contact forms as functions of numbers, for many random states at a time. Modes are chosen as at the start of a
run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from tests.reference.contact_and_friction import contact_roots as ct
from tests.reference.contact_and_friction.friction_laws import Law as ReferenceLaw
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import Wrench
from trunnion.elements.contact.contact_element import COMPONENTS
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.system.structure.external_value_layout import MODE

NUMBERS = {
    "journal": ("radius", "half_length", "thrust_radius"),
    "shaft": ("radius", "half_length"),
    "ball": ("radius",),
    "cross": ("radius[1]", "radius[2]", "half_length[1]", "half_length[2]"),
    "sleeve": ("half_width", "half_height", "half_length"),
}
RATES = {"journal": 1, "shaft": 2, "ball": 3, "cross": 2, "sleeve": 1}
PAIRS = {"journal": 1, "shaft": 1, "ball": 1, "cross": 2, "sleeve": 1}
LAW_NUMBERS = {"regularized": ("mu", "v_eps"), "viscous": ("viscosity",), "coulomb": ("mu",),
               "stribeck": ("mu", "mu_static", "v_stribeck", "viscosity")}
ELEMENTS = tuple(NUMBERS)


@lru_cache(maxsize=64)
def functions(element: str, law: str, adams: bool, pin: int) -> tuple[ca.Function, ca.Function, ca.Function]:
    """(speeds, friction, contacts) as functions of (wrench, rates, numbers, modes). Each column is a state."""
    e = CONTACTS[element]
    wrench, rates = ca.SX.sym("w", 6), ca.SX.sym("r", RATES[element])
    names = (*NUMBERS[element], *LAW_NUMBERS[law])
    numbers, mode = ca.SX.sym("g", len(names)), ca.SX.sym("m", MODE * PAIRS[element])
    g = {n: numbers[i] for i, n in enumerate(names)}
    w = Wrench({n: wrench[i] for i, n in enumerate(COMPONENTS)}, pin)
    r = [rates[i] for i in range(RATES[element])]

    def laws():
        return [LAWS[law](g, [mode[MODE * i + k] for k in range(MODE)]) for i in range(PAIRS[element])]

    arguments = [wrench, rates, numbers, mode]
    kinks = [one.kink for one in laws()]
    speeds = ca.vertcat(*e.speeds(w, r, laws(), g, adams), *kinks)
    friction = ca.vertcat(*e.friction(w, r, laws(), g, adams))
    touching = ca.vertcat(*[x for c in e.contacts(w, r, laws(), g, [ca.SX(0)] * len(r)) for x in (c.force, *c.vector)])
    full = ca.jacobian(friction, wrench)
    return (
        ca.Function("speeds", arguments, [speeds]),
        ca.Function("friction", arguments, [friction, ca.vec(full)]),
        ca.Function("contacts", arguments, [touching]),
    )


@dataclass(frozen=True)
class States:
    """Random states of one element. Each column is a state."""

    element: str
    law: str
    wrench: np.ndarray
    rates: np.ndarray
    numbers: np.ndarray

    def number(self, name: str) -> np.ndarray:
        """A number of the element or of the law, for each state."""
        return self.numbers[(*NUMBERS[self.element], *LAW_NUMBERS[self.law]).index(name)]


def random_states(element: str, law: str, n: int, seed: int = 0) -> States:
    """Forces and moments of every direction, with sizes over five decades; slow and fast sliding in both directions."""
    rng = np.random.default_rng([seed, *map(ord, element + law)])
    size = 10 ** rng.uniform(-2, 3, n)
    wrench = np.vstack([rng.normal(size=(3, n)) * size, rng.normal(size=(3, n)) * size * 0.2])
    names = (*NUMBERS[element], *LAW_NUMBERS[law])
    ranges = {
        "mu": (0.05, 0.9),
        "mu_static": (0.9, 1.2),
        "v_eps": (1e-4, 0.2),
        "v_stribeck": (1e-3, 0.3),
        "viscosity": (0.01, 3.0),
        "radius": (0.005, 0.08),
        "half_length": (0.05, 0.4),
        "thrust_radius": (0.0, 0.03),
        "half_width": (0.01, 0.1),
        "half_height": (0.01, 0.1),
    }
    numbers = np.array([rng.uniform(*ranges[k.partition("[")[0]], n) for k in names])
    rates = rng.normal(size=(RATES[element], n)) * 10 ** rng.uniform(-2, 1, n)
    return States(element, law, wrench, rates, numbers)


def modes(s: States, adams: bool, pin: int) -> np.ndarray:
    """Flags and frozen directions, set as the runtime sets them at the start of a run."""
    n, pairs = s.wrench.shape[1], PAIRS[s.element]
    mode = np.zeros((MODE * pairs, n))
    for i in range(pairs):
        if RATES[s.element] == pairs:
            mode[MODE * i + 1] = np.where(s.rates[i] < 0, -1.0, 1.0)
        else:
            mode[MODE * i + 1 : MODE * i + 1 + RATES[s.element]] = s.rates
    speeds = functions(s.element, s.law, adams, pin)[0](s.wrench, s.rates, s.numbers, mode).full()
    for i in range(pairs):
        mode[MODE * i] = LAWS[s.law].sets or np.abs(speeds[i]) > speeds[pairs + i]
    return mode


def evaluated(s: States, adams: bool, pin: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(friction along the freedoms, its derivative with respect to the wrench, contacts: force and vector each); columns are
    states."""
    mode = modes(s, adams, pin)
    _, friction, contacts = functions(s.element, s.law, adams, pin)
    eta, derivative = (x.full() for x in friction(s.wrench, s.rates, s.numbers, mode))
    return eta, derivative, contacts(s.wrench, s.rates, s.numbers, mode).full()


def reference(s: States, i: int, adams: bool, pin: int) -> tuple[np.ndarray, list[ct.Contact]]:
    """Friction on the inboard part and contacts of state i from the numerical roots (pin frame)."""
    w, r, g = s.wrench[:, i], pin * s.rates[:, i], {k: float(s.number(k)[i]) for k in (*NUMBERS[s.element], *LAW_NUMBERS[s.law])}
    law = ReferenceLaw(s.law, g.get("mu", 0.0), g.get("v_eps", 1e-4), g.get("viscosity", 0.0))
    if s.element == "cross":
        return _universal(w, s.rates[:, i], g, law, adams, pin)
    fc, mc = w[:3], w[3:]
    if s.element == "ball":
        out = ct.ball(fc, r, g["radius"], law)
        torque = ct.adams_ball(fc, r, g["radius"], law) if adams else out.torque
        return pin * torque, out.contacts
    if s.element == "sleeve":
        out = ct.sleeve(fc, mc, r[0], g["half_width"], g["half_height"], g["half_length"], law)
        force = law.slope(abs(r[0])) * r[0] * np.linalg.norm(fc[1:]) if adams else out.force
        return pin * np.array([force]), out.contacts
    sdot, omega = (r[0], r[1]) if s.element == "shaft" else (0.0, r[0])
    out = ct.journal(fc, mc, omega, sdot, g["radius"], g["half_length"], law, g.get("thrust_radius", 0.0))
    if adams:
        out = ct.adams_journal(out, fc, omega, sdot, g["radius"], law, axial=s.element == "journal")
    return pin * np.array([out.force, out.torque] if s.element == "shaft" else [out.torque]), out.contacts


def _universal(w, rates, g, law, adams, pin) -> tuple[np.ndarray, list[ct.Contact]]:
    """Two journals on a massless cross. The opposite wrench loads the second journal."""
    friction, seen = np.zeros(2), []
    for k, turn in enumerate(([0, 1, 2], [1, 2, 0])):
        sign = pin * (1.0 if k == 0 else -1.0)
        fc, mc, omega = sign * w[turn], sign * w[[3 + t for t in turn]], sign * rates[k]
        out = ct.journal(fc, mc, omega, 0.0, g[f"radius[{k + 1}]"], g[f"half_length[{k + 1}]"], law)
        if adams:
            out = ct.adams_journal(out, fc, omega, 0.0, g[f"radius[{k + 1}]"], law, axial=True)
        friction[k] = sign * out.torque
        back = np.eye(3)[:, turn]
        seen += [ct.Contact(c.normal_force, back @ c.normal, c.angle) for c in out.contacts]
    return friction, seen
