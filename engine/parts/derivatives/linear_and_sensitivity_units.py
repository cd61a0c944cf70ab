"""Derivatives beyond the Jacobian. The linear unit differentiates rates and columns with respect to inputs and states. The
sensitivity unit differentiates with respect to parameters, too."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.interface.runtime_tables import names_of_powers
from trunnion.parts.bytecode.program import Builtin, Slot, Space
from trunnion.parts.derivatives.acceleration_derivatives import DifferentiableScene
from trunnion.parts.derivatives.forward_mode import Directions
from trunnion.parts.derivatives.jacobian import JacobianProgram, changed, each, time
from trunnion.parts.derivatives.tangent_layout import Change, TangentTables, tangent_tables
from trunnion.parts.primitives.primitive_cache import friction, joint_devices, signals_loads_energies
from trunnion.parts.primitives.primitive_keys import FrictionKey, Primitive
from trunnion.parts.programs.column_programs import ColumnPrograms
from trunnion.parts.programs.mechanical_powers import write_powers
from trunnion.system.structure.bodies_and_joints import Joint, Latch, System
from trunnion.system.structure.external_value_layout import TABLE
from trunnion.system.structure.friction_joint_indices import Element


@dataclass
class DerivedUnit:
    """A scene with its tangents. values: number of differentiated doubles."""

    scene: DifferentiableScene
    tangents: TangentTables
    values: int


def states(system: System) -> int:
    """Number of states."""
    return system.nq + system.nv + len(system.bristles)


# -- the linear unit ------------------------------------------------------------------------------------------------------------


def linear_rates(system: System, active: Sequence[int]) -> DerivedUnit:
    """Tangents of [F; R] along [inputs (a ``tr_signal`` each), y, z]."""
    changes = [*_signals(system), *each(Space.Y, states(system)), *each(Space.Z, len(active) + system.neta)]
    return _rates(system, active, changes, False)


def linear_columns(system: System, chosen: list[Column]) -> DerivedUnit:
    """Tangents of columns along [inputs, y, λ of all rows, η, accelerations]. Integrals, and values that only the runtime computes,
    are treated as constants."""
    multipliers = each(Space.Z, system.rows + system.neta)
    changes = [*_signals(system), *each(Space.Y, states(system)), *multipliers, *each(Space.A, system.nv)]
    return _columns(system, [c if c.quantity.instantaneous else None for c in chosen], changes, False)


def _signals(system: System) -> list[Change]:
    return each(Space.X, TABLE * len(system.inputs), system.external.table(0))


# -- the sensitivity unit -------------------------------------------------------------------------------------------------------


def motion(system: System, parameters: int, active: Sequence[int], quadratures: bool) -> DerivedUnit:
    """Tangents of f = [F; R; V; H; L; E; G] along [y, z, p, inputs, t].

    F = [q̇; v̇; rates of friction states; powers]. R: multiplier residuals. V: rates of all freedoms of frictional joints. H:
    friction ratio minus one for pairs at rest; zero at their release. L: distance of each latch's hook from its release. E:
    distance or angle inside the free ends of the wall of each joint with such ends. G: gap, rate of the gap and restitution of each
    joint that only pushes. While this joint is open, its residuals in R are its multipliers."""
    own = [*each(Space.Y, states(system)), *each(Space.Z, len(active) + system.neta)]
    return _rates(system, active, [*own, *_outside(system, parameters)], True, quadratures)


def outputs(system: System, parameters: int, chosen: list[Column], quadratures: bool) -> DerivedUnit:
    """Tangents of columns along [y, integrals, λ of all rows, η, accelerations, p, inputs, t]."""
    integrals = len(names_of_powers(system)) if quadratures else 0
    own = [*each(Space.Y, states(system) + integrals), *each(Space.Z, system.rows + system.neta), *each(Space.A, system.nv)]
    return _columns(system, chosen, [*own, *_outside(system, parameters)], True)


def _outside(system: System, parameters: int) -> list[Change]:
    inputs = [each(Space.X, 1, system.external.table(i))[0] for i in range(len(system.inputs))]
    return [*each(Space.P, parameters), *inputs, time(DifferentiableScene(system))]


class _Motion(JacobianProgram):
    """Adds further values to F and R: the powers, and V, H, L, E and G of ``motion``."""

    def __init__(self, scene: DifferentiableScene, active: Sequence[int], d: Directions, quadratures: bool):
        self.powers = len(names_of_powers(scene.system)) if quadratures else 0
        super().__init__(scene, scene.program("point"), active, d)

    @property
    def between(self) -> int:
        return self.powers

    def write(self) -> None:
        super().write()
        if self.powers:
            write_powers(self.scene, self.program, self.motion_of, self.moving, self.N, Space.OUT, states(self.system))
        for e in self.elements:
            n = e.joint.kind.nv
            self.program.copy(self.motion(e.joint).v.slice(0, n), Slot(Space.OUT, self.size, n))
            self.size += n
        for e in self.elements:
            self._hold(e)
        self.size += len(self.system.sliders)
        for j in self.system.joints:
            for k, device in enumerate(j.devices):
                if device.latch is not None:
                    self._hook(device.latch, self.motion(j).q.slice(j.kind.coordinate_of(k), 1))
        self.size += self.system.latches
        for j in self.system.with_free_ends:
            self._copy_block(j, "inside")
        for j in self.system.unilateral:
            self._gap(j)

    def open_contact(self, j: Joint, multipliers: Slot, residuals: Slot) -> None:
        if j.unilateral is None:
            return
        program, closed, n = self.program, Slot(Space.X, self.system.external.stop(j.unilateral.flag), 1), residuals.size
        opened, own = program.scratch_slot(1), program.scratch_slot(n)
        program.copy(self.scene.constant([1.0]), opened)
        program.call(Builtin.ADD_DOT, [self.scene.against, closed, opened], [1, 1])
        program.copy(residuals, own)
        program.call(Builtin.SCALE, [own, closed, residuals], [n])
        for k in range(n):
            program.call(Builtin.ADD_DOT, [opened, multipliers.slice(k, 1), residuals.slice(k, 1)], [1, 1])

    def _gap(self, j: Joint) -> None:
        """Write gap, rate and restitution of a joint that only pushes."""
        assert j.unilateral is not None
        self._copy_block(j, "phi")
        self._copy_block(j, "rate")
        self.program.copy(self.scene.numbers([j.unilateral.restitution]), Slot(Space.OUT, self.size, 1))
        self.size += 1

    def _copy_block(self, j: Joint, name: str) -> None:
        """Write the first number of a block of a cut joint."""
        c = next(c for c in self.closed if c.joint.name == j.name)
        self.program.copy(c.blocks[name].slice(0, 1), Slot(Space.OUT, self.size, 1))
        self.size += 1

    def _hold(self, e: Element) -> None:
        """Write (friction ratio − 1) of each pair, computed for the pair at rest; −1 for a law without static friction."""
        pairs, program, s = e.friction.sliders, self.program, self.scene
        hold = program.scratch_slot(3 * len(pairs))
        if e.sets:
            self.law(held_alone, e, self.reactions[e.joint.name], u=s.eta(e.joint), hold=hold)
        for i, pair in enumerate(pairs):
            out = Slot(Space.OUT, self.size + pair.flag, 1)
            program.zero(out)
            if e.sets:
                s.call(program, signals_loads_energies.over(), a=hold.slice(3 * i + 1, 1), b=hold.slice(3 * i, 1), out=out)
            program.call(Builtin.ADD, [s.against, out], [1])


    def _hook(self, latch: Latch, q: Slot) -> None:
        program, s, found = self.program, self.scene, self.program.scratch_slot(3)
        release = s.value(program, latch.release, program.scratch_slot)
        s.call(program, joint_devices.latch("depths"), q=q, release=release, out=found, **s.latch(program, latch))
        program.copy(found.slice(0, 1), Slot(Space.OUT, self.size + latch.hook, 1))


def held_alone(which: FrictionKey) -> Primitive:
    """The primitive of the static friction capacity, without derivatives."""
    return friction.held(which, True)


def _rates(system: System, active: Sequence[int], changes: list[Change], numbers: bool, quadratures: bool = False) -> DerivedUnit:
    scene = DifferentiableScene(system)
    point = scene.program("point")
    d = Directions(scene, point, changed(changes), numbers)
    made = _Motion(scene, active, d, quadratures) if numbers else JacobianProgram(scene, point, active, d)
    return _unit(scene, d, changes, made.size)


def _columns(system: System, chosen: Sequence[Column | None], changes: list[Change], numbers: bool) -> DerivedUnit:
    scene = DifferentiableScene(system)
    point = scene.program("point")
    d = Directions(scene, point, changed(changes), numbers)
    ColumnPrograms(scene, point).write(chosen)
    d.follow(point)
    return _unit(scene, d, changes, len(chosen))


def _unit(scene: DifferentiableScene, d: Directions, changes: list[Change], count: int) -> DerivedUnit:
    """Finish a unit. If directions change parameters, ``point`` also writes the values of the differentiated quantities."""
    point, outs = scene.program("point"), [Slot(Space.OUT, i, 1) for i in range(count)]
    del point.code[:]
    d.point(point, outs if d.numbers else ())
    return DerivedUnit(scene, tangent_tables(d, changes, outs), count)
