"""Blocks at a state, and their right-hand side as a function of state and time."""

from __future__ import annotations

import numpy as np

from tests.reference.scenes.random_scenes import Case
from trunnion.scene import Scene
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.run_settings import KERNELS
from trunnion.system.structure.bodies_and_joints import state_coordinates

ENERGY = ("energy.*",)
"""Columns that need every integral. With them a block has all that right-hand sides can have, and little other code to compile."""


def block_at(case: Case, outputs: tuple[str, ...] = ENERGY, kernel: str = KERNELS[0]) -> bl.Block:
    """The engine's block at the case's state and time, with its friction modes chosen for that state."""
    model = Model(case.scene, outputs, kernel)
    block, system = model.block, model.system
    block.configure(bl.Settings(rtol=1e-9))
    for j in system.tree:
        states = list(state_coordinates(j))
        block.y[j.q0 : j.q0 + len(states)] = np.asarray(case.q[j.name], float)[states]
        block.y[system.nq + j.v0 : system.nq + j.v0 + len(j.free)] = np.asarray(case.qd[j.name], float)[list(j.free)]
    assert model.begin(bl.Settings(rtol=1e-9), case.t, case.t + 1.0, 1.0, np.zeros(block.width)) == bl.OK
    return model.block


def block_after(scene: Scene, t: float, rtol: float = 1e-10, kernel: str = KERNELS[0]) -> bl.Block:
    """The scene's block after a run from its start to t, s."""
    model = Model(scene, ENERGY, kernel)
    block = model.block
    settings = bl.Settings(rtol=rtol)
    block.configure(settings)
    assert block.assemble() == 1
    assert model.begin(settings, 0.0, t, t, np.zeros(block.width)) == bl.OK
    block, rows = model.block, np.empty((10, model.block.width))
    while (status := block.advance(t, 10000, rows)[0]) != bl.DONE:
        assert status in (bl.MORE, bl.ROWS_FULL, bl.EVENTS_FULL, bl.NEED_JACOBIAN)
        if status == bl.NEED_JACOBIAN:
            block.attach_jacobian()
    return block


def rate(block: bl.Block, y: np.ndarray | None = None, t: float | None = None) -> np.ndarray:
    """d/dt of [states, integrals] at (t, y). Friction modes stay as they are. If a time is given, modes are decided as at the start
    of a run."""
    keep, n = block.y.copy(), block.ny + block.kernel.sizes["works"]
    if y is not None:
        block.y[: block.ny] = y[: block.ny]
    if t is not None:
        assert block.start(t, t + 1.0, 1.0, np.zeros(block.width)) == bl.OK
    out, z = np.zeros(n + 4), np.zeros(block.kernel.sizes["active"] + block.kernel.sizes["neta"] + 1)
    assert block.lib.tr_evaluate(block.at, out.ctypes.data, z.ctypes.data)
    block.y[:] = keep
    return out[:n]


def differences(block: bl.Block) -> np.ndarray:
    """Matrix d rate/dy by differences of fourth order; column i belongs to y[i]."""
    y, columns = block.y[: block.ny].copy(), []
    for i in range(block.ny):
        h = 1e-5 * max(1.0, abs(y[i]))
        f = [rate(block, y + k * h * np.eye(block.ny)[i])[: block.ny] for k in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h))
    return np.array(columns).T


def time_differences(block: bl.Block, t: float) -> np.ndarray:
    """Vector d rate/dt by differences of fourth order."""
    h = 1e-4
    f = [rate(block, t=t + k * h)[: block.ny] for k in (-2, -1, 1, 2)]
    rate(block, t=t)
    return (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h)
