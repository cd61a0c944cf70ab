"""Joints on loops, and the number of scaled reactions of each. Scaled reactions are the criterion that selects the reactions of
redundant loops (theory, "Redundant loops"). This module does not need the symbolic library."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, System, way_to_ground
from trunnion.system.structure.friction_joint_indices import Element, elements
from trunnion.system.structure.parameter_table import Leaves

USUAL = 1e8
"""Default radial stiffness of a joint's contacts, N/m: about that of a steel pin of 20 mm in a bearing. The value matters only if
the scene gives the stiffness of other joints."""
NO_SIZE = 1e-24
"""Square of the smallest size of a joint, m². This value avoids a division by zero, and keeps the squares of the quotients
finite."""


def bodies_of_loop(system: System, c: Joint) -> list[int]:
    """Bodies whose tree joints are on the loop of a cut joint, in ascending order. The loop is the path between the cut joint's two
    bodies; for a gearbox, the paths between the two bodies of each shaft's joint."""
    paths = [set(way_to_ground(system.bodies, body)) for body in c.ends]
    pairs = zip(paths[::2], paths[1::2], strict=True)
    return sorted(set().union(*(a ^ b for a, b in pairs)))


def loop_joints(system: System) -> list[Joint]:
    """Joints on any loop, in the order of the system's joints. These are the cut joints, and the tree joints on the path between
    the two bodies of each cut joint."""
    cuts = system.joints[len(system.bodies) :]
    wanted = {c.name for c in cuts} | {system.tree[b].name for c in cuts for b in bodies_of_loop(system, c)}
    return [j for j in system.joints if j.name in wanted]


def block_points(system: System) -> dict[str, dict[int, list[Leaves]]]:
    """For each joint on a loop: the points of all joints of its block, by body, in the body's axes. Joints of one loop are in one
    block; loops with a common joint are in one block, too. The choice of the cut joints has no effect on blocks."""
    blocks: dict[str, set[str]] = {}
    for c in system.joints[len(system.bodies) :]:
        loop = {c.name, *(system.tree[b].name for b in bodies_of_loop(system, c))}
        block = loop.union(*(blocks[n] for n in loop if n in blocks))
        blocks |= dict.fromkeys(block, block)
    found: dict[int, dict[int, list[Leaves]]] = {}
    for j in (j for j in system.joints if j.name in blocks and j.mimic is None):
        points = found.setdefault(id(blocks[j.name]), defaultdict(list))
        points[j.inb].append(j.inb_point)
        points[j.out].append(j.out_point)
    return {name: found[id(block)] for name, block in blocks.items()}


def with_centres(system: System, points: Mapping[int, Sequence[Leaves]]) -> dict[int, list[Leaves]]:
    """Points by body, and the mass centres of these bodies."""
    return {b: [*own, *([system.bodies[b].center] if b != GROUND else [])] for b, own in points.items()}


def rubs(system: System) -> bool:
    """Whether any joint on a loop has friction."""
    return any(j.friction for j in loop_joints(system))


def rows_of(system: System) -> list[tuple[str, int]]:
    """Each joint on a loop, with the number of its rows in ``scaled_reactions``, in the order of the rows."""
    if rubs(system):
        return [(j.name, springs_of(j)) for j in loop_joints(system)]
    return [(j.name, 6 * sum(b != GROUND for b in (j.out, j.inb))) for j in loop_joints(system)]


def contact_of(j: Joint) -> ContactElement | None:
    """The contact element of joints of this type; None if the type cannot have friction."""
    return CONTACTS[j.kind.friction] if j.kind.friction else None


def springs_of(j: Joint) -> int:
    """Number of rows of a joint: the rows of contacts and faces, or six without a contact element, plus one row for each drive."""
    element = contact_of(j)
    return (6 if element is None else element.springs + len(element.thrusts)) + len(j.driven)


def rubbing_on_loops(system: System) -> list[tuple[Element, int, int]]:
    """For each joint with friction on a loop: the joint, index of its first row among the scaled reactions, number of its rows that
    friction changes."""
    first, at = {}, 0
    for name, rows in rows_of(system):
        first[name] = at
        at += rows
    found = [e for e in elements(system) if e.joint.name in first]
    # friction without contacts (a given force) changes no contact forces
    found = [e for e in found if e.contact.count]
    return [(e, first[e.joint.name], springs_of(e.joint) - len(e.contact.thrusts) - len(e.joint.driven)) for e in found]
