"""Primitive of a body and its joint: one step of the recursion, for any frames, masses and loads.

The functions of the primitive, in the order in which their inputs become available:

  prepare        numbers → constants
  outward        motion of the body
  inward         reduction
  column         reduction of one force column of the affine maps
  accelerations  accelerations and reaction under known forces
  response       accelerations and reaction that a force column causes
  weigh          M Ż − F of the body alone
  carry          reaction as a wrench on the inboard body
  moved          Ż of the body from q̈ of its joint
  onward         ``accelerations`` without the reaction

If friction is solved along the recursion (``articulated_inertias``), ``narrow``, ``pull`` and ``push`` are added; with loops also
``press``, ``sense`` and ``swing``."""

from __future__ import annotations

import re
from functools import cache

import casadi as ca

from trunnion.elements.joints import REGISTRY
from trunnion.kernel.c_code.code_generator import Code, Input, Output, Stage, emit
from trunnion.kernel.interface.runtime_tables import HANDED, MOTION
from trunnion.kernel.units.motion_and_inertia_packing import pack_handed, pack_motion, unpack_handed, unpack_motion
from trunnion.parts.primitives.articulated_inertias import NARROW, narrowed
from trunnion.parts.primitives.primitive_from_expressions import SIGNATURE
from trunnion.parts.primitives.primitive_keys import BodyKey, Primitive
from trunnion.parts.primitives.primitive_symbols import ParameterCounter, PrimitiveSymbols, a_body, a_joint
from trunnion.recursion.body_kinematics import Motion, Step, walk
from trunnion.recursion.inward_reduction import Articulated, project, transferred_inertia
from trunnion.recursion.masses_and_forces import Mass, mass_matrix, velocity_force
from trunnion.recursion.vector_algebra import SX, Gamma, GammaT, symmetric, zeros

OPERANDS = ("numbers", "constants", "q", "v", "known", "carrier", "work", "kept", "motion", "pose", "handed", "force", "effort",
            "up", "y", "F", "Z", "yc", "fc", "qdd", "Zo", "N", "bias", "fq", *NARROW)  # fmt: skip
"""Operands of all functions. A function has only the operands that it uses, in this order."""
FUNCTIONS = ("prepare", "outward", "inward", "column", "accelerations", "response", "weigh", "carry", "moved", "onward", "narrow",
             "pull", "push", "press", "sense", "swing")  # fmt: skip
NARROWS, CROSSES = FUNCTIONS.index("narrow"), FUNCTIONS.index("press")
AT = {name: f"a[{i}]" for i, name in enumerate(OPERANDS)}


@cache
def body_primitive(which: BodyKey) -> Primitive:
    """Build the primitive from the symbolic functions that also build compiled scenes. sizes: number of parameters, of constants
    computed from these parameters, and of values that each pass stores."""
    kind, count = REGISTRY[which.kind], ParameterCounter()
    spun = count.take(kind.nv) if which.rotors else ()
    joint = a_joint(count, which.kind, which.forward, which.driven, kind.pitched, kind.nv)
    body = a_body(count)
    sym = PrimitiveSymbols(count.count, kind)
    carrier, handed = SX.sym("carrier", MOTION), SX.sym("handed", HANDED)
    motion, step = walk(sym, joint, unpack_motion(ca.vertsplit(carrier)))
    d11, d12, d22, dF = unpack_handed(ca.vertsplit(handed))
    mass = mass_matrix(sym, body, motion.R)
    force, effort = SX.sym("force", 6), SX.sym("effort", kind.nv)
    F = velocity_force(mass, motion.omega) + force + dF
    art = Articulated(symmetric(mass.M11 + d11), ca.sparsify(mass.M12 + d12), symmetric(mass.M22 + d22), F)
    n = len(joint.free)
    turned = ca.diag(ca.vertcat(SX(0, 1), *[sym.leaf(spun[k]) for k in joint.free])) if spun else zeros(n, n)
    project(art, step, ca.vertcat(SX(0, 1), *[effort[k] for k in joint.free]), turned)
    moved = art.F - art.MPi @ art.y - art.times(step.w[:3], step.w[3:])
    up = pack_handed(*transferred_inertia(art, step.lever), GammaT(step.lever, ca.sparsify(moved)))
    ins = [
        Input(AT["numbers"], sym.p, 0), *[Input(AT[n], s, 1, transient=True) for n, s in
        (("q", sym.q), ("v", sym.v), ("known", sym.known), ("carrier", carrier))],
        *[Input(AT[n], s, 2, transient=True) for n, s in (("handed", handed), ("force", force), ("effort", effort))],
    ]  # fmt: skip
    outs = [
        Output(AT["motion"], 0, pack_motion(motion), 1), Output(AT["pose"], 0, _pose(step), 1), Output(AT["bias"], 0, step.w, 1),
        Output(AT["up"], 0, up, 2, True, True), Output(AT["y"], 0, art.y, 2), Output(AT["F"], 0, art.F, 2),
    ]  # fmt: skip
    more = [_column(art, step), *(_outward(art, step, stage) for stage in (4, 5, 9)), *_balance(mass, motion, step)]
    more += narrowed(mass, step, velocity_force(mass, motion.omega), AT, NARROWS, which.looped, turned) if which.rubbed else []
    code = _emitted(which, [*ins, *[i for found, _ in more for i in found]], [*outs, *[o for _, found in more for o in found]])
    text, operands = _with_own_operands(which, code.text)
    constants, work, kept = code.kept[:3]
    slim = sum(code.kept[NARROWS:])
    sizes = {"numbers": count.count, "constants": constants, "work": work, "kept": kept, "slim": slim}
    return Primitive(operands, sizes, text)


def _pose(step: Step) -> list[SX]:
    return [x for primitive in (step.Ein, step.Eout, step.s) for x in ca.vertsplit(ca.vec(ca.densify(primitive)))]


def _column(art: Articulated, step: Step) -> tuple[list[Input], list[Output]]:
    """Reduction of a force column, which consists of the wrench f on the body (6) and the forces along the free freedoms
    (``effort``)."""
    f, g = SX.sym("f", 6), SX.sym("g", step.Pi.size2())
    fq = step.Pi.T @ f + g
    y = art.solve(fq)
    up = GammaT(step.lever, f - art.MPi @ y)
    ins = [Input(AT["fc"], f, 3), Input(AT["effort"], g, 3)]
    return ins, [Output(AT["yc"], 0, y, 3), Output(AT["fq"], 0, fq, 3), Output(AT["up"], 0, up, 3, True)]


def _outward(art: Articulated, step: Step, stage: int) -> tuple[list[Input], list[Output]]:
    """The outward step. Stages 4 and 9 include the known accelerations w; stage 5, for force columns, does not."""
    Z, y, f = SX.sym("Z", 6), SX.sym("y", step.Pi.size2()), SX.sym("F", 6)
    carried = Gamma(step.lever, Z)
    qdd = y - art.solve(art.MPi.T @ carried)
    out = carried + step.Pi @ qdd + (zeros(6) if stage == 5 else step.w)
    N = art.times(out[:3], out[3:]) - f
    ins, outs = [("Z", Z), ("yc", y), ("fc", f)], [("qdd", qdd), ("Zo", out), ("N", N)]
    last = 2 if stage == 9 else 3
    return [Input(AT[n], s, stage) for n, s in ins[:last]], [Output(AT[n], 0, v, stage) for n, v in outs[:last]]


def _balance(mass: Mass, motion: Motion, step: Step) -> list[tuple[list[Input], list[Output]]]:
    """Three functions. The first one adds M Ż − F of the body alone to N, where F includes the wrench ``force``. The second one
    converts N to a wrench on the inboard body. The third one computes Ż from q̈."""
    Z, f, N = SX.sym("Z", 6), SX.sym("f", 6), SX.sym("N", 6)
    moved = ca.vertcat(mass.M11 @ Z[:3] + mass.M12 @ Z[3:], mass.M12.T @ Z[:3] + mass.M22 @ Z[3:])
    own = moved - velocity_force(mass, motion.omega) - f
    a, Zi = SX.sym("a", step.Pi.size2()), SX.sym("Zi", 6)
    return [
        ([Input(AT["Z"], Z, 6), Input(AT["force"], f, 6)], [Output(AT["N"], 0, own, 6, True)]),
        ([Input(AT["N"], N, 7)], [Output(AT["up"], 0, GammaT(step.lever, N), 7, True)]),
        ([Input(AT["Z"], Zi, 8), Input(AT["qdd"], a, 8)], [Output(AT["Zo"], 0, Gamma(step.lever, Zi) + step.Pi @ a + step.w, 8)]),
    ]


def _with_own_operands(which: BodyKey, text: str) -> tuple[str, dict[str, tuple[str, ...]]]:
    """The text with the operands of each function renumbered from 0, and the names of each function's operands."""
    operands, out, pieces = {}, [], ""
    for function in re.split(r"(?<=\n}\n)", text):
        pieces += function
        found = re.search(rf"^void {which.name}_(\w+)\(", function, re.MULTILINE)
        if not found:
            continue  # a helper function, which precedes the function that calls it
        used = sorted({int(i) for i in re.findall(r"\ba\[(\d+)\]", pieces)})
        number = {str(i): n for n, i in enumerate(used)}
        out.append(re.sub(r"\ba\[(\d+)\]", lambda m, number=number: f"a[{number[m.group(1)]}]", pieces))  # type: ignore[misc]
        operands[f"{which.name}_{found.group(1)}"] = tuple(OPERANDS[i] for i in used)
        pieces = ""
    return "".join(out), operands


def _emitted(which: BodyKey, ins: list[Input], outs: list[Output]) -> Code:
    keep = {"prepare": AT["constants"], "outward": AT["work"], "inward": AT["kept"], "narrow": AT["slim"]}
    functions = FUNCTIONS if which.looped else FUNCTIONS[:CROSSES] if which.rubbed else FUNCTIONS[:NARROWS]
    stages = [Stage(f"{which.name}_{f}", SIGNATURE, keep.get(f, "")) for f in functions]
    return emit([i for i in ins if i.symbol.numel()], [o for o in outs if _length(o)], stages)


def _length(o: Output) -> int:
    return o.values.numel() if isinstance(o.values, SX) else len(o.values)
