"""Light freedoms (theory, "Light bodies"). The freedoms of a tree joint on a loop are light if the body that the joint carries is
much lighter than other bodies on loops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from trunnion.basics.errors import Problem
from trunnion.elements.joints.mimic_and_light_rows import LIGHT_ROW
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.system.structure.bodies_and_joints import GROUND, Body, Joint, way_to_ground
from trunnion.system.structure.coupling_joint_data import LightFreedom
from trunnion.system.structure.parameter_table import Leaves, Param, ParameterTable

LIGHT = 1e-3
"""A body on a loop is light if its inertia is below this fraction of the heaviest body's inertia. With an inertia ratio of 10^-n,
the loop equations lose n digits. Above this limit, the equations keep the digits that events and steps require."""


def light_freedoms(
    scene: Scene, table: ParameterTable, bodies: Sequence[Body], joints: Sequence[Joint], more: Sequence[Joint]
) -> list[LightFreedom]:
    """All light freedoms of tree joints. The function judges a joint by the body that the joint carries, without heavier bodies
    outboard. (A wheel that turns freely on a shaft adds nothing to the shaft's inertia about the axis.) The carried body is
    compared with the bodies on the loops, and with all bodies outboard of the loops. more: couplings, which also close loops."""
    on_loops = _bodies_on_loops(bodies, [j for j in joints if j.cut] + list(more))
    if not on_loops:
        return []
    mass, spin = ([size(scene, b) for b in bodies] for size in (_mass, _spin))
    masses, turns = ([every[i] for i in _with_outboard(bodies, on_loops)] for every in (mass, spin))
    out = []
    for i in on_loops:
        j, own = joints[i], bodies[i]
        for k in j.free:
            turning = j.kind.turns(k)
            inertia, sizes = (spin[i] + _offset(scene, table, own, j), turns) if turning else (mass[i], masses)
            light = LIGHT * max(sizes)
            if inertia < light and j.devices[k].inertia is None:
                added = min(x for x in sizes if x >= light)
                out.append(LightFreedom(i, k, turning, 2.0 ** round(math.log2(added))))  # rounding lets sweeps share a kernel
    return out


def light_rows(joints: Sequence[Joint], found: Sequence[LightFreedom], rows: int) -> tuple[Joint, ...]:
    """The rows of light freedoms, from row ``rows`` on."""
    return tuple(
        replace(
            joints[x.joint], name=f"{joints[x.joint].name}.light[{x.freedom + 1}]", kind_name=LIGHT_ROW.name, pitch=None,
            inb=GROUND, out=x.joint, devices=(), friction=None, cut=True, child=GROUND, rows=rows + at, stiffness=None, light=x,
        )
        for at, x in enumerate(found)
    )  # fmt: skip


def massless_and_free(
    scene: Scene, bodies: Sequence[Body], joints: Sequence[Joint], found: Sequence[LightFreedom]
) -> list[Problem]:
    """A problem for each massless body whose motion nothing determines: no loop, and no body with mass outboard of the body."""
    light = {(x.joint, x.freedom) for x in found}
    mass, out = [_mass(scene, b) for b in bodies], []
    carried = _largest_outboard(bodies, mass)
    for i, b in enumerate(bodies):
        if mass[i] > 0.0 or carried[i] > 0.0:
            continue
        j = joints[i]
        free = [k for k in j.free if (i, k) not in light and j.devices[k].turned is None]
        loose = [k for k in free if not (j.kind.turns(k) and _spin(scene, b) > 0.0)]
        if loose:
            named = " and ".join(j.freedom(k) for k in loose)
            hint = "give it a mass, close a loop through it, or make it a part of another body"
            out.append(Problem(f"bodies.{b.name}.mass", f"the mass is 0, and no loop determines {named}", hint))
    return out


def with_inertias(joints: Sequence[Joint], found: Sequence[LightFreedom]) -> tuple[Joint, ...]:
    """The joints with the inertias that the recursion adds to light freedoms."""
    added = {(x.joint, x.freedom): x.inertia for x in found}
    return tuple(
        replace(j, devices=tuple(replace(d, added=added.get((i, k), 0.0)) for k, d in enumerate(j.devices)))
        for i, j in enumerate(joints)
    )


def _largest_outboard(bodies: Sequence[Body], sizes: Sequence[float]) -> list[float]:
    """For each body, the largest value in ``sizes`` of the bodies outboard of it; −1 if there are none."""
    out = [-1.0] * len(bodies)
    for i in reversed(range(len(bodies))):  # inboard bodies come first
        if (parent := bodies[i].parent) != GROUND:
            out[parent] = max(out[parent], sizes[i], out[i])
    return out


def _with_outboard(bodies: Sequence[Body], on_loops: Sequence[int]) -> list[int]:
    """The given bodies and all bodies outboard of them."""
    found = set(on_loops)
    for i, b in enumerate(bodies):  # inboard bodies come first
        if b.parent in found:
            found.add(i)
    return sorted(found)


def _bodies_on_loops(bodies: Sequence[Body], cuts: Sequence[Joint]) -> list[int]:
    """Bodies on the tree paths between the bodies of each cut joint or coupling."""
    found: set[int] = set()
    for c in cuts:
        ways = [set(way_to_ground(bodies, b)) for b in c.ends]
        found |= {b for way in ways for b in way if not all(b in w for w in ways)}
    return sorted(found)


def _mass(scene: Scene, b: Body) -> float:
    return mass_properties(scene.bodies[b.name])[0]


def _spin(scene: Scene, b: Body) -> float:
    """Half the trace of a body's inertia, kg m²."""
    inertia = mass_properties(scene.bodies[b.name])[2]
    return 0.5 * sum(inertia[k][k] for k in range(3))


def _offset(scene: Scene, table: ParameterTable, b: Body, j: Joint) -> float:
    """Inertia of a body's mass about the point of the joint that carries it, kg m²."""
    point: Leaves = j.out_point if j.forward else j.inb_point
    distance = math.dist(*([table.values[x.index] if isinstance(x, Param) else x for x in leaves] for leaves in (b.center, point)))
    return _mass(scene, b) * distance**2
