"""The LuGre law: bristles carry friction, and their deflection is a state (Canudas de Wit, Olsson, Åström, Lischinsky 1995).

z (m) is the deflection, one for each velocity component; |v| is the norm over all components:
  ż = v − σ0 |v|/g z,   k = σ0 z + σ1 ż + σ2 v,   g = μ + (μ_static − μ) exp(−(v/v_stribeck)²)
σ0 bristle_stiffness (1/m), σ1 bristle_damping (s/m), σ2 viscosity (s/m) are ratios to the normal force.
If the scene gives no μ_static, g = μ. |σ0 z| never exceeds μ_static. In steady sliding k = g v/|v| + σ2 v.

The integrated state is the friction ratio σ0 z. The magnitude of this ratio is about μ for any stiffness, so that one absolute
tolerance suits all stiffnesses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.number_declarations import POSITIVE, Number
from trunnion.elements.friction.friction_law import TINY, Law, Rest
from trunnion.elements.friction.law_parameters import MU, MU_STATIC, OPPOSES, V_STRIBECK, VISCOSITY


class LuGre(Law):
    """Friction as a function of velocity and state. Below break-away a pair behaves like a spring that creeps slowly.

    |v| has a kink at v = 0. With a single rate, the kink is never inside a step, because the sign of the rate is fixed during a
    step. With several components, error control handles the kink."""

    name = "lugre"
    numbers = (
        MU, replace(MU_STATIC, needed=False), replace(V_STRIBECK, needed=False, needed_with="mu_static"),
        Number("bristle_stiffness", "1/m", "friction coefficient per deflection of the bristles", POSITIVE, '"1e5 1/m"',
               symbol="σ0"),
        Number("bristle_damping", "s/m", "friction coefficient per rate of deflection of the bristles", OPPOSES, "0.2 s/m",
               needed=False, symbol="σ1"),
        replace(VISCOSITY, needed=False),
    )  # fmt: skip
    rest = Rest.BRISTLES
    dry = "coulomb"
    steps = False
    state_scale = "bristle_stiffness"
    formula, at_rest = "σ0 z + σ1 ż + σ2 v, ż = v − σ0 |v|/g z", "the same: a function of state"

    def level(self, speed2: SX) -> SX:
        """g, the ratio in steady sliding without the viscous part."""
        n = self.value
        if "mu_static" not in n:
            return n["mu"]
        return n["mu"] + (n["mu_static"] - n["mu"]) * ca.exp(-speed2 / n["v_stribeck"] ** 2)

    def drift(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """Rates of σ0 z, 1/s, one for each component."""
        speed2 = sum((x * x for x in v), ca.SX(0))
        pull = (v[0] * self.frozen[0] if len(v) == 1 else ca.sqrt(speed2 + TINY)) / self.level(speed2)
        return [self.value["bristle_stiffness"] * (x - pull * s) for x, s in zip(v, state, strict=True)]

    def carried(self, v: Sequence[SX], state: Sequence[SX]) -> list[SX]:
        """k = σ0 z + σ1 ż + σ2 v, one for each component."""
        n, out = self.value, list(state)
        if "bristle_damping" in n:
            each = n["bristle_damping"] / n["bristle_stiffness"]
            out = [k + each * rate for k, rate in zip(out, self.drift(v, state), strict=True)]
        if "viscosity" in n:
            out = [k + n["viscosity"] * x for k, x in zip(out, v, strict=True)]
        return out
