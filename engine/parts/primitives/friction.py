"""Primitives of joint friction: laws, residuals, static friction capacity, bristle rates."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca

from trunnion.elements.contact import REGISTRY
from trunnion.elements.joints import REGISTRY as REGISTRY_OF_JOINTS
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import FrictionKey, Primitive
from trunnion.parts.primitives.primitive_symbols import PrimitiveSymbols
from trunnion.parts.primitives.signals_loads_energies import pin_components
from trunnion.recursion.complement_equation_terms import by_loads, laws, numbers, wrench
from trunnion.recursion.loop_contact_springs import complete_wrench, friction_change
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import Fit, FrictionElement
from trunnion.system.structure.external_value_layout import MODE
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.parameter_table import Param


class FrictionSymbols(PrimitiveSymbols):
    """Symbols of a joint's friction: its numbers, the modes of its pairs, the states of its law."""

    def __init__(self, which: FrictionKey, more: int = 0):
        f = _friction(which)
        super().__init__(len(f.numbers) + more)
        self.modes = SX.sym("modes", MODE * len(f.sliders))
        self.eta_of = [e for s in f.sliders for e in s.eta] if f.bristles else []
        self.b = SX.sym("b", len(self.eta_of))
        self.system = self  # type: ignore[assignment]

    @property
    def bristles(self) -> tuple[int, ...]:
        """Indices of the friction multipliers that have a bristle state. (This object takes the place of a ``System``, which has an
        attribute of this name.)"""
        return tuple(self.eta_of)

    def mode(self, slider: int) -> list[SX]:
        return [self.modes[MODE * slider + i] for i in range(MODE)]


class _Evaluation:
    """Symbols of a joint's friction, reaction N and rates. Laws, numbers and wrench are expressions of these symbols. inputs:
    numbers, N, rates, modes, states. arguments: the arguments of a contact element's functions."""

    def __init__(self, which: FrictionKey, velocity: str = "r", soft: bool = False):
        sym, self.N, rates = FrictionSymbols(which, int(soft)), SX.sym("N", len(which.needs)), SX.sym(velocity, which.joint.kind.nv)
        self.symbols, self.element = sym, element_of(which, which.needs)
        self.laws, self.numbers, self.wrench = laws(sym, self.element), numbers(sym, self.element), wrench(self.element, self.N)
        self.rates = [rates[k] for k in range(rates.numel())]
        self.arguments = self.wrench, self.rates, self.laws, self.numbers, self.element.friction.adams
        self.inputs = {"numbers": sym.p, "N": self.N, velocity: rates, "modes": sym.modes, "b": sym.b}

    def by_loads(self, values: SX) -> SX:
        """Derivative of ``values`` with respect to N, column-major."""
        return ca.vec(by_loads(values, self.element, self.N))


@cache
def law(which: FrictionKey, alone: bool) -> Primitive:
    """Primitive of a friction law. Inputs: ``_Evaluation.inputs``. Outputs: η in the order of the freedoms, ∂η/∂N (unless
    ``alone``), and a ``tr_sliding`` per pair."""
    at = _Evaluation(which)
    contact, ls = at.element.contact, at.laws
    values = ca.vertcat(*contact.friction(*at.arguments))
    sliding: list[SX] = []
    cones = contact.cone(*at.arguments) if contact.cone and all(x.sets or x.kinks for x in ls) else [SX(1)] * len(ls)
    for speed, x, cone in zip(contact.speeds(*at.arguments), ls, cones, strict=True):
        sliding += [speed, SX(x.kink), SX(cone)]
    outs = {"eta": values} | ({} if alone else {"dN": at.by_loads(values)}) | {"sliding": sliding}
    return expression_primitive(f"{which.name}_law{'_alone' if alone else ''}", at.inputs, outs)


@cache
def residual(which: FrictionKey) -> Primitive:
    """Primitive of the residuals of η. Inputs: ``_Evaluation.inputs``, η, accelerations of the freedoms. Output: the residuals. The
    residual of a sliding pair is η − law(N, rates). The residual of a pair at rest is the acceleration."""
    at, nv = _Evaluation(which), which.joint.kind.nv
    e, eta, acc = at.element, SX.sym("eta", nv), SX.sym("acc", nv)
    out = [eta[k] - value for k, value in enumerate(e.contact.friction(*at.arguments))]
    for s, x in zip(e.friction.sliders, at.laws, strict=True):
        for i in s.eta if e.sets else ():
            out[i] = ca.if_else(x.stuck, acc[i], out[i])
    ins = at.inputs | {"eta": eta} | ({"acc": acc} if e.sets else {})
    return expression_primitive(f"{which.name}_residual", ins, {"out": out})


@cache
def held(which: FrictionKey, alone: bool) -> Primitive:
    """Primitive of static friction. Inputs: ``_Evaluation.inputs``, with the friction u in place of the rates. Outputs: a
    ``tr_hold`` per pair, and (unless ``alone``) ∂(capacity)/∂N of each pair."""
    at = _Evaluation(which, "u")
    e = at.element
    found = e.contact.held(at.wrench, [at.rates[i] for i in e.eta], at.laws, at.numbers, e.friction.adams)
    values = [x for h in found for x in (h.capacity, h.size, SX(h.beyond))]
    outs = {"hold": values} | ({} if alone else {"dN": ca.vertcat(*[at.by_loads(h.capacity) for h in found])})
    return expression_primitive(f"{which.name}_held{'_alone' if alone else ''}", at.inputs, outs)


@cache
def grip(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...], free: tuple[int, ...]) -> Primitive:
    """Primitive of the derivative of a law by the joint's reaction. Inputs: pose of the joint, and ∂law/∂N with a row per freedom.
    Output: ∂law/∂N ∂N/∂(reaction on the child), with a row per free freedom (n×6)."""
    reaction = SX.sym("N", 6)
    ins, rows = pin_components(kind, forward, fit, needs, reaction)
    dN = SX.sym("dN", REGISTRY_OF_JOINTS[kind].nv, len(needs))
    out = ca.sparsify(dN[list(free), :] @ ca.jacobian(rows, reaction)) if free else SX(0, 6)
    words = [kind, "out" if forward else "in", fit.label, *map(str, free), *needs]
    return expression_primitive("_".join(["g", *words]), {**ins, "dN": ca.vec(dN)}, {"out": out})


@cache
def drift(which: FrictionKey) -> Primitive:
    """Primitive of bristle rates. Inputs: ``_Evaluation.inputs``. Output: time derivatives of the law's states, 1/s."""
    at = _Evaluation(which)
    return expression_primitive(f"{which.name}_drift", at.inputs, {"out": at.element.contact.drifts(*at.arguments)})


@cache
def pressed(which: FrictionKey, soft: bool) -> Primitive:
    """Primitive of the effect of friction on scaled reactions. Inputs: ``_Evaluation.inputs``, and the friction u. Outputs: change
    of the joint's first scaled reactions by friction; ∂(change)/∂N, then ∂(change)/∂u. soft: whether the joint has a stiffness,
    which is then the last number."""
    at, u = _Evaluation(which, soft=soft), SX.sym("u", which.joint.kind.nv)
    joint = replace(which.joint, stiffness=Param(len(_friction(which).numbers)) if soft else None)
    e = replace(at.element, joint=joint)
    values = friction_change(at.symbols, e, complete_wrench(e, at.N), at.rates, at.laws, at.numbers, [u[i] for i in e.eta])
    slopes = ca.vertcat(at.by_loads(values), ca.vec(ca.densify(ca.jacobian(values, u))))
    name = f"{which.name}_pressed{'_soft' if soft else ''}"
    return expression_primitive(name, at.inputs | {"u": u}, {"more": ca.densify(values), "dN": slopes})


def _friction(which: FrictionKey) -> FrictionElement:
    assert which.joint.friction is not None
    return which.joint.friction


def element_of(which: FrictionKey, needs: tuple[str, ...]) -> Element:
    """The element of a key, with the reaction components ``needs``."""
    return Element(which.joint, REGISTRY[_friction(which).contact], needs, 0, 0)
