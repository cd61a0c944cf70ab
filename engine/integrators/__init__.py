"""Integrators as data. A new method is a new file and a line in ``REGISTRY``: schema, settings, help, statistics, the C runtime,
FMUs and charts follow from it."""

from dataclasses import dataclass

from engine.integrators.impulses import MOREAU, Impulses
from engine.integrators.rk5 import RK5
from engine.integrators.rk8 import RK8
from engine.integrators.rodas5p import RODAS5P
from engine.integrators.rosenbrock import Rosenbrock
from engine.integrators.tableau import Tableau

Method = Tableau | Rosenbrock | Impulses
REGISTRY: tuple[Method, ...] = (
    RK5,
    RK8,
    RODAS5P,
    MOREAU,
)


@dataclass(frozen=True)
class Auto:
    """The methods that ``auto`` chooses from: explicit ones for tolerances above ``loose_above`` and for the others, one for
    stiff motions, and one for events that accumulate."""

    loose: Tableau
    tight: Tableau
    loose_above: float
    stiff: Rosenbrock
    accumulating: Impulses


AUTO = Auto(RK5, RK8, 2e-4, RODAS5P, MOREAU)
METHODS = ("auto", *(m.name for m in REGISTRY))
"""Names of all methods; a method's place is its number in C."""
if len(set(METHODS)) < len(METHODS):
    raise ValueError(f"two methods have one name: {', '.join(METHODS)}")

__all__ = ["AUTO", "METHODS", "REGISTRY", "RK5", "RK8", "RODAS5P", "Impulses", "Method", "Rosenbrock", "Tableau"]
