"""Primitives of joints that close loops, and of scaled reactions. Scaled reactions are the criterion that selects the reactions of
redundant loops."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import casadi as ca

from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import COMPONENTS, OVERLAP
from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.mimic_and_light_rows import MIMIC
from trunnion.kernel.interface.runtime_tables import MOTION
from trunnion.kernel.units.motion_and_inertia_packing import unpack_motion
from trunnion.parts.bytecode.body_and_joint_slots import ENDS
from trunnion.parts.primitives.primitive_from_expressions import expression_primitive
from trunnion.parts.primitives.primitive_keys import BARE, PIECE, POSE, ParameterCounter, Primitive
from trunnion.parts.primitives.primitive_symbols import PRESCRIBED, PrimitiveSymbols, a_body
from trunnion.recursion import cam_follower_constraint, point_on_curve_constraint
from trunnion.recursion import cut_joint_constraints as cutting
from trunnion.recursion.body_kinematics import GROUND_MOTION
from trunnion.recursion.joint_reactions import at_point, on_pin_part
from trunnion.recursion.loop_contact_springs import arm_of, spring_rows
from trunnion.recursion.pin_in_slot_constraint import slot_axes
from trunnion.recursion.vector_algebra import SX, cross
from trunnion.system.structure.bodies_and_joints import GROUND, Device, Fit, FrictionElement, Joint
from trunnion.system.structure.coupling_joint_data import FOOT, Curve, Mimic, Profile, Slot, Unilateral, Wheels


def _closing(kind: str, ground: str) -> tuple[PrimitiveSymbols, dict[str, SX], cutting.Cut]:
    """Symbols, inputs and frames of a cut joint, without its constraint rows."""
    n = ParameterCounter()
    frames, points = [n.take(9), n.take(9)], [n.take(3), n.take(3)]
    a, b = (GROUND if ground == "inb" else 0), (GROUND if ground == "out" else 1)
    devices = tuple(Device() for _ in range(REGISTRY[kind].nv))
    rolls = REGISTRY[kind].rolls
    wheels = Wheels(n.take_one(), (n.take_one(), n.take_one()), n.take_one()) if rolls else None
    if wheels and rolls and rolls.touch == "skew":
        wheels = replace(wheels, lead=n.take_one())
    length = n.take_one() if REGISTRY[kind].keeps_distance else None
    follows = REGISTRY[kind].follows
    cam = follows in ("point", "face")
    profile = Profile((n.take_one(), n.take_one()), n.take_one(), n.take_one(), n.take_one(), (), ()) if cam else None
    slot = Slot(n.take_one(), (n.take_one(), n.take_one()), n.take_one()) if REGISTRY[kind].plays else None
    path = Curve((), 0.0, n.take_one(), n.take_one()) if follows == "curve" else None
    contact = Unilateral(0.0, -1, False, False, -1, n.take_one()) if cam or path else None
    p, f = points, frames
    more = {"slot": slot, "curve": path, "wheels": wheels, "length": length, "profile": profile, "unilateral": contact}
    joint = Joint("", kind, a, b, p[0], p[1], f[0], f[1], Fit(), None, devices, None, True, **more)  # type: ignore[arg-type]
    sym, motions = PrimitiveSymbols(n.count), {k: SX.sym(k, MOTION) for k in ("inb", "out") if k != ground}
    if follows == "curve":
        sym.piece = SX.sym(PIECE, FOOT)
    both = [unpack_motion(ca.vertsplit(motions[k])) if k in motions else GROUND_MOTION for k in ("inb", "out")]
    return sym, {"numbers": sym.p, **motions}, cutting.locate_cut(sym, both, joint)


@cache
def bearing(kind: str, ground: str) -> Primitive:
    """Primitive of the argument of a curve. Inputs: numbers, motions. Output: the angle of a cam's profile, or a point (2) in a
    curve's plane."""
    sym, ins, c = _closing(kind, ground)
    if c.joint.kind.follows == "curve":
        axes = slot_axes(sym, c) if c.joint.slot else (c.Ein[:, 1], c.Ein[:, 2])
        at = point_on_curve_constraint.spot(axes, c)
    else:
        at = cam_follower_constraint.bearing(sym, c)
    return expression_primitive(f"c_{kind}_{ground or 'bodies'}_bearing", ins, {"angle": at})


@cache
def cut(kind: str, ground: str, bare: str = "") -> Primitive:
    """Primitive of a cut joint.

    Inputs: numbers (24: two frames, two points; 4 more for wheels: module, teeth, phase, and of a worm its lead angle; 1 more for
    rods: length; 5 more for cams: ``Profile``; 4 more for pins in slots: ``Slot``; 2 more for curves: length, roller;
    1 more for cams and curves: thickness);
    motions ``inb`` and ``out`` (none for the end ``ground``); the active piece of a cam's profile, or the foot on a curve.
    Outputs: residual, rate and bias of each row (phi, rate, xi); wrenches of each row on the two bodies (gin, gout: 6 per row), and
    on the outboard part at its point (gat); coordinates q and rates v; acceleration bias of each freedom (bias); wrenches of a
    force along each freedom (win, wout, wat); pose; point on the outboard part; of a cam, curve or slot the distance inside its
    ends (inside). bare: a variant with fewer outputs (``BARE``)."""
    sym, ins, c = _closing(kind, ground)
    cutting.add_rows(sym, c)
    joint = c.joint
    if joint.kind.follows:
        ins[PIECE] = sym.piece
    outs: dict[str, SX | list[SX]] = {
        "phi": [r.phi for r in c.rows], "rate": [r.rate for r in c.rows], "xi": [r.xi for r in c.rows],
        "gin": _beside([r.g_in for r in c.rows]), "gout": _beside([r.g_out for r in c.rows]),
        "gat": _beside([at_point(r.g_out, c.c_out) for r in c.rows]),
        "q": cutting.coordinates(c) if joint.kind.nv else [], **_freedoms(c), **_place(c),
    }  # fmt: skip
    asked = BARE[bare]
    outs = outs if asked is None else {name: outs[name] for name in asked}
    if cutting.INSIDE in c.made:
        outs["inside"] = c.made[cutting.INSIDE]
    return expression_primitive(f"c_{kind}_{'_'.join([ground or 'bodies', *([bare] if bare else [])])}", ins, outs)


def _beside(columns: list[SX]) -> SX:
    return ca.densify(ca.horzcat(SX(6, 0), *columns))


@cache
def tie(follower: str, leader: str, coupling: str = MIMIC.name) -> Primitive:
    """Coupling of a freedom that follows another freedom. Inputs: numbers (50: two frames and two points of each joint, ratio,
    offset), coordinates and rates of the two freedoms (2 each), motions of the four bodies. Outputs: residual, rate and ξ of the
    constraint row, and its wrenches on the four bodies. For a gearbox, also the outputs of ``cut`` for the gearbox's freedom,
    except the rate."""
    n, q, v = ParameterCounter(), SX.sym("q", 2), SX.sym("v", 2)
    ends = {name: SX.sym(name, MOTION) for name in ("inb", "out", "inb2", "out2")}
    motions = [unpack_motion(ca.vertsplit(m)) for m in ends.values()]
    joints = []
    for kind in (follower, leader):
        frames, points = [n.take(9), n.take(9)], [n.take(3), n.take(3)]
        joints.append(Joint("", kind, 0, 0, points[0], points[1], frames[0], frames[1], Fit(), None, (), None, True))  # type: ignore[arg-type]
    m = Mimic(0, 0, 0, 0, False, n.take_one(), n.take_one())
    sym = PrimitiveSymbols(n.count)
    follows, leads = (cutting.locate_cut(sym, motions[2 * k : 2 * k + 2], j) for k, j in enumerate(joints))
    c = replace(follows, joint=replace(joints[0], kind_name=coupling), rows=[], made={})
    cutting.add_tie(sym, c, follows, leads, [(q[0], v[0]), (q[1], v[1])], m)
    (row,) = c.rows
    outs: dict[str, SX | list[SX]] = {"phi": row.phi, "rate": row.rate, "xi": row.xi}
    outs.update(zip(ENDS, map(ca.densify, row.on), strict=True))
    if c.joint.kind.nv:
        found = {"gat": at_point(row.g_out, c.c_out), **_freedoms(c), **_place(c)}
        outs.update((name, x) for name, x in found.items() if name != "v")
    return expression_primitive(f"c_{coupling}_{follower}_{leader}", {"numbers": sym.p, "q": q, "v": v, **ends}, outs)


def _freedoms(c: cutting.Cut) -> dict[str, SX | list[SX]]:
    """The outputs of a cut joint's freedoms: rates, acceleration biases, and wrenches of a force along each freedom."""
    wrenches = [cutting.axis_wrenches(c, k) for k in range(c.joint.kind.nv)]
    return {
        "v": cutting.rates(c), "bias": [cutting.acceleration_bias(c, k) for k in range(c.joint.kind.nv)],
        "win": _beside([w for w, _ in wrenches]), "wout": _beside([w for _, w in wrenches]),
        "wat": _beside([at_point(w, c.c_out) for _, w in wrenches]),
    }  # fmt: skip


def _place(c: cutting.Cut) -> dict[str, SX]:
    """The pose of a cut joint, and its point on the outboard part."""
    pose = ca.vertcat(ca.vec(ca.densify(c.Ein)), ca.vec(ca.densify(c.Eout)), ca.densify(c.s))
    return {"pose": pose, "point": c.out.r + c.c_out}


@cache
def outboard(forward: bool) -> Primitive:
    """Primitive of a tree joint's wrench. Inputs: N on the child (6), pose of the joint. Output: force and torque on the outboard
    part at the part's joint point (6)."""
    N, pose = SX.sym("N", 6), SX.sym("pose", POSE)
    f, t, s = N[:3], N[3:], pose[18:]
    if not forward:
        f, t = -f, -(t - cross(s, f))
    return expression_primitive(f"r_outboard_{'out' if forward else 'in'}", {"N": N, "pose": pose}, {"out": ca.vertcat(f, t)})


def _posed() -> tuple[SX, SX, SX, SX, SX]:
    ft, pose = SX.sym("ft", 6), SX.sym("pose", POSE)
    return ft, pose, ca.reshape(pose[:9], 3, 3), ca.reshape(pose[9:18], 3, 3), pose[18:]


@cache
def pin(kind: str, fit: Fit, needs: tuple[str, ...]) -> Primitive:
    """Primitive of the pin's wrench. Inputs: wrench on the outboard part (6), pose (and lengths of overlapping parts). Output: the
    components ``needs`` of f_c, m_c; the component of the span is 0."""
    ft, pose, Ein, Eout, s = _posed()
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, (), None, True)
    ins = {"ft": ft, "pose": pose} | ({"lengths": SX.sym("lengths", 2)} if fit.ends == OVERLAP else {})
    both = ca.vertcat(*on_pin_part(joint, ft[:3], ft[3:], s, Ein, Eout, ins.get("lengths")))
    out = [both[COMPONENTS.index(n)] if n in COMPONENTS else SX(0) for n in needs]
    return expression_primitive("_".join(["r_cut", CONTACTS[joint.kind.friction].name, fit.label, *needs]), ins, {"out": out})


@cache
def weighed(sign: int) -> Primitive:
    """Primitive of a scaled wrench. Inputs: wrench on the outboard part (6), the joint's point (3), motion and numbers of one body,
    half the trace of the body's inertia. Output: the wrench scaled by mass and inertia (6). In loops without friction, scaled
    wrenches select the reactions of redundant loops."""
    count = ParameterCounter()
    body = a_body(count)
    sym, ft, point = PrimitiveSymbols(count.count), SX.sym("ft", 6), SX.sym("point", 3)
    motion, spin = SX.sym("motion", MOTION), SX.sym("spin")
    m = unpack_motion(ca.vertsplit(motion))
    torque = ft[3:] + cross(point - (m.r + m.R @ sym.leaves(body.center)), ft[:3])
    out = ca.vertcat(sign * ft[:3] / ca.sqrt(sym.leaf(body.mass)), sign * torque / ca.sqrt(spin))
    ins = {"ft": ft, "point": point, "motion": motion, "numbers": sym.p, "spin": spin}
    return expression_primitive(f"k_weighed_{'out' if sign > 0 else 'inb'}", ins, {"out": out})


@cache
def arm(bodies: int) -> Primitive:
    """Primitive of the arm of a joint without friction. Inputs: half the trace of the inertia, and the mass, of each body of the
    joint; squared size of the joint's block, without and with mass centres. Output: half length of the joint's contacts."""
    spin, mass, size, wide = SX.sym("spin", bodies), SX.sym("mass", bodies), SX.sym("size"), SX.sym("wide")
    out = arm_of(size, wide, ca.vertsplit(spin), ca.vertsplit(mass))
    return expression_primitive(f"k_arm_{bodies}", {"spin": spin, "mass": mass, "size": size, "wide": wide}, {"out": out})


@cache
def sprung(kind: str, fit: Fit, sizes: tuple[str, ...], soft: bool, driven: tuple[int, ...]) -> Primitive:
    """Primitive of contacts as springs. Inputs: wrench on the outboard part (6), pose, sizes of the contact element (and the
    joint's stiffness), arm. Output: the spring forces of the contacts; with friction in loops, these forces select the reactions of
    redundant loops. sizes: names of the sizes; empty without friction."""
    ft, pose, Ein, Eout, s = _posed()
    n = ParameterCounter()
    friction = FrictionElement("", "", False, tuple((name, n.take_one()) for name in sizes), ()) if sizes else None
    stiffness = n.take_one() if soft else None
    devices = tuple(PRESCRIBED if k in driven else Device() for k in range(REGISTRY[kind].nv))
    joint = Joint("", kind, 0, 0, (), (), (), (), fit, None, devices, friction, True, stiffness=stiffness)
    sym, length = PrimitiveSymbols(n.count), SX.sym("arm")
    out = spring_rows(sym, joint, ft[:3], ft[3:], s, Ein, Eout, length)
    words = [kind, fit.label, *sizes, *(["soft"] if soft else []), *map(str, driven)]
    name = re.sub(r"\W", "_", "_".join(["k_sprung", *words]))
    return expression_primitive(name, {"ft": ft, "pose": pose, "numbers": sym.p, "arm": length}, {"out": out})
