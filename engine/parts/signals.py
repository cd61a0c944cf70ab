"""Values of single signals at an instant, by the parts that evaluate them in a run."""

from __future__ import annotations

import ctypes

import numpy as np

from engine.parts.store import libraries, small
from engine.system.external import External
from engine.system.leaves import Leaf, Param
from engine.system.structure import Signal


def motion(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Position, rate and acceleration that a drive prescribes. p: values of parameters; x: external values (``External``)."""
    if s.kind == "table":
        at = external.table(s.index)
        return x[at : at + 3]
    return _evaluated(s, True, p, x, 3, external)


def value(s: Signal, external: External, p: np.ndarray, x: np.ndarray) -> float:
    """Value of the signal of a load or effort, likewise."""
    if s.kind == "value":
        return _number(s.leaves[0], p)
    return float(x[external.table(s.index)] if s.kind == "table" else _evaluated(s, False, p, x, 1, external)[0])


def _number(leaf: Leaf, p: np.ndarray) -> float:
    return float(p[leaf.index]) if isinstance(leaf, Param) else float(leaf)


def _evaluated(s: Signal, moves: bool, p: np.ndarray, x: np.ndarray, size: int, external: External) -> np.ndarray:
    part = small.signal(s.kind, moves)
    places = {"numbers": np.array([_number(leaf, p) for leaf in s.leaves]), "x": np.ascontiguousarray(x), "out": np.zeros(size)}
    if s.kind == "through":
        places["u"] = np.array([x[external.table(s.index)]])
    handed = (ctypes.c_void_p * len(places))(*(places[name].ctypes.data for name in part.places[part.first]))
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)((part.first, libraries([part])[0]))(ctypes.addressof(handed), None)
    return places["out"]
