"""C code of the methods: explicit ones as one unrolled function per stage sum, vectorised over the state (rows padded to whole
vectors); the Rosenbrock method as tables."""

from __future__ import annotations

from collections.abc import Sequence

from engine.integrators import EXPLICIT, STIFF
from engine.integrators.rosenbrock import Rosenbrock
from engine.integrators.tableau import Tableau


def header() -> str:
    """Text of the generated header ``tr_tables.h``."""
    return "#include \"vec.h\"\n" + "\n".join([*(_method(t) for t in EXPLICIT), _rosenbrock(STIFF)])


def _sum(coefficients: Sequence[float], rows: Sequence[int] | None = None) -> str:
    """Σ c_i K[i] over the non-zero coefficients, as vector expressions."""
    rows = rows or range(len(coefficients))
    terms = [f"{float(c)!r}*K[{i}*n+j]" for c, i in zip(coefficients, rows, strict=True) if c != 0]
    return "+".join(f"({t})" for t in terms) or "v0"


def _method(t: Tableau) -> str:
    """Stage argument, solution, error and dense rows of one method. K: rows of n vectors."""
    s = t.stages
    parts = []
    loops = {i: _sum(row) for i, row in enumerate(t.A) if i}
    loops |= {s + 1 + i: _sum(row) for i, row in enumerate(t.A_dense)}
    cases = "\n".join(
        f"case {i}: for(int j=0;j<n;++j) out[j]=y[j]+h*({e}); break;" for i, e in loops.items()
    )
    parts.append(
        f"static void {t.name}_argument(int stage,int n,double h,const tr_vec*restrict y,const tr_vec*restrict K,"
        "tr_vec*restrict out)"
        f"{{\nswitch(stage){{\n{cases}\n}}\n}}"
    )
    parts.append(
        f"static void {t.name}_solution(int n,double h,const tr_vec*restrict y,const tr_vec*restrict K,tr_vec*restrict out)"
        f"{{for(int j=0;j<n;++j) out[j]=y[j]+h*({_sum(t.B)});}}"
    )
    for i, e in enumerate(t.E):
        parts.append(
            f"static void {t.name}_error{i}(int n,double h,const tr_vec*restrict K,tr_vec*restrict out)"
            f"{{const tr_vec v0={{0}};(void)v0;for(int j=0;j<n;++j) out[j]=h*({_sum(e)});}}"
        )
    for i, d in enumerate(t.D):
        parts.append(
            f"static void {t.name}_dense{i}(int n,double h,const tr_vec*restrict K,tr_vec*restrict out)"
            f"{{for(int j=0;j<n;++j) out[j]=h*({_sum(d)});}}"
        )
    nodes = [*t.C, 1.0, *t.C_dense]
    parts.append(f"static const double {t.name}_c[]={{{','.join(repr(float(c)) for c in nodes)}}};")
    extra = len(t.C_dense)
    parts.append(f"enum {{{t.name.upper()}_STAGES={s},{t.name.upper()}_EXTRA={extra},{t.name.upper()}_DENSE={len(t.D)}}};")
    return "\n".join(parts)


def _rosenbrock(t: Rosenbrock) -> str:
    """Tables of a Rosenbrock method (square, zero padded)."""
    n = t.stages

    def square(rows: Sequence[Sequence[float]]) -> str:
        return ",".join("{" + ",".join(repr(float(v)) for v in [*row, *([0.0] * (n - len(row)))]) + "}" for row in rows)

    def line(row: Sequence[float]) -> str:
        return ",".join(repr(float(v)) for v in row)

    return (
        f"enum {{TR_ROS_STAGES={n},TR_ROS_END={n + 1},TR_ROS_ORDER={t.order}}};\n"
        f"static const double tr_ros_gamma={t.gamma!r};\n"
        f"static const double tr_ros_a[{n}][{n}]={{{square(t.A)}}};\n"
        f"static const double tr_ros_C[{n}][{n}]={{{square(t.C)}}};\n"
        f"static const double tr_ros_c[{n}]={{{line(t.c)}}},tr_ros_d[{n}]={{{line(t.d)}}};\n"
        f"static const double tr_ros_b[{n}]={{{line(list(t.weights()))}}};\n"
        f"static const double tr_ros_H[3][{n}]={{{square(t.H)}}};\n"
    )
