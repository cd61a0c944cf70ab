"""``modes``: how a mechanism swings about a pose of rest: frequencies, damping, shapes; with its frictional pairs sliding freely or
held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine.basics.problems import SimulationError
from engine.questions.equilibrium import caught, coordinates, settled, started
from engine.questions.still import Still, ideal
from engine.scene import model as sm
from engine.scene.overrides import Given, scene_given
from engine.system.structure import state_coordinates

REST = 1e-7
"""Of the scale of rates squared: a pose whose accelerations are larger is no pose of rest."""
SLOW = 1e-7
"""Of the fastest mode: below it a mode does not swing at all (a freedom that nothing brings back)."""


@dataclass(frozen=True)
class Mode:
    """One mode. frequency, Hz (of the damped swing; 0 of one that creeps or runs away); damping: ratio to critical damping
    (negative: it grows); rate: real part of its eigenvalue, 1/s; shape: how far each freedom of the tree goes, the largest 1
    (complex where damping shifts them)."""

    frequency: float
    damping: float
    rate: float
    shape: dict[str, complex]


@dataclass(frozen=True)
class Modes:
    """All modes about a pose. q: coordinates of tree joints; held: joints whose friction holds them."""

    q: dict[str, tuple[float, ...]]
    modes: tuple[Mode, ...]
    held: tuple[str, ...]
    scene: sm.Scene

    def document(self) -> dict[str, Any]:
        """As plain data; shapes as [real, imaginary]."""
        each = [
            {"frequency": m.frequency, "damping": m.damping, "rate": m.rate}
            | {"shape": {n: [x.real, x.imag] for n, x in m.shape.items()}}
            for m in self.modes
        ]
        return {"q": self.q, "held": list(self.held), "modes": each}


def modes(scene: Given, stick: bool = False, at_start: bool = False, overrides: Mapping[str, Any] | None = None) -> Modes:
    """Modes about the pose that the mechanism comes to rest in, or (``at_start``) about its start, which must be one. Friction is
    left out; with ``stick`` the joints that rub are held where they are, as small swings that friction holds leave them. Drives
    are held, loads as at t = 0. SceneError for wrong input, SimulationError where there is no pose of rest."""
    loaded = scene_given(scene, overrides)
    bare = ideal(loaded)
    still = Still(bare) if at_start else settled(bare)
    scale = max(still.model.built.numbers.rate**2, 1e-300)
    if np.abs(still.accelerations()).max(initial=0.0) > REST * scale:
        raise SimulationError("the start is no pose of rest: leave out at_start, or place the joints where it rests")
    held = tuple(n for n, j in loaded.joints.items() if j.friction is not None) if stick else ()
    K, C, basis = still.reduced(_locked(still, held))
    n = len(K)
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [K, C]]) if n else np.zeros((0, 0))
    values, vectors = np.linalg.eig(whole) if n else (np.zeros(0), np.zeros((0, 0)))
    fastest = float(np.abs(values).max(initial=0.0))
    found: list[Mode] = []
    idle = 0  # a freedom that nothing brings back has the eigenvalue 0 twice
    for value, vector in sorted(zip(values, vectors.T, strict=True), key=lambda p: (abs(p[0].imag), -p[0].real)):
        creeps = abs(value) <= SLOW * fastest
        idle += creeps
        if value.imag >= 0.0 and not (creeps and idle % 2 == 0):
            found.append(_mode(value, basis @ vector[:n], still.freedoms, fastest))
    rest = caught(started(loaded, {k: np.array(v) for k, v in coordinates(still).items()}), still.scene)
    return Modes(coordinates(still), tuple(found), held, rest)


def _mode(value: complex, shape: np.ndarray, names: Sequence[str], fastest: float) -> Mode:
    largest = shape[int(np.argmax(np.abs(shape)))]
    shape = shape / largest
    size, still = abs(value), abs(value) <= SLOW * fastest
    told = {n: complex(x) for n, x in zip(names, shape, strict=True)}
    if still:
        return Mode(0.0, 0.0, 0.0, told)
    return Mode(abs(value.imag) / (2 * np.pi), -value.real / size, float(value.real), told)


def _locked(still: Still, held: Sequence[str]) -> list[np.ndarray]:
    """Rows over the rates that are zero where these joints hold."""
    rows, nv = [], still.system.nv
    for j in still.system.joints:
        if j.name not in held:
            continue
        if not j.cut:
            rows += [np.eye(nv)[j.v0 + i][None, :] for i in range(len(j.free))]
    cut = [j for j in still.system.cuts if j.name in held]
    if cut:
        raise SimulationError(f"{cut[0].name} is where a loop is cut: cut another joint of it (cut: true) to hold this one")
    return rows


def displaced(result: Modes, number: int, size: float = 0.3) -> sm.Scene:
    """The scene at the largest excursion of a mode, its largest freedom by ``size`` rad or of the scene's length."""
    still = Still(ideal(result.scene))
    shape = result.modes[number].shape
    way = np.array([shape[n].real for n in still.freedoms])
    largest = int(np.argmax(np.abs(way)))
    joint = next(j for j in still.system.tree if j.v0 <= largest < j.v0 + len(j.free))
    unit = 1.0 if joint.kind.turns(joint.free[largest - joint.v0]) else still.model.built.numbers.length
    for _ in range(20):
        still.move(size * unit * way / 20)
    y = still.block.y
    q = {j.name: np.array(y[j.q0 : j.q0 + len(state_coordinates(j))]) for j in still.system.tree}
    return started(result.scene, q)
