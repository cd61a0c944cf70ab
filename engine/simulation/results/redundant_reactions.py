"""Reactions that redundant constraints of loops do not determine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.simulation.runtime_interface.simulation_block import Block

SHARE = 1e-6
"""Consider the reaction patterns (unit vectors) that the motion does not determine. A joint's reactions are not unique if one of
these patterns has a component of at least this size in the joint. Round-off is at most 1e-12."""


Combination = dict[str, float]
"""A sum of columns: {name: factor}."""


@dataclass(frozen=True)
class Redundancy:
    """Reactions that are not unique (theory, "Redundant loops").

    Without friction in the loops, the reported reactions have the minimum norm in the metric of the bodies' inertia. With friction
    in the loops, the reported reactions are the limit for stiff contacts.

    Attributes:
        count: number of independent reaction patterns that the motion does not determine.
        joints: joints whose reactions are not unique.
        rubbing: the joints among ``joints`` that have friction. For rigid bodies, their friction and the motion are not unique.
        columns: columns of the components of reactions that are not unique at the start or at the end of the run. All other
            components are unique at the start and at the end. With ``rubbing``, these other components are unique only for given
            friction.
        drives: columns of the efforts of drives that are not unique.
        determined: independent combinations of ``drives`` that are unique at the start, as {column: factor}, in SI units.
    """

    count: int
    joints: tuple[str, ...] = ()
    rubbing: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    drives: tuple[str, ...] = ()
    determined: tuple[Combination, ...] = ()

    def or_at(self, later: Redundancy) -> Redundancy:
        """The redundancies of this state and of a later state of the run, as one. A column is unique only if it is unique at both
        states."""
        def both(a: tuple[str, ...], b: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(dict.fromkeys((*a, *b)))

        return replace(
            self, joints=both(self.joints, later.joints), rubbing=both(self.rubbing, later.rubbing),
            columns=both(self.columns, later.columns), drives=both(self.drives, later.drives),
        )  # fmt: skip


def redundancy(block: Block) -> Redundancy:
    """The redundancy at the current state of the block."""
    if not block.kernel.sizes["rows"]:
        return Redundancy(0)
    count, found = block.redundancy()
    share, names, at = found.tolist(), [], 0
    for name, rows in block.kernel.facts["loop_rows"]:
        if rows and max(share[at : at + rows]) > SHARE:
            names.append(name)
        at += rows
    rubbing = block.kernel.facts["rubbing"] if block.kernel.sizes["nkappa"] else ()
    return Redundancy(count, tuple(names), tuple(n for n in names if n in rubbing))


def redundancy_notes(r: Redundancy) -> list[str]:
    """Notes about reactions and efforts that are not unique; empty if all are unique."""
    if r.count == 0:
        return []
    redundant = f"{r.count} redundant constraint{'s' * (r.count > 1)}"
    which = "; ".join(_components(r)) if r.columns else f"those of {', '.join(r.joints)}"
    if not r.rubbing:
        others = "all other components are unique; " if r.columns else ""
        what = f"the motion is unique, but these reactions are not: {which}"
        return [f"{redundant}: {what}; {others}minimum-norm reactions are reported", *_drive_notes(r)]
    others = "; for given friction, all other components are unique" if r.columns else ""
    return [
        f"{redundant}: for rigid bodies, the friction of {', '.join(r.rubbing)}, the motion and these reactions are not unique: "
        f"{which}{others}; the solution for contacts of equal, high radial stiffness is reported",
        *_drive_notes(r),
    ]


def _components(r: Redundancy) -> list[str]:
    """The components that are not unique, in words. Joints with equal components share one text."""
    by_joint: dict[str, dict[str, list[str]]] = {}
    joints = set(r.joints)
    for name in r.columns:
        joint = name.rpartition(".")[0]
        while joint not in joints:
            joint = joint.rpartition(".")[0]
        word, _, index = name[len(joint) + 1 :].removeprefix("reaction.").partition("[")
        by_joint.setdefault(joint, {}).setdefault(word, []).extend([index[:-1]] if index else [])
    alike: dict[str, list[str]] = {}
    for joint, words in by_joint.items():
        text = ", ".join(f"{w}[{','.join(indices)}]" if indices else w for w, indices in words.items())
        alike.setdefault(text, []).append(joint)
    return [f"{text} of {', '.join(joints)}" for text, joints in alike.items()]


def _drive_notes(r: Redundancy) -> list[str]:
    """A note about efforts of drives that are not unique."""
    if not r.drives:
        return []
    sums = ", ".join(" ".join(_terms(c)) for c in r.determined)
    told = f"at the start, only {sums} {'are' if len(r.determined) > 1 else 'is'} unique" if sums else "no sum of them is unique"
    return [f"the drives share a load arbitrarily: {', '.join(r.drives)} are not unique; {told}"]


def _terms(c: Combination) -> Iterator[str]:
    """A sum in words, such as a + 0.5 b."""
    for i, (name, x) in enumerate(c.items()):
        sign = ("-" if x < 0 else "") if i == 0 else ("- " if x < 0 else "+ ")
        yield f"{sign}{name}" if abs(abs(x) - 1.0) < SHARE else f"{sign}{abs(x):.6g} {name}"
