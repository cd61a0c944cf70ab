"""Parts of friction: the law of a joint, what its pairs hold at rest."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca

from engine.contact import REGISTRY, ContactElement
from engine.joints import REGISTRY as REGISTRY_OF_JOINTS
from engine.kernel.expressions import TOUCHING, angle, oriented, touches
from engine.parts.known import POSE, Part, Rubbing
from engine.parts.local import PartSymbols
from engine.parts.one import one
from engine.parts.small import pinned_by
from engine.recursion.elements import by_loads, laws, numbers, wrench
from engine.recursion.reactions import pin_axes
from engine.recursion.springs import complete_wrench, rubbed
from engine.recursion.vectors import SX
from engine.system.elements import Element, everything
from engine.system.external import MODE
from engine.system.leaves import Param
from engine.system.structure import Fit, FrictionElement


class _Rubbed(PartSymbols):
    """With the modes of the joint's pairs, and the states of its law."""

    def __init__(self, which: Rubbing, more: int = 0):
        f = _friction(which)
        super().__init__(len(f.numbers) + more)
        self.modes = SX.sym("modes", MODE * len(f.sliders))
        self.eta_of = [e for s in f.sliders for e in s.eta] if f.bristles else []
        self.b = SX.sym("b", len(self.eta_of))
        self.system = self  # type: ignore[assignment]

    @property
    def bristles(self) -> tuple[int, ...]:
        """Multipliers with a state, as a system tells them."""
        return tuple(self.eta_of)

    def mode(self, slider: int) -> list[SX]:
        return [self.modes[MODE * slider + i] for i in range(MODE)]


@cache
def law(which: Rubbing, alone: bool) -> Part:
    """numbers, N, rates, modes, states → η (in order of its freedoms), ∂η/∂N (column-major, unless ``alone``), a ``tr_sliding`` a
    pair."""
    e = Element(which.joint, _contact(which), which.needs, 0, 0)
    sym, nv = _Rubbed(which), which.joint.kind.nv
    N, r = SX.sym("N", len(which.needs)), SX.sym("r", nv)
    ls, g, w = laws(sym, e), numbers(sym, e), wrench(e, N)
    rates, adams = [r[k] for k in range(nv)], e.friction.adams
    values = ca.vertcat(*e.contact.friction(w, rates, ls, g, adams))
    sliding: list[SX] = []
    cones = e.contact.cone(w, rates, ls, g, adams) if e.contact.cone and all(x.sets or x.kinks for x in ls) else [SX(1)] * len(ls)
    for speed, x, cone in zip(e.contact.speeds(w, rates, ls, g, adams), ls, cones, strict=True):
        sliding += [speed, SX(x.kink), SX(cone)]
    ins = {"numbers": sym.p, "N": N, "r": r, "modes": sym.modes, "b": sym.b}
    outs = {"eta": values} | ({} if alone else {"dN": ca.vec(by_loads(values, e, N))}) | {"sliding": sliding}
    return one(f"{which.name}_law{'_alone' if alone else ''}", ins, outs)


@cache
def residual(which: Rubbing) -> Part:
    """numbers, N, rates, modes, states, η, accelerations of the freedoms → the residuals of η: η − law(N, rates), or of a pair that
    is held at rest the acceleration."""
    e = Element(which.joint, _contact(which), which.needs, 0, 0)
    sym, nv = _Rubbed(which), which.joint.kind.nv
    N, r, eta, acc = SX.sym("N", len(which.needs)), SX.sym("r", nv), SX.sym("eta", nv), SX.sym("acc", nv)
    ls, g = laws(sym, e), numbers(sym, e)
    values = e.contact.friction(wrench(e, N), [r[k] for k in range(nv)], ls, g, e.friction.adams)
    out = [eta[k] - value for k, value in enumerate(values)]
    for s, x in zip(e.friction.sliders, ls, strict=True):
        for i in s.eta if e.sets else ():
            out[i] = ca.if_else(x.stuck, acc[i], out[i])
    ins = {"numbers": sym.p, "N": N, "r": r, "modes": sym.modes, "b": sym.b, "eta": eta} | ({"acc": acc} if e.sets else {})
    return one(f"{which.name}_residual", ins, {"out": out})


@cache
def held(which: Rubbing, alone: bool) -> Part:
    """numbers, N, u, modes, states → three numbers a pair (``tr_hold``), and the derivative of each pair's capacity by N."""
    e = Element(which.joint, _contact(which), which.needs, 0, 0)
    sym = _Rubbed(which)
    N, u = SX.sym("N", len(which.needs)), SX.sym("u", which.joint.kind.nv)
    values, rows = [], []
    g = numbers(sym, e)
    found = e.contact.held(wrench(e, N), [u[i] for i in e.eta], laws(sym, e), g, e.friction.adams)
    for h in found:
        values += [h.capacity, h.size, SX(h.beyond)]
        rows.append(ca.vec(by_loads(h.capacity, e, N)))
    ins = {"numbers": sym.p, "N": N, "u": u, "modes": sym.modes, "b": sym.b}
    outs = {"hold": values} | ({} if alone else {"dN": ca.vertcat(*rows)})
    return one(f"{which.name}_held{'_alone' if alone else ''}", ins, outs)


@cache
def grip(kind: str, forward: bool, fit: Fit, needs: tuple[str, ...], free: tuple[int, ...]) -> Part:
    """Pose of a joint, ∂law/∂N (a row a freedom) → ∂law/∂N ∂N/∂(reaction on the child) of the free freedoms (n×6)."""
    reaction = SX.sym("N", 6)
    ins, rows = pinned_by(kind, forward, fit, needs, reaction)
    dN = SX.sym("dN", REGISTRY_OF_JOINTS[kind].nv, len(needs))
    out = ca.sparsify(dN[list(free), :] @ ca.jacobian(rows, reaction)) if free else SX(0, 6)
    words = [kind, "out" if forward else "in", fit.label, *map(str, free), *needs]
    return one("_".join(["g", *words]), {**ins, "dN": ca.vec(dN)}, {"out": out})


@cache
def drift(which: Rubbing) -> Part:
    """numbers, N, rates, modes, states → rates of the states of a law that has some, 1/s."""
    e = Element(which.joint, _contact(which), which.needs, 0, 0)
    sym, nv = _Rubbed(which), which.joint.kind.nv
    N, r = SX.sym("N", len(which.needs)), SX.sym("r", nv)
    g = numbers(sym, e)
    out = e.contact.drifts(wrench(e, N), [r[k] for k in range(nv)], laws(sym, e), g, e.friction.adams)
    return one(f"{which.name}_drift", {"numbers": sym.p, "N": N, "r": r, "modes": sym.modes, "b": sym.b}, {"out": out})


@cache
def pressed(which: Rubbing, soft: bool) -> Part:
    """numbers (the stiffness of the joint last, if it says one: ``soft``), N, rates, modes, states → what friction of sliding
    changes in the first of the joint's scaled reactions, and the derivative of that by N."""
    joint = replace(which.joint, stiffness=Param(len(_friction(which).numbers)) if soft else None)
    e = Element(joint, _contact(which), which.needs, 0, 0)
    sym, nv = _Rubbed(which, int(soft)), which.joint.kind.nv
    N, r = SX.sym("N", len(which.needs)), SX.sym("r", nv)
    g = numbers(sym, e)
    values = rubbed(sym, e, complete_wrench(e, N), [r[k] for k in range(nv)], laws(sym, e), g)
    ins = {"numbers": sym.p, "N": N, "r": r, "modes": sym.modes, "b": sym.b}
    name = f"{which.name}_pressed{'_soft' if soft else ''}"
    return one(name, ins, {"more": ca.densify(values), "dN": ca.vec(by_loads(values, e, N))})


@cache
def contacts(which: Rubbing) -> Part:
    """numbers, all of f_c and m_c (6; the span behind them), rates, modes, states, η, pose → ``TOUCH`` numbers for each
    contact, and a ``tr_contact`` each."""
    e = Element(which.joint, _contact(which), everything(which.joint), 0, 0)
    sym, nv = _Rubbed(which), which.joint.kind.nv
    N, r, eta, pose = SX.sym("N", len(e.needs)), SX.sym("r", nv), SX.sym("eta", nv), SX.sym("pose", POSE)
    g = numbers(sym, e)
    found = e.contact.contacts(wrench(e, N), [r[k] for k in range(nv)], laws(sym, e), g, [eta[k] for k in range(nv)])
    Ein, Eout = ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3)
    touching = touches(found, ca.sparsify(Ein.T @ pin_axes(which.joint, Ein, Eout)))
    columns, four = [], []
    for c in touching:
        axis, base = c.plane
        columns += [c.force, angle(c.vector[base], c.vector[axis]), c.elevation]
        columns += [*[c.normal[k] for k in range(3)], c.force > TOUCHING]
        four += [c.force, *oriented(c)]
    ins = {"numbers": sym.p, "N": N, "r": r, "modes": sym.modes, "b": sym.b, "eta": eta, "pose": pose}
    return one(f"{which.name}_contacts", ins, {"columns": columns, "four": four})


def _friction(which: Rubbing) -> FrictionElement:
    assert which.joint.friction is not None
    return which.joint.friction


def _contact(which: Rubbing) -> ContactElement:
    return REGISTRY[_friction(which).contact]
