"""Fast arithmetic of CasADi symbols.

CasADi's Python operators test each operand for every kind of matrix, which takes seven times as long as the operation itself.
``SX.binary`` makes an expression without these tests. A model has about 30,000 expressions; with ``SX.binary``, the build of a
model takes a quarter less time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock

import casadi as ca

SX = ca.SX
KNOWN = (SX, float, int)
BINARY = {"add": ca.OP_ADD, "sub": ca.OP_SUB, "mul": ca.OP_MUL, "truediv": ca.OP_DIV}


def _operators() -> Iterator[tuple[str, Callable]]:
    binary = SX.binary

    def forward(op: int, general: Callable) -> Callable:
        return lambda x, y: binary(op, x, y) if type(y) in KNOWN else general(x, y)

    def backward(op: int, general: Callable) -> Callable:
        return lambda x, y: binary(op, y, x) if type(y) in KNOWN else general(x, y)

    for name, op in BINARY.items():
        yield f"__{name}__", forward(op, getattr(SX, f"__{name}__"))
        yield f"__r{name}__", backward(op, getattr(SX, f"__r{name}__"))


DIRECT = dict(_operators())
"""Fast operators by method name. ``direct_operators`` sets them as attributes of SX, where they hide the inherited operators."""
_LOCK = Lock()
_inside = 0


@contextmanager
def direct_operators() -> Iterator[None]:
    """Within the block, the operators +, −, × and / of an SX with an SX, float or int call ``SX.binary``. For other operands, these
    operators work as before."""
    global _inside
    with _LOCK:
        _inside += 1
        if _inside == 1:
            for name, operator in DIRECT.items():
                setattr(SX, name, operator)
    try:
        yield
    finally:
        with _LOCK:
            _inside -= 1
            if _inside == 0:
                for name in DIRECT:
                    delattr(SX, name)
