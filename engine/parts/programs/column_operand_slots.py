"""Operands of output columns as slots. Each operand in ``trunnion.columns.operands`` has a method here. The first column that needs
a pass of the recursion adds this pass to the program."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple

from trunnion.columns.operands import provides_all
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.kernel.interface.runtime_tables import GIVING, names_of_powers
from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, CutJointSlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.layout.load_operands import law_numbers
from trunnion.parts.primitives.primitive_cache import force_laws
from trunnion.parts.primitives.primitive_keys import PIN_IN, PIN_OUT
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.shared_operands import element_operands, write_pin, write_span
from trunnion.runtime.abi.run_records import EXTRA
from trunnion.system.structure.bodies_and_joints import GROUND, Device, FrictionElement, Joint
from trunnion.system.structure.friction_joint_indices import elements, everything
from trunnion.system.structure.parameter_table import Leaves


class OperandSlots(NamedTuple):
    """An operand. slots: a slot for each operand of the primitive; the key "" stands for the name of the operand itself.
    structure: data, besides the operand's name, that determine the primitive's code."""

    slots: dict[str, Slot]
    structure: Hashable = None


def sized(slot: Slot) -> OperandSlots:
    """A vector whose size depends on a joint's structure."""
    return OperandSlots({"": slot}, slot.size)


@provides_all
class ColumnOperands:
    """Provides the operands of the columns in one program."""

    def __init__(self, scene: ScenePasses, program: Program):
        self.scene, self.program, self.system = scene, program, scene.system
        self.joints = {j.name: j for j in self.system.joints}
        self.elements = {e.joint.name: e for e in elements(self.system)}
        self.powers = names_of_powers(self.system)
        self._made: dict[Hashable, Slot] = {}
        self._moving: list[BodySlots] = []
        self._closed: dict[str, CutJointSlots] = {}
        self._every_row = {k: k for k in range(self.system.rows)}
        scene.multipliers = self.system.rows
        self._Z: list[Slot] = []
        self._N: list[Slot] = []

    # -- passes -------------------------------------------------------------------------------------------------------------

    def moving(self) -> list[BodySlots]:
        """Motions of all bodies, and the wrenches on them."""
        if not self._moving:
            self._moving = self.scene.outward(self.program, self.program.scratch_slot)
            closed = self.scene.closed(self.program, self._moving, self.program.scratch_slot)
            self._closed = {c.joint.name: c for c in closed}
        return self._moving

    def joint(self, name: str) -> tuple[Joint, BodySlots | CutJointSlots]:
        """A joint, and its slots."""
        j, moving = self.joints[name], self.moving()
        return j, self._closed[name] if j.cut else moving[j.child]

    def accelerations(self) -> list[Slot]:
        """Ż of each body."""
        moving = self.moving()
        if not self._Z:
            for i, j in enumerate(self.system.tree):
                base = self.scene.acceleration(self._Z, self.scene.parent(i))
                self._Z.append(self.program.scratch_slot(6))
                a = Slot(Space.A, j.v0, len(j.free))
                self.scene.body_call(self.program, i, "moved", work=moving[i].work, Z=base, qdd=a, Zo=self._Z[i])
        return self._Z

    def reactions(self) -> list[Slot]:
        """N of each body."""
        if not self._N:
            Z = self.accelerations()
            self._N = self.scene.balance(self.program, self.moving(), Z, list(self._closed.values()), self._every_row)
        return self._N

    def once(self, key: Hashable, size: int, make: Callable[[Slot], None]) -> Slot:
        """The slot of this key. The first request calls ``make``, which writes the values of the slot."""
        if key not in self._made:
            self._made[key] = self.program.scratch_slot(size)
            make(self._made[key])
        return self._made[key]

    def numbers(self, key: Hashable, leaves: Leaves) -> Slot:
        """The slot of this key for numbers of the scene. The first request writes the numbers into the slot."""
        if key not in self._made:
            self._made[key] = self.scene.numbers(leaves)
        return self._made[key]

    # -- bodies -------------------------------------------------------------------------------------------------------------

    def body_motion(self, i: int) -> Slot:
        return self.moving()[i].motion

    def body_angular_velocity(self, i: int) -> Slot:
        return self.moving()[i].motion.slice(12, 3)

    def body_acceleration(self, i: int) -> Slot:
        return self.accelerations()[i]

    def mass_centre(self, i: int) -> Slot:
        return self.scene.inertial_numbers(i).slice(1, 3)

    def body_point(self, i: int, name: str) -> Slot:
        return self.numbers(("point", i, name), dict(self.system.bodies[i].points)[name])

    def gravity(self) -> Slot:
        return self.scene.gravity

    # -- joints -------------------------------------------------------------------------------------------------------------

    def coordinate(self, name: str, i: int) -> Slot:
        return self.joint(name)[1].q.slice(i, 1)

    def rate(self, name: str, k: int) -> Slot:
        return self.joint(name)[1].v.slice(k, 1)

    def joint_acceleration(self, name: str, k: int) -> Slot:
        j, m = self.joint(name)
        if isinstance(m, BodySlots):
            return self.scene.freedom_acceleration(j, k, m, Slot(Space.A, 0, self.system.nv))
        Z = [self.scene.acceleration(self.accelerations(), b) for b in (j.inb, j.out)]

        def relative(out: Slot) -> None:
            self.program.copy(m.blocks["bias"], out)
            for which, z in zip(("win", "wout"), Z, strict=True):
                self.program.call(Builtin.ADD_ROW_DOTS, [m.blocks[which], z, out], [6, j.kind.nv, 6, 1])

        return self.once(("qdd", name), j.kind.nv, relative).slice(k, 1)

    def joint_pose(self, name: str) -> Slot:
        return self.joint(name)[1].pose

    def reaction_arm(self, name: str) -> OperandSlots:
        j, m = self.joint(name)
        return OperandSlots({}, PIN_OUT) if j.fit.pin_out else OperandSlots({"": m.pose.slice(18, 3)}, PIN_IN)

    def outboard_wrench(self, name: str) -> Slot:
        j, m = self.joint(name)
        N = self.scene.zeros if j.cut else self.reactions()[j.child]

        def write(out: Slot) -> None:
            self.scene.outboard_wrench(self.program, j, m, N, out)
            if isinstance(m, CutJointSlots):
                self.scene.add_wrenches(self.program, m, "gat", self._every_row, out, 1)

        return self.once(("outboard", name), 6, write)

    def drive_effort(self, name: str, k: int) -> Slot:
        j, m = self.joint(name)
        assert isinstance(m, BodySlots)
        N = self.reactions()[j.child]
        return self.once(("drive", name, k), 1, lambda out: self.scene.drive_effort(self.program, j, k, m, N, out))

    def device_effort(self, name: str, k: int, field: str) -> Slot:
        j, m = self.joint(name)
        d, q, rate = next((d, q, v) for i, d, q, v in self.scene.each_device(j, m.q, m.v) if i == k)

        def force(out: Slot) -> None:
            if field == "effort":
                self.program.copy(self.scene.value(self.program, d.effort, self.program.scratch_slot), out)
                return
            self.program.zero(out)
            if field == "motor":
                self.scene.motor(self.program, d, rate, out)
            else:
                self.scene.device(self.program, Device(**{field: getattr(d, field)}), "force", q, rate, out)

        return self.once(("device", name, k, field), 1, force)

    def latch_hook(self, name: str, k: int) -> Slot:
        latch = self.joints[name].devices[k].latch
        assert latch is not None
        return Slot(Space.X, self.system.external.stop(self.system.hook(latch.hook)), 1)

    def gap(self, name: str) -> Slot:
        _, m = self.joint(name)
        assert isinstance(m, CutJointSlots)
        return m.blocks["phi"].slice(0, 1)

    def coupling_multiplier(self, row: int) -> Slot:
        return Slot(Space.Z, row, 1)

    # -- friction -----------------------------------------------------------------------------------------------------------

    def _friction(self, name: str) -> FrictionElement:
        return self.elements[name].friction

    def friction_multiplier(self, name: str, k: int) -> Slot:
        return self.scene.eta(self.joints[name]).slice(k, 1)

    def bristle_state(self, name: str, k: int) -> Slot:
        eta = self._friction(name).eta[k]
        return Slot(Space.Y, self.system.nq + self.system.nv + self.system.bristles.index(eta), 1)

    def bristle_scale(self, name: str) -> Slot:
        friction = self._friction(name)
        return self.numbers(("scale", name), (friction.number(LAWS[friction.law].state_scale),))

    def pair_state(self, flag: int) -> Slot:
        return Slot(Space.EXTRA, EXTRA.numbers + flag, 1)

    def friction(self, name: str) -> OperandSlots:
        e = self.elements[name]
        return OperandSlots(element_operands(self.scene, self.program, e), self.scene.key_of(e))

    def contact_reaction(self, name: str) -> OperandSlots:
        (j, m), ft = self.joint(name), self.outboard_wrench(name)
        needs = everything(j)

        def press(out: Slot) -> None:
            write_pin(self.scene, self.program, j, needs, ft, m.pose, out)
            write_span(self.scene, self.program, j, needs, m.pose, out)

        return sized(self.once(("pin", name), len(needs), press))

    def joint_rates(self, name: str) -> OperandSlots:
        j, m = self.joint(name)
        return sized(m.v.slice(0, j.kind.nv))

    def joint_multipliers(self, name: str) -> OperandSlots:
        return sized(self.scene.eta(self.joints[name]))

    # -- loads, and the whole scene -----------------------------------------------------------------------------------------

    def load_ends(self, i: int) -> OperandSlots:
        moving = self.moving()
        motions = [self.scene.ground if b == GROUND else moving[b].motion for b in self.system.loads[i].bodies]
        return OperandSlots(dict(zip("ab", motions, strict=True)))

    def load_numbers(self, i: int) -> Slot:
        return self.numbers(("load", i), self.system.loads[i].leaves)

    def nonlinear_force(self, i: int) -> Slot:
        load = self.system.loads[i]
        if not load.nonlinear:
            return self.scene.zeros.slice(0, 1)
        operands = self.load_ends(i).slots

        def add(out: Slot) -> None:
            self.program.zero(out)
            for law in load.nonlinear:
                numbers = law_numbers(self.scene, load, law)
                self.scene.call(self.program, force_laws.between_points(law.law, "force"), numbers=numbers, out=out, **operands)

        return self.once(("nonlinear", i), 1, add)

    def energies(self) -> Slot:
        moving = self.moving()
        closed = list(self._closed.values())
        return self.once("energies", 2, lambda out: self.scene.energies(self.program, moving, closed, out))

    def _works(self) -> Slot:
        return Slot(Space.Y, self.system.nq + self.system.nv + len(self.system.bristles), len(self.powers))

    def work(self, name: str) -> Slot:
        return self._works().slice(self.powers.index(name), 1)

    def drive_work(self) -> Slot:
        return self.work("drive")

    def load_work(self) -> Slot:
        return self.work("load")

    def taken_work(self) -> Slot:
        works = self._works().slice(0, len(self.powers) - GIVING)

        def add(out: Slot) -> None:
            self.program.zero(out)
            ones = self.scene.constant([1.0] * works.size)
            self.program.call(Builtin.ADD_DOT, [ones, works, out], [works.size, 1])

        return self.once("taken", 1, add)

    def runtime_values(self) -> Slot:
        return Slot(Space.EXTRA, 0, EXTRA.numbers)
