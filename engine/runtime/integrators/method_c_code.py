"""C code of the methods. An explicit method becomes unrolled functions, one for each sum of stages, vectorised over the state. A
Rosenbrock method becomes tables. The runtime reads all methods from one table (``base/method_tables.h``)."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.runtime.integrators import AUTO, METHODS, REGISTRY, Impulses, Method, Rosenbrock, Tableau

HERMITE = 3
"""Number of dense-output rows of cubic Hermite interpolation, which all explicit methods have."""
ROWS = "const tr_vec*restrict K"


def header() -> str:
    """Text of the generated header ``tr_tables.h``."""
    return '#include "base/method_tables.h"\n' + "\n".join([*map(_numbers_of, REGISTRY), _table(), _choices()])


def _numbers_of(m: Method) -> str:
    """C text of a method's coefficients. Raises ValueError if the coefficients contradict the declared properties."""
    if not isinstance(m, Impulses):
        m.check()
    return explicit_text(m) if isinstance(m, Tableau) else _rosenbrock(m) if isinstance(m, Rosenbrock) else _impulses(m)


def _sum(coefficients: Sequence[float]) -> str:
    """C expression, on vectors, of Σ c_i K[i] over the non-zero coefficients c_i."""
    terms = [f"({float(c)!r}*K[{i}*n+j])" for i, c in enumerate(coefficients) if c != 0]
    return "+".join(terms) or "v0"


def _loop(target: str) -> str:
    return f"const tr_vec v0=TR_NOUGHT;(void)v0;for(int j=0;j<n;++j) out[j]={target};"


def explicit_text(t: Tableau) -> str:
    """C functions of one explicit method: argument of each stage, solution, errors, dense rows. Each row of K has n SIMD
    vectors."""
    s, name = t.stages, t.name
    loops = {i: _sum(row) for i, row in enumerate(t.A) if i}
    loops |= {s + 1 + i: _sum(row) for i, row in enumerate(t.A_dense)}
    cases = "\n".join(f"case {i}: for(int j=0;j<n;++j) out[j]=y[j]+h*({e}); break;" for i, e in loops.items())
    y = "const tr_vec*restrict y"
    parts = [
        f"static void {name}_argument(int stage,int n,double h,{y},{ROWS},tr_vec*restrict out)"
        f"{{\nswitch(stage){{\n{cases}\n}}\n}}",
        f"static void {name}_solution(int n,double h,{y},{ROWS},tr_vec*restrict out){{{_loop(f'y[j]+h*({_sum(t.B)})')}}}",
    ]
    for kind, rows in (("error", t.E), ("dense", t.D)):
        for i, row in enumerate(rows):
            parts.append(f"static void {name}_{kind}{i}(int n,double h,{ROWS},tr_vec*restrict out){{{_loop(f'h*({_sum(row)})')}}}")
        names = ",".join(f"{name}_{kind}{i}" for i in range(len(rows))) or "0"
        parts.append(f"static const tr_combination {name}_{kind}s[]={{{names}}};")
    parts.append(f"static const double {name}_c[]={_numbers([*t.C, 1.0, *t.C_dense])};")
    parts.append(f"static const double {name}_lead[]={_numbers([x for row in t.lead() for x in row])};")
    parts.append(
        f"static const tr_explicit {name}_method={{.stages={s},.extra={len(t.C_dense)},.errors={len(t.E)},.dense={len(t.D)},"
        f".ends_in_error={int(t.first_same_as_last)},.stiff_at={t.stiff_at!r},.c={name}_c,.lead={name}_lead,.argument={name}_argument,"
        f".solution={name}_solution,.error={name}_errors,.dense_row={name}_denses}};\n"
    )
    return "\n".join(parts)


def _rosenbrock(t: Rosenbrock) -> str:
    """C tables of a Rosenbrock method. Its triangular matrices are padded with zeros to square matrices."""
    n, name = t.stages, t.name

    def square(rows: Sequence[Sequence[float]]) -> list[float]:
        return [v for row in rows for v in [*row, *([0.0] * (n - len(row)))]]

    tables = {"A": square(t.A), "C": square(t.C), "c": t.c, "d": t.d, "b": list(t.weights()), "H": square(t.H)}
    texts = [f"static const double {name}_{k}[]={_numbers(v)};" for k, v in tables.items()]
    fields = ",".join(f".{k}={name}_{k}" for k in tables)
    return "\n".join([*texts, f"static const tr_rosenbrock {name}_method={{.stages={n},.gamma={t.gamma!r},{fields}}};\n"])


def _impulses(t: Impulses) -> str:
    """C table of the weights of time stepping, for the whole step and for the two half steps."""
    whole, halves = t.weights
    return f"static const tr_impulses {t.name}_method={{.whole={float(whole)!r},.halves={float(halves)!r}}};\n"


def _numbers(values: Sequence[float]) -> str:
    return "{" + ",".join(repr(float(v)) for v in values) + "}"


def _kind(m: Method) -> str:
    if isinstance(m, Tableau):
        return f".kind=TR_EXPLICIT,.order={m.order},.end={m.end},.explicit=&{m.name}_method"
    if isinstance(m, Rosenbrock):
        return f".kind=TR_IMPLICIT,.order={m.order},.end={m.end},.rosenbrock=&{m.name}_method"
    return f".kind=TR_IMPULSES,.order={m.order},.impulses=&{m.name}_method"


def _table() -> str:
    """C table of all methods, indexed by method number."""
    rows = ",\n".join("{" + _kind(m) + "}" for m in REGISTRY)
    return f"static const tr_method tr_methods[TR_METHODS]={{\n{{.kind=TR_CHOSEN}},\n{rows}}};\n"


def _choices() -> str:
    """C definitions of the methods of ``auto``, and of the largest array sizes."""
    of: dict[str, Method] = {"LOOSE": AUTO.loose, "TIGHT": AUTO.tight, "STIFF": AUTO.stiff, "ACCUMULATING": AUTO.accumulating}
    numbers = ", ".join(f"TR_AUTO_{k} = {METHODS.index(m.name)}" for k, m in of.items())
    with_rows = [m for m in REGISTRY if isinstance(m, Tableau | Rosenbrock)]
    dense = max(HERMITE + len(m.D) if isinstance(m, Tableau) else 1 + len(m.H) for m in with_rows)
    return (
        f"enum {{{numbers}}};\n#define TR_AUTO_LOOSE_ABOVE {AUTO.loose_above!r}\n"
        f"enum {{TR_STAGES = {max(m.rows for m in with_rows)}, TR_DENSE_ROWS = {dense}}};\n"
    )
