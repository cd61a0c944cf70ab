"""Integration methods as data. A new method is a file and a line in ``REGISTRY``; schema, settings, help, statistics, the C
runtime, FMUs and charts follow."""

from dataclasses import dataclass

from trunnion.runtime.integrators.impulse_method import MOREAU, Impulses
from trunnion.runtime.integrators.rk5 import RK5
from trunnion.runtime.integrators.rk8 import RK8
from trunnion.runtime.integrators.rodas5p import RODAS5P
from trunnion.runtime.integrators.rosenbrock_coefficients import Rosenbrock
from trunnion.runtime.integrators.runge_kutta_tableau import Tableau

Method = Tableau | Rosenbrock | Impulses
REGISTRY: tuple[Method, ...] = (
    RK5,
    RK8,
    RODAS5P,
    MOREAU,
)


@dataclass(frozen=True)
class Auto:
    """Methods that ``auto`` chooses from: explicit ones above and below ``loose_above``, one for stiff motion, one for
    accumulating events."""

    loose: Tableau
    tight: Tableau
    loose_above: float
    stiff: Rosenbrock
    accumulating: Impulses


AUTO = Auto(RK5, RK8, 2e-4, RODAS5P, MOREAU)
METHODS = ("auto", *(m.name for m in REGISTRY))
"""Names of all methods. A method's index is its number in C."""
if len(set(METHODS)) < len(METHODS):
    raise ValueError(f"two methods have one name: {', '.join(METHODS)}")

__all__ = ["AUTO", "METHODS", "REGISTRY", "RK5", "RK8", "RODAS5P", "Impulses", "Method", "Rosenbrock", "Tableau"]
