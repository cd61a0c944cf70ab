"""Passes over the bodies of a scene, and the forces on bodies and along freedoms."""

from __future__ import annotations

from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.parts.bytecode.body_and_joint_slots import ALONG, Allocate, BodySlots, CutJointSlots
from trunnion.parts.bytecode.program import Builtin, Program, Slot, Space
from trunnion.parts.layout.load_operands import call_joining
from trunnion.parts.primitives.primitive_cache import loop_joints_and_reactions, signals_loads_energies
from trunnion.parts.primitives.primitive_keys import BARE, PIECE, POSE
from trunnion.parts.programs.couplings import foot, light, piece, tied
from trunnion.parts.programs.joint_signals_and_devices import JointForces
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, Load, state_coordinates


class ScenePasses(JointForces):
    """Writes passes that several functions of a kernel share."""

    # -- the pass outward ---------------------------------------------------------------------------------------------------

    def outward(self, program: Program, allocate: Allocate, forces: bool = True) -> list[BodySlots]:
        """Write the motions of all bodies, from the ground outward. forces: whether to write device forces and loads, too."""
        out: list[BodySlots] = []
        bias = allocate(6 * (len(self.system.bodies) + 1))
        for i, j in enumerate(self.system.tree):
            q, v, known = self.rates_of(program, j, allocate)
            motion, pose, work = allocate(MOTION), allocate(POSE), allocate(self.work(i))
            m = BodySlots(q, v, known, motion, pose, work, self.zeros, self.zeros, bias.slice(6 * i, 6))
            carrier = self.ground if self.parent(i) == GROUND else out[self.parent(i)].motion
            self.body_call(program, i, "outward", q=q, v=v, known=known, carrier=carrier, work=m.work, motion=m.motion, pose=m.pose,
                           bias=m.bias)  # fmt: skip
            out.append(m)
        program.copy(self.base, bias.slice(bias.size - 6, 6))
        self.all_bias = bias
        if forces:
            for j in self.system.tree:
                self._efforts(program, j, out[j.child], allocate)
            for load in self.system.loads:
                self._load(program, load, out, allocate)
        return out

    def rates_of(self, program: Program, j: Joint, allocate: Allocate) -> tuple[Slot, Slot, Slot]:
        """Coordinates and rates of all freedoms of a tree joint, and the joint's prescribed accelerations."""
        states = state_coordinates(j)
        own_q, own_v = Slot(Space.Y, j.q0, len(states)), Slot(Space.Y, self.system.nq + j.v0, len(j.free))
        if not j.driven:
            return own_q, own_v, self.zeros
        q, v, known = allocate(j.kind.nq), allocate(j.kind.nv), allocate(j.kind.nv)
        program.zero(known)
        for at, i in enumerate(states):
            program.copy(own_q.slice(at, 1), q.slice(i, 1))
        for at, k in enumerate(j.free):
            program.copy(own_v.slice(at, 1), v.slice(k, 1))
        for k in j.driven:
            drive = j.devices[k].drive
            assert drive is not None
            moved = self.motion(program, drive, allocate)
            for source, target in ((0, q.slice(j.kind.coordinate_of(k), 1)), (1, v.slice(k, 1)), (2, known.slice(k, 1))):
                program.copy(moved.slice(source, 1), target)
        return q, v, known

    # -- forces and energies -------------------------------------------------------------------------------------------------

    def _efforts(self, program: Program, j: Joint, m: BodySlots, allocate: Allocate) -> None:
        if self.acts(j):
            m.effort = allocate(j.kind.nv)
            program.zero(m.effort)
            self.add_efforts(program, j, m.q, m.v, m.effort, allocate)

    def add_efforts(self, program: Program, j: Joint, q: Slot, v: Slot, out: Slot, allocate: Allocate) -> None:
        """Add the forces of a joint's devices along each freedom."""
        for k, d, own, rate in self.each_device(j, q, v):
            self.device(program, d, "force", own, rate, out.slice(k, 1))
            if d.effort:
                program.call(Builtin.ADD, [self.value(program, d.effort, allocate), out.slice(k, 1)], [1])
            self.motor(program, d, rate, out.slice(k, 1))

    def closed(self, program: Program, moving: list[BodySlots], allocate: Allocate, forces: bool = True) -> list[CutJointSlots]:
        """Write the cut joints, from the motions of all bodies. forces: whether to add the device forces of these joints to the
        bodies."""
        return [self._row(program, j, moving, allocate, forces) for j in self.system.cuts]

    def _row(self, program: Program, j: Joint, moving: list[BodySlots], allocate: Allocate, forces: bool) -> CutJointSlots:
        if j.light:
            return light(self, j)
        return tied(self, program, j, moving, allocate) if j.mimic else self._closed(program, j, moving, allocate, forces)

    def _closed(self, program: Program, j: Joint, moving: list[BodySlots], allocate: Allocate, forces: bool) -> CutJointSlots:
        ground = "inb" if j.inb == GROUND else "out" if j.out == GROUND else ""
        bare = ("moving" if forces else "closed") if self.bare and not self.acts(j) and not j.friction else ""
        primitive, nv, n = loop_joints_and_reactions.cut(j.kind_name, ground, bare), j.kind.nv, j.kind.rows
        sizes = {"phi": n, "rate": n, "xi": n, "gin": 6 * n, "gout": 6 * n, "gat": 6 * n, "q": j.kind.nq, "v": nv, "bias": nv,
                 "win": 6 * nv, "wout": 6 * nv, "wat": 6 * nv, "pose": POSE, "point": 3}  # fmt: skip
        ends_of_wall = ["inside"] if j.profile or j.curve else []
        sizes |= dict.fromkeys(ends_of_wall, 1)
        asked = (*(BARE[bare] or sizes), *ends_of_wall)
        blocks = {name: allocate(size) if name in asked else self.zeros for name, size in sizes.items()}
        ends = {name: moving[b].motion for name, b in (("inb", j.inb), ("out", j.out)) if b != GROUND}
        wheels = [j.wheels.module, *j.wheels.teeth, j.wheels.phase] if j.wheels else []
        wheels += [j.wheels.lead] if j.wheels and j.wheels.lead is not None else []
        length = [j.length] if j.length is not None else []
        middle = [*j.profile.middle, j.profile.half, j.profile.side, j.profile.roller] if j.profile else []
        slot = [j.slot.play, *j.slot.mouths, j.slot.repeated] if j.slot else []
        slot += [j.curve.length, j.curve.roller] if j.curve else []
        slot += [j.unilateral.thickness if j.unilateral else 0.0] if ends_of_wall else []
        numbers = self.numbers([*j.inb_frame, *j.out_frame, *j.inb_point, *j.out_point, *wheels, *length, *middle, *slot])
        bearing = loop_joints_and_reactions.bearing
        if j.curve:
            ends[PIECE] = foot(self, program, j.curve, bearing(j.kind_name, ground), numbers=numbers, **ends)
        if j.profile:
            ends[PIECE] = piece(self, program, j.profile, bearing(j.kind_name, ground), numbers=numbers, **ends)
        self.call(program, primitive, numbers=numbers, **ends, **blocks)
        made = CutJointSlots(j, blocks["q"], blocks["v"], blocks["pose"], blocks, self.zeros)
        if forces and self.acts(j):
            made.effort = allocate(nv)
            program.zero(made.effort)
            self.add_efforts(program, j, made.q, made.v, made.effort, allocate)
            for b, which in ((j.inb, "win"), (j.out, "wout")):
                if b != GROUND:
                    program.call(
                        Builtin.ADD_COLUMNS, [blocks[which], made.effort, self.force_on(program, b, moving, allocate)], [6, nv]
                    )
        return made

    def outboard_wrench(self, program: Program, j: Joint, m: BodySlots | CutJointSlots, N: Slot, out: Slot) -> None:
        """Write force and torque on a joint's outboard part. For a cut joint, the wrench contains only the forces of its devices.
        N: reaction of a tree joint."""
        if isinstance(m, CutJointSlots):
            program.zero(out)
            program.call(Builtin.ADD_COLUMNS, [m.blocks["wat"], m.effort, out], [6, j.kind.nv])
        else:
            self.call(program, loop_joints_and_reactions.outboard(j.forward), N=N, pose=m.pose, out=out)

    @staticmethod
    def freedom_acceleration(j: Joint, k: int, m: BodySlots, qdd: Slot) -> Slot:
        """Acceleration of freedom k of a tree joint: an entry of q̈ (nv), or a prescribed acceleration."""
        return qdd.slice(j.v0 + j.free.index(k), 1) if k in j.free else m.known.slice(k, 1)

    def force_on(self, program: Program, b: int, moving: list[BodySlots], allocate: Allocate) -> Slot:
        """The slot of the wrench on a body. The slot starts at zero; loads and devices add to it."""
        if moving[b].force is self.zeros:
            moving[b].force = allocate(6)
            program.zero(moving[b].force)
        return moving[b].force

    def _load(self, program: Program, load: Load, moving: list[BodySlots], allocate: Allocate) -> None:
        for b in load.bodies:
            if b != GROUND:
                self.force_on(program, b, moving, allocate)
        if load.joins:
            sink = program.scratch_slot(6)
            forces = [moving[b].force if b != GROUND else sink for b in load.bodies]
            call_joining(self, program, load, "wrench", moving, on_a=forces[0], on_b=forces[1])
            return
        m = moving[load.bodies[0]]
        self.call(
            program,
            signals_loads_energies.load(load.acts_as, load.body_frame, "wrench"),
            out=m.force,
            **self.applied(program, load, m, allocate),
        )

    def balance(
        self, program: Program, moving: list[BodySlots], Z: list[Slot], closed: list[CutJointSlots], rows: dict[int, int]
    ) -> list[Slot]:
        """Write the reaction N of every body, from the balance of the body. rows: maps each row with a multiplier to its index in
        z."""
        N = [program.scratch_slot(6) for _ in Z]
        for i, out in enumerate(N):
            program.zero(out)
            self.body_call(program, i, "weigh", work=moving[i].work, motion=moving[i].motion, force=moving[i].force, Z=Z[i], N=out)
        for c in closed:
            for b, g in c.ends:
                if b != GROUND:
                    self.add_wrenches(program, c, g, rows, N[b], -1)
        for i in reversed(range(len(N))):
            if self.parent(i) != GROUND:
                self.body_call(program, i, "carry", work=moving[i].work, up=N[self.parent(i)], N=N[i])
        return N

    def drive_effort(self, program: Program, j: Joint, k: int, m: BodySlots, N: Slot, out: Slot) -> None:
        """Write the effort of a drive. The effort is the transmitted force along the freedom, minus the device forces, plus η (the
        friction force is −η), plus the inertia force of the rotor."""
        devices = program.scratch_slot(1)
        pitch = self.numbers([j.pitch if j.pitch is not None else 0.0])
        self.call(program, signals_loads_energies.along(j.kind_name, j.forward, k), N=N, pose=m.pose, pitch=pitch, out=out)
        program.zero(devices)
        i, d = j.kind.coordinate_of(k), j.devices[k]
        self.device(program, d, "force", m.q.slice(i, 1) if i >= 0 else self.zeros, m.v.slice(k, 1), devices)
        if d.effort:
            program.call(Builtin.ADD, [self.value(program, d.effort, program.scratch_slot), devices], [1])
        self.motor(program, d, m.v.slice(k, 1), devices)
        program.call(Builtin.ADD_DOT, [devices, self.one, out], [1, -1])
        if j.friction:
            program.call(Builtin.ADD_DOT, [self.eta(j).slice(k, 1), self.one, out], [1, 1])
        if d.inertia is not None:
            program.call(Builtin.ADD_DOT, [self.numbers([d.inertia]), m.known.slice(k, 1), out], [1, 1])

    def eta(self, j: Joint) -> Slot:
        """The friction multipliers of a joint."""
        assert j.friction is not None
        return Slot(Space.Z, self.multipliers + j.friction.eta[0], j.kind.nv)

    def add_wrenches(self, program: Program, c: CutJointSlots, g: str, rows: dict[int, int], out: Slot, sign: int) -> None:
        """Add to ``out`` the wrenches g of a cut joint's multipliers and friction (−η), times ``sign``."""
        j = c.joint
        for k in range(j.kind.rows):
            if j.rows + k in rows:
                z = self.times(program, Slot(Space.Z, rows[j.rows + k], 1), sign)
                program.call(Builtin.ADD_COLUMNS, [c.row(g, k), z, out], [6, 1])
        if j.friction and g in ALONG:
            program.call(Builtin.ADD_COLUMNS, [c.blocks[ALONG[g]], self.times(program, self.eta(j), -sign), out], [6, j.kind.nv])

    def times(self, program: Program, numbers: Slot, sign: int) -> Slot:
        """Slot of these numbers times ``sign`` (1 or −1)."""
        if sign > 0:
            return numbers
        out = program.scratch_slot(numbers.size)
        program.call(Builtin.SCALE, [numbers, self.against, out], [numbers.size])
        return out

    def energies(self, program: Program, moving: list[BodySlots], closed: list[CutJointSlots], out: Slot) -> None:
        """Write kinetic and potential energy."""
        program.zero(out)
        for i, m in enumerate(moving):
            numbers = self.inertial_numbers(i)
            self.call(program, signals_loads_energies.energies(), numbers=numbers, g=self.gravity, motion=m.motion, out=out)
        potential = out.slice(1, 1)
        for j, m in zip(self.system.tree, moving, strict=True):
            self._spun(program, j, m, out.slice(0, 1))
        joints = [(j, m.q, m.v) for j, m in zip(self.system.tree, moving, strict=True)] + [(c.joint, c.q, c.v) for c in closed]
        for j, q, v in joints:
            for _, d, own, rate in self.each_device(j, q, v):
                self.device(program, d, "potential", own, rate, potential)
        for load in self.system.loads:
            if load.joins:
                call_joining(self, program, load, "potential", moving, out=potential)

    def _spun(self, program: Program, j: Joint, m: BodySlots, kinetic: Slot) -> None:
        """Add the kinetic energy of a joint's rotors."""
        for k, d in enumerate(j.devices):
            if d.inertia is None:
                continue
            half, rate = program.scratch_slot(1), m.v.slice(k, 1)
            program.call(Builtin.SCALE, [rate, self.constant([0.5]), half], [1])
            momentum = program.scratch_slot(1)
            program.call(Builtin.SCALE, [rate, self.numbers([d.inertia]), momentum], [1])
            program.call(Builtin.ADD_DOT, [half, momentum, kinetic], [1, 1])

    def applied(self, program: Program, load: Load, m: BodySlots, allocate: Allocate) -> dict[str, Slot]:
        """Operands for the primitives of a load on a body."""
        numbers, value, at = self.numbers(load.points[0] if load.points else (0.0, 0.0, 0.0)), allocate(3), None
        if load.kind == "field":
            at = program.scratch_slot(3)
            self.call(program, signals_loads_energies.place(), numbers=numbers, motion=m.motion, out=at)
        for k, s in enumerate(load.vector):
            found = self.value(program, s, allocate) if at is None or s is None else self.formula(program, s, allocate, at=at)
            program.copy(found, value.slice(k, 1))
        return {"numbers": numbers, "motion": m.motion, "value": value}
