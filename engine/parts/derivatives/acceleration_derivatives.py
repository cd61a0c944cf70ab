"""Accelerations under given multipliers, and derivatives of these accelerations along directions.

The recursion that computes accelerations also computes the derivatives of these accelerations. For this, the forces are replaced by
the derivatives of the body balances at fixed accelerations. The recursion itself therefore needs no tangents (theory, "Jacobians on
parts")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trunnion.kernel.interface.runtime_tables import HANDED, MOTION
from trunnion.parts.bytecode.body_and_joint_slots import BodySlots, free_of
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.derivatives.forward_mode import Directions
from trunnion.parts.layout.scene_tables import SceneTables
from trunnion.parts.primitives.primitive_cache import inverse_dynamics, primitive_derivatives
from trunnion.parts.primitives.primitive_keys import POSE, BodyKey
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.system.structure.bodies_and_joints import GROUND, Joint
from trunnion.system.structure.friction_joint_indices import elements

COUNTERPARTS = ("outward", "moved", "carry")
"""Body functions that ``inverse_dynamics`` also provides."""


class DifferentiableScene(ScenePasses):
    """A scene whose passes use body functions with tangents."""

    def work(self, i: int) -> int:
        return inverse_dynamics.outward(self.rotorless_body(i)).sizes["work"]

    def rotorless_body(self, i: int) -> BodyKey:
        """Key of body i without rotors. The motion and the balance of a body do not depend on rotors."""
        return replace(self.which[i], rotors=False)

    def body_call(self, program: Program, i: int, function: str, **operands: Slot) -> None:
        if function == "weigh":
            self.call(program, inverse_dynamics.weigh(1), numbers=self.inertial_numbers(i), **operands)
        elif function in COUNTERPARTS:
            counterpart = getattr(inverse_dynamics, function)(self.rotorless_body(i))
            self.call(program, counterpart, numbers=self.body_numbers[i], **operands)
        else:
            super().body_call(program, i, function, **operands)

    def reduced_call(self, program: Program, i: int, function: str, **operands: Slot) -> None:
        """Call a function of body i's primitive in the recursion for accelerations."""
        SceneTables.body_call(self, program, i, function, **operands)


class AccelerationTangents:
    """Writes motions, q̈, Ż and N into a program, and differentiates these values along ``directions``.

    active: rows of cut joints with a multiplier. redundant: whether the program needs the wrenches that cut joints transmit."""

    def __init__(
        self, scene: DifferentiableScene, program: Program, active: Sequence[int], directions: Directions, redundant: bool
    ):
        self.scene, self.system, self.program, self.directions = scene, scene.system, program, directions
        self.active, self.elements = tuple(active), elements(scene.system)
        self.rows = {row: i for i, row in enumerate(self.active)}
        scene.multipliers = len(self.active)
        scene.bare = not self.system.neta and not redundant
        self.moving = scene.outward(program, program.scratch_slot)
        self.closed = scene.closed(program, self.moving, program.scratch_slot)
        self._push()
        self.efforts = [self._effort(j, m) for j, m in zip(self.system.tree, self.moving, strict=True)]
        count = len(self.system.bodies)
        self.qdd = program.scratch_slot(self.system.nv)
        self.Z, self.N = ([program.scratch_slot(6) for _ in range(count)] for _ in range(2))
        self._accelerate()
        self._follow()

    # -- forces -------------------------------------------------------------------------------------------------------------

    def _push(self) -> None:
        """Add the wrenches that cut joints exert on their bodies."""
        for c in self.closed:
            for b, g in c.ends:
                if b != GROUND:
                    out = self.scene.force_on(self.program, b, self.moving, self.program.scratch_slot)
                    self.scene.add_wrenches(self.program, c, g, self.rows, out, 1)

    def _effort(self, j: Joint, m: BodySlots) -> Slot:
        """Forces along all freedoms of a tree joint: from devices, friction, and rows of light freedoms."""
        light = [c for c in self.system.light_rows_of(j) if c.rows in self.rows]
        if not j.friction and not light:
            return m.effort
        out = self.scene.times(self.program, self.scene.eta(j), -1) if j.friction else self.program.scratch_slot(j.kind.nv)
        if not j.friction:
            self.program.zero(out)
        if self.scene.acts(j):
            self.program.call(Builtin.ADD, [m.effort, out], [j.kind.nv])
        for c in light:
            assert c.light is not None
            self.program.call(Builtin.ADD, [Slot(Space.Z, self.rows[c.rows], 1), out.slice(c.light.freedom, 1)], [1])
        return out

    # -- accelerations ------------------------------------------------------------------------------------------------------

    def _accelerate(self) -> None:
        """Write q̈, Ż and N, computed by the recursion."""
        program, s, count = self.program, self.scene, len(self.system.bodies)
        self.work = [program.scratch_slot(p.sizes["work"]) for p in s.body_primitives]
        self.kept = [program.scratch_slot(p.sizes["kept"]) for p in s.body_primitives]
        handed = [program.scratch_slot(HANDED) for _ in range(count + 1)]
        y, F = program.scratch_slot(self.system.nv), [program.scratch_slot(6) for _ in range(count)]
        again = [program.scratch_slot(size) for size in (MOTION, POSE, 6)]
        for h in handed:
            program.zero(h)
        for i, m in enumerate(self.moving):
            carrier = s.ground if s.parent(i) == GROUND else self.moving[s.parent(i)].motion
            s.reduced_call(program, i, "outward", q=m.q, v=m.v, known=m.known, carrier=carrier, work=self.work[i], motion=again[0],
                           pose=again[1], bias=again[2])  # fmt: skip
        for i in reversed(range(count)):
            m, j = self.moving[i], self.system.tree[i]
            s.reduced_call(program, i, "inward", work=self.work[i], kept=self.kept[i], handed=handed[i], force=m.force,
                           effort=self.efforts[i], up=handed[s.parent(i)], y=free_of(y, j), F=F[i], known=m.known)  # fmt: skip
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            Z, known = s.acceleration(self.Z, s.parent(i)), m.known
            s.reduced_call(program, i, "accelerations", work=self.work[i], kept=self.kept[i], Z=Z, yc=free_of(y, j), fc=F[i],
                           qdd=free_of(self.qdd, j), Zo=self.Z[i], N=self.N[i], known=known)  # fmt: skip

    def _follow(self) -> None:
        """Write the derivatives of body balances (``less``) and joint balances (``along``) at fixed accelerations. Then write the
        derivatives of the accelerations."""
        program, s, count = self.program, self.scene, len(self.system.bodies)
        fixed, less = ([program.scratch_slot(6) for _ in range(count)] for _ in range(2))
        along, ground = program.scratch_slot(self.system.nv), program.scratch_slot(6)
        program.zero(ground)
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            s.body_call(
                program, i, "moved", work=m.work, Z=s.acceleration(fixed, s.parent(i)), qdd=free_of(self.qdd, j), Zo=fixed[i]
            )
            program.zero(less[i])
            n, own = s.inertial_numbers(i), free_of(along, j)
            s.call(program, inverse_dynamics.weigh(-1), numbers=n, motion=m.motion, force=m.force, Z=fixed[i], N=less[i])
            if own.size:
                program.call(Builtin.SELECT, [self.efforts[i], own], [own.size, *j.free])
            for at, k in enumerate(j.free):
                rotor = j.devices[k].turned
                if rotor is not None:
                    program.call(
                        Builtin.ADD_DOT, [s.numbers([rotor]), free_of(self.qdd, j).slice(at, 1), own.slice(at, 1)], [1, -1]
                    )
        for i, (j, m) in enumerate(zip(self.system.tree, self.moving, strict=True)):
            up = less[s.parent(i)] if s.parent(i) != GROUND else ground
            s.call(program, inverse_dynamics.turned(s.rotorless_body(i)), work=m.work, N=self.N[i], up=up, along=free_of(along, j))
        self.directions.follow(program)
        self._solve(self.directions, fixed, less, along)

    def _solve(self, d: Directions, fixed: list[Slot], less: list[Slot], along: Slot) -> None:
        """Write the tangents of q̈, Ż and N by the recursion. The derivatives of the balances serve as forces."""
        program, s, count = self.program, self.scene, len(self.system.bodies)
        y, fq = program.scratch_slot(self.system.nv), program.scratch_slot(self.system.nv)
        Z, nothing = [program.scratch_slot(6) for _ in range(count)], program.scratch_slot(6)
        for i in reversed(range(count)):
            j, up = self.system.tree[i], less[s.parent(i)] if s.parent(i) != GROUND else nothing
            spots = {
                "effort": free_of(along, j),
                "fc": less[i],
                "yc": free_of(y, j),
                "fq": free_of(fq, j),
                "up": up,
            }
            self._linear(d, i, "column", spots, ("effort", "fc"), ("yc", "fq"), ("up",))
        for i in range(count):
            j, before = self.system.tree[i], Z[s.parent(i)] if s.parent(i) != GROUND else s.zeros.slice(0, 6)
            spots = {
                "Z": before,
                "yc": free_of(y, j),
                "fc": less[i],
                "qdd": free_of(self.qdd, j),
                "Zo": Z[i],
                "N": self.N[i],
            }
            self._linear(d, i, "response", spots, ("Z", "yc", "fc"), ("qdd", "Zo", "N"), ())
        for i in range(count):
            d.linear(Builtin.COPY, [(Z[i], True), (self.Z[i], True)], [Z[i]], [self.Z[i]], numbers=[6])
            d.linear(Builtin.ADD, [(fixed[i], True), (self.Z[i], True)], [fixed[i]], [], [self.Z[i]], numbers=[6])

    def _linear(self, d: Directions, i: int, function: str, spots: dict[str, Slot], ins: Sequence[str], outs: Sequence[str],
                added: Sequence[str]) -> None:  # fmt: skip
        primitive, kept = primitive_derivatives.solving(self.scene.which[i]), {"work": self.work[i], "kept": self.kept[i]}
        name = f"v{self.scene.which[i].name}_{function}"
        operands = [(kept[n], False) if n in kept else (spots[n], True) for n in primitive.operands[name]]
        read, written, summed = ([spots[n] for n in of] for of in (ins, outs, added))
        d.linear(self.scene.function(primitive, name), operands, read, written, summed)
