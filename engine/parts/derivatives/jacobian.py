"""Program of F = ẏ and of the residuals R of the multipliers, and the Jacobian of both (theory, "Jacobians on parts")."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, CutJointSlots, free_of
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.derivatives.acceleration_derivatives import AccelerationTangents, DifferentiableScene
from trunnion.parts.derivatives.forward_mode import Directions
from trunnion.parts.derivatives.tangent_layout import Change, TangentTables, tangent_tables
from trunnion.parts.primitives.primitive_cache import friction
from trunnion.parts.primitives.primitive_keys import FrictionKey, Primitive, rubbing
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.scaled_reactions import ScaledReactions
from trunnion.parts.programs.shared_operands import coordinate_rates, element_operands, write_pin, write_span
from trunnion.system.structure.bodies_and_joints import Joint, state_coordinates
from trunnion.system.structure.external_value_layout import NOW, TABLE
from trunnion.system.structure.friction_joint_indices import Element
from trunnion.system.structure.loop_joints import rubbing_on_loops


class JacobianProgram(AccelerationTangents):
    """Writes F (= ẏ) and the residuals R into OUT. The redundant variant appends the scaled reactions κ, and the change of κ by
    friction. size: number of doubles in OUT."""

    def __init__(
        self, scene: DifferentiableScene, program: Program, active: Sequence[int], directions: Directions, redundant: bool = False
    ):
        super().__init__(scene, program, active, directions, redundant)
        self.redundant, first = redundant, len(program.code)
        self.write()
        directions.follow(program, first)

    @property
    def between(self) -> int:
        """Number of doubles between F and R."""
        return 0

    def write(self) -> None:
        """Write all values after the accelerations."""
        system, program = self.system, self.program
        nq, nv = system.nq, system.nv
        coordinate_rates(self.scene, program, Slot(Space.Y, nq, nv), Slot(Space.OUT, 0, nq))
        program.copy(self.qdd, Slot(Space.OUT, nq, nv))
        bristles, residual = nq + nv, nq + nv + len(system.bristles) + self.between
        self._close(residual)
        residual += len(self.active)
        self.reactions = {e.joint.name: self._components(e) for e in self.elements}
        for e in self.elements:
            n, N = e.joint.kind.nv, self.reactions[e.joint.name]
            if e.friction.bristles:
                self.law(friction.drift, e, N, out=Slot(Space.OUT, bristles, n))
                bristles += n
            acc = self._acceleration(e) if e.sets else self.scene.zeros
            out = Slot(Space.OUT, residual + e.eta[0], n)
            self.law(friction.residual, e, N, eta=self.scene.eta(e.joint), acc=acc, out=out)
            self.open_contact(e.joint, self.scene.eta(e.joint), out)
        self.size = residual + system.neta
        if self.redundant and self.elements:
            self._share(ScaledReactions(self.scene))

    def motion(self, j: Joint) -> BodySlots | CutJointSlots:
        return next(c for c in self.closed if c.joint.name == j.name) if j.cut else self.moving[j.child]

    def motion_of(self, j: Joint) -> tuple[Slot, Slot]:
        """Coordinates and rates of a joint."""
        found = self.motion(j)
        return found.q, found.v

    def law(self, primitive: Callable[[FrictionKey], Primitive], e: Element, N: Slot, **operands: Slot) -> None:
        own = primitive(rubbing(e))
        rates = self.motion(e.joint).v
        self.scene.call(self.program, own, **{**element_operands(self.scene, self.program, e), "N": N, "r": rates, **operands})

    def _close(self, at: int) -> None:
        """Write the residuals R_λ, which are accelerations along the constraint rows of cut joints."""
        for c in self.closed:
            n = c.joint.kind.rows
            out = self.program.scratch_slot(n)
            self.program.copy(c.blocks["xi"], out)
            self._add_accelerations(c.ends, c, out)
            if c.joint.light:
                j = self.system.tree[c.joint.light.joint]
                self.program.copy(free_of(self.qdd, j).slice(j.free.index(c.joint.light.freedom), 1), out)
                less, force = self.scene.constant([c.joint.light.response]), Slot(Space.Z, self.rows[c.joint.rows], 1)
                self.program.call(Builtin.ADD_DOT, [less, force, out], [1, 1])
            for k in range(n):
                if c.joint.rows + k in self.rows:
                    i = self.rows[c.joint.rows + k]
                    self.program.copy(out.slice(k, 1), Slot(Space.OUT, at + i, 1))
                    self.open_contact(c.joint, Slot(Space.Z, i, 1), Slot(Space.OUT, at + i, 1))

    def open_contact(self, j: Joint, multipliers: Slot, residuals: Slot) -> None:
        """Replace the residuals of a joint while the joint's contact is open. (In the Jacobian, the runtime replaces the
        residuals.)"""

    def _add_accelerations(self, ends: list[tuple[int, str]], c: CutJointSlots, out: Slot) -> None:
        for b, which in ends:
            Z = self.scene.acceleration(self.Z, b)
            self.program.call(Builtin.ADD_ROW_DOTS, [c.blocks[which], Z, out], [6, out.size, 6, 1])

    def _acceleration(self, e: Element) -> Slot:
        """Accelerations of all freedoms of a joint."""
        j, program = e.joint, self.program
        out = program.scratch_slot(j.kind.nv)
        if j.cut:
            c = self.motion(j)
            assert isinstance(c, CutJointSlots)
            program.copy(c.blocks["bias"], out)
            self._add_accelerations([(j.inb, "win"), (j.out, "wout")], c, out)
            return out
        for k in range(j.kind.nv):
            program.copy(self.scene.freedom_acceleration(j, k, self.moving[j.child], self.qdd), out.slice(k, 1))
        return out

    def _transmitted(self, j: Joint) -> Slot:
        """Force and torque (6) on the outboard part of a joint."""
        out = self.program.scratch_slot(6)
        m = self.motion(j)
        self.scene.outboard_wrench(self.program, j, m, self.scene.zeros if j.cut else self.N[j.child], out)
        if isinstance(m, CutJointSlots):
            self.scene.add_wrenches(self.program, m, "gat", self.rows, out, 1)
        return out

    def _components(self, e: Element) -> Slot:
        """The components of f_c, m_c that the law of the element needs."""
        j, out = e.joint, self.program.scratch_slot(len(e.needs))
        if e.needs:
            pose = self.motion(j).pose
            write_pin(self.scene, self.program, j, e.needs, self._transmitted(j), pose, out)
            write_span(self.scene, self.program, j, e.needs, pose, out)
        return out

    def _share(self, shares: ScaledReactions) -> None:
        """Write the scaled reactions κ, and the change of κ by friction."""
        program, where = self.program, {j.name: self.motion(j) for j in self.system.joints}
        transmitted = {j.name: self._transmitted(j) for j in shares.joints}
        shares.write(program, where, self.moving, lambda j: transmitted[j.name], Slot(Space.OUT, self.size, shares.size))
        self.size += shares.size
        for e, _, count in rubbing_on_loops(self.system):
            stiffness, n = e.joint.stiffness, len(e.needs) + e.joint.kind.nv
            more, spare = program.scratch_slot(count), program.scratch_slot(count * n)
            operands = element_operands(self.scene, program, e, *([] if stiffness is None else [stiffness]))
            primitive, rates = friction.pressed(rubbing(e), stiffness is not None), self.motion(e.joint).v
            N, u = self.reactions[e.joint.name], self.scene.eta(e.joint)
            self.scene.call(program, primitive, more=more, dN=spare, N=N, r=rates, u=u, **operands)
            program.copy(more, Slot(Space.OUT, self.size, count))
            self.size += count


def jacobian(scene: DifferentiableScene, active: Sequence[int], redundant: bool) -> TangentTables:
    """Write the program ``point``. Returns the tangents of [F; R; κ; change of κ by friction] with respect to [y, t, z]."""
    system = scene.system
    ny, nz = system.nq + system.nv + len(system.bristles), len(active) + system.neta
    changes = [*each(Space.Y, ny), time(scene), *each(Space.Z, nz)]
    point = scene.program("point")
    d = Directions(scene, point, changed(changes))
    rates = JacobianProgram(scene, point, active, d, redundant)
    del point.code[:]
    d.point(point)
    return tangent_tables(d, changes, [Slot(Space.OUT, i, 1) for i in range(rates.size)], _order(scene))


def each(space: Space, count: int, first: int = 0) -> list[Change]:
    """A direction for each of ``count`` numbers of a space, from ``first`` on. Each direction changes only its own number."""
    return [[(Slot(space, first + i, 1), -1)] for i in range(count)]


def time(scene: ScenePasses) -> Change:
    """Direction of time. t itself changes at rate 1. The numbers of a table are a value and its derivatives. Each of them except
    the last one changes at the rate that the next number gives."""
    at, tables = scene.system.external, range(scene.system.tables)
    numbers = [(NOW, -1), *[(at.table(k) + i, at.table(k) + i + 1) for k in tables for i in range(TABLE - 1)]]
    return [(Slot(Space.X, i, 1), rate) for i, rate in numbers]


def changed(changes: Sequence[Change]) -> list[Slot]:
    """All slots that the directions change."""
    return [b for change in changes for b, _ in change]


def _order(scene: DifferentiableScene) -> list[int]:
    """Order of the columns [y, t, z] in which the coordinates and rates of a joint are adjacent."""
    system = scene.system
    out: list[int] = []
    for j in system.tree:
        out += range(j.q0, j.q0 + len(state_coordinates(j)))
        out += range(system.nq + j.v0, system.nq + j.v0 + len(j.free))
    left = set(out)
    count = system.nq + system.nv + len(system.bristles) + 1 + scene.multipliers + system.neta
    return [*out, *[q for q in range(count) if q not in left]]
