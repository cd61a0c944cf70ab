"""Properties of a random case. Tests select cases by these properties."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.reference.scenes.random_scenes import Case
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.system.construction.spanning_tree import span

Property = Callable[[Case], bool]
DEVICES = ("spring", "damping", "end_stops", "effort", "drive")
DRIVES = ("constant", "ramp", "harmonic", "table")


def some_joint(holds: Callable[[sm.Joint], Any]) -> Property:
    """The property that the predicate holds for at least one joint."""
    return lambda case: any(holds(j) for j in case.scene.joints.values())


def both(one: Callable[[sm.Joint], Any], other: Callable[[sm.Joint], Any]) -> Property:
    """The property that one predicate holds for some joint, and the other for some joint."""
    return lambda case: some_joint(one)(case) and some_joint(other)(case)


def some_cut(holds: Callable[[sm.Joint], Any]) -> Property:
    """The property that the predicate holds for at least one joint at which a loop is cut."""
    return lambda case: any(holds(case.scene.joints[n]) for n in span(case.scene).cut)


def some_load(holds: Callable[[Any], Any]) -> Property:
    """The property that the predicate holds for at least one applied force, torque or spring-damper."""
    return lambda case: any(holds(f) for f in case.scene.forces.values())


def rubs(j: sm.Joint, pin: str | None = None, law: str | None = None, normal: str | None = "any") -> bool:
    """The property that a joint has friction, with the pin on this part, of this law, and with this kind of normal force."""
    return (
        j.friction is not None
        and pin in (None, j.pin)
        and law in (None, j.friction.law)
        and (normal == "any" or j.friction.normal_force == normal)
    )


def drives(j: sm.Joint) -> list[sm.Drive]:
    """The drives of a joint, one for each prescribed freedom."""
    return [d for d in (j.drive if isinstance(j.drive, tuple) else (j.drive,)) if d is not None]


def pressed(case: Case) -> bool:
    """Whether some stop is engaged."""
    q = {n: np.atleast_1d(x) for n, x in case.state().q.items()}
    return any(
        s is not None and ((s.lower is not None and q[n][k] < s.lower) or (s.upper is not None and q[n][k] > s.upper))
        for n, j in case.scene.joints.items()
        for k, s in enumerate(j.end_stops if isinstance(j.end_stops, tuple) else (j.end_stops,))
    )


def sliding(inside: bool) -> Property:
    """The property that some joint of one freedom slides below v_eps of the regularised law (104), or above it."""

    def holds(case: Case) -> bool:
        some = [(n, j) for n, j in case.scene.joints.items() if REGISTRY[j.type].nv == 1 and rubs(j, law="regularized")]
        speeds = [(abs(case.qd[n][0]) * (j.friction.radius if REGISTRY[j.type].turns(0) else 1.0), j) for n, j in some]
        return any((v < j.friction.v_eps) == inside for v, j in speeds)

    return holds
