"""Tables of a kernel that describe the scene, for both kinds of kernel. This module does not load the symbolic library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from trunnion.basics.errors import Problem, SceneError
from trunnion.kernel.interface.output_columns import Column
from trunnion.runtime.abi import Coordinate, Post, RowKind, Wants
from trunnion.runtime.abi.kernel_records import ELEMENT, PAIR, POST, UNILATERAL
from trunnion.system.structure.bodies_and_joints import System, state_coordinates
from trunnion.system.structure.friction_joint_indices import Element

MOTION = 18
"""Number of scalars of a body's motion: R (9, column-major), r, ω, ṙ (3 each)."""
HANDED = 27
"""Number of scalars that a body passes inward: ΔM as blocks M11 (6: xx xy xz yy yz zz), M12 (9, column-major) and M22 (6), then ΔF
(6)."""
GIVING = 2
"""Number of powers that may supply energy (drives, loads). These powers come last."""


def names_of_powers(system: System) -> list[str]:
    """Names of the powers of ``power_expressions.powers``, in their order."""
    return [*(f"friction:{j.name}" for j in system.frictional), "damping", "drive", "load"]


def coordinate_kinds(system: System) -> tuple[list[int], list[int], list[int]]:
    """(kinds of the state's coordinates, kinds of the rates, offsets of quaternions among the coordinates)."""
    qkind: list[int] = []
    vkind: list[int] = []
    quat: list[int] = []
    for j in system.tree:
        states = state_coordinates(j)
        if j.kind.quaternion >= 0:
            quat.append(len(qkind) + states.index(j.kind.quaternion))
        qkind += [Coordinate[j.kind.coordinates[i].upper()].value for i in states]
        vkind += [Coordinate.ANGLE.value if j.kind.turns(k) else Coordinate.LENGTH.value for k in j.free]
    return qkind, vkind, quat


def row_kinds(system: System) -> list[int]:
    """Kinds of the rows of cut joints."""
    each = [[RowKind.TRAVEL] * c.travels + [RowKind.TURNING] * (c.kind.rows - c.travels) for c in system.cuts]
    return [int(k) for kinds in each for k in kinds]


def element_table(
    elements: Sequence[Element], turned: Mapping[str, tuple[int, int]]
) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]], int]:
    """The rows of the table of elements, the rows of the table of friction pairs, and the number of derivatives of the laws.
    turned: for each joint in a loop, index of the first scaled reaction that friction changes, and number of these reactions."""
    rows: list[tuple[int, ...]] = []
    sliders: list[tuple[int, ...]] = []
    dn = contact = more = dmore = 0
    for number, e in enumerate(elements):
        n, nv = len(e.needs), e.joint.kind.nv
        kappa0, count = turned.get(e.joint.name, (0, 0))
        rows.append(ELEMENT.row(
            n0=e.n0, needs=n, eta0=e.eta[0], neta=nv, rate0=e.rate0, nrates=nv, dn0=dn, kappa0=kappa0, nmore=count, more0=more,
            dmore0=dmore,
        ))  # fmt: skip
        more, dmore = more + count, dmore + count * (n + nv)
        dn += nv * n
        pairs = e.friction.sliders
        each = e.contact.count // len(pairs)
        for s in pairs:
            first = min(s.eta) - e.eta[0]
            own = [first + k for k in range(len(s.eta))]
            mine = not e.joint.cut and all(k in e.joint.free for k in own)
            v0 = e.joint.v0 + e.joint.free.index(first) if mine else -1
            cone = int(e.contact.cone is not None and not e.friction.adams)
            sliders.append(PAIR.row(
                element=number, eta0=s.eta[0], neta=len(s.eta), rate0=e.rate0 + first, nrates=len(s.eta), kind=int(e.law_kind),
                contact0=contact, ncontacts=each, v0=v0, cone=cone,
                stores=int(bool(e.friction.bristles)),
            ))  # fmt: skip
            contact += each
    return rows, sliders, dn


def unilateral_table(system: System, active: Sequence[int]) -> list[tuple[int, ...]]:
    """Rows of the table of unilateral joints, whose contact pushes but does not pull. active: the constraint rows with a
    multiplier. Raises SceneError if no freedom can open or close a contact."""
    out = []
    for j in system.unilateral:
        assert j.unilateral is not None
        pair = j.friction.sliders[0].flag if j.friction else -1
        x = j.unilateral
        if j.rows not in active:
            what = "no freedom of the parts opens or closes this contact"
            raise SceneError([Problem(f"joints.{j.name}.unilateral", what, "leave out the key unilateral")])
        out.append(UNILATERAL.row(stop=x.flag, row=j.rows, pair=pair, poisson=int(x.poisson), open=int(x.open), inside=x.inside))
    return out


def wants_of(chosen: list[Column], solved: bool) -> int:
    """Additional results that the chosen columns need from the runtime, as bits (``Wants``). solved: whether the columns depend on
    multipliers or accelerations."""
    names = {c.name for c in chosen}
    contraction = "audit.contraction" in names
    audit = bool(names & {"audit.constraint", "audit.complement", "audit.verdict"})
    solution = solved or contraction or "audit.complement" in names
    return Wants.CONTRACTION * contraction + Wants.AUDIT * audit + Wants.SOLUTION * solution


def post_of(chosen: list[Column]) -> list[tuple[int, ...]]:
    """Post-processing of columns by the runtime (``tr_post``). The post-processing "hold" takes place only if the normal force of
    the contact is a chosen column, too."""
    names = {c.name: i for i, c in enumerate(chosen)}
    out = []
    for i, c in enumerate(chosen):
        if c.post == "wrap":
            out.append(POST.row(kind=Post.WRAP.value, column=i, partner=i))
        elif c.post == "touch":
            out.append(POST.row(kind=Post.TOUCH.value, column=i, partner=i))
        elif c.post == "hold":
            partner = names.get(c.name.rsplit(".", 1)[0] + ".normal_force")
            if partner is not None:
                out.append(POST.row(kind=Post.HOLD.value, column=i, partner=partner))
    return out
