"""Evaluates a scene at one instant: every column at given coordinates and rates, without stepping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from trunnion.basics.errors import SimulationError
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.structure.bodies_and_joints import state_coordinates


def evaluate(model: Model, q: Mapping[str, Sequence[float]], qd: Mapping[str, Sequence[float]], t: float = 0.0) -> dict[str, float]:
    """All columns at one state, {name: value in SI units}, without stepping.

    Args:
        model: the compiled scene.
        q: for each tree joint in the mapping, all its coordinates, rad or m. Coordinates of driven freedoms are ignored. Joints
            that are not in the mapping keep their start values. The state must close the loops, because the function does not
            assemble it.
        qd: for each tree joint in the mapping, all its rates, rad/s or m/s.
        t: time, s.

    Raises:
        ValueError: for unknown joints and wrong counts of numbers.
        SimulationError: if the state has no solution.
    """
    block, system = model.block, model.system
    _check_names(model, q, qd)
    n = model.built.numbers
    block.configure(bl.Settings(rtol=1e-9))
    block.y[:] = 0.0
    block.y[: len(n.q) + len(n.v)] = np.concatenate([n.q, n.v])
    for j in system.tree:
        states = state_coordinates(j)
        if j.name in q:
            block.y[j.q0 : j.q0 + len(states)] = np.asarray(q[j.name], float)[list(states)]
        if j.name in qd:
            at = system.nq + j.v0
            block.y[at : at + len(j.free)] = np.asarray(qd[j.name], float)[list(j.free)]
    row = np.zeros(block.width)
    status = model.begin(bl.Settings(rtol=1e-9), t, t + 1.0, 1.0, row)
    if status != bl.OK:
        raise SimulationError(f"the state cannot be evaluated (runtime status {status})")
    return dict(zip(["time", *(c.name for c in model.columns)], row.tolist(), strict=True))


def _check_names(model: Model, q: Mapping[str, Sequence[float]], qd: Mapping[str, Sequence[float]]) -> None:
    """Raise ValueError for unknown joints and for wrong numbers of values."""
    kinds = {j.name: j.kind for j in model.system.tree}
    cut = {j.name for j in model.system.cuts}
    for what, given in (("coordinates", q), ("rates", qd)):
        for name, values in given.items():
            if name in cut:
                continue  # the tree joints determine the values of a cut joint
            if name not in kinds:
                raise ValueError(f"{what} of {name!r}: the joints of the tree are {', '.join(kinds)}")
            wanted = kinds[name].nq if what == "coordinates" else kinds[name].nv
            if len(np.atleast_1d(values)) != wanted:
                raise ValueError(f"{name} has {wanted} {what}, not {len(np.atleast_1d(values))}")
