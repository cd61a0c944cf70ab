"""Results of the reference for a scene at one state: accelerations, reactions, friction, contacts, energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.contact_and_friction.complement_equation_roots import all_roots, connected_root
from tests.reference.contact_and_friction.contact_roots import Contact
from tests.reference.contact_and_friction.joint_friction import Rubbing, reaction
from tests.reference.mechanics.kinematics import State, forward
from tests.reference.mechanics.loads_and_devices import kinetic_energy
from tests.reference.mechanics.newton_euler_equations import Equations


@dataclass(frozen=True)
class Result:
    """Results for a scene at a state. Names and signs follow notation.md; one entry per joint or body.

    qdd             every joint, loop joints too
    acceleration    of each body's mass centre; ``angular`` its angular acceleration (world)
    reaction        (force, torque): total, on the inboard part, at the joint centre, inboard joint frame
    friction        on the inboard part along each freedom (joints with friction)
    contacts        of joints with friction; normals in the inboard joint frame
    drive_effort    {freedom: effort on the outboard part}
    rank, rows      of all constraint rows and driven freedoms; redundancy = rows - rank; freedom = degrees of freedom
    loose           {joint: 6 x redundancy}: directions of its reaction (force, torque) that redundancy leaves open
    inconsistency   worst violation of an acceleration constraint (0 when the rows can be met)
    kinetic, stored {kind: energy}, power {kind: W}: what changes kinetic + sum(stored)
    """

    qdd: dict[str, np.ndarray]
    acceleration: dict[str, np.ndarray]
    angular: dict[str, np.ndarray]
    reaction: dict[str, tuple[np.ndarray, np.ndarray]]
    friction: dict[str, np.ndarray]
    contacts: dict[str, list[Contact]]
    drive_effort: dict[str, dict[int, float]]
    eta: np.ndarray
    rank: int
    rows: int
    freedom: int
    loose: dict[str, np.ndarray]
    inconsistency: float
    kinetic: float
    stored: dict[str, float]
    power: dict[str, float]

    @property
    def redundancy(self) -> int:
        """Number of constraint rows that depend linearly on other constraint rows."""
        return self.rows - self.rank

    @property
    def not_unique(self) -> set[str]:
        """Joints whose reactions the redundancy does not determine."""
        return {n for n, w in self.loose.items() if w.size and np.max(np.abs(w)) > 1e-6}

    @property
    def potential(self) -> float:
        """Potential energy of all kinds together, J."""
        return float(sum(self.stored.values()))


def solve(state: State, eta: np.ndarray | None = None) -> Result:
    """Solve a state. eta: friction values that are used instead of the solution for friction."""
    eq = Equations(state)
    return result_at(eq, connected_root(eq) if eta is None else np.asarray(eta, float))


def solve_scene(scene, q, qd=None, t: float = 0.0) -> Result:
    """Solve a scene at given joint coordinates and rates."""
    return solve(forward(scene, q, qd, t))


def every_root(state: State, starts: int = 30, seed: int = 0, spread: float = 3.0) -> list[Result]:
    """Results for all roots of the complement equations that are found from many starts; ``spread`` in units of force x radius."""
    eq = Equations(state)
    return [result_at(eq, eta) for eta in all_roots(eq, starts, seed, spread)]


def result_at(eq: Equations, eta: np.ndarray) -> Result:
    """The result at these friction values. The solution is affine in them."""
    x, state = np.r_[1.0, eta], eq.state
    u = (eq.u @ x).reshape(-1, 6)
    names = list(state.scene.joints)
    rubbing = dict.fromkeys(n for n, _ in eq.eta)
    contacts = {n: Rubbing(state, n).friction(eq.press(n) @ x, eq.devices(n) @ x)[1] for n in rubbing}
    friction = {n: eq.friction_columns(n) @ x for n in rubbing}
    drives = {n: {k: float(lam @ x) for k, lam in eq.drive_effort(n).items()} for n in names}
    power = dict(eq.applied.power)
    power["friction"] = -float(sum(friction[n] @ state.qd[n] for n in rubbing))
    power["drives"] = float(sum(e * state.qd[n][k] for n, d in drives.items() for k, e in d.items()))
    return Result(
        qdd={n: eq.accelerations(n) @ x for n in names},
        acceleration={b: u[i, :3] for b, i in eq.index.items()},
        angular={b: u[i, 3:] for b, i in eq.index.items()},
        reaction={n: reaction(state, n, eq.total(n) @ x) for n in names},
        friction=friction,
        contacts=contacts,
        drive_effort={n: d for n, d in drives.items() if d},
        eta=eta,
        rank=eq.rank,
        rows=len(eq.rows),
        freedom=6 * len(eq.index) - eq.rank,
        loose={n: loose(eq, n) for n in names},
        inconsistency=eq.inconsistency,
        kinetic=kinetic_energy(state),
        stored=dict(eq.applied.stored),
        power=power,
    )


def loose(eq: Equations, name: str) -> np.ndarray:
    """Directions of a joint's reaction that redundancy leaves open, as columns [force; torque] in the terms of ``reaction``."""
    columns = [np.concatenate(reaction(eq.state, name, w)) for w in eq.loose(name).T]
    return np.array(columns).reshape(-1, 6).T
