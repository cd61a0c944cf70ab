"""Joints on loops, and how many scaled reactions of each decide what redundant loops leave open (theory, "Redundant loops"). No
symbolic library here."""

from __future__ import annotations

from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact import ContactElement
from trunnion.system.structure.bodies_and_joints import GROUND, Joint, System
from trunnion.system.structure.friction_joint_indices import Element, elements

USUAL = 1e8
"""N/m; radial stiffness of the contacts of a joint that says none: about that of a steel pin of 20 mm in its bearing. It counts
only beside joints that say theirs."""
NO_SIZE = 1e-24
"""m²: a size that is none, squared, where one is divided by. What is scaled by it is squared again and must stay finite."""


def loop_joints(system: System) -> list[Joint]:
    """Joints on any loop, in the system's order: cut joints, and the tree joints on the way between the two bodies of each."""
    found: list[str] = []
    for c in system.joints[len(system.bodies) :]:
        paths = []
        for body in (c.inb, c.out):
            path = []
            while body != GROUND:
                path.append(body)
                body = system.bodies[body].parent
            paths.append(path)
        different = set(paths[0]) ^ set(paths[1])
        found += [system.tree[b].name for b in sorted(different)] + [c.name]
    wanted = set(found)
    return [j for j in system.joints if j.name in wanted]


def rubs(system: System) -> bool:
    """Whether a joint on a loop has friction."""
    return any(j.friction for j in loop_joints(system))


def rows_of(system: System) -> list[tuple[str, int]]:
    """How many rows of ``scaled_reactions`` belong to each joint, in their order."""
    if rubs(system):
        return [(j.name, springs_of(j)) for j in loop_joints(system)]
    return [(j.name, 6 * sum(b != GROUND for b in (j.out, j.inb))) for j in loop_joints(system)]


def contact_of(j: Joint) -> ContactElement | None:
    """The contact element of joints of this type, if they may rub."""
    return CONTACTS[j.kind.friction] if j.kind.friction else None


def springs_of(j: Joint) -> int:
    """How many rows a joint has: its contacts', its faces', or all six components; and one for each drive."""
    element = contact_of(j)
    return (6 if element is None else element.springs + len(element.thrusts)) + len(j.driven)


def rubbing_on_loops(system: System) -> list[tuple[Element, int, int]]:
    """Joints on loops that rub, where the rows of each begin among the scaled reactions, and how many of these friction changes."""
    first, at = {}, 0
    for name, rows in rows_of(system):
        first[name] = at
        at += rows
    found = [e for e in elements(system) if e.joint.name in first]
    # friction that does not follow what presses changes nothing of it
    found = [e for e in found if e.contact.count]
    return [(e, first[e.joint.name], springs_of(e.joint) - len(e.contact.thrusts) - len(e.joint.driven)) for e in found]
