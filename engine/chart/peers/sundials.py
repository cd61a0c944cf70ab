"""SUNDIALS through CasADi: CVODES on open mechanisms without friction, IDAS with the multipliers as algebraic unknowns."""

from __future__ import annotations

import time

import casadi as ca
import numpy as np

from engine.chart.peers.base import TOLERANCES, Peer, Setting, Unable
from engine.chart.peers.snapshot import Snapshot
from engine.chart.runs import Prepared
from engine.kernel.calling import active_rows, combination, qdot
from engine.kernel.jacobian_unit import residuals
from engine.recursion.accelerations import Accelerations, outward
from engine.recursion.elements import joint_rates, laws, numbers, reaction_rows, wrench
from engine.recursion.reduction import Model, model
from engine.recursion.symbols import Symbols
from engine.simulation.block import Settings
from engine.simulation.run import Model as Ready
from engine.system.elements import elements

SX = ca.SX


class Sundials(Peer):
    """Variable-order BDF on our equations, which CasADi's virtual machine evaluates."""

    name = "sundials (casadi)"
    package = "casadi"

    def __init__(self, ready: Prepared, scene: Snapshot):
        super().__init__(ready, scene)
        self.built = Ready(ready.scene, ["*.position[*"])
        system = self.built.system
        if system.tables or system.inputs or system.stops or self.built.built.numbers.breaks:
            raise Unable("the scene has tables, inputs, ramps or stops")
        if not system.nv:
            raise Unable("all motion is prescribed: nothing to integrate")
        block = self.built.block
        block.configure(Settings())
        block.assemble()
        block.start(0.0, 1.0, 1.0, np.zeros(block.width))
        self.start, self.guess = block.y[: block.ny].copy(), block.evaluate()[1]
        self.dae = self._dae(Symbols(system, len(self.built.built.parameters.values)))
        self.plugin = "idas" if "alg" in self.dae else "cvodes"

    def _dae(self, sym: Symbols) -> dict[str, SX]:
        """Expressions of ẏ and of the residuals of the multipliers, with numbers in place of the parameters."""
        m = model(sym)
        pick, active = combination(sym), list(active_rows(m))
        acc = outward(m, pick)
        rate = ca.vertcat(*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())])
        z = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active], sym.eta)
        alg = residuals(m, acc, pick, active)
        old, new = [sym.p], [ca.DM(self.built.built.parameters.values)]
        flags, values = _flags(m, acc, pick)
        rate, alg = ca.substitute([rate, alg], flags, values) if flags else (rate, alg)
        idle = [sym.lam[k] for k in range(sym.system.rows) if k not in active]
        if idle:
            old, new = [*old, ca.vertcat(*idle)], [*new, ca.DM.zeros(len(idle))]
        now = SX.sym("t")
        rate, alg = ca.substitute([rate, alg], [*old, sym.x[0], sym.x[1:]], [*new, now, ca.DM.zeros(sym.x.numel() - 1)])
        position = self._positions(m, sym)
        self.center = ca.Function("center", [ca.vertcat(sym.q, sym.v)], [ca.substitute(position, sym.p, new[0])])
        out = {"x": ca.vertcat(sym.q, sym.v), "ode": rate, "t": now}
        return out | ({"z": z, "alg": alg} if z.numel() else {})

    def _positions(self, m: Model, sym: Symbols) -> SX:
        return ca.vertcat(*[mo.r + mo.R @ sym.leaves(b.center) for b, mo in zip(sym.system.bodies, m.motions, strict=True)])

    def leaves_out(self) -> str:
        """How the equations are evaluated, and what the solver does not do."""
        words = ["our equations in CasADi's virtual machine"]
        words += ["kinks of the friction law not located"] if self.scene.rubs else []
        words += ["loops drift (accelerations only are held)"] if self.scene.loops else []
        return "; ".join(words)

    def settings(self) -> list[Setting]:
        """The solver's tolerances, ever tighter."""
        return [Setting(self.plugin.upper(), r) for r in TOLERANCES]

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate to all sample times (see ``Peer.run``)."""
        options = {"reltol": s.rtol, "abstol": s.rtol, "max_num_steps": 50_000}
        f = ca.integrator("f", self.plugin, self.dae, 0.0, self.times[1:].tolist(), options)
        given = {"x0": self.start} | ({"z0": self.guess} if "z" in self.dae else {})
        started = time.perf_counter()
        x = np.array(f(**given)["xf"])
        seconds = time.perf_counter() - started
        states = np.column_stack([self.start, x])
        centers = np.array([np.array(self.center(states[:, k])).reshape(-1, 3) for k in range(states.shape[1])])
        return self.by_position(centers), seconds


def _flags(m: Model, acc: Accelerations, pick: SX) -> tuple[list[SX], list[SX]]:
    """(mode symbols, expressions put in their place): branches follow the speed of the instant, directions the motion."""
    sym, old, new = m.sym, [], []
    for e in elements(sym.system):
        w, rates, g = wrench(e, reaction_rows(m, acc, e, pick)), joint_rates(m, e.joint), numbers(sym, e)
        ls = laws(sym, e)
        speeds = e.contact.speeds(w, rates, ls, g, e.friction.adams)
        for s, speed, law in zip(e.friction.sliders, speeds, ls, strict=True):
            mode = sym.mode(s.flag)
            mine = [rates[k - min(e.eta)] for k in s.eta]
            direction = [ca.if_else(mine[0] < 0, -1, 1)] if len(mine) == 1 else mine
            proportional = ca.substitute(speed, mode[0], SX(0))
            old += [mode[0], *mode[1 : 1 + len(direction)]]
            new += [ca.fabs(proportional) > law.kink, *direction]
    return old, new
