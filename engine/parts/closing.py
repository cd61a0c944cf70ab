"""Parts of the joints that close loops, and of the reactions that decide what redundant loops leave open."""

from __future__ import annotations

import re
from functools import cache

import casadi as ca

from engine.contact import REGISTRY as CONTACTS
from engine.contact.base import COMPONENTS, OVERLAP
from engine.joints import REGISTRY
from engine.kernel.classes import unpack_motion
from engine.kernel.records import MOTION
from engine.parts.blocks import ENDS
from engine.parts.known import BARE, PIECE, POSE, Numbers, Part
from engine.parts.local import PRESCRIBED, PartSymbols, a_body
from engine.parts.one import one
from engine.recursion import curved, following
from engine.recursion import cuts as cutting
from engine.recursion.kinematics import GROUND_MOTION
from engine.recursion.reactions import at_point, pinned
from engine.recursion.springs import PART, spring_rows
from engine.recursion.vectors import SX, cross
from engine.system.loops import NO_SIZE
from engine.system.structure import GROUND, Device, Fit, FrictionElement, Joint
from engine.system.tied import FOOT, Mimic, Profile, Wheels


def _closing(kind: str, ground: str) -> tuple[PartSymbols, dict[str, SX], cutting.Cut]:
    """Symbols, inputs and frames of a cut joint, still without rows."""
    n = Numbers()
    frames, points = [n.some(9), n.some(9)], [n.some(3), n.some(3)]
    a, b = (GROUND if ground == "inb" else 0), (GROUND if ground == "out" else 1)
    devices = tuple(Device() for _ in range(REGISTRY[kind].nv))
    wheels = Wheels(n.one(), (n.one(), n.one()), n.one()) if REGISTRY[kind].rolls else None
    follows = REGISTRY[kind].follows
    profile = Profile((n.one(), n.one()), n.one(), (), ()) if follows in ("point", "face") else None
    p, f = points, frames
    joint = Joint("", kind, a, b, p[0], p[1], f[0], f[1], Fit(), None, devices, None, True, wheels=wheels, profile=profile)  # type: ignore[arg-type]
    sym, motions = PartSymbols(n.count), {k: SX.sym(k, MOTION) for k in ("inb", "out") if k != ground}
    if follows == "curve":
        sym.piece = SX.sym(PIECE, FOOT)
    both = [unpack_motion(ca.vertsplit(motions[k])) if k in motions else GROUND_MOTION for k in ("inb", "out")]
    return sym, {"numbers": sym.p, **motions}, cutting.opened(sym, both, joint)


@cache
def bearing(kind: str, ground: str) -> Part:
    """A cam: numbers (27), motions → the angle at which its profile is read; of a curve (24) the point, seen in its plane (2)."""
    sym, ins, c = _closing(kind, ground)
    at = curved.spot(c) if c.joint.kind.follows == "curve" else following.bearing(sym, c)
    return one(f"c_{kind}_{ground or 'bodies'}_bearing", ins, {"angle": at})


@cache
def cut(kind: str, ground: str, bare: str = "") -> Part:
    """A cut joint: numbers (two frames, two points: 24; of wheels also module, teeth, phase: 4; of cams the middle of the profile
    and the roller: 3), motions ``inb`` and ``out`` (that of the ``ground`` is not handed), of cams the piece of the profile in
    force, of curves the foot → residuals of its rows (phi, rate, xi), their wrenches on the two bodies (gin, gout: 6 a row; gat:
    that on the outboard part at its point), its coordinates, rates and the accelerations that the bodies' own cause none of (bias),
    wrenches of a force along each freedom (win, wout, wat), its pose and its point on the outboard part."""
    sym, ins, c = _closing(kind, ground)
    cutting.add_rows(sym, c)
    joint = c.joint
    if joint.kind.follows:
        ins[PIECE] = sym.piece
    wrenches = [cutting.axis_wrenches(c, k) for k in range(joint.kind.nv)]
    outs: dict[str, SX | list[SX]] = {
        "phi": [r.phi for r in c.rows], "rate": [r.rate for r in c.rows], "xi": [r.xi for r in c.rows],
        "gin": _beside([r.g_in for r in c.rows]), "gout": _beside([r.g_out for r in c.rows]),
        "gat": _beside([at_point(r.g_out, c.c_out) for r in c.rows]),
        "q": cutting.coordinates(c) if joint.kind.nv else [], "v": cutting.rates(c),
        "bias": [cutting.acceleration_bias(c, k) for k in range(joint.kind.nv)],
        "win": _beside([w for w, _ in wrenches]), "wout": _beside([w for _, w in wrenches]),
        "wat": _beside([at_point(w, c.c_out) for _, w in wrenches]),
        "pose": ca.vertcat(ca.vec(ca.densify(c.Ein)), ca.vec(ca.densify(c.Eout)), ca.densify(c.s)), "point": c.out.r + c.c_out,
    }  # fmt: skip
    asked = BARE[bare]
    outs = outs if asked is None else {name: outs[name] for name in asked}
    return one(f"c_{kind}_{'_'.join([ground or 'bodies', *([bare] if bare else [])])}", ins, outs)


def _beside(columns: list[SX]) -> SX:
    return ca.densify(ca.horzcat(SX(6, 0), *columns))


@cache
def tie(follower: str, leader: str) -> Part:
    """A freedom that follows another: numbers (two frames and two points of each joint, ratio, offset: 50), coordinates and rates
    of both (2), motions of the bodies of both → residual, rate and ξ, and wrenches on these four."""
    n, q, v = Numbers(), SX.sym("q", 2), SX.sym("v", 2)
    ends = {name: SX.sym(name, MOTION) for name in ("inb", "out", "inb2", "out2")}
    motions = [unpack_motion(ca.vertsplit(m)) for m in ends.values()]
    joints = []
    for kind in (follower, leader):
        frames, points = [n.some(9), n.some(9)], [n.some(3), n.some(3)]
        joints.append(Joint("", kind, 0, 0, points[0], points[1], frames[0], frames[1], Fit(), None, (), None, True))  # type: ignore[arg-type]
    m = Mimic(0, 0, 0, 0, False, n.one(), n.one())
    sym = PartSymbols(n.count)
    follows, leads = (cutting.opened(sym, motions[2 * k : 2 * k + 2], j) for k, j in enumerate(joints))
    row = cutting.mimic_row(sym, follows, leads, [(q[0], v[0]), (q[1], v[1])], m)
    outs = {"phi": row.phi, "rate": row.rate, "xi": row.xi} | dict(zip(ENDS, map(ca.densify, row.on), strict=True))
    return one(f"c_mimic_{follower}_{leader}", {"numbers": sym.p, "q": q, "v": v, **ends}, outs)


@cache
def outboard(forward: bool) -> Part:
    """N on the child (6), pose of a tree joint → force and torque on its outboard part, at its point there (6)."""
    N, pose = SX.sym("N", 6), SX.sym("pose", POSE)
    f, t, s = N[:3], N[3:], pose[18:]
    if not forward:
        f, t = -f, -(t - cross(s, f))
    return one(f"r_outboard_{'out' if forward else 'in'}", {"N": N, "pose": pose}, {"out": ca.vertcat(f, t)})


def _posed() -> tuple[SX, SX, SX, SX, SX]:
    ft, pose = SX.sym("ft", 6), SX.sym("pose", POSE)
    return ft, pose, ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]


@cache
def pin(kind: str, fit: Fit, needs: tuple[str, ...]) -> Part:
    """Force and torque on the outboard part (6), pose (and lengths of parts that overlap) → the needed components of f_c, m_c; 0
    for the span."""
    ft, pose, Ein, Eout, s = _posed()
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, (), None, True)
    ins = {"ft": ft, "pose": pose} | ({"lengths": SX.sym("lengths", 2)} if fit.ends == OVERLAP else {})
    both = ca.vertcat(*pinned(joint, ft[:3], ft[3:], s, Ein, Eout, ins.get("lengths")))
    out = [both[COMPONENTS.index(n)] if n in COMPONENTS else SX(0) for n in needs]
    name = re.sub(r"\W", "_", "_".join(["r_cut", CONTACTS[joint.kind.friction].name, fit.label, *needs]))
    return one(name, ins, {"out": out})


@cache
def reaction(pin_out: bool) -> Part:
    """Force and torque on the outboard part (6), pose → those on the inboard part at the joint's centre, in its frame (6)."""
    ft, pose, Ein, _, s = _posed()
    f, t = ft[:3], ft[3:] if pin_out else ft[3:] + cross(s, ft[:3])
    out = ca.vertcat(-(Ein.T @ f), -(Ein.T @ t))
    return one(f"o_reaction_cut_{'pin_out' if pin_out else 'pin_in'}", {"ft": ft, "pose": pose}, {"out": out})


@cache
def weighed(sign: int) -> Part:
    """Force and torque on the outboard part (6), its point there (3), motion and numbers of one of the two bodies, half the trace
    of its inertia → what its inertia makes of them (6), by which open reactions are chosen where nothing rubs."""
    count = Numbers()
    body = a_body(count)
    sym, ft, point = PartSymbols(count.count), SX.sym("ft", 6), SX.sym("point", 3)
    motion, spin = SX.sym("motion", MOTION), SX.sym("spin")
    m = unpack_motion(ca.vertsplit(motion))
    torque = ft[3:] + cross(point - (m.r + m.R @ sym.leaves(body.center)), ft[:3])
    out = ca.vertcat(sign * ft[:3] / ca.sqrt(sym.leaf(body.mass)), sign * torque / ca.sqrt(spin))
    ins = {"ft": ft, "point": point, "motion": motion, "numbers": sym.p, "spin": spin}
    return one(f"k_weighed_{'out' if sign > 0 else 'inb'}", ins, {"out": out})


@cache
def arm(bodies: int) -> Part:
    """Half the trace of the inertia and the mass of each of a joint's bodies → half length of its contacts where it has no friction
    (``springs``)."""
    spin, mass = SX.sym("spin", bodies), SX.sym("mass", bodies)
    square = sum((spin[k] / mass[k] for k in range(bodies)), SX(0)) / bodies
    return one(f"k_arm_{bodies}", {"spin": spin, "mass": mass}, {"out": PART * ca.sqrt(square + NO_SIZE)})


@cache
def sprung(kind: str, fit: Fit, sizes: tuple[str, ...], soft: bool, driven: tuple[int, ...]) -> Part:
    """Force and torque on the outboard part (6), pose, sizes of its contact element (named ``sizes``; none where it has no
    friction) and its stiffness if it says one, arm → what its contacts carry as springs, by which open reactions are chosen where
    joints on loops rub."""
    ft, pose, Ein, Eout, s = _posed()
    n = Numbers()
    friction = FrictionElement("", "", False, tuple((name, n.one()) for name in sizes), ()) if sizes else None
    stiffness = n.one() if soft else None
    devices = tuple(PRESCRIBED if k in driven else Device() for k in range(REGISTRY[kind].nv))
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, devices, friction, True, stiffness=stiffness)
    sym, length = PartSymbols(n.count), SX.sym("arm")
    out = spring_rows(sym, joint, ft[:3], ft[3:], s, Ein, Eout, length)
    words = [kind, fit.label, *sizes, *(["soft"] if soft else []), *map(str, driven)]
    name = re.sub(r"\W", "_", "_".join(["k_sprung", *words]))
    return one(name, {"ft": ft, "pose": pose, "numbers": sym.p, "arm": length}, {"out": out})
