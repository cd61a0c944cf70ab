"""SUNDIALS through CasADi: CVODES for open mechanisms without friction, otherwise IDAS with the multipliers as algebraic
unknowns."""

from __future__ import annotations

import time

import casadi as ca
import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.kernel.units.generated_function_inputs import active_rows, combination, qdot
from trunnion.kernel.units.jacobian_unit import residuals
from trunnion.recursion.complement_equation_terms import joint_rates, laws, numbers, reaction_rows, wrench
from trunnion.recursion.inward_reduction import Model, model
from trunnion.recursion.outward_accelerations import Accelerations, outward
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.simulation.run import Model as Ready
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.structure.friction_joint_indices import elements

SX = ca.SX


class Sundials(ReferenceSolver):
    """Variable-order BDF on the engine's equations. CasADi's virtual machine evaluates the equations."""

    name = "sundials (casadi)"
    package = "casadi"

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        self.built = Ready(ready.scene, ["*.position[*"])
        system = self.built.system
        if system.tables or system.inputs or system.stops or self.built.built.numbers.breaks:
            raise SceneNotSupported("the scene has tables, inputs, ramps or stops")
        if not system.nv:
            raise SceneNotSupported("all motion is prescribed: nothing to integrate")
        block = self.built.block
        block.configure(Settings())
        block.assemble()
        block.start(0.0, 1.0, 1.0, np.zeros(block.width))
        self.start, self.guess = block.y[: block.ny].copy(), block.evaluate()[1]
        self.dae = self._dae(Symbols(system, len(self.built.built.parameters.values)))
        self.plugin = "idas" if "alg" in self.dae else "cvodes"
        self.methods = (self.plugin.upper(),)

    def _dae(self, sym: Symbols) -> dict[str, SX]:
        """Expressions of ẏ and of the residuals of the multipliers, with numerical values for the parameters."""
        m = model(sym)
        pick, active = combination(sym), list(active_rows(m))
        acc = outward(m, pick)
        rate = ca.vertcat(*qdot(sym, sym.v), *[a[i] for a in acc.qdd for i in range(a.numel())])
        z = ca.vertcat(SX(0, 1), *[sym.lam[k] for k in active], sym.eta)
        alg = residuals(m, acc, pick, active)
        old, new = [sym.p], [ca.DM(self.built.built.parameters.values)]
        flags, values = _mode_expressions(m, acc, pick)
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

    def describe_omissions(self) -> str:
        """How the equations are evaluated, and what the solver does not model."""
        words = ["our equations in CasADi's virtual machine"]
        words += ["kinks of the friction law not located"] if self.scene.rubs else []
        words += ["loops drift (only their accelerations are constrained)"] if self.scene.loops else []
        return "; ".join(words)

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate to all sample times (see ``ReferenceSolver.run``)."""
        options = {"reltol": s.rtol, "abstol": s.rtol, "max_num_steps": 50_000}
        f = ca.integrator("f", self.plugin, self.dae, 0.0, self.times[1:].tolist(), options)
        given = {"x0": self.start} | ({"z0": self.guess} if "z" in self.dae else {})
        started = time.perf_counter()
        x = np.array(f(**given)["xf"])
        seconds = time.perf_counter() - started
        states = np.column_stack([self.start, x])
        centers = np.array([np.array(self.center(states[:, k])).reshape(-1, 3) for k in range(states.shape[1])])
        return self.by_position(centers), seconds


def _mode_expressions(m: Model, acc: Accelerations, pick: SX) -> tuple[list[SX], list[SX]]:
    """(mode symbols, expressions that replace these symbols). The momentary sliding speed selects the branch of the friction law,
    and the motion gives the direction of friction."""
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
