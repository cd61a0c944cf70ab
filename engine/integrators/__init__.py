"""Integrators as tables. A new method is a new file and one line here; the C code follows from the table."""

from engine.integrators.rk5 import RK5
from engine.integrators.rk8 import RK8
from engine.integrators.rodas5p import RODAS5P

EXPLICIT = (RK5, RK8)
STIFF = RODAS5P

METHODS = ("auto", *(m.name for m in EXPLICIT), "rosenbrock", "moreau")
"""Names of all methods; a method's place is its number in C."""

__all__ = ["EXPLICIT", "METHODS", "RK5", "RK8", "RODAS5P", "STIFF"]
