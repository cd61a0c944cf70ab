"""Calls single functions of a kernel on separate arrays.

At rest the results are affine functions of the multipliers and loads. Therefore the value at zero, and one finite difference for
each multiplier and load, determine the functions.
"""

from __future__ import annotations

import ctypes

import numpy as np

from trunnion.runtime.abi.kernel_records import KERNEL
from trunnion.simulation.runtime_interface.simulation_block import Block

PAD = 8
"""Number of extra doubles at the end of each array, because generated code may write whole SIMD vectors."""


class Probe:
    """A kernel, evaluated at the pose of a simulation block with all rates zero."""

    def __init__(self, block: Block):
        self.sizes, self.block = block.kernel.sizes, block
        self.table = KERNEL.ctype.from_address(block.kernel.address("kernel"))
        s = self.sizes
        self.x, self.y = _padded(block.x), _padded(block.y)
        self.y[s["nq"] :] = 0.0
        self.parameters = block.parameters.copy()
        self.c, self.w, self.maps = (np.zeros(s[n] + PAD) for n in ("nc", "nw", "nmaps"))
        self.dy = np.zeros(s["nq"] + s["nv"] + s["nb"] + PAD)
        self.power = np.zeros(s["npowers"] + PAD)
        self.unknowns = s["active"] + s["neta"]
        self.prepare(self.parameters)

    def _call(self, name: str, *places: np.ndarray | int | None) -> None:
        address = ctypes.cast(getattr(self.table, name), ctypes.c_void_p).value or 0
        function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(places))(address)
        function(*[p.ctypes.data if isinstance(p, np.ndarray) else p for p in places])

    def prepare(self, parameters: np.ndarray) -> None:
        """Compute the constants and stage 1 of the kernel with these parameters."""
        self._call("prepare", self.table.scene, _padded(parameters), self.c)
        self._call("stage1", self.x, self.y, self.c, self.w, self.maps, self.dy, self.power)

    def accelerations(self, z: np.ndarray) -> np.ndarray:
        """q̈ (nv) for the multipliers z = [λ; η]."""
        s = self.sizes
        if self.unknowns:
            self._call("stage2", self.x, self.y, self.c, self.w, _padded(z), self.dy, self.power)
        return self.dy[s["nq"] : s["nq"] + s["nv"]].copy()

    def reactions(self, z: np.ndarray) -> np.ndarray:
        """The reaction components of contacts (nn), N or N m, for the multipliers z = [λ; η]."""
        s = self.sizes
        a, e, n = s["active"], s["neta"], s["nn"]
        at = s["nS"] + a * e + a
        constant, by_lambda = self.maps[at : at + n], self.maps[at + n : at + n + n * a].reshape(a, n).T
        by_eta = self.maps[at + n + n * a : at + n + n * a + n * e].reshape(e, n).T
        return constant + by_lambda @ z[:a] + by_eta @ z[a:]

    def rates(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(rates of the freedoms of frictional joints, rates of the loop constraints) for the free rates v (nv)."""
        s = self.sizes
        a, e, n, y = s["active"], s["neta"], s["nn"], self.y.copy()
        y[s["nq"] : s["nq"] + s["nv"]] = v
        maps, residuals = np.zeros_like(self.maps), np.zeros(2 * s["rows"] + PAD)
        self._call("stage1", self.x, y, self.c, np.zeros_like(self.w), maps, np.zeros_like(self.dy), self.power)
        self._call("closure", self.x, y, self.c[s["c_closure"] :], residuals)
        at = s["nS"] + a * e + a + n * (1 + a + e)
        return maps[at : at + s["nrates"]].copy(), residuals[s["rows"] : 2 * s["rows"]].copy()

    def capacities(self, N: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """For every pair held with η: capacity, friction, and the load that friction cannot carry, in N at the surface (pairs ×
        3)."""
        out = np.zeros(3 * self.sizes["nsliders"] + PAD)
        self._call("held_alone", _padded(N), _padded(eta), self.x, self.c[self.sizes["c_held"] :], out)
        return out[: 3 * self.sizes["nsliders"]].reshape(-1, 3)

    def kinetic(self, v: np.ndarray) -> float:
        """Kinetic energy for the free rates v (nv), J; 0 if the kernel (of a large tree) has no kinetic energy."""
        y, out = self.y.copy(), np.zeros(PAD)
        y[self.sizes["nq"] : self.sizes["nq"] + self.sizes["nv"]] = v
        self._call("energy", self.x, y, self.c[self.sizes["c_energy"] :], out)
        return float(out[0])


def _padded(values: np.ndarray) -> np.ndarray:
    out = np.zeros(len(values) + PAD)
    out[: len(values)] = values
    return out
