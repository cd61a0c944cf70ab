"""The recursion of large trees as C loops over the bodies, with a C function for each class of bodies. Small trees have one
unrolled text instead.

The unrolled text of 64 bodies is larger than the instruction cache: an evaluation takes 1.3 times as long as in C loops. If all
joints have friction, the unrolled text grows with the square of the number of joints. C loops serve open trees without springs
between bodies. The force column of a friction multiplier is passed inward along the bodies that carry its joint. The accelerations
that the column causes are passed outward to all bodies.
"""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.kernel.c_code.code_generator import Code, Input, Output, Stage, emit
from trunnion.kernel.interface.runtime_tables import HANDED, MOTION
from trunnion.kernel.units.body_classes import BodyCode, Classes, Shape, classify, outward_step
from trunnion.kernel.units.unit_inputs import CONST, STATE
from trunnion.recursion.joint_reactions import pin_wrench
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.friction_joint_indices import any_sets, elements
from trunnion.system.structure.parameter_table import Leaf, Param

MIN_BODIES = 20
REUSE = 3
"""C loops are faster with at least MIN_BODIES bodies, and at least REUSE bodies per class. For a chain, an evaluation in C loops
takes 80 ns per body. The unrolled text takes 54 ns per body up to 18 bodies, where it fits a cache of 64 KB. It takes 91 ns from 20
bodies on, and 107 ns at 64 bodies."""


def loops_pay(system: System, quadratures: bool) -> bool:
    """Whether the recursion in C loops supports a system and is faster. quadratures: whether integrals of powers are needed, which
    C loops do not support."""
    if system.cuts or quadratures or system.bristles or len(system.bodies) < MIN_BODIES:
        return False
    if any(load.joins for load in system.loads):
        return False
    if any(j.fit.ends == OVERLAP for j in system.joints):
        return False
    if any_sets(system) and any(j.driven for j in system.frictional):
        return False
    alike = {(j.kind_name, j.forward, j.inb_frame, j.out_frame) for j in system.tree}
    return len(system.bodies) >= REUSE * (len(alike) + 2)


class LoopedRecursion:
    """C code of prepare, stage 1 and stage 2. reactions: whether to store also N of every body (6 each), for benchmarks."""

    def __init__(self, sym: Symbols, reactions: bool = False):
        self.sym, self.system, self.reactions = sym, sym.system, reactions
        self.classes: Classes = classify(sym)
        self.parts = elements(self.system)
        self.by_child = {e.joint.child: e for e in self.parts}
        self.kept: dict[Shape, list[int]] = {}
        self.operations = [0, 0, 0]  # of prepare, stage 1 and stage 2
        texts = [self._class(i, shape, code) for i, (shape, code) in enumerate(self.classes.codes.items())]
        self._offsets()
        self.code = Code("\n".join([*texts, self._tables(), self._drivers()]), [self.nc, self.nw, 0], self.operations)

    @property
    def sizes(self) -> dict[str, int]:
        """Sizes of the stepping unit, as in ``tr_kernel``, without nc."""
        s, ne = self.system, self.system.neta
        nn, nrates = sum(len(e.needs) for e in self.parts), sum(e.joint.kind.nv for e in self.parts)
        held = ne * (1 + ne) if any_sets(s) else 0
        zero = ("nb", "rows", "active", "npowers", "ntaken", "nkappa", "loop_friction", "coupled")
        return dict.fromkeys(zero, 0) | {
            "nq": s.nq, "nv": s.nv, "nx": self.sym.x.shape[0], "np": self.sym.p.shape[0], "nw": self.nw,
            "nmaps": nn * (1 + ne) + nrates + held + 1, "neta": ne, "nn": nn, "nrates": nrates,
        }  # fmt: skip

    def _class(self, i: int, shape: Shape, b: BodyCode) -> str:
        full, column = outward_step(b, True), outward_step(b, False)
        s = b.sym
        first = [("p", s.p, 0), ("x", s.x, 1), ("q", s.q, 1), ("v", s.v, 1), ("P", b.parent, 1), ("H", b.children, 2)]
        ins = [Input(name, symbol, stage, transient=True) for name, symbol, stage in first]
        ins += [Input("f", b.column_f, 3), Input("g", b.column_g, 3)]
        for o, stage in ((full, 4), (column, 5)):
            ins += [Input("Z", o.Z, stage), Input("yc", o.y, stage), Input("fc", o.f, stage)]
        pin = SX.sym("n", 6)
        rows = pin_wrench(b.step, shape.joint, pin, shape.needs) if shape.needs else SX(0, 1)
        keep_f = [Output("F", 0, b.art.F, 2)] if self._needs_force else []
        outs = [
            Output("M", 0, b.motion, 1), Output("rates", 0, b.step.rates, 1), Output("up", 0, b.handed, 2, True),
            Output("y", 0, b.y, 2), *keep_f, Output("yc", 0, b.column_y, 3), Output("up", 0, b.column_handed, 3, True),
            *[Output("qdd", 0, o.qdd, k) for o, k in ((full, 4), (column, 5))],
            *[Output("Zo", 0, o.Zo, k) for o, k in ((full, 4), (column, 5))],
        ]
        if self._needs_force:
            outs += [Output("N", 0, full.N, 4), Output("N", 0, column.N, 5)]
        if shape.needs:
            outs.append(Output("row", 0, rows, 6))
            ins.append(Input("N", pin, 6))
        w, writes = "double*restrict w", "double*restrict y,double*restrict F"
        stages = [
            Stage(f"c{i}_prepare", f"{CONST}p,double*restrict c", "c"),
            Stage(f"c{i}_fwd", f"{CONST}x,{CONST}q,{CONST}v,{CONST}c,{CONST}P,{w},double*restrict M,double*restrict rates", "w"),
            Stage(f"c{i}_in", f"{CONST}c,{w},{CONST}H,double*restrict w2,double*restrict up,{writes}", "w2"),
            Stage(f"c{i}_col", f"{CONST}c,{CONST}w,{CONST}w2,{CONST}f,{CONST}g,double*restrict yc,double*restrict up", ""),
            Stage(f"c{i}_out", self._out_arguments(), ""),
            Stage(f"c{i}_outcol", self._out_arguments(), ""),
            Stage(f"c{i}_pin", f"{CONST}c,{CONST}w,{CONST}w2,{CONST}N,double*restrict row", ""),
        ]
        code = emit(ins, [o for o in outs if _length(o.values)], stages)
        self.kept[shape] = code.kept[:3]
        members = sum(s == shape for s in self.classes.shapes)
        self.operations[0] += members * code.operations[0]
        self.operations[1] += members * (code.operations[1] + code.operations[2])
        self.operations[2] += members * code.operations[4]
        return code.text.replace("\nvoid ", "\nstatic void ").replace("void c", "static void c", 1)

    @staticmethod
    def _out_arguments() -> str:
        outs = "double*restrict qdd,double*restrict Zo,double*restrict N"
        return f"{CONST}c,{CONST}w,{CONST}w2,{CONST}Z,{CONST}yc,{CONST}fc,{outs}"

    @property
    def _needs_force(self) -> bool:
        return self.reactions or bool(self.parts)

    def _offsets(self) -> None:
        """Compute offsets: of each body's constants in c, of its kept values in w, and of the arrays that follow these values in w.
        Gravity is last in c."""
        n, ne = len(self.system.bodies), self.system.neta
        self.co: list[int] = []
        self.wo: list[int] = []
        self.w2o: list[int] = []
        c = w = 0
        for shape in self.classes.shapes:
            k = self.kept[shape]
            self.co.append(c)
            c += k[0]
        for shape in self.classes.shapes:
            self.wo.append(w)
            w += self.kept[shape][1]
            self.w2o.append(w)
            w += self.kept[shape][2]
        self.gravity, self.nc, at = c, c + 3, w
        self.arrays: dict[str, int] = {}
        sizes = {"M": MOTION * n, "H": HANDED * (n + 1), "Y": 6 * n, "F": 6 * n, "Z": 6 * n, "N": 6 * n, "R": 6 * n,
                 "YC": 6 * n * ne, "FC": 6 * (n + 1), "ZC": 6 * n, "NC": 6 * n}
        for name, size in sizes.items():
            self.arrays[name] = at
            at += size
        self.nw = at

    def _tables(self) -> str:
        s = self.system
        index = self.classes.index
        gather = [i for p in self.classes.parameters for i in p]
        starts = [sum(len(p) for p in self.classes.parameters[:i]) for i in range(len(s.bodies) + 1)]
        e0 = [self.by_child[i].eta[0] if i in self.by_child else -1 for i in range(len(s.bodies))]
        n0 = [self.by_child[i].n0 if i in self.by_child else -1 for i in range(len(s.bodies))]
        r0 = [self.by_child[i].rate0 if i in self.by_child else -1 for i in range(len(s.bodies))]
        rows = {
            "b_class": [index[x] for x in self.classes.shapes], "b_parent": [b.parent for b in s.bodies],
            "b_q": [j.q0 for j in s.tree], "b_v": [s.nq + j.v0 for j in s.tree], "b_c": self.co, "b_w": self.wo, "b_w2": self.w2o,
            "b_gather": gather, "b_start": starts, "b_eta": e0, "b_n0": n0, "b_r0": r0, "b_nv": [j.kind.nv for j in s.tree],
            "b_free": [len(j.free) for j in s.tree],
        }
        text = "".join(f"static const int {k}[]={{{','.join(map(str, v)) or '0'}}};\n" for k, v in rows.items())
        free = [f for j in s.tree for f in [*j.free, *([-1] * (6 - len(j.free)))]]
        return text + f"static const int b_freedom[]={{{','.join(map(str, free))}}};\nenum {{B_N={len(s.bodies)}}};\n"

    def _switch(self, call: str, only: Sequence[int] | None = None) -> str:
        """C switch over the class of body i. In the call, ``{}`` stands for the number of the class. only: classes that get a
        case."""
        cases = "".join(f"case {k}:{call.format(k)};break;" for k in range(len(self.classes.codes)) if only is None or k in only)
        return f"switch(b_class[i]){{{cases}}}"

    def _drivers(self) -> str:
        a = {k: f"(w+{v})" for k, v in self.arrays.items()}
        fwd = self._switch(
            f"c{{}}_fwd(x,y+b_q[i],y+b_v[i],c+b_c[i],b_parent[i]<0?0:{a['M']}+{MOTION}*b_parent[i],w+b_w[i],{a['M']}+{MOTION}*i,{a['R']}+6*i)")
        inward = self._switch(
            f"c{{}}_in(c+b_c[i],w+b_w[i],{a['H']}+{HANDED}*i,w+b_w2[i],{a['H']}+{HANDED}*(b_parent[i]<0?B_N:b_parent[i]),{a['Y']}+6*i,{a['F']}+6*i)")
        n_at = f"{a['N']}+6*i"
        # c_out writes q̈ of body i directly into ẏ, where the free rates of a joint are adjacent
        out = self._switch(
            f"c{{}}_out(c+b_c[i],w+b_w[i],w+b_w2[i],b_parent[i]<0?base:{a['Z']}+6*b_parent[i],yc,{a['F']}+6*i,dy+b_v[i],{a['Z']}+6*i,{n_at})")
        prepare = self._switch("c{}_prepare(local,c+b_c[i])")
        most = max(len(p) for p in self.classes.parameters)
        gravity = "".join(f"base[{k}]=-c[{self.gravity}+{k}];" for k in range(3))
        g_code = "".join(f"c[{self.gravity}+{k}]={_number(self.system.gravity[k])};" for k in range(3))
        text = [
            f"void k_prepare({CONST}p,double*restrict c){{double local[{most + 1}];for(int i=0;i<B_N;++i){{"
            f"for(int k=b_start[i];k<b_start[i+1];++k) local[k-b_start[i]]=p[b_gather[k]];{prepare}}}{g_code}}}",
            f"static void k_kinematics({CONST}x,{CONST}y,{CONST}c,double*restrict w){{for(int i=0;i<B_N;++i){{{fwd}}}"
            f"for(int i=0;i<{HANDED}*(B_N+1);++i) {a['H']}[i]=0.0;for(int i=B_N-1;i>=0;--i){{{inward}}}}}",
            f"static void k_outward({CONST}c,double*restrict w,{CONST}Y,double*restrict dy){{double base[6]={{0}};{gravity}"
            f"for(int i=0;i<B_N;++i){{const double*yc=Y+6*i;{out}}}}}",
        ]
        return "\n".join([*text, self._stage1(a), self._stage2(a)])

    def _coordinate_rates(self) -> str:
        return f"k_qdot(y,y+{self.system.nq},c,dy);"

    def _stage1(self, a: dict[str, str]) -> str:
        writes = "double*restrict w,double*restrict maps,double*restrict dy,double*restrict power"
        head = f"void k_stage1({STATE},{writes}){{k_kinematics(x,y,c,w);"
        if not self.parts:
            return f"{head}{self._coordinate_rates()}k_outward(c,w,{a['Y']},dy);}}"
        return head + f"k_outward(c,w,{a['Y']},dy);" + self._columns(a) + "}"

    def _columns(self, a: dict[str, str]) -> str:
        """C text of N0, Ne and the rates of the maps. Each column is passed inward along the path of its joint, then outward."""
        nn, ne = sum(len(e.needs) for e in self.parts), self.system.neta
        framed = [k for k, s in enumerate(self.classes.codes) if s.needs]
        pin0 = self._switch(f"c{{}}_pin(c+b_c[i],w+b_w[i],w+b_w2[i],{a['N']}+6*i,maps+b_n0[i])", framed)
        pinc = self._switch(f"c{{}}_pin(c+b_c[i],w+b_w[i],w+b_w2[i],{a['NC']}+6*i,maps+{nn}+{nn}*j+b_n0[i])", framed)
        col = self._switch(f"c{{}}_col(c+b_c[i],w+b_w[i],w+b_w2[i],f,g,{a['YC']}+6*(i+B_N*j),up)")
        outcol = self._switch(
            f"c{{}}_outcol(c+b_c[i],w+b_w[i],w+b_w2[i],b_parent[i]<0?none:{a['ZC']}+6*b_parent[i],{a['YC']}+6*(i+B_N*j),{a['FC']}+6*i,qdd,"
            f"{a['ZC']}+6*i,{a['NC']}+6*i)")
        rates = nn + nn * ne
        return (
            f"for(int i=0;i<B_N;++i) if(b_eta[i]>=0){{{pin0}for(int k=0;k<b_nv[i];++k) maps[{rates}+b_r0[i]+k]={a['R']}[6*i+k];"
            f"{self._held_bias(rates)}}}\n"
            "const double none[6]={0};double qdd[6];\n"
            f"for(int b=0;b<B_N;++b) if(b_eta[b]>=0) for(int k=0;k<b_nv[b];++k){{const int j=b_eta[b]+k;double g[6]={{0}},sink[6];"
            "for(int m=0;m<b_free[b];++m) if(b_freedom[6*b+m]==k) g[m]=-1.0;"
            f"for(int i=0;i<6*B_N;++i) {a['YC']}[6*B_N*j+i]=0.0;for(int i=0;i<6*(B_N+1);++i) {a['FC']}[i]=0.0;"
            f"for(int i=b;i>=0;i=b_parent[i]){{double*f={a['FC']}+6*i,*up=b_parent[i]<0?sink:{a['FC']}+6*b_parent[i];{col}"
            "for(int m=0;m<6;++m) g[m]=0.0;}"
            f"for(int i=0;i<B_N;++i){{{outcol}if(b_eta[i]>=0){{{pinc}{self._held_column(rates)}}}}}}}\n"
        )

    def _held_bias(self, rates: int) -> str:
        """C text of Q0 of the maps: accelerations of the sliding freedoms without friction."""
        if not any_sets(self.system):
            return ""
        at = rates + sum(e.joint.kind.nv for e in self.parts)
        return f"for(int k=0;k<b_free[i];++k) maps[{at}+b_eta[i]+b_freedom[6*i+k]]=dy[b_v[i]+k];"

    def _held_column(self, rates: int) -> str:
        """C text of column j of Qe of the maps: accelerations of the sliding freedoms that a unit of η_j causes."""
        if not any_sets(self.system):
            return ""
        ne = self.system.neta
        at = rates + sum(e.joint.kind.nv for e in self.parts) + ne
        return f"for(int k=0;k<b_free[i];++k) maps[{at}+{ne}*j+b_eta[i]+b_freedom[6*i+k]]=qdd[k];"

    def _stage2(self, a: dict[str, str]) -> str:
        writes = "double*restrict dy,double*restrict power"
        head = f"void k_stage2({CONST}x,{CONST}y,{CONST}c,{CONST}w0,{CONST}z,{writes}){{double*w=(double*)w0;"
        ne = self.system.neta
        if not self.parts:
            return head + "}"
        combine = (
            f"double Y[6*B_N];for(int i=0;i<6*B_N;++i){{Y[i]={a['Y']}[i];for(int j=0;j<{ne};++j) Y[i]+={a['YC']}[6*B_N*j+i]*z[j];}}"
        )
        return head + combine + self._coordinate_rates() + "k_outward(c,w,Y,dy);}"


def _length(values: Sequence[SX] | SX) -> int:
    return values.numel() if isinstance(values, SX) else len(values)


def _number(leaf: Leaf) -> str:
    """C expression of a number of the scene: a literal, or a parameter of the run."""
    return f"p[{leaf.index}]" if isinstance(leaf, Param) else repr(float(leaf))
