"""``modes``: vibrations about a pose of rest (frequencies, damping, shapes), either without friction or with the frictional joints
held."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.equilibrium_pose import coordinates, find_rest, start_at
from trunnion.analysis.mechanics.friction_rest_ranges import copy_latches
from trunnion.analysis.mechanics.mechanism_at_rest import MechanismAtRest, open_contacts, remove_friction
from trunnion.analysis.static_bounds.kernel_function_calls import Probe
from trunnion.analysis.static_bounds.start_pose_statics import hold_drives, start_at_rest
from trunnion.basics.errors import SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import Given, scene_given
from trunnion.simulation.run import Model
from trunnion.system.structure.friction_joint_indices import elements

REST = 1e-7
"""A pose counts as a pose of rest if its largest acceleration, relative to the square of the scene's rate, is below this value."""
SLOW = 1e-7
"""A mode whose eigenvalue, relative to the largest eigenvalue, is below this value has no stiffness and does not vibrate."""


@dataclass(frozen=True)
class VibrationMode:
    """One vibration mode.

    Attributes:
        frequency: frequency of the damped vibration, Hz; 0 for a mode that does not oscillate.
        damping: ratio to critical damping; negative for a growing mode.
        rate: real part of the eigenvalue, 1/s.
        shape: complex amplitude of each freedom of the tree; the largest amplitude is 1.
    """

    frequency: float
    damping: float
    rate: float
    shape: dict[str, complex]


@dataclass(frozen=True)
class VibrationModes:
    """All modes about a pose.

    Attributes:
        q: coordinates of tree joints, rad or m, by joint.
        modes: the modes.
        held: joints that friction holds.
        scene: the scene at the pose.
    """

    q: dict[str, tuple[float, ...]]
    modes: tuple[VibrationMode, ...]
    held: tuple[str, ...]
    scene: sm.Scene

    def document(self) -> dict[str, Any]:
        """The data of this object as plain lists and numbers. Each amplitude of a shape becomes [real, imaginary]."""
        each = [
            {"frequency": m.frequency, "damping": m.damping, "rate": m.rate}
            | {"shape": {n: [x.real, x.imag] for n, x in m.shape.items()}}
            for m in self.modes
        ]
        return {"q": self.q, "held": list(self.held), "modes": each}


def modes(
    scene: Given, stick: bool = False, at_start: bool = False, overrides: Mapping[str, Any] | None = None
) -> VibrationModes:
    """Vibration modes about a pose of rest without friction. Drives are held; loads are those of t = 0. Contacts that begin and end
    stay as they are in this pose, which is valid for vibrations too small to open or close them.

    Args:
        scene: as for ``simulate``.
        stick: whether joints with friction are held, which is valid for vibrations too small to cause slip.
        at_start: whether the pose is the start of the scene, which must be a pose of rest. Otherwise the pose is that in which
            the mechanism comes to rest.
        overrides: changes of the scene, {path: value}.

    Raises:
        SceneError: for wrong input.
        SimulationError: if no pose of rest exists.
    """
    loaded = scene_given(scene, overrides)
    bare = remove_friction(loaded)
    still = MechanismAtRest(bare) if at_start else find_rest(bare)
    scale = max(still.model.built.numbers.rate**2, 1e-300)
    if np.abs(still.accelerations()).max(initial=0.0) > REST * scale:
        raise SimulationError("the start is not a pose of rest: omit at_start, or set the start coordinates of a pose of rest")
    q = coordinates(still.system, still.pose())
    pose = copy_latches(open_contacts(start_at(loaded, q), still.open_contacts()), still.scene)
    held, locked = _hold_pairs(pose, still.open_contacts()) if stick else ((), [])
    K, C, basis = still.reduced(locked)
    n = len(K)
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [K, C]]) if n else np.zeros((0, 0))
    values, vectors = np.linalg.eig(whole) if n else (np.zeros(0), np.zeros((0, 0)))
    fastest = float(np.abs(values).max(initial=0.0))
    found: list[VibrationMode] = []
    idle = 0  # zero eigenvalues so far; a freedom without stiffness has two
    for value, vector in sorted(zip(values, vectors.T, strict=True), key=lambda p: (abs(p[0].imag), -p[0].real)):
        creeps = abs(value) <= SLOW * fastest
        idle += creeps
        if value.imag >= 0.0 and not (creeps and idle % 2 == 0):
            found.append(_mode(value, basis @ vector[:n], still.freedoms, fastest))
    return VibrationModes(q, tuple(found), held, pose)


def _mode(value: complex, shape: np.ndarray, names: Sequence[str], fastest: float) -> VibrationMode:
    largest = shape[int(np.argmax(np.abs(shape)))]
    told = {n: complex(x) for n, x in zip(names, shape / largest, strict=True)}
    if abs(value) <= SLOW * fastest:
        return VibrationMode(0.0, 0.0, 0.0, told)
    return VibrationMode(abs(value.imag) / (2 * np.pi), -value.real / abs(value), float(value.real), told)


def _hold_pairs(pose: sm.Scene, opened: Collection[str]) -> tuple[tuple[str, ...], list[np.ndarray]]:
    """(joints, rows): the joints that friction holds in ``pose``, and the rates of their pairs as linear functions of the tree's
    rates (rows of nv numbers). opened: joints whose contacts are open."""
    model = Model(hold_drives(pose)[0], ())
    start_at_rest(model)
    probe = Probe(model.block)
    rates = np.array([probe.rates(e)[0] for e in np.eye(model.system.nv)]).reshape(model.system.nv, -1).T
    held = [e for e in elements(model.system) if e.joint.name not in opened]
    rows = [e.rate0 + e.eta.index(k) for e in held for pair in e.friction.sliders for k in pair.eta]
    return tuple(e.joint.name for e in held), list(rates[rows])


def displaced(result: VibrationModes, number: int, size: float = 0.3) -> sm.Scene:
    """The scene at the largest excursion of a mode. size: excursion of the freedom with the largest amplitude, rad or relative to
    the scene's length."""
    still = MechanismAtRest(remove_friction(result.scene))
    shape = result.modes[number].shape
    way = np.array([shape[n].real for n in still.freedoms])
    largest = int(np.argmax(np.abs(way)))
    joint = next(j for j in still.system.tree if j.v0 <= largest < j.v0 + len(j.free))
    unit = 1.0 if joint.kind.turns(joint.free[largest - joint.v0]) else still.model.built.numbers.length
    for _ in range(20):
        still.move(size * unit * way / 20)
    return start_at(result.scene, coordinates(still.system, still.pose()))
