"""CasADi, loaded at the first expression.

Laws and contact elements declare data (read with every scene) and expressions (for kernels) in one file. Only expressions need
CasADi, and its import takes longer than reading most scenes. Modules that a scene reader imports take ``ca`` from here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any


class _Deferred:
    """Stands for module ``casadi``, and loads it at the first attribute."""

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
