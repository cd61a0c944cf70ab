"""CasADi, loaded when the first expression is made.

Laws and contact elements say in one file both what they are (numbers and names, asked for whenever a scene is read) and what they
compute (expressions, asked for when a kernel is built). Loading CasADi costs more time than reading most scenes, and only the
second needs it. Import ``ca`` from here in every module that reading a scene imports.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any


class _Deferred:
    """Stands for the module ``casadi``, which it loads when an attribute is first asked for; attributes found are kept."""

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
    """For annotations; expressions are made with ``ca.SX``."""

__all__ = ["SX", "ca"]
