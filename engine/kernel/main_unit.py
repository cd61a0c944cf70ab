"""The stepping unit: prepare, stage 1 (maps), laws, stage 2 (accelerations), closure of loops, coordinate rates.

Between stage 1 and stage 2 the runtime solves for the multipliers (METHOD, "Affine maps"); nothing here depends on the mode of a
pair. Stage 1 writes one block, "maps", of matrices in column-major order. With a active cut rows, e multipliers η, n reaction
components, r rates and k scaled reactions it holds, one after the other:

  S (a×a), Se (a×e), g0 (a)      constraint equations S λ + Se η + g0 = 0
  N0 (n), Nl (n×a), Ne (n×e)     reaction components of frictional joints, N0 + Nl λ + Ne η
  rates (r)                      of the freedoms of frictional joints, and behind them the states of friction laws
  Q0 (e), Ql (e×a), Qe (e×e)     accelerations of these freedoms, which rest sets to zero; only where some law is set-valued
  κ0 (k), κl (k×a), κe (k×e)     scaled reactions (friction counted as any other force), which decide what redundant loops leave
                                 open; only in the redundant variant, needed while stepping when friction depends on them
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from engine.kernel.calling import CONST, STATE, active_rows, combination, inputs, qdot
from engine.kernel.emit import Code, Input, Output, Stage, emit
from engine.kernel.functions import (
    closure_function,
    coordinate_rates_function,
    energy_function,
    held_function,
    laws_function,
    prepare_all,
    pressed_function,
    stops_function,
)
from engine.kernel.looped import Looped, loops_pay
from engine.kernel.powers import powers
from engine.kernel.records import GIVING
from engine.recursion.accelerations import outward
from engine.recursion.elements import acceleration_rows, bristle_rates, joint_rates, reaction_rows
from engine.recursion.reduction import Model, reduced
from engine.recursion.redundancy import inactive_rows_couple, scaled_reactions
from engine.recursion.symbols import Symbols
from engine.recursion.vectors import SX
from engine.system.elements import Element, any_sets, elements
from engine.system.loops import rubbing_on_loops, rubs

PROTOTYPES = f"void k_qdot({CONST}y,{CONST}v,{CONST}c,double*restrict dq);"


@dataclass(frozen=True)
class Sizes:
    """Dimensions the runtime needs (names as in ``tr_kernel``)."""

    nq: int
    nv: int
    nb: int
    nx: int
    np: int
    nc: int
    nw: int
    nmaps: int
    rows: int
    active: tuple[int, ...]
    neta: int
    nn: int
    nrates: int
    npowers: int
    ntaken: int
    nkappa: int
    loop_friction: int
    coupled: int


@dataclass
class MainUnit:
    """C text and sizes of the stepping unit."""

    text: str
    sizes: Sizes
    elements: list[Element]
    operations: dict[str, int]
    looped: bool
    turned: dict[str, tuple[int, int]]
    """Of joints on loops that rub: their first scaled reaction that friction changes, and how many (``rubbing_on_loops``)."""


def main_unit(plain: Model, quadratures: bool, redundant: bool = False) -> MainUnit:
    """Build the unit of a model before its reduction; ``redundant``: the variant that carries all rows and the scaled reactions."""
    sym = plain.sym
    system, parts = sym.system, elements(sym.system)
    if loops_pay(system, quadratures):
        return _looped(sym, parts)
    m = reduced(plain)
    active = list(range(system.rows)) if redundant else list(active_rows(m))
    maps, nn, nrates, nkappa = _maps(m, parts, active, redundant)
    loop_friction = rubs(system)
    inactive = [k for k in range(system.rows) if k not in active]
    coupled = loop_friction and inactive_rows_couple(m, outward(m), inactive)
    rate, each = _derivative(m)
    code = _stages(sym, maps, rate, each, active)
    sizes = Sizes(
        system.nq, system.nv, sym.b.numel(), sym.x.shape[0], sym.p.shape[0], 0, code.kept[1],
        sum(int(v.numel()) for v in maps), system.rows, tuple(active), system.neta, nn, nrates, len(each), len(each) - GIVING,
        nkappa, int(loop_friction), int(coupled),
    )
    return _complete(sym, m, parts, code, sizes)


def _stages(sym: Symbols, maps: list[SX], rate: list[SX], each: list[SX], active: list[int]) -> Code:
    """prepare, stage 1 and stage 2, unrolled. Inactive multipliers never reach the motion: they are structurally absent from it."""
    multipliers = bool(active) or sym.system.neta > 0
    stages = [
        Stage("k_prepare", f"{CONST}p,double*restrict c", "c"),
        Stage("k_stage1", f"{STATE},double*restrict w,double*restrict maps,double*restrict dy,double*restrict power", "w"),
        Stage("k_stage2", f"{STATE},{CONST}w,{CONST}z,double*restrict dy,double*restrict power", ""),
    ]
    lam = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active])
    ins = [*inputs(sym), Input("z", lam, 2), Input(f"z+{len(active)}", sym.eta, 2)]
    rate = _without_inactive(sym, rate, active)
    last = 2 if multipliers else 1
    return emit(ins, [Output("maps", 0, maps, 1), Output("dy", 0, rate, last), Output("power", 0, each, last)], stages)


def _looped(sym: Symbols, parts: list[Element]) -> MainUnit:
    """The unit of a large tree, its recursion in loops."""
    loop = Looped(sym)
    system, nn = sym.system, sum(len(e.needs) for e in parts)
    nrates, ne = sum(e.joint.kind.nv for e in parts), system.neta
    held = ne * (1 + ne) if any_sets(system) else 0
    sizes = Sizes(
        system.nq, system.nv, 0, sym.x.shape[0], sym.p.shape[0], 0, loop.nw, nn * (1 + ne) + nrates + held + 1, 0, (), ne,
        nn, nrates, 0, 0, 0, 0, 0,
    )
    return _complete(sym, None, parts, Code(loop.text, [loop.nc + 3, loop.nw, 0], loop.operations), sizes)


def _complete(sym: Symbols, m: Model | None, parts: list[Element], code: Code, sizes: Sizes) -> MainUnit:
    """A unit with the functions added that unrolled and looped units have in common."""
    closure = closure_function(sym, m)
    laws_code = laws_function(sym, parts)
    rates_code = coordinate_rates_function(sym)
    stops_code = stops_function(sym, m)
    turned = rubbing_on_loops(sym.system) if sizes.nkappa else []
    held = held_function(sym, parts)
    codes = [
        code, closure, laws_code, stops_code, held, energy_function(sym, m), pressed_function(sym, turned),
    ]  # fmt: skip
    text = "\n".join([PROTOTYPES, *(c.text for c in codes), rates_code.text, prepare_all(codes)])
    sizes = replace(sizes, nc=sum(c.kept[0] for c in codes))
    ops = {"prepare": code.operations[0], "stage1": code.operations[1], "stage2": code.operations[2],
           "laws": laws_code.operations[1], "closure": closure.operations[1], "held": held.operations[1]}
    return MainUnit(text, sizes, parts, ops, m is None, {e.joint.name: (at, count) for e, at, count in turned})


def _without_inactive(sym: Symbols, values: list[SX], active: list[int]) -> list[SX]:
    """The same expressions with multipliers of inactive rows set to zero (they multiply structural zeros anyway)."""
    inactive = [k for k in range(sym.system.rows) if k not in active]
    if not inactive:
        return values
    old = ca.vertcat(*[sym.lam[k] for k in inactive])
    return ca.substitute(values, [old], [SX.zeros(len(inactive))])


def _maps(m: Model, parts: list[Element], active: list[int], redundant: bool) -> tuple[list[SX], int, int, int]:
    """The parts of the maps block, and how many reaction components, rates and scaled reactions it holds."""
    system = m.sym.system
    blocks = [ca.vec(ca.densify(m.S[active, active])), ca.vec(ca.densify(m.Se[active, :])), ca.densify(m.g0[active])]
    nn = nrates = nkappa = 0
    if parts:
        acc = outward(m)
        rows = ca.vertcat(*[reaction_rows(m, acc, e) for e in parts])
        nl, nn = system.rows, rows.size1()
        lam = rows[:, 1 : 1 + nl][:, active]
        blocks += [ca.densify(rows[:, 0]), ca.vec(ca.densify(lam)), ca.vec(ca.densify(rows[:, 1 + nl :]))]
        rates = [r for e in parts for r in joint_rates(m, e.joint)]
        rates += [m.sym.b[i] for i in range(m.sym.b.numel())]
        nrates = len(rates)
        blocks += rates
        if any_sets(system):
            held = ca.vertcat(*[acceleration_rows(m, acc, e.joint) for e in parts])
            lam = held[:, 1 : 1 + nl][:, active]
            blocks += [ca.densify(held[:, 0]), ca.vec(ca.densify(lam)), ca.vec(ca.densify(held[:, 1 + nl :]))]
        if redundant:
            kappa = scaled_reactions(m, acc)
            nkappa = kappa.size1()
            blocks += [ca.densify(kappa[:, 0]), ca.vec(ca.densify(kappa[:, 1 : 1 + nl])), ca.vec(ca.densify(kappa[:, 1 + nl :]))]
    return [ca.densify(b) for b in blocks if b.numel()] or [SX(0, 1)], nn, nrates, nkappa


def _derivative(m: Model) -> tuple[list[SX], list[SX]]:
    """ẏ = [q̇; v̇; rates of friction states] and the powers beside it. All of them whatever columns are asked for: with other text
    around it the compiler rounds the motion otherwise."""
    sym = m.sym
    pick = combination(sym)
    acc = outward(m, pick, reactions=sym.b.numel() > 0 or any(j.driven for j in sym.system.tree))
    rate = [*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())], *bristle_rates(m, acc, pick)]
    return rate, [p for _, p in powers(m, acc, pick)]
