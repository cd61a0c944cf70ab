"""Friction laws: friction ratio as a function of sliding speed. The paper's (104), viscous friction, and Coulomb friction during
sliding."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Law:
    """A friction law. kind: "regularized" (104), "viscous", or "coulomb" during sliding. ``scale`` multiplies the ratio, for the
    continuation from zero friction."""

    kind: str
    mu: float = 0.0
    v_eps: float = 1e-4
    viscosity: float = 0.0
    scale: float = 1.0

    def slope(self, speed: float) -> float:
        """mu_e / |v|: (104) is mu min(|v|/v_eps, 1) / |v|."""
        if self.kind == "viscous":
            return self.scale * self.viscosity
        if self.kind == "regularized":
            return self.scale * self.mu / max(speed, self.v_eps)
        if speed == 0.0:
            raise ArithmeticError("exact Coulomb friction at zero sliding speed is not a function")
        return self.scale * self.mu / speed

    def mu_e(self, speed: float) -> float:
        """Effective coefficient of friction at this sliding speed."""
        return self.slope(speed) * speed if speed else 0.0


def law_of(scene, friction, scale: float = 1.0) -> Law:
    """The law of a joint. The settings of the joint replace the scene's defaults."""
    kind = friction.law or scene.friction.law
    if kind not in ("regularized", "viscous", "coulomb"):
        raise NotImplementedError(f"the reference has no {kind} law")
    v_eps = friction.v_eps if friction.v_eps is not None else scene.friction.v_eps
    return Law(kind, friction.mu or 0.0, v_eps, friction.viscosity or 0.0, scale)


def is_adams(scene, friction) -> bool:
    """True if the normal force is computed by Adams' method."""
    return (friction.normal_force or scene.friction.normal_force) == "adams"
