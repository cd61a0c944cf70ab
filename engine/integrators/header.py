"""C code of the explicit methods: one unrolled function per stage sum, vectorised over the state (rows padded to whole vectors)."""

from __future__ import annotations

from collections.abc import Sequence

from engine.integrators import EXPLICIT
from engine.integrators.tableau import Tableau


def header() -> str:
    """Text of the generated header ``tr_tables.h``."""
    return "#include \"vec.h\"\n" + "\n".join(_method(t) for t in EXPLICIT)


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
        f"static void {t.name}_argument(int stage,int n,double h,const tr_vec*restrict y,const tr_vec*restrict K,tr_vec*restrict out)"
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
