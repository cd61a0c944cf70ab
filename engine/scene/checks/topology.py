"""Checks of the topology: joints of a body with itself, bodies without connection to the ground, rigid loops, and the key
``cut``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import CONNECTIONS, Finding
from trunnion.scene.findings.name_suggestions import listed, shown
from trunnion.scene.queries.body_references import GROUND, body_of
from trunnion.scene.queries.cuttable_joints import has_rotor, is_driven, may_be_cut, tied


class _Groups:
    """Sets of connected bodies (union-find)."""

    def __init__(self, names: Iterable[str]):
        self.parent = {n: n for n in names}

    def find(self, name: str) -> str:
        """The representative of the group that contains a body."""
        while self.parent[name] != name:
            self.parent[name] = self.parent[self.parent[name]]
            name = self.parent[name]
        return name

    def join(self, a: str, b: str) -> bool:
        """Unite the groups of two bodies; False when both bodies are already in the same group."""
        a, b = self.find(a), self.find(b)
        self.parent[a] = b
        return a != b


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about connections."""
    ends: dict[str, tuple[str, str]] = {}
    dangling = False
    for name, j in scene.joints.items():
        a, b = body_of(j.inboard), body_of(j.outboard)
        if a == b:
            part = "the ground" if a == GROUND else shown(a)
            yield Finding(("joints", name), f"both sides are on {part}", "connect two different parts with the joint")
        elif {a, b} <= {GROUND, *scene.bodies}:
            if not REGISTRY[j.type].bodiless and j.unilateral is None:
                ends[name] = (a, b)
        else:
            dangling = True
    if not dangling:  # a joint to an unknown part might connect the loose bodies
        yield from _loose(scene, ends)
    yield from _rigid(scene, ends)
    yield from _cuts(scene, ends)


def _loose(scene: Scene, ends: dict[str, tuple[str, str]]) -> Iterator[Finding]:
    """Findings for bodies without a chain of joints to the ground."""
    groups = _Groups([GROUND, *scene.bodies])
    for a, b in ends.values():
        groups.join(a, b)
    loose: dict[str, list[str]] = {}
    for name in scene.bodies:
        if groups.find(name) != groups.find(GROUND):
            loose.setdefault(groups.find(name), []).append(name)
    for members in loose.values():
        first = members[0]
        if len(members) == 1:
            what, hint = ("no joint ties this body to anything", f"give a body that flies freely a joint of type free to {GROUND}")
        else:
            what = f"no joint ties these bodies to the ground: {listed(members)}"
            hint = f"if they fly freely, give one of them a joint of type free to {GROUND}"
        yield Finding(("bodies", first), what, hint, about=(CONNECTIONS,))


def _rigid(scene: Scene, ends: dict[str, tuple[str, str]]) -> Iterator[Finding]:
    """A finding for every loop that consists of fixed joints only; such a loop is redundant and may be inconsistent."""
    groups = _Groups([GROUND, *scene.bodies])
    for name, (a, b) in ends.items():
        if not REGISTRY[scene.joints[name].type].nv and not groups.join(a, b):
            what = f"{shown(a)} and {shown(b)} are already fixed to each other, so this joint is redundant"
            yield Finding(("joints", name), what, "remove this fixed joint")


def _cuts(scene: Scene, ends: dict[str, tuple[str, str]]) -> Iterator[Finding]:
    """Findings about the key ``cut``. No loop may consist only of joints that must not be cut. The joints that are not marked for
    cutting must connect every body to the ground."""
    keep, rest = _Groups([GROUND, *scene.bodies]), _Groups([GROUND, *scene.bodies])
    marked, together = [], tied(scene)
    for name, (a, b) in ends.items():
        j = scene.joints[name]
        path, kind = ("joints", name, "cut"), REGISTRY[j.type]
        if j.cut and not kind.cuttable:
            yield Finding(path, f"a {j.type} joint cannot be cut", "leave it out")
        elif (j.cut is False or not (j.cut or (may_be_cut(j) and name not in together))) and not keep.join(a, b):
            has = "a drive" if is_driven(j) else "rotor inertia" if has_rotor(j) else "mimic" if name in together else ""
            hint = f"leave one of its joints without {has}" if has else "leave one of them to be cut"
            yield Finding(path, "the joints that must not be cut close a loop", hint)
        if j.cut and kind.cuttable:
            held = "driven joint" if is_driven(j) else "joint with rotor inertia" if has_rotor(j) else ""
            marked.append((path, a, b, held or ("joint that follows another or leads one" if name in together else "")))
        else:
            rest.join(a, b)
    for path, a, b, held in marked:
        if rest.join(a, b):
            what = "cutting this joint (and the other joints with cut: true) would leave a body without connection to the ground"
            yield Finding(path, what, "only a joint of a closed loop can be cut", about=(CONNECTIONS,))
        elif held:
            yield Finding(path, f"a {held} cannot be cut", "leave it out")
