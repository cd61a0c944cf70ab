"""Values of single signals at one instant, computed by the primitives that runs use."""

from __future__ import annotations

import ctypes

import numpy as np

from trunnion.parts.primitives.primitive_cache import libraries, signals_loads_energies
from trunnion.parts.primitives.primitive_keys import Primitive
from trunnion.scene.signals.time_formulas import computed
from trunnion.system.structure.bodies_and_joints import Signal
from trunnion.system.structure.external_value_layout import NOW, External
from trunnion.system.structure.parameter_table import Leaf, Param


def motion(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Position, rate and acceleration that a drive prescribes. p: values of the parameters. x: external values (``External``)."""
    if s.kind == "table":
        at = external.table(s.index)
        return x[at : at + 3]
    return _evaluated(s, True, p, x, 3, external)


def value(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> float:
    """Value of the signal of a load or effort. p, x: see ``motion``."""
    if s.kind == "value":
        return _number(s.leaves[0], p)
    return float(x[external.table(s.index)] if s.kind == "table" else _evaluated(s, False, p, x, 1, external)[0])


def _number(leaf: Leaf, p: np.ndarray) -> float:
    return float(p[leaf.index]) if isinstance(leaf, Param) else float(leaf)


def _evaluated(s: Signal, moves: bool, p: np.ndarray, x: np.ndarray, size: int, external: External) -> np.ndarray:
    numbers = np.array([_number(leaf, p) for leaf in s.leaves])
    if s.of is not None:
        return _call(signals_loads_energies.limit(), size, numbers=numbers, u=np.array([value(s.of, external, p, x)]))
    if s.kind == "expression":
        def operation(what: str, *given: np.ndarray) -> np.ndarray:
            return _call(signals_loads_energies.operation(what, size), size, **dict(zip("ab", given, strict=False)))

        now = np.array([x[NOW], 1.0, 0.0][:size])
        return computed(s.formula, lambda i: np.array([numbers[i], 0.0, 0.0][:size]), lambda: now, operation)
    more = {"u": np.array([x[external.table(s.index)]])} if s.kind == "through" else {}
    return _call(signals_loads_energies.signal(s.kind, moves), size, numbers=numbers, x=np.ascontiguousarray(x), **more)


def _call(primitive: Primitive, size: int, **operands: np.ndarray) -> np.ndarray:
    """The output (size) of a primitive."""
    operands["out"] = np.zeros(size)
    handed = (ctypes.c_void_p * len(operands))(*(operands[name].ctypes.data for name in primitive.operands[primitive.first]))
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)((primitive.first, libraries([primitive])[0]))(
        ctypes.addressof(handed), None
    )
    return operands["out"]
