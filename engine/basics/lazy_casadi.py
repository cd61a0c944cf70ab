"""CasADi, imported when the first expression is built.

The file of a law or contact element declares data and expressions. Every scene needs the data, but only kernels need the
expressions. The import of CasADi takes longer than the reading of most scenes, and only expressions need CasADi. Modules that a
scene reader imports therefore import ``ca`` from this module."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any


class _Deferred:
    """Stand-in for the module ``casadi``, which is imported when an attribute is first used."""

    def __getattr__(self, name: str) -> Any:
        import casadi

        value = getattr(casadi, name)
        setattr(self, name, value)
        return value


if TYPE_CHECKING:
    import casadi as ca
    from casadi import SX
else:
    ca = _Deferred()
    SX = Any
    """For annotations only; code that makes expressions uses ``ca.SX``."""

__all__ = ["SX", "ca"]
