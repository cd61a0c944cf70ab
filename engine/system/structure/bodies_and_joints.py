"""The data of a system, from which the recursion is built. All of it is immutable and hashes by content, which makes the
kernel's key."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY, TIES, JointKind
from trunnion.system.structure.devices_and_loads import Device as Device
from trunnion.system.structure.devices_and_loads import Latch as Latch
from trunnion.system.structure.devices_and_loads import Load as Load
from trunnion.system.structure.devices_and_loads import Motor as Motor
from trunnion.system.structure.devices_and_loads import Signal as Signal
from trunnion.system.structure.devices_and_loads import Stop as Stop
from trunnion.system.structure.external_value_layout import External
from trunnion.system.structure.joint_couplings import Curve, Mimic, Profile, Wheels
from trunnion.system.structure.parameter_table import Leaf, Leaves
from trunnion.system.structure.pin_fit import Fit as Fit

GROUND = -1


@dataclass(frozen=True)
class Slider:
    """One pair of surfaces that slide on each other: the unit of friction states, kinks and events.

    eta: indices of its friction multipliers; flag: its index among all sliding pairs; label: suffix in the names of its states
    ("1", "2").
    """

    flag: int
    eta: tuple[int, ...]
    label: str


@dataclass(frozen=True)
class FrictionElement:
    """Friction of a joint: contact element and law by registry name, numbers by name (``mu``, ``radius``, …)."""

    contact: str
    law: str
    adams: bool
    numbers: tuple[tuple[str, Leaf | Signal], ...]
    sliders: tuple[Slider, ...]
    bound: tuple[int, ...] = ()
    """Friction multipliers of forces that are no friction (``ContactElement.bound``)."""

    @property
    def eta(self) -> tuple[int, ...]:
        """Indices of its multipliers, one a freedom, in their order."""
        return tuple(sorted([*(e for s in self.sliders for e in s.eta), *self.bound]))

    def number(self, name: str) -> Leaf:
        """The leaf called ``name``, which follows nothing; KeyError when the element has none."""
        return {n: x for n, x in self.numbers if not isinstance(x, Signal)}[name]

    @property
    def varies(self) -> bool:
        """Whether any of its numbers follows time or an input."""
        return any(isinstance(x, Signal) for _, x in self.numbers)

    def has(self, name: str) -> bool:
        """Whether the element has a number of that name."""
        return any(n == name for n, _ in self.numbers)

    @property
    def bristles(self) -> bool:
        """Whether its law has a state along every freedom (bristles)."""
        return LAWS[self.law].bristles


@dataclass(frozen=True)
class Joint:
    """A joint. ``inb``/``out``: indices of its bodies (GROUND = −1). Points are relative to the bodies' reference origins, in body
    axes; frames are row-major 3×3 tuples.

    For a tree joint, ``child`` is the body it carries, ``forward`` says whether the child is the outboard part, and q0 and v0 are
    the offsets of its coordinates and free rates in the state. For a cut joint, ``rows`` is the offset of its constraint rows.
    """

    name: str
    kind_name: str
    inb: int
    out: int
    inb_point: Leaves
    out_point: Leaves
    inb_frame: tuple[float, ...]
    out_frame: tuple[float, ...]
    fit: Fit
    pitch: Leaf | None
    devices: tuple[Device, ...]
    friction: FrictionElement | None
    cut: bool
    child: int = GROUND
    forward: bool = True
    q0: int = 0
    v0: int = 0
    rows: int = 0
    stiffness: Leaf | None = None
    wheels: Wheels | None = None
    profile: Profile | None = None
    curve: Curve | None = None
    mimic: Mimic | None = None

    @property
    def kind(self) -> JointKind:
        """The joint type."""
        return REGISTRY.get(self.kind_name) or TIES[self.kind_name]

    @property
    def ends(self) -> tuple[int, ...]:
        """The bodies that the rows of a cut joint are on: its inboard and its outboard one, and those of a joint it follows."""
        return (self.inb, self.out, *((self.mimic.inb, self.mimic.out) if self.mimic else ()))

    @property
    def travels(self) -> int:
        """How many rows of a cut joint hold a travel, m; the others hold angles."""
        return 0 if self.mimic and self.mimic.turns else self.kind.travels

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the freedoms that are not driven."""
        return tuple(k for k, d in enumerate(self.devices) if d.drive is None)

    @property
    def driven(self) -> tuple[int, ...]:
        """Indices of the freedoms whose motion is prescribed."""
        return tuple(k for k, d in enumerate(self.devices) if d.drive is not None)


@dataclass(frozen=True)
class Body:
    """A body in tree order. ``center``: its mass centre, measured from the reference origin in body axes, m; ``inertia``: (xx,
    yy, zz, xy, xz, yz) about the mass centre, kg m², or m² when it is given per mass (``per_mass``); ``points``: named points,
    measured as the mass centre is; ``joint``: index of the tree joint that carries it; ``parent``: its inboard body in the
    tree."""

    name: str
    mass: Leaf
    center: Leaves
    inertia: Leaves
    per_mass: bool
    points: tuple[tuple[str, Leaves], ...]
    joint: int
    parent: int


@dataclass(frozen=True)
class System:
    """A whole mechanism: bodies in tree order (inboard before outboard), joints (those of the tree first, in the order of the
    bodies they carry, then cut joints), applied loads, gravity, and sizes. bounded: whether steps are, for real time."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    loads: tuple[Load, ...]
    gravity: Leaves
    inputs: tuple[str, ...]
    tables: int
    stops: int
    outputs: tuple[str, ...] = ("*",)
    ground_points: tuple[tuple[str, Leaves], ...] = field(default=())
    ties: tuple[Joint, ...] = ()
    latches: int = 0
    bounded: bool = False

    @property
    def down(self) -> tuple[int, ...]:
        """For each latch on which tooth it begins down, 0: up."""
        return tuple(x.down for x in self._hooks)

    @property
    def presses(self) -> tuple[int, ...]:
        """For each latch which stop says whether it is pressed."""
        return tuple(x.pressed for x in self._hooks)

    @property
    def _hooks(self) -> list[Latch]:
        found = [d.latch for j in self.joints for d in j.devices if d.latch is not None]
        return sorted(found, key=lambda x: x.hook)

    def hook(self, latch: int) -> int:
        """Which stop says whether a latch is down: hooks are the last of the stops."""
        return self.stops - self.latches + latch

    @cached_property
    def tree(self) -> tuple[Joint, ...]:
        """The tree joints; joint i carries body i."""
        return self.joints[: len(self.bodies)]

    @cached_property
    def cuts(self) -> tuple[Joint, ...]:
        """The cut joints, and what ties freedoms of others."""
        return self.joints[len(self.bodies) :] + self.ties

    @cached_property
    def nq(self) -> int:
        """Number of coordinates in the state; those of driven freedoms are not in it."""
        return sum(len(state_coordinates(j)) for j in self.tree)

    @cached_property
    def nv(self) -> int:
        """Number of rates in the state."""
        return sum(len(j.free) for j in self.tree)

    @cached_property
    def rows(self) -> int:
        """Number of constraint rows of all cut joints."""
        return sum(j.kind.rows for j in self.cuts)

    @cached_property
    def frictional(self) -> tuple[Joint, ...]:
        """The joints with friction, in the order of all joints."""
        return tuple(j for j in self.joints if j.friction)

    @cached_property
    def neta(self) -> int:
        """Number of friction multipliers."""
        return sum(j.kind.nv for j in self.frictional)

    @cached_property
    def bristles(self) -> tuple[int, ...]:
        """Indices of the friction multipliers whose law has a state. The states come in this order, after the rates, in the
        state of the run."""
        return tuple(e for j in self.frictional if j.friction and j.friction.bristles for s in j.friction.sliders for e in s.eta)

    @cached_property
    def sliders(self) -> tuple[Slider, ...]:
        """All sliding pairs, in order of their flags."""
        return tuple(s for j in self.frictional if j.friction for s in j.friction.sliders)

    @property
    def external(self) -> External:
        """Where things are in the external values x."""
        return External(self.tables, self.stops, len(self.sliders))


def state_coordinates(j: Joint) -> tuple[int, ...]:
    """Indices of the joint's coordinates that are states (quaternions always, others unless driven)."""
    k = j.kind
    driven = {k.coordinate_of(r) for r in j.driven}
    return tuple(i for i in range(k.nq) if i not in driven)
