"""Integration methods as data. A new method requires one file and one line in ``REGISTRY``. Schema, settings, help, statistics, C
runtime, FMUs and charts read this registry."""


from trunnion.basics.lazy_data_classes import dataclass
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
    """Methods among which ``auto`` chooses. The explicit method is ``loose`` above the tolerance ``loose_above``, otherwise
    ``tight``. ``stiff`` is for stiff motion, ``accumulating`` for events that accumulate."""

    loose: Tableau
    tight: Tableau
    loose_above: float
    stiff: Rosenbrock
    accumulating: Impulses


AUTO = Auto(RK5, RK8, 2e-4, RODAS5P, MOREAU)
METHODS = ("auto", *(m.name for m in REGISTRY))
"""Names of all methods. The index of a name is the method's number in C."""
if len(set(METHODS)) < len(METHODS):
    raise ValueError(f"two methods have the same name: {', '.join(METHODS)}")

__all__ = ["AUTO", "METHODS", "REGISTRY", "RK5", "RK8", "RODAS5P", "Impulses", "Method", "Rosenbrock", "Tableau"]
