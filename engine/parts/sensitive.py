"""Derivatives beyond the Jacobian: of rates and columns along inputs and states (the linear unit), and of all that a trajectory is
made of, parameters included (the sensitivity unit)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from engine.kernel.columns import Column
from engine.kernel.records import names_of_powers
from engine.parts.cells import Change, Found, found
from engine.parts.directions import Directions
from engine.parts.known import Part, Rubbing
from engine.parts.powers import write_powers
from engine.parts.rates import Rates, changed, each, time
from engine.parts.rows import Rows
from engine.parts.smooth import Smooth
from engine.parts.store import friction, small
from engine.parts.tape import Block, Builtin, Space
from engine.system.elements import Element
from engine.system.external import TABLE
from engine.system.structure import Joint, System


@dataclass
class Unit:
    """A scene and its directions. values: how many numbers have derivatives."""

    scene: Smooth
    found: Found
    values: int


def states(system: System) -> int:
    """How many states there are."""
    return system.nq + system.nv + len(system.bristles)


# -- the linear unit ------------------------------------------------------------------------------------------------------------


def linear_rates(system: System, active: Sequence[int]) -> Unit:
    """[F; R] along [inputs (a ``tr_signal`` each), y, z]."""
    changes = [*_signals(system), *each(Space.Y, states(system)), *each(Space.Z, len(active) + system.neta)]
    return _rates(system, active, changes, False)


def linear_columns(system: System, chosen: list[Column]) -> Unit:
    """The columns along [inputs, y, λ of all rows, η, accelerations]; integrals, and what only the runtime knows, count as
    constant."""
    multipliers = each(Space.Z, system.rows + system.neta)
    changes = [*_signals(system), *each(Space.Y, states(system)), *multipliers, *each(Space.A, system.nv)]
    return _columns(system, [c if c.quantity.instantaneous else None for c in chosen], changes, False)


def _signals(system: System) -> list[Change]:
    return each(Space.X, TABLE * len(system.inputs), system.external.table(0))


# -- the sensitivity unit -------------------------------------------------------------------------------------------------------


def motion(system: System, parameters: int, active: Sequence[int], quadratures: bool) -> Unit:
    """[F with powers; R; V; H] (``kernel.parameter_unit``) along [y, z, p, inputs, t]."""
    own = [*each(Space.Y, states(system)), *each(Space.Z, len(active) + system.neta)]
    return _rates(system, active, [*own, *_outside(system, parameters)], True, quadratures)


def outputs(system: System, parameters: int, chosen: list[Column], quadratures: bool) -> Unit:
    """The columns along [y, integrals, λ of all rows, η, accelerations, p, inputs, t]."""
    integrals = len(names_of_powers(system)) if quadratures else 0
    own = [*each(Space.Y, states(system) + integrals), *each(Space.Z, system.rows + system.neta), *each(Space.A, system.nv)]
    return _columns(system, chosen, [*own, *_outside(system, parameters)], True)


def _outside(system: System, parameters: int) -> list[Change]:
    inputs = [each(Space.X, 1, system.external.table(i))[0] for i in range(len(system.inputs))]
    return [*each(Space.P, parameters), *inputs, time(Smooth(system))]


class _Motion(Rates):
    """With powers, rates of all frictional freedoms and friction ratios of pairs at rest, less one."""

    def __init__(self, scene: Smooth, active: Sequence[int], d: Directions, quadratures: bool):
        self.powers = len(names_of_powers(scene.system)) if quadratures else 0
        super().__init__(scene, scene.tape("point"), active, d)

    @property
    def between(self) -> int:
        return self.powers

    def write(self) -> None:
        super().write()
        if self.powers:
            write_powers(self.scene, self.tape, self._both, self.moving, self.N, Space.OUT, states(self.system))
        for e in self.parts:
            n = e.joint.kind.nv
            self.tape.copy(self.motion(e.joint).v.part(0, n), Block(Space.OUT, self.size, n))
            self.size += n
        for e in self.parts:
            self._hold(e)
        self.size += len(self.system.sliders)

    def _both(self, j: Joint) -> tuple[Block, Block]:
        found = self.motion(j)
        return found.q, found.v

    def _hold(self, e: Element) -> None:
        """Friction ratios − 1 as if at rest; −1 of laws that hold nothing."""
        pairs, tape, s = e.friction.sliders, self.tape, self.scene
        hold = tape.scratch_block(3 * len(pairs))
        if e.sets:
            self.law(held_alone, e, self.reactions[e.joint.name], u=s.eta(e.joint), hold=hold)
        for i, pair in enumerate(pairs):
            out = Block(Space.OUT, self.size + pair.flag, 1)
            tape.zero(out)
            if e.sets:
                s.call(tape, small.over(), a=hold.part(3 * i + 1, 1), b=hold.part(3 * i, 1), out=out)
            tape.call(Builtin.ADD, [s.against, out], [1])


def held_alone(which: Rubbing) -> Part:
    """What rest holds, without its derivative."""
    return friction.held(which, True)


def _rates(system: System, active: Sequence[int], changes: list[Change], numbers: bool, quadratures: bool = False) -> Unit:
    scene = Smooth(system)
    point = scene.tape("point")
    d = Directions(scene, point, changed(changes), numbers)
    made = _Motion(scene, active, d, quadratures) if numbers else Rates(scene, point, active, d)
    return _unit(scene, d, changes, made.size)


def _columns(system: System, chosen: Sequence[Column | None], changes: list[Change], numbers: bool) -> Unit:
    scene = Smooth(system)
    point = scene.tape("point")
    d = Directions(scene, point, changed(changes), numbers)
    rows = Rows(scene, point)
    for i, c in enumerate(chosen):
        if c:
            point.copy(rows.value(c.key), Block(Space.OUT, i, 1))
    d.follow(point)
    return _unit(scene, d, changes, len(chosen))


def _unit(scene: Smooth, d: Directions, changes: list[Change], count: int) -> Unit:
    """With the values, where they are asked for, too."""
    point, outs = scene.tape("point"), [Block(Space.OUT, i, 1) for i in range(count)]
    point.code.clear()
    d.point(point, outs if d.numbers else ())
    return Unit(scene, found(d, changes, outs), count)
