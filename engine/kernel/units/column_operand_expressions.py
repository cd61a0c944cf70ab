"""Operands of columns as expressions of the whole scene. Each operand in ``trunnion.columns.operands`` has a method."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import casadi as ca

from trunnion.columns.operands import provides_all
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.kernel.interface.runtime_tables import GIVING, names_of_powers
from trunnion.kernel.units.energy_expressions import kinetic, potential
from trunnion.kernel.units.generated_function_inputs import combination
from trunnion.kernel.units.power_expressions import coordinates_of, drive_effort
from trunnion.recursion.body_kinematics import Motion, Pose, motions_of
from trunnion.recursion.complement_equation_terms import (
    FrictionTerms,
    acceleration_rows,
    friction_terms,
    joint_rates,
    reaction_rows,
)
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.joint_reactions import on_outboard, pose_of
from trunnion.recursion.masses_and_forces import device_force, line_of, nonlinear_force
from trunnion.recursion.outward_accelerations import Accelerations, balance
from trunnion.recursion.vector_algebra import SX, zeros
from trunnion.runtime.abi.run_records import EXTRA
from trunnion.system.structure.bodies_and_joints import Device, FrictionElement, Joint
from trunnion.system.structure.friction_joint_indices import Element, elements, everything


@provides_all
class ColumnOperands:
    """Provides the operands of columns. a: symbols of the accelerations of the free rates, which the runtime provides. integrals:
    symbols of the integrals, in the order of ``names_of_powers`` (none without quadratures). runtime: symbols of values that only
    the runtime computes."""

    def __init__(self, m: Model, quadratures: bool):
        self.m, self.sym, self.system = m, m.sym, m.sym.system
        self.pick = combination(m.sym)
        self.a = SX.sym("a", self.system.nv)
        self.acc: Accelerations = balance(m, self.a, self.pick)
        self.powers = names_of_powers(self.system) if quadratures else []
        self.integrals = SX.sym("quad", len(self.powers))
        self.runtime = SX.sym("extra", EXTRA.numbers + len(self.system.sliders))

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def body_motion(self, i: int) -> Motion:
        return self.m.motions[i]

    def body_angular_velocity(self, i: int) -> SX:
        return self.m.motions[i].omega

    def body_acceleration(self, i: int) -> SX:
        return self.acc.Zdot[i]

    def mass_centre(self, i: int) -> SX:
        return self.sym.leaves(self.system.bodies[i].center)

    def body_point(self, i: int, name: str) -> SX:
        return self.sym.leaves(dict(self.system.bodies[i].points)[name])

    def gravity(self) -> SX:
        return self.sym.leaves(self.system.gravity)

    # -- joints -------------------------------------------------------------------------------------------------------------

    @cached_property
    def _joints(self) -> dict[str, Joint]:
        return {j.name: j for j in self.system.joints}

    def _friction(self, name: str) -> FrictionElement:
        friction = self._joints[name].friction
        assert friction is not None
        return friction

    def coordinate(self, name: str, i: int) -> SX:
        return coordinates_of(self.m, self._joints[name])[i]

    def rate(self, name: str, k: int) -> SX:
        return joint_rates(self.m, self._joints[name])[k]

    def joint_acceleration(self, name: str, k: int) -> SX:
        return acceleration_rows(self.m, self.acc, self._joints[name])[k]

    def joint_pose(self, name: str) -> Pose:
        return pose_of(self.m, self._joints[name])

    def reaction_arm(self, name: str) -> SX:
        j = self._joints[name]
        return zeros(3) if j.fit.pin_out else pose_of(self.m, j).s

    def outboard_wrench(self, name: str) -> SX:
        f, t, _ = on_outboard(self.m, self.acc, self._joints[name], self.pick)
        return ca.vertcat(f, t)

    def drive_effort(self, name: str, k: int) -> SX:
        return drive_effort(self.m, self.acc, self.pick, self._joints[name], k)

    def device_effort(self, name: str, k: int, field: str) -> SX:
        j = self._joints[name]
        i, one = j.kind.coordinate_of(k), Device(**{field: getattr(j.devices[k], field)})
        return device_force(self.sym, one, self.coordinate(name, i) if i >= 0 else None, self.rate(name, k))

    def latch_hook(self, name: str, k: int) -> SX:
        latch = self._joints[name].devices[k].latch
        assert latch is not None
        return self.sym.latch_flags(latch)[0]

    def gap(self, name: str) -> SX:
        return next(c.rows[0].phi for c in self.m.cuts if c.joint.name == name)

    def coupling_multiplier(self, row: int) -> SX:
        return self.sym.lam[row]

    # -- friction -----------------------------------------------------------------------------------------------------------

    def friction_multiplier(self, name: str, k: int) -> SX:
        return self.sym.eta[self._friction(name).eta[k]]

    def bristle_state(self, name: str, k: int) -> SX:
        return self.sym.b[self.system.bristles.index(self._friction(name).eta[k])]

    def bristle_scale(self, name: str) -> SX:
        friction = self._friction(name)
        return self.sym.leaf(friction.number(LAWS[friction.law].state_scale))

    def pair_state(self, flag: int) -> SX:
        return self.runtime[EXTRA.numbers + flag]

    @cached_property
    def _elements(self) -> dict[str, Element]:
        """Elements with all components of their reactions. Contact columns use the exact formulas, even if friction uses an
        approximation."""
        return {e.joint.name: replace(e, needs=everything(e.joint)) for e in elements(self.system)}

    def friction(self, name: str) -> FrictionTerms:
        return friction_terms(self.sym, self._elements[name])

    def contact_reaction(self, name: str) -> SX:
        return reaction_rows(self.m, self.acc, self._elements[name], self.pick)

    def joint_rates(self, name: str) -> SX:
        return ca.vertcat(*joint_rates(self.m, self._joints[name]))

    def joint_multipliers(self, name: str) -> SX:
        return ca.vertcat(*[self.sym.eta[i] for i in self._friction(name).eta])

    # -- loads, and the whole scene -----------------------------------------------------------------------------------------

    def load_ends(self, i: int) -> tuple[Motion, ...]:
        return motions_of(self.m.motions, self.system.loads[i].bodies)

    def load_numbers(self, i: int) -> SX:
        return self.sym.leaves(self.system.loads[i].leaves)

    def nonlinear_force(self, i: int) -> SX:
        load = self.system.loads[i]
        line = line_of(self.sym, self.m.motions, load)
        return nonlinear_force(self.sym, load.nonlinear, line.length, line.rate)

    def energies(self) -> SX:
        return ca.vertcat(self.m.once(kinetic), self.m.once(potential))

    def work(self, name: str) -> SX:
        return self.integrals[self.powers.index(name)]

    def drive_work(self) -> SX:
        return self.work("drive")

    def load_work(self) -> SX:
        return self.work("load")

    def taken_work(self) -> SX:
        return sum((self.work(n) for n in self.powers[:-GIVING]), SX(0))

    def runtime_values(self) -> SX:
        return self.runtime
