"""Scaled reactions of joints in loops: the criterion that selects the reactions of redundant loops
(``recursion.redundant_loop_reactions``)."""

from __future__ import annotations

from collections.abc import Callable

from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, CutJointSlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot
from trunnion.parts.primitives.primitive_cache import loop_joints_and_reactions
from trunnion.parts.primitives.primitive_keys import sized
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.loop_joints import NO_SIZE, block_points, loop_joints, rows_of, rubs, with_centres
from trunnion.system.structure.parameter_table import Leaves


class ScaledReactions:
    """Writes the scaled reactions of a scene. size: number of these reactions."""

    def __init__(self, scene: ScenePasses):
        self.scene, self.system = scene, scene.system
        self.joints, self.rubs = loop_joints(scene.system), rubs(scene.system)
        self.rows = dict(rows_of(scene.system))
        self.size = sum(self.rows.values())
        self._spins: dict[int, Slot] = {}
        self._numbers: dict[str, Slot] = {}
        self._sizes: dict[int, tuple[Slot, Slot]] = {}
        points = block_points(scene.system) if self.rubs else {}
        self._arms = {j.name: self._arm(j, points[j.name]) for j in self.joints} if self.rubs else {}

    def at(self, name: str) -> int:
        """Index of the first scaled reaction of a joint."""
        names = list(self.rows)
        return sum(self.rows[n] for n in names[: names.index(name)])

    def write(
        self,
        program: Program,
        where: dict[str, BodySlots | CutJointSlots],
        moving: list[BodySlots],
        ft: Callable[[Joint], Slot | None],
        out: Slot,
    ) -> None:
        """Write all scaled reactions. ft: function that returns the wrench that a joint transmits to its outboard part, or None for
        zero."""
        at = zeros = 0
        for j in self.joints:
            size, transmitted = self.rows[j.name], ft(j)
            at += size
            if transmitted is None:
                zeros += size
                continue
            program.zero(out.slice(at - size - zeros, zeros))
            own, zeros = out.slice(at - size, size), 0
            if self.rubs:
                self._sprung(program, j, where[j.name].pose, transmitted, own)
            else:
                self._weighed(program, j, where[j.name], moving, transmitted, own)
        program.zero(out.slice(at - zeros, zeros))

    def _sprung(self, program: Program, j: Joint, pose: Slot, ft: Slot, out: Slot) -> None:
        f = j.friction
        own = sized(f.contact) if f and CONTACTS[f.contact].count else ()
        found = [(name, f.number(name)) for name, _ in (f.numbers if f else ()) if f and name in own]
        sizes, leaves, soft = tuple(name for name, _ in found), [x for _, x in found], j.stiffness is not None
        primitive = loop_joints_and_reactions.sprung(j.kind_name, j.fit, sizes, soft, j.driven)
        if j.name not in self._numbers:
            self._numbers[j.name] = self.scene.numbers([*leaves, *([j.stiffness] if j.stiffness is not None else [])])
        self.scene.call(program, primitive, ft=ft, pose=pose, numbers=self._numbers[j.name], arm=self._arms[j.name], out=out)

    def _weighed(
        self, program: Program, j: Joint, here: BodySlots | CutJointSlots, moving: list[BodySlots], ft: Slot, out: Slot
    ) -> None:
        point = self._point(program, j, here)
        at = 0
        for body, sign in ((j.out, 1), (j.inb, -1)):
            if body == GROUND:
                continue
            self.scene.call(
                program, loop_joints_and_reactions.weighed(sign), ft=ft, point=point, motion=moving[body].motion,
                numbers=self.scene.inertial_numbers(body), spin=self.spin(body), out=out.slice(at, 6),
            )  # fmt: skip
            at += 6

    def _point(self, program: Program, j: Joint, here: BodySlots | CutJointSlots) -> Slot:
        """The point of a joint on its outboard part, in world coordinates (3)."""
        if isinstance(here, CutJointSlots):
            return here.blocks["point"]
        origin = here.motion.slice(9, 3)
        if j.forward:
            return origin
        point = program.scratch_slot(3)
        program.copy(origin, point)
        program.call(Builtin.ADD, [here.pose.slice(18, 3), point], [3])
        return point

    def spin(self, i: int) -> Slot:
        """Half the trace of a body's inertia, kg m²."""
        if i not in self._spins:
            self._spins[i] = self._spin(i)
        return self._spins[i]

    def _spin(self, i: int) -> Slot:
        s, prepare, body = self.scene, self.scene.prepare, self.system.bodies[i]
        n, out = s.inertial_numbers(i), s.constant_slot(1)
        prepare.zero(out)
        if any(x != 0.0 for x in body.inertia[:3]):
            prepare.call(Builtin.ADD_DOT, [n.slice(4, 3), s.constant([0.5, 0.5, 0.5]), out], [3, 1])
            return out
        prepare.copy(s.constant([NO_SIZE]), out)
        if any(x != 0.0 for x in body.center):
            prepare.call(Builtin.ADD_DOT, [n.slice(1, 3), n.slice(1, 3), out], [3, 1])
        else:
            for j in self.system.joints:
                for point, of in ((j.inb_point, j.inb), (j.out_point, j.out)):
                    if of == i:
                        p = s.numbers(point)
                        prepare.call(Builtin.ADD_DOT, [p, p, out], [3, 1])
        prepare.call(Builtin.SCALE, [out, n.slice(0, 1), out], [1])
        return out

    def _arm(self, j: Joint, points: dict[int, list[Leaves]]) -> Slot:
        """Half length of the contacts of a joint without friction, m. points: the joint points of its block, by body."""
        s, bodies = self.scene, [b for b in (j.out, j.inb) if b != GROUND]
        spins, masses, out = s.constant_slot(len(bodies)), s.constant_slot(len(bodies)), s.constant_slot(1)
        for k, b in enumerate(bodies):
            s.prepare.copy(self.spin(b), spins.slice(k, 1))
            s.prepare.copy(s.inertial_numbers(b).slice(0, 1), masses.slice(k, 1))
        if id(points) not in self._sizes:
            self._sizes[id(points)] = self._size(points), self._size(with_centres(self.system, points))
        size, wide = self._sizes[id(points)]
        arm = loop_joints_and_reactions.arm(len(bodies))
        s.call(s.prepare, arm, spin=spins, mass=masses, size=size, wide=wide, out=out)
        return out

    def _size(self, points: dict[int, list[Leaves]]) -> Slot:
        """Squared size of a block (``recursion.loop_contact_springs.block_size``), m²."""
        s, prepare = self.scene, self.scene.prepare
        total, middle, away = s.constant_slot(1), s.constant_slot(3), s.constant_slot(3)
        prepare.zero(total)
        for own in points.values():
            places = [s.numbers(p) for p in own]
            prepare.zero(middle)
            for p in places:
                prepare.call(Builtin.ADD_COLUMNS, [p, s.constant([1.0 / len(own)]), middle], [3, 1])
            for p in places:
                prepare.call(Builtin.COMBINE, [p, middle, s.constant([-1.0]), away], [3, 1, 3])
                prepare.call(Builtin.ADD_DOT, [away, away, total], [3, 1])
        prepare.call(Builtin.SCALE, [total, s.constant([1.0 / sum(map(len, points.values()))]), total], [1])
        return total
