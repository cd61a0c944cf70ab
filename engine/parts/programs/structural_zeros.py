"""Structural zeros of loop equations: rows that need no multiplier, and absent couplings by friction. The maps with all
rows are evaluated at random states. An entry that vanishes at every state is a structural zero."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from trunnion.parts.layout.multiplier_maps_layout import Maps
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.loop_joints import rows_of, rubbing_on_loops

ROUND_OFF = 1e-12
"""Largest round-off of a sum that is zero in exact arithmetic. Terms of order one cancel in such a sum, if axes are oblique."""
TRIALS = 3
"""Number of random states. At a single state, an entry may vanish by chance."""


class StructureProbe:
    """Evaluates the maps of a scene with all rows, at random states. table: record of the scene's kernel. call: calls a function of
    this kernel."""

    def __init__(self, system: System, table: Any, maps: Maps, call: Callable[..., None]):
        self.system, self.table, self.maps, self.call = system, table, maps, call
        self.made = [self._at(trial) for trial in range(TRIALS)]

    def _at(self, trial: int) -> tuple[np.ndarray, np.ndarray]:
        """Maps, and ∂(change of the scaled reactions by friction)/∂N of all joints, concatenated."""
        rng, t, external = np.random.default_rng(trial), self.table, self.system.external
        p, x = rng.uniform(0.5, 1.5, t.np + 1), rng.uniform(0.5, 1.5, t.nx + 1)
        y = rng.normal(size=t.nq + t.nv + t.nb + 1)
        quaternions = (ctypes.c_int * (t.nquat + 1)).from_address(t.quat)[: t.nquat]
        for at in quaternions:
            y[at : at + 4] /= np.linalg.norm(y[at : at + 4])
        for k in range(len(self.system.sliders)):
            x[external.mode(k)], x[external.mode(k) + 4] = 1.0, 0.0
        c, w, dy, power = np.zeros(t.nc + 1), np.zeros(t.nw + 1), np.zeros(t.nq + t.nv + t.nb + 1), np.zeros(t.npowers + 1)
        maps, more, turns = np.zeros(t.nmaps + 1), np.zeros(t.nmore + 1), np.zeros(t.ndmore + 1)
        self.call("prepare", p, c)
        self.call("stage1", x, y, c, w, maps, dy, power)
        if t.nmore:
            N, rates, u = (rng.normal(size=n + 1) for n in (t.nn, t.nrates, t.neta))
            self.call("pressed", N, rates, u, x, c, more, turns)
        return maps, turns

    def active(self) -> list[int]:
        """Rows that are not structurally zero."""
        a, e = self.maps.active, self.maps.ne
        filled = np.zeros(a, bool)
        for maps, _ in self.made:
            S = self.maps.matrix.largest(maps) if self.maps.matrix else np.abs(maps[: a * a].reshape(a, a)).max(0, initial=0.0)
            Se = maps[self.maps.at("Se") : self.maps.at("Se") + a * e].reshape(e, a)
            g0 = maps[self.maps.at("g0") : self.maps.at("g0") + a]
            row = np.concatenate([S[None], np.abs(Se), np.abs(g0)[None]]).max(0)
            filled |= row > ROUND_OFF
        return [int(k) for k in np.flatnonzero(filled)]

    def coupled(self, active: list[int]) -> bool:
        """Whether friction couples the multipliers of inactive rows to the other multipliers. The motion does not determine the
        multipliers of inactive rows (``recursion.redundant_loop_reactions``)."""
        inactive = [k for k in range(self.maps.active) if k not in active]
        return bool(inactive) and any(self._couples(maps, turns, inactive) for maps, turns in self.made)

    def _couples(self, maps: np.ndarray, turns: np.ndarray, inactive: list[int]) -> bool:
        nk, columns = self.maps.nkappa, 1 + self.maps.columns
        kappa = maps[self.maps.at("kappa") : self.maps.at("kappa") + nk * columns].reshape(columns, nk).T.copy()
        N = maps[self.maps.at("N") : self.maps.at("N") + self.maps.nn * columns].reshape(columns, self.maps.nn).T
        free = kappa[:, [1 + k for k in inactive]].copy()
        at = 0
        for e, first, count in rubbing_on_loops(self.system):
            n = len(e.needs)
            kappa[first : first + count] += turns[at : at + count * n].reshape(n, count).T @ N[e.n0 : e.n0 + n]
            at += count * (n + e.joint.kind.nv)
        others = [k for k in range(columns) if k - 1 not in inactive]
        assert nk == sum(n for _, n in rows_of(self.system))
        sizes = np.linalg.norm(free, axis=0)[:, None] * np.linalg.norm(kappa[:, others], axis=0)
        return bool((np.abs(free.T @ kappa[:, others]) > ROUND_OFF * sizes.max()).any())
