"""``linearize``: the matrices of the linear system near a state of a scene's motion, from exact derivatives."""

from __future__ import annotations

import ctypes
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.basics.errors import SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import Status
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Amount, Amounts, Names
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import OK, Settings
from trunnion.system.signals.signal_tables import ExternalInput
from trunnion.system.structure.bodies_and_joints import state_coordinates
from trunnion.system.structure.external_value_layout import TABLE


@dataclass(frozen=True)
class Linearization:
    """The linear system δẋ = A δx + B δu, δy = C δx + D δu, in SI units.

    The states are not independent if they contain the four coordinates of a quaternion or if the mechanism has closed loops.

    Attributes:
        time: time, s.
        states: names of the n states: coordinates of the tree joints, their rates, then friction states of bristles.
        inputs: names of the m inputs.
        outputs: names of the p outputs.
        A: state matrix (n × n).
        B: input matrix (n × m).
        C: output matrix (p × n).
        D: feedthrough matrix (p × m).
        x: states (n).
        u: inputs (m).
        y: outputs (p).
        dx: ẋ (n).
    """

    time: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    x: np.ndarray
    u: np.ndarray
    y: np.ndarray
    dx: np.ndarray

    def save(self, file: str | Path) -> Path:
        """Write matrices and names to a file: in NumPy's format for the suffix .npz, as JSON for any other suffix. Returns the
        path."""
        path = Path(file)
        data = {k: getattr(self, k) for k in self.__dataclass_fields__}
        if path.suffix == ".npz":
            np.savez(path, **data)
        else:
            plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in data.items()}
            path.write_text(json.dumps(plain, indent=1) + "\n", encoding="utf-8")
        return path


def linearize(
    scene: Given,
    at: Amount = 0.0,
    outputs: Names | None = None,
    overrides: Mapping[str, Any] | None = None,
    rtol: Amount | None = None,
) -> Linearization:
    """Run the scene up to an instant and linearise its equations at this state.

    Integrals, counts and friction modes have no derivative: their rows are zero. For an input that prescribes a motion, the
    columns of B and D refer to the acceleration with which the motion follows the input.

    Args:
        scene: as for ``simulate``.
        at: the instant, s.
        outputs: names or patterns of columns; default: the outputs of the scene.
        overrides: changes of the scene, {path: value}.
        rtol: relative tolerance of the run.

    Returns:
        The matrices, with the names of their rows and columns.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the run ends before the instant.
    """
    loaded, read = scene_given(scene, overrides), Amounts()
    time, tolerance = read.time(at, "at"), read.number(rtol or loaded.simulation.rtol, "rtol")
    read.end()
    model = Model(loaded, outputs)
    _run_to(model, time, Settings(rtol=tolerance, method=loaded.simulation.method))
    return _Point(model).linearization()


def _run_to(model: Model, at: float, settings: Settings) -> None:
    """Step the model's block to time ``at``, s."""
    if at > 0.0:
        outcome = run(model, at, at, settings).outcome
        if not outcome.ok:
            raise SimulationError(f"the run does not reach t = {at:g} s: {outcome}")
        return
    model.block.configure(settings)
    closed, row = model.block.assemble(), np.zeros(model.block.width)
    status = model.begin(settings, 0.0, 1.0, 1.0, row) if closed == 1 else Status.FAIL_CLOSURE
    if status:
        raise SimulationError(f"the scene cannot start (runtime status {status})")


class _Point:
    """The block at the point of linearisation, with the compiled unit for directional derivatives."""

    def __init__(self, model: Model):
        self.model, self.block = model, model.block
        self.block.attach_jacobian()
        self.unit = model.kernel.linear(model.columns)

    def along(self, inputs: np.ndarray, dy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(δẋ, δcolumns) for given changes: ``dy`` of the states, and ``inputs`` of the input signals."""
        rates, columns = np.zeros(self.block.ny + 1), np.zeros(len(self.model.columns) + 1)
        inputs, dy = np.append(inputs, 0.0), np.append(dy, 0.0)
        places = [a.ctypes.data_as(ctypes.c_void_p) for a in (inputs, dy, rates, columns)]
        if not self.block.lib.tr_directional(self.block.at, self.unit, *places):
            raise SimulationError("there are no derivatives at this state")
        return rates[:-1], columns[:-1]

    def linearization(self) -> Linearization:
        """The linear system, from unit changes of every state and every input."""
        block, system = self.block, self.model.system
        ny, names = block.ny, system.inputs
        row = np.zeros(block.width)
        if block.row(row) != OK:
            raise SimulationError("an output at this state is too large for a number: check masses and loads")
        x, (dx, _) = block.y[:ny].copy(), block.evaluate()
        states = [self.along(np.zeros(TABLE * len(names)), e) for e in np.eye(ny)]
        inputs = [self.along(s, np.zeros(ny)) for s in self._input_seeds()]
        A, C = (np.array([s[i] for s in states]).T.reshape(n, ny) for i, n in ((0, ny), (1, len(row) - 1)))
        B, D = (np.array([s[i] for s in inputs]).T.reshape(n, len(names)) for i, n in ((0, ny), (1, len(row) - 1)))
        u = np.array(self.model.built.numbers.inputs)
        columns = tuple(c.name for c in self.model.columns)
        states_ = state_names(self.model)
        return Linearization(block.time, states_, tuple(names), columns, A, B, C, D, x, u, row[1:], dx.copy())

    def _input_seeds(self) -> np.ndarray:
        """For each input (row), the effect of a unit change on the input's signal. The unit change concerns the signal's value or,
        for a prescribed motion, the acceleration."""
        count, tables = len(self.model.system.inputs), self.model.built.numbers.tables
        out = np.zeros((count, TABLE * count))
        for i, given in enumerate(tables[:count]):
            assert isinstance(given, ExternalInput)
            out[i, TABLE * i + (2 if given.tracked else 0)] = given.bandwidth**2 if given.tracked else 1.0
        return out


def state_names(model: Model) -> tuple[str, ...]:
    """Names of the states: coordinates of the tree joints, rates, and friction ratios of bristles (σ0 z)."""
    tree = model.system.tree
    q = [f"{j.name}.q[{i + 1}]" for j in tree for i in state_coordinates(j)]
    b = [f"{j.name}.friction.bristle_ratio[{k + 1}]" for j in model.system.frictional for k in range(j.kind.nv)
         if j.friction and j.friction.bristles]
    return (*q, *(f"{j.name}.qd[{k + 1}]" for j in tree for k in j.free), *b)
