"""Evaluate a scene at one instant: every column at given coordinates and rates, without stepping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from engine.basics.problems import SimulationError
from engine.simulation import block as bl
from engine.simulation.run import Model
from engine.system.structure import state_coordinates


def evaluate(model: Model, q: Mapping[str, Sequence[float]], qd: Mapping[str, Sequence[float]], t: float = 0.0) -> dict[str, float]:
    """Columns by name, in SI units, at time t, s, without stepping. q, qd: coordinates and rates of tree joints by name, for
    each joint all of them (those of driven freedoms are ignored); a joint that is not named is as the scene starts it, and cut
    joints follow from the tree. The state must close the loops: it is used as it is. ValueError for joints or numbers that are
    not there, SimulationError when the state has no solution."""
    block, system = model.block, model.system
    _known(model, q, qd)
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


def _known(model: Model, q: Mapping[str, Sequence[float]], qd: Mapping[str, Sequence[float]]) -> None:
    """ValueError for joints that are not in the tree, and for too many or too few numbers."""
    kinds = {j.name: j.kind for j in model.system.tree}
    cut = {j.name for j in model.system.cuts}
    for what, given in (("coordinates", q), ("rates", qd)):
        for name, values in given.items():
            if name in cut:
                continue  # a cut joint's coordinates follow from the tree
            if name not in kinds:
                raise ValueError(f"{what} of {name!r}: the joints of the tree are {', '.join(kinds)}")
            wanted = kinds[name].nq if what == "coordinates" else kinds[name].nv
            if len(np.atleast_1d(values)) != wanted:
                raise ValueError(f"{name} has {wanted} {what}, not {len(np.atleast_1d(values))}")
