"""The output unit: requested columns, contact forces, and the reactions of all joints in loops (for redundant ones)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from engine.abi.runs import EXTRA, LAST
from engine.basics.interrupts import heed
from engine.friction import REGISTRY as LAWS
from engine.joints.base import to_quaternion
from engine.kernel import expressions as ex
from engine.kernel.calling import CONST, STATE, combination, inputs
from engine.kernel.columns import Column
from engine.kernel.emit import Input, Output, Stage, emit
from engine.kernel.records import names_of_powers, post_of, wants_of
from engine.recursion.accelerations import Accelerations, given
from engine.recursion.bushings import Bushing, bushing
from engine.recursion.loads import device_force, spring_line
from engine.recursion.reduction import Model
from engine.recursion.redundancy import scaled_reactions
from engine.recursion.vectors import SX, cross
from engine.system.structure import Device


@dataclass
class OutputUnit:
    """C text of the unit and its sizes."""

    text: str
    nout: int
    ncontacts: int
    nc: int
    nkappa: int
    post: list[tuple[int, ...]]
    energy: int
    works: int
    """Whether columns ask for integrals of the powers."""
    wants: int
    """What the runtime does besides: bits of ``Wants``."""
    operations: int
    """Floating-point operations of a row, contacts apart."""


class Outputs:
    """Expressions of columns by their key (``Column.key``): the first word of a key is the method below that builds it. a: symbols
    of the accelerations of the free rates, which the runtime hands over; quad: symbols of the integrals, named as in
    ``powers``."""

    def __init__(self, m: Model, quadratures: bool):
        self.m, self.sym = m, m.sym
        self.pick = combination(m.sym)
        self.a = SX.sym("a", m.sym.system.nv)
        self.acc: Accelerations = given(m, self.a, self.pick)
        self.names = names_of_powers(m.sym.system) if quadratures else []
        self.quad = SX.sym("quad", len(self.names))
        self.extra = SX.sym("extra", EXTRA.numbers + len(m.sym.system.sliders))
        self._made: dict[tuple, Any] = {}

    def once(self, build: Callable[..., Any], *which: str | int) -> Any:
        """``build(*which)``, made once for all columns that are a component of it."""
        key = (build.__name__, *which)
        if key not in self._made:
            self._made[key] = build(*which)
        return self._made[key]

    def value(self, key: tuple) -> SX:
        """Expression of the column with this key."""
        heed()
        return getattr(self, f"_{key[0]}")(*key[1:])

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def _center(self, i: int) -> SX:
        return self.m.motions[i].R @ self.sym.leaves(self.sym.system.bodies[i].center)

    def _position(self, i: int, k: int) -> SX:
        return (self.m.motions[i].r + self.once(self._center, i))[k]

    def _velocities(self, i: int) -> SX:
        motion = self.m.motions[i]
        return motion.rdot + cross(motion.omega, self.once(self._center, i))

    def _velocity(self, i: int, k: int) -> SX:
        return self.once(self._velocities, i)[k]

    def _accelerations(self, i: int) -> SX:
        motion, Z, c = self.m.motions[i], self.acc.Zdot[i], self.once(self._center, i)
        return Z[:3] + cross(Z[3:], c) + cross(motion.omega, cross(motion.omega, c)) + self.sym.leaves(self.sym.system.gravity)

    def _acceleration(self, i: int, k: int) -> SX:
        return self.once(self._accelerations, i)[k]

    def _quaternion(self, i: int) -> list[SX]:
        R = self.m.motions[i].R
        return to_quaternion([[R[r, c] for c in range(3)] for r in range(3)], ca)

    def _orientation(self, i: int, k: int) -> SX:
        return self.once(self._quaternion, i)[k]

    def _omega(self, i: int, k: int) -> SX:
        return self.m.motions[i].omega[k]

    def _point(self, i: int, name: str, k: int) -> SX:
        leaves = dict(self.sym.system.bodies[i].points)[name]
        return (self.m.motions[i].r + self.m.motions[i].R @ self.sym.leaves(leaves))[k]

    # -- joints -------------------------------------------------------------------------------------------------------------

    def _q(self, name: str, i: int) -> SX:
        return ex.coordinates(self.m, name)[i]

    def _qd(self, name: str, k: int) -> SX:
        return ex.rates(self.m, name)[k]

    def _qdd(self, name: str, k: int) -> SX:
        return self.once(self._joint_accelerations, name)[k]

    def _joint_accelerations(self, name: str) -> SX:
        return ex.accelerations(self.m, self.acc, name)

    def _reactions(self, name: str) -> tuple[SX, SX]:
        return ex.reaction(self.m, self.acc, name, self.pick)

    def _reaction(self, name: str, which: str, k: int) -> SX:
        f, t = self.once(self._reactions, name)
        return (f if which == "f" else t)[k]

    def _tie(self, row: int) -> SX:
        return self.sym.lam[row]

    def _drive(self, name: str, k: int) -> SX:
        return ex.drive(self.m, self.acc, self.pick, name, k)

    def _device(self, name: str, k: int, field: str) -> SX:
        j, c = ex.joint(self.m, name), self.once(self._of_joint, name)
        i = j.kind.coordinate_of(k)
        only = Device(**{field: getattr(j.devices[k], field)})
        return device_force(self.sym, only, c[0][i] if i >= 0 else None, c[1][k])

    def _of_joint(self, name: str) -> tuple[list[SX], list[SX]]:
        return ex.coordinates(self.m, name), ex.rates(self.m, name)

    def _power(self, name: str, k: int, field: str) -> SX:
        effort = self._drive(name, k) if field == "drive" else self._device(name, k, field)
        return effort * self._qd(name, k)

    def _line(self, i: int, what: str) -> SX:
        load = self.sym.system.loads[i]
        length, rate, _, _ = spring_line(self.sym, self.m.motions, load)
        stiffness, damping, free = (self.sym.leaf(x) for x in load.numbers)
        force = stiffness * (length - free) + damping * rate
        return {"length": length, "force": force, "power": -force * rate}[what]

    def _latched(self, name: str, k: int) -> SX:
        latch = ex.joint(self.m, name).devices[k].latch
        assert latch is not None
        return self.sym.latch_flags(latch)[0]

    def _bushings(self, i: int) -> Bushing:
        return bushing(self.sym, self.m.motions, self.sym.system.loads[i])

    def _bushing(self, i: int, what: str, k: int) -> SX:
        return getattr(self.once(self._bushings, i), what)[k]

    def _friction(self, name: str, k: int) -> SX:
        return self.sym.eta[ex.eta_of(self.m, name)[k]]

    def _bristle(self, name: str, k: int) -> SX:
        friction = ex.joint(self.m, name).friction
        assert friction is not None
        eta = friction.eta[k]
        return self.sym.b[self.sym.system.bristles.index(eta)] / self.sym.leaf(friction.number(LAWS[friction.law].state_scale))

    def _state(self, flag: int) -> SX:
        return self.extra[EXTRA.numbers + flag]

    def contacts(self, name: str) -> list[ex.Touch]:
        """Contacts of a frictional joint."""
        return ex.contacts(self.m, self.acc, self.pick, name)

    def _contact(self, name: str, i: int, what: str, k: int = 0) -> SX:
        c = self.once(self.contacts, name)[i]
        if what == "force":
            return c.force
        if what == "state":
            return c.force > ex.TOUCHING
        if what == "angle":
            axis, base = c.plane
            return ex.angle(c.vector[base], c.vector[axis])
        if what == "elevation":
            return c.elevation
        return c.normal[k]

    # -- the whole ----------------------------------------------------------------------------------------------------------

    def _quad(self, name: str) -> SX:
        return self.quad[self.names.index(name)]

    def _kinetic(self) -> SX:
        return self.m.once(ex.kinetic)

    def _potential(self) -> SX:
        return self.m.once(ex.potential)

    def _dissipated(self) -> SX:
        return -sum((self._quad(n) for n in self.names if n not in ("drive", "load")), SX(0))

    def _residual(self) -> SX:
        work = self._quad("drive") + self._quad("load")
        return self._kinetic() + self._potential() - self.extra[EXTRA.at("energy0")] - work + self._dissipated()

    def _extra(self, name: str) -> SX:
        return self.extra[EXTRA.at(name)]

    def _last(self, name: str) -> SX:
        return self.extra[EXTRA.at("last") + LAST.at(name)]


def output_unit(m: Model, chosen: list[Column], quadratures: bool) -> OutputUnit:
    """Build the unit for the chosen columns."""
    o, sym = Outputs(m, quadratures), m.sym
    state, ny = inputs(sym), sym.system.nq + sym.system.nv + sym.b.numel()
    z = [Input("z", sym.lam, 1), Input(f"z+{sym.system.rows}", sym.eta, 1), Input("a", o.a, 1)]
    values = [o.value(c.key) for c in chosen]
    more = [Input(f"y+{ny}", o.quad, 1), Input("extra", o.extra, 1)]
    stages = [Stage("o_prepare", f"{CONST}p,double*restrict c", "c"),
              Stage("o_eval", f"{STATE},{CONST}z,{CONST}a,{CONST}extra,double*restrict out", "")]
    main = emit(state + z + more, [Output("out", 0, values or [SX(0, 1)], 1)], stages)
    touching = [c for j in sym.system.frictional for c in o.once(o.contacts, j.name)]
    four = [v for c in touching for v in (c.force, *ex.oriented(c))]
    contact = _second("contacts", state + z, four)
    loops = scaled_reactions(m, o.acc, o.pick)
    kappa = _second("kappa", state + z, [loops[i] for i in range(loops.numel())])
    a, b = main.kept[0], main.kept[0] + contact.kept[0]
    text = "\n".join([
        main.text, contact.text, kappa.text,
        f"void o_prepare_all(const void*scene,{CONST}p,double*restrict c)"
        f"{{o_prepare(p,c);o_prepare_contacts(p,c+{a});o_prepare_kappa(p,c+{b});}}",
        f"void o_contacts_at({STATE},{CONST}z,{CONST}a,double*restrict out){{o_contacts(x,y,c+{a},z,a,out);}}",
        f"void o_kappa_at({STATE},{CONST}z,{CONST}a,double*restrict out){{o_kappa(x,y,c+{b},z,a,out);}}",
    ])
    solved = bool(values) and ca.depends_on(ca.vertcat(*values), ca.vertcat(sym.lam, sym.eta, o.a))
    energy = next((i for i, c in enumerate(chosen) if c.name == "energy.residual"), -1)
    wants = wants_of(chosen, solved)
    nc, post = b + kappa.kept[0], post_of(chosen)
    return OutputUnit(text, len(chosen), len(touching), nc, loops.numel(), post, energy, int(quadratures), wants,
                      main.operations[1])


def _second(name: str, ins: list[Input], values: list[SX]):
    stages = [Stage(f"o_prepare_{name}", f"{CONST}p,double*restrict c", "c"),
              Stage(f"o_{name}", f"{STATE},{CONST}z,{CONST}a,double*restrict out", "")]
    return emit(ins, [Output("out", 0, values or [SX(0, 1)], 1)], stages)
