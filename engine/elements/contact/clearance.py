"""Clearances of contact elements: directions in which the parts of a joint with clearance can move (theory, "Clearance").

Directions are e1, e2, e3 of the inboard joint frame, and for a universal joint u2 = outboard e2 and u3 = u1 × u2."""

from __future__ import annotations

from typing import Literal

from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class Play:
    """A clearance of a joint: one axis for flat faces, two for a pin, three for a ball.

    axes    indices of the axes of the bearing's frame in which the parts can move relative to each other.
    ways    directions of travel that other faces lock.
    turns   directions of rotation that the joint locks; motions that tilt the parts within the clearance are not computed.
    angle   directions of the cosine and of the sine of a contact's angle.
    side    joint frame of the part with the bearing, in which the motion is described.
    swaps   whether the normal of the pin is opposite to that of a hinge's pin.
    """

    axes: tuple[int, ...]
    ways: tuple[str, ...]
    turns: tuple[str, ...]
    angle: tuple[str, str]
    side: Literal["in", "out"] = "in"
    swaps: bool = False
