"""C sources of a system's kernel: generated functions and the table ``tr_kernel`` the runtime reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from engine.kernel.columns import Column
from engine.kernel.jacobian_unit import jacobian_unit
from engine.kernel.linear_unit import linear_text
from engine.kernel.main_unit import MainUnit, main_unit
from engine.kernel.output_unit import OutputUnit, output_unit
from engine.recursion.reduction import model
from engine.recursion.redundancy import rows_of
from engine.recursion.symbols import Symbols
from engine.system.structure import System, state_coordinates

ABI = 9
"""Must equal TR_ABI of ``runtime/tr.h`` (the runtime refuses a kernel of another one)."""
PREAMBLE = '#include <math.h>\n#include "tr.h"\n'


@dataclass
class KernelSource:
    """C text by unit name ("kernel", "outputs") and facts worth keeping beside the library."""

    units: dict[str, str]
    facts: dict[str, object]


def kernel_source(
    system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool = False
) -> KernelSource:
    """Symbolic build of everything a run needs (the Jacobian comes later, when a method asks for it)."""
    sym = Symbols(system, parameters)
    main = main_unit(sym, quadratures, redundant)
    out = output_unit(model(sym, reduce=False), chosen, quadratures)
    facts: dict[str, object] = {"operations": main.operations, "active_rows": list(main.sizes.active), "loop_rows": rows_of(system)}
    return KernelSource({"kernel": _kernel_text(system, main), "outputs": _outputs_text(out)}, facts)


def jacobian_source(system: System, parameters: int, quadratures: bool, redundant: bool) -> str:
    """C text of the Jacobian unit."""
    unit = jacobian_unit(model(Symbols(system, parameters)), quadratures, redundant)
    names = "j_eval,0,0" if unit.dense else "0,j_point,j_along"
    struct = f"const tr_jacobian trunnion_jacobian={{{ABI},{unit.nc},{unit.nw},j_prepare,{names}}};\n"
    return PREAMBLE + unit.text + struct


def linear_source(system: System, parameters: int, chosen: list[Column], quadratures: bool, redundant: bool) -> str:
    """C text of the linear unit."""
    text, nc = linear_text(system, parameters, chosen, quadratures, redundant)
    struct = f"const tr_linear trunnion_linear={{{ABI},{nc},{len(system.inputs)},l_prepare_all,l_rates,l_columns_at}};\n"
    return PREAMBLE + text + struct


def _ints(name: str, values: Sequence[int]) -> str:
    """A static table of integers (never empty in C)."""
    return f"static const int {name}[]={{{','.join(map(str, values)) or '0'}}};\n"


def coordinate_kinds(system: System) -> tuple[list[int], list[int], list[int]]:
    """(kind of each q: 0 angle, 1 length, 2 quaternion; kind of each v: 0, 1; offsets of quaternions)."""
    qkind: list[int] = []
    vkind: list[int] = []
    quat: list[int] = []
    codes = {"angle": 0, "length": 1, "quaternion": 2}
    for j in system.tree:
        states = state_coordinates(j)
        if j.kind.quaternion >= 0:
            quat.append(len(qkind) + states.index(j.kind.quaternion))
        qkind += [codes[j.kind.coordinates[i]] for i in states]
        vkind += [0 if j.kind.columns[k][0].rot else 1 for k in j.free]
    return qkind, vkind, quat


def element_table(main: MainUnit) -> tuple[list[int], list[int], int]:
    """Rows of the element and slider tables (see ``tr.h``) and the length of the law Jacobian block."""
    rows: list[int] = []
    sliders: list[int] = []
    dn = contact = 0
    for number, e in enumerate(main.elements):
        n, nv = len(e.needs), e.joint.kind.nv
        rows += [e.n0, n, e.eta[0], nv, e.rate0, nv, dn]
        dn += nv * n
        pairs = e.friction.sliders
        each = e.contact.count // len(pairs)
        for s in pairs:
            first = min(s.eta) - e.eta[0]
            own = [first + k for k in range(len(s.eta))]
            mine = not e.joint.cut and all(k in e.joint.free for k in own)
            v0 = e.joint.v0 + e.joint.free.index(first) if mine else -1
            cone = int(e.contact.cone is not None and not e.friction.adams)
            sliders += [number, s.eta[0], len(s.eta), e.rate0 + first, len(s.eta), e.law_kind, contact, each, v0, cone]
            contact += each
    return rows, sliders, dn


def _kernel_text(system: System, main: MainUnit) -> str:
    z = main.sizes
    qkind, vkind, quat = coordinate_kinds(system)
    elements, sliders, dn = element_table(main)
    row_kind = [k for c in system.cuts for k in [0] * len(c.kind.rows_s) + [1] * len(c.kind.rows_r)]
    values = [
        ABI, z.nq, z.nv, z.nb, z.nx, z.np, z.nc, z.nw, z.nmaps, z.rows, len(z.active), z.neta, z.nn, z.nrates, z.nquad,
        len(system.sliders), system.stops, system.tables, len(quat), len(main.elements), dn,
        z.nkappa, z.loop_friction, z.coupled, int(any(e.sets for e in main.elements)),
    ]
    tables = "".join([
        _ints("k_active", z.active), _ints("k_row_kind", row_kind), _ints("k_qkind", qkind), _ints("k_vkind", vkind),
        _ints("k_quat", quat), _ints("k_element", elements), _ints("k_slider", sliders),
    ])
    struct = (
        f"const tr_kernel trunnion_kernel={{{','.join(map(str, values))},K_C_CLOSURE,K_C_LAWS,K_C_EVENTS,K_C_HELD,k_active,"
        "k_row_kind,k_qkind,k_vkind,k_quat,k_element,k_slider,k_prepare_all,k_stage1,k_stage2,k_laws,k_held,k_closure,k_events,k_qdot};\n"
    )
    return PREAMBLE + main.text + tables + struct


def _outputs_text(out: OutputUnit) -> str:
    post = [v for entry in out.post for v in entry]
    kappa = "o_kappa_at" if out.nkappa else "0"
    contacts = "o_contacts_at" if out.ncontacts else "0"
    struct = (
        f"const tr_outputs trunnion_outputs={{{ABI},{out.nout},{out.ncontacts},{out.nc},{out.nkappa},{len(out.post)},{out.energy},"
        f"{out.wants},o_post,o_prepare_all,o_eval,{contacts},{kappa}}};\n"
    )
    return PREAMBLE + out.text + _ints("o_post", post) + struct
