"""Data of joints that carry no body but couple two bodies: pairs of wheels, cams with followers, points on curves, and freedoms
that follow another freedom."""

from __future__ import annotations

from functools import cache

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.system.structure.parameter_table import Leaf


@dataclass(frozen=True)
class Wheels:
    """Two wheels that roll on each other.

    module   pitch diameter divided by number of teeth, m.
    teeth    signed numbers of teeth of the inboard and the outboard wheel.
    phase    value of ``elements.joints.wheel_pairs.phase`` at which the wheels mesh, rad.
    lead     only of a worm: its lead angle, rad.
    wrap     only of a belt that may slide: angle of wrap about the smaller pulley, rad."""

    module: Leaf
    teeth: tuple[Leaf, Leaf]
    phase: Leaf
    lead: Leaf | None = None
    wrap: Leaf | None = None


@dataclass(frozen=True)
class Profile:
    """Profile of a cam: distance of the follower from the cam's axis as a piecewise cubic function of the angle about the axis.

    middle   (cosine, sine) of the reference angle; all other angles are measured from it, within ±π.
    half     half of the angle that the profile covers, rad.
    side     1 if the follower is outside the cam, −1 if it is inside.
    roller   radius of the follower's roller, m.
    starts   angles at which the pieces begin, rad. The first and the last piece continue beyond the profile's ends.
    pieces   four coefficients for each piece, of powers of (angle − start)."""

    middle: tuple[Leaf, Leaf]
    half: Leaf
    side: Leaf
    roller: Leaf
    starts: tuple[float, ...]
    pieces: tuple[tuple[float, float, float, float], ...]


ENDLESS = 1e300
"""Curve parameter that stands for infinity, at the far end of the straight piece that continues an open curve."""
FOOT = 11
"""Number of values that describe a foot point on a curve. These are parameter and arc length at the start of the piece that
contains the foot point, four coefficients along e2, four along e3, and the foot point's parameter."""


@dataclass(frozen=True)
class CurveSegment:
    """A piece of a curve.

    start, end   parameters of the spline at the piece's start and end.
    way          arc length of the curve up to the piece's start, m.
    e2, e3       four coefficients of powers of (parameter − start), for the position along e2 and along e3, m."""

    start: float
    end: float
    way: float
    e2: tuple[float, ...]
    e3: tuple[float, ...]


@dataclass(frozen=True)
class Curve:
    """A plane curve in pieces. An open curve begins and ends with an infinite straight piece. around: period of the parameter of a
    closed curve; 0 for an open curve. length: arc length of the curve, m. roller: radius of the roller around the point that
    follows the curve, m."""

    pieces: tuple[CurveSegment, ...]
    around: float
    length: Leaf
    roller: Leaf = 0.0


@dataclass(frozen=True)
class Slot:
    """Walls of a slot along a curve, or of equal slots around e1.

    play       largest distance of the pin's centre from the curve, m.
    mouths     whether the slot is open at the start and at the end of its curve, 1 or 0 each.
    repeated   number of slots."""

    play: Leaf
    mouths: tuple[Leaf, Leaf]
    repeated: Leaf


@dataclass(frozen=True)
class Mimic:
    """A coupling of two tree joints' freedoms: q_follower = ratio · q_leader + offset.

    follower, leader   indices of the two joints in the tree.
    inb, out           bodies of the leader.
    turns              whether the follower's freedom is a rotation."""

    follower: int
    leader: int
    inb: int
    out: int
    turns: bool
    ratio: Leaf
    offset: Leaf


@cache
def gauss_points() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Points and weights of Gauss's rule for the arc length of a piece of a curve. The error is round-off for a piece whose
    direction turns by a right angle."""
    from numpy.polynomial.legendre import leggauss

    points, weights = leggauss(20)
    return tuple(map(float, points)), tuple(map(float, weights))


NO_INERTIA = 1e-15
"""Smallest inertia of a light freedom, relative to the inertia added to the freedom; larger than round-off."""


@dataclass(frozen=True)
class LightFreedom:
    """A freedom that moves only bodies much lighter than others on the same loop (theory, "Light bodies"). The recursion adds
    ``inertia`` (kg or kg m²) to the freedom; a constraint row removes the force of this inertia. joint: index of the tree joint;
    turns: whether the freedom is a rotation."""

    joint: int
    freedom: int
    turns: bool
    inertia: float

    @property
    def response(self) -> float:
        """The part of the row's diagonal entry in S that does not come from the mechanism's response: −1/inertia. A massless rod
        that turns about its own axis has neither an inertia nor a loop that moves it. To keep S regular, every light freedom keeps
        the fraction NO_INERTIA of the added inertia."""
        return -(1.0 + NO_INERTIA) / self.inertia


@dataclass(frozen=True)
class Unilateral:
    """A contact that begins and ends.

    flag        index of its flag among those of end stops; the flag is 1 while the contact is closed.
    poisson     whether restitution follows Poisson's law instead of Newton's.
    open        whether the contact starts open.
    inside      index of another flag, which is 1 while the outboard part is inside the free ends of the wall; −1 without free ends.
    thickness   thickness of a wall with free ends, m."""

    restitution: Leaf
    flag: int
    poisson: bool
    open: bool
    inside: int
    thickness: Leaf
