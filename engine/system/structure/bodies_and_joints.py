"""The data of a system, from which the recursion is built. All data are immutable. The hash of the data depends on the content
alone, and gives the kernel's key."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY, TIES, JointKind
from trunnion.system.structure.coupling_joint_data import Curve, LightFreedom, Mimic, Profile, Slot, Unilateral, Wheels
from trunnion.system.structure.device_load_signal_data import Device as Device
from trunnion.system.structure.device_load_signal_data import Latch as Latch
from trunnion.system.structure.device_load_signal_data import LawForce as LawForce
from trunnion.system.structure.device_load_signal_data import Load as Load
from trunnion.system.structure.device_load_signal_data import Motor as Motor
from trunnion.system.structure.device_load_signal_data import Signal as Signal
from trunnion.system.structure.device_load_signal_data import Stop as Stop
from trunnion.system.structure.external_value_layout import External
from trunnion.system.structure.parameter_table import Leaf, Leaves
from trunnion.system.structure.pin_and_bearing_roles import Fit as Fit

GROUND = -1


@dataclass(frozen=True)
class Slider:
    """A friction pair: a pair of surfaces that slide on each other. Friction states, kinks and events belong to a pair.

    flag    index among all friction pairs of the system.
    eta     indices of the pair's friction multipliers.
    label   suffix in the names of the pair's states ("1", "2").
    """

    flag: int
    eta: tuple[int, ...]
    label: str


@dataclass(frozen=True)
class FrictionElement:
    """Friction of a joint: contact element and law by registry name, parameters by name (``mu``, ``radius``, …)."""

    contact: str
    law: str
    adams: bool
    numbers: tuple[tuple[str, Leaf | Signal], ...]
    sliders: tuple[Slider, ...]
    bound: tuple[int, ...] = ()
    """Indices of the multipliers η that are contact forces instead of friction (``ContactElement.bound``)."""

    @property
    def eta(self) -> tuple[int, ...]:
        """Indices of the friction multipliers, one for each freedom, in the order of the freedoms."""
        return tuple(sorted([*(e for s in self.sliders for e in s.eta), *self.bound]))

    def number(self, name: str) -> Leaf:
        """The leaf of the parameter ``name``. Raises KeyError if there is no such parameter, or if the parameter depends on time or
        an input."""
        return {n: x for n, x in self.numbers if not isinstance(x, Signal)}[name]

    @property
    def varies(self) -> bool:
        """Whether any parameter depends on time or an input."""
        return any(isinstance(x, Signal) for _, x in self.numbers)

    def has(self, name: str) -> bool:
        """Whether the element has a parameter of this name."""
        return any(n == name for n, _ in self.numbers)

    @property
    def bristles(self) -> bool:
        """Whether the law has a state along every freedom (bristles)."""
        return LAWS[self.law].bristles


@dataclass(frozen=True)
class Joint:
    """A joint. ``inb``, ``out``: indices of the inboard and outboard body (GROUND = −1). Points are relative to the body's
    reference origin, in body axes, m. Frames are 3×3 matrices as row-major tuples (9).

    ``child``, ``forward``, ``q0`` and ``v0`` belong to tree joints. ``child`` is the index of the body that the joint carries;
    ``forward`` is true if this body is the outboard part. q0 and v0 are the offsets of the joint's coordinates and free rates in
    the state. ``rows`` belongs to cut joints: the offset of the joint's constraint rows.
    ``length`` belongs to rods, m.
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
    length: Leaf | None = None
    profile: Profile | None = None
    curve: Curve | None = None
    slot: Slot | None = None
    mimic: Mimic | None = None
    light: LightFreedom | None = None
    unilateral: Unilateral | None = None

    @property
    def kind(self) -> JointKind:
        """The joint type."""
        return REGISTRY.get(self.kind_name) or TIES[self.kind_name]

    @property
    def ends(self) -> tuple[int, ...]:
        """The bodies on which the rows of a cut joint act: inboard body, outboard body and, for a coupling, those of the leader."""
        return (self.inb, self.out, *((self.mimic.inb, self.mimic.out) if self.mimic else ()))

    @property
    def travels(self) -> int:
        """Number of rows of a cut joint that constrain a translation, m. The other rows constrain rotations."""
        own = self.mimic or self.light
        return 0 if own and own.turns else self.kind.travels

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Indices of the freedoms that are not driven."""
        return tuple(k for k, d in enumerate(self.devices) if d.drive is None)

    def freedom(self, k: int) -> str:
        """A freedom in words: "freedom 3 of plane (rotation about e1)"."""
        axis = self.kind.axes[k][0]
        side = "outboard " if axis.side == "out" else ""
        return f"freedom {k + 1} of {self.name} ({'rotation about' if axis.rot else 'travel along'} {side}e{axis.index + 1})"

    @cached_property
    def driven(self) -> tuple[int, ...]:
        """Indices of the freedoms whose motion is prescribed."""
        return tuple(k for k, d in enumerate(self.devices) if d.drive is not None)


@dataclass(frozen=True)
class Body:
    """A body, in tree order.

    center     mass centre, from the reference origin in body axes, m.
    inertia    (xx, yy, zz, xy, xz, yz) about the mass centre, kg m²; with ``per_mass``, divided by the mass, m².
    points     named points, from the reference origin in body axes, m.
    joint      index of the tree joint that carries the body.
    parent     index of the inboard body in the tree."""

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
    """A whole mechanism.

    bodies           in tree order: inboard before outboard.
    joints           tree joints, in the order of the bodies that they carry; then cut joints.
    ties             couplings, which count as cut joints.
    tables           number of tables, external inputs included.
    stops            number of flags of end stops and latches, hooks of latches included.
    latches          number of latches.
    bounded          whether steps have a bounded cost, for real-time use."""

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
        """For each latch: the tooth on which the latch's hook is at the start; 0: the hook is up."""
        return tuple(x.down for x in self._hooks)

    @property
    def presses(self) -> tuple[int, ...]:
        """For each latch: index of the flag that is 1 while the latch's hook is pressed."""
        return tuple(x.pressed for x in self._hooks)

    @property
    def _hooks(self) -> list[Latch]:
        found = [d.latch for j in self.joints for d in j.devices if d.latch is not None]
        return sorted(found, key=lambda x: x.hook)

    def hook(self, latch: int) -> int:
        """Index of a latch's hook among the flags of end stops; hooks are the last of these flags."""
        return self.stops - self.latches + latch

    @cached_property
    def tree(self) -> tuple[Joint, ...]:
        """The tree joints. Joint i carries body i."""
        return self.joints[: len(self.bodies)]

    @cached_property
    def cuts(self) -> tuple[Joint, ...]:
        """The cut joints, then the couplings."""
        return self.joints[len(self.bodies) :] + self.ties

    @cached_property
    def unilateral(self) -> tuple[Joint, ...]:
        """The joints whose contact can push, but not pull."""
        return tuple(j for j in self.joints if j.unilateral)

    @cached_property
    def with_free_ends(self) -> tuple[Joint, ...]:
        """Joints that only push, and whose wall has free ends."""
        return tuple(j for j in self.unilateral if j.unilateral and j.unilateral.inside >= 0)

    @cached_property
    def light(self) -> tuple[Joint, ...]:
        """The rows of light freedoms. These rows are the last of ``ties``."""
        return tuple(j for j in self.ties if j.light)

    @property
    def constraint_rows(self) -> int:
        """Number of rows that constrain the motion: all but those of light freedoms."""
        return self.rows - len(self.light)

    def light_rows_of(self, j: Joint) -> list[Joint]:
        """The rows of a tree joint's light freedoms."""
        return [c for c in self.light if c.light is not None and self.tree[c.light.joint].name == j.name]

    @cached_property
    def nq(self) -> int:
        """Number of coordinates in the state. Coordinates of driven freedoms are not in the state."""
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
        """Indices of the friction multipliers whose law has a bristle state. In the state of the run, the bristle states come after
        the rates, in this order."""
        return tuple(e for j in self.frictional if j.friction and j.friction.bristles for s in j.friction.sliders for e in s.eta)

    @cached_property
    def sliders(self) -> tuple[Slider, ...]:
        """All friction pairs, in the order of ``Slider.flag``."""
        return tuple(s for j in self.frictional if j.friction for s in j.friction.sliders)

    @property
    def external(self) -> External:
        """Layout of the external values x."""
        return External(self.tables, self.stops, len(self.sliders))


def way_to_ground(bodies: Sequence[Body], body: int) -> list[int]:
    """A body and all its inboard bodies, the body first."""
    way = []
    while body != GROUND:
        way.append(body)
        body = bodies[body].parent
    return way


def state_coordinates(j: Joint) -> tuple[int, ...]:
    """Indices of the joint's coordinates that are states: all components of a quaternion, and all other coordinates that are not
    driven."""
    k = j.kind
    driven = {k.coordinate_of(r) for r in j.driven}
    return tuple(i for i in range(k.nq) if i not in driven)
