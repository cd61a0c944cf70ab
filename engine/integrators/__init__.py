"""Integrators as tables. A new explicit pair is a new file and one line here; the C code follows from the table."""

from engine.integrators.rk5 import RK5
from engine.integrators.rk8 import RK8

EXPLICIT = (RK5, RK8)

__all__ = ["EXPLICIT", "RK5", "RK8"]
