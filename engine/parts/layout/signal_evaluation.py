"""Values of single signals at one instant. The same primitives compute them as in a run."""

from __future__ import annotations

import ctypes

import numpy as np

from trunnion.parts.primitives.primitive_cache import libraries, loads_and_scalars
from trunnion.system.structure.bodies_and_joints import Signal
from trunnion.system.structure.external_value_layout import External
from trunnion.system.structure.parameter_table import Leaf, Param


def motion(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Position, rate and acceleration that a drive prescribes. p: values of the parameters. x: external values (``External``)."""
    if s.kind == "table":
        at = external.table(s.index)
        return x[at : at + 3]
    return _evaluated(s, True, p, x, 3, external)


def value(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> float:
    """Value of the signal of a load or effort. p, x: as in ``motion``."""
    if s.kind == "value":
        return _number(s.leaves[0], p)
    return float(x[external.table(s.index)] if s.kind == "table" else _evaluated(s, False, p, x, 1, external)[0])


def _number(leaf: Leaf, p: np.ndarray) -> float:
    return float(p[leaf.index]) if isinstance(leaf, Param) else float(leaf)


def _evaluated(s: Signal, moves: bool, p: np.ndarray, x: np.ndarray, size: int, external: External) -> np.ndarray:
    primitive = loads_and_scalars.signal(s.kind, moves)
    operands = {"numbers": np.array([_number(leaf, p) for leaf in s.leaves]), "x": np.ascontiguousarray(x), "out": np.zeros(size)}
    if s.kind == "through":
        operands["u"] = np.array([x[external.table(s.index)]])
    handed = (ctypes.c_void_p * len(operands))(*(operands[name].ctypes.data for name in primitive.operands[primitive.first]))
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)((primitive.first, libraries([primitive])[0]))(
        ctypes.addressof(handed), None
    )
    return operands["out"]
