"""The C tables of an exported model (``fmu_model`` of ``native/fmu.h``)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import accumulate

from engine.basics.problems import Problem, SceneError
from engine.scene.finding import called, parse_path
from engine.simulation.audit import SAID
from engine.simulation.block import METHODS
from engine.simulation.outcome import ADVICE, NAMES
from engine.simulation.run import Model
from engine.system.curves import table_block
from fmu.description import Variable
from fmu.following import Arrangement, depth

STACK = 256
"""Values an expression may keep (``FMU_STACK``)."""
HEAD = '#include <math.h>\n#include "fmu.h"\nextern const tr_kernel trunnion_kernel;\nextern const tr_outputs trunnion_outputs;\n' \
       "extern const tr_jacobian trunnion_jacobian;\nextern const tr_linear trunnion_linear;\n"


def model_text(model: Model, all_: Arrangement, guid: str, linear: bool) -> str:
    """The C source that defines ``fmu_the_model``."""
    n, sizes = model.built.numbers, model.kernel.sizes
    listed = all_.listed
    settings = [*(v for v in listed if v.causality == "parameter"), *all_.followers]
    begin = list(accumulate((len(p) for p in all_.programs), initial=0))
    tables = table_block(n.tables)
    watched = sizes["nsliders"] + sizes["nstops"]
    arrays = [
        doubles("m_p", model.built.parameters.values), doubles("m_breaks", n.breaks), doubles("m_tables", tables),
        doubles("m_q", n.q), doubles("m_v", n.v), doubles("m_qg", n.q_given_by_rate), doubles("m_vg", n.v_given),
        _settings(settings), _outcomes(model), _code(all_.programs),
        f"static const int m_begin[]={{{','.join(map(str, begin))}}};\n",
        strings("m_joint", [j.name for j in model.system.frictional]), strings("m_law", SAID.values()),
    ]
    counts = [sum(v.causality == c for v in listed) for c in ("output", "input")]
    values = [
        string(guid), string(model.built.scene.name), *counts, len(settings), len(all_.followers),
        "&trunnion_kernel", "&trunnion_outputs",
        "&trunnion_jacobian", "&trunnion_linear" if linear else "0", "m_p", len(n.breaks), len(tables), "m_breaks", "m_tables",
        "m_q", "m_v", "m_qg", "m_vg", number(n.length), number(n.rate), number(n.energy),
        METHODS[model.built.scene.simulation.method], 4 * watched + 16, len(NAMES) + 1, "m_setting", "m_outcome",
        "m_code", "m_begin", "m_joint", "m_law",
    ]
    return HEAD + "".join(arrays) + f"const fmu_model fmu_the_model={{{','.join(map(str, values))}}};\n"


def number(x: float) -> str:
    """A double as C reads it back exactly."""
    return repr(float(x)) if math.isfinite(x) else "INFINITY" if x > 0 else "-INFINITY"


def string(text: str) -> str:
    """The text as a C string literal; line breaks become spaces."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
    return f'"{escaped}"'


def strings(name: str, values: Iterable[str]) -> str:
    """A constant C array of strings; without values it holds an empty one."""
    return f"static const char *const {name}[]={{{','.join(map(string, values)) or string('')}}};\n"


def doubles(name: str, values: Iterable[float]) -> str:
    """A constant C array; without values it holds one zero, because C has no empty arrays."""
    return f"static const double {name}[]={{{','.join(map(number, values)) or '0'}}};\n"


def _code(programs: list[list[str]]) -> str:
    """The C array of the words of all expressions."""
    most = max((depth(p) for p in programs), default=1)
    if most > STACK:
        raise SceneError([Problem("parameters", f"an expression keeps {most} values, more than {STACK}", "give parts of it names")])
    return f"static const double m_code[]={{{','.join(w for p in programs for w in p) or '0'}}};\n"


def _settings(settings: list[Variable]) -> str:
    """The C table of parameters: what they stand for, the values they may have, and the words of their refusal."""
    place = {v.name: i for i, v in enumerate(settings)}
    rows = ",\n".join(
        f"{{{v.role},{v.index},{int(v.tunable)},{number(v.start or 0.0)},{number(v.bound.least)},{number(v.bound.most)},"
        f"{int(v.bound.open)},{int(v.bound.nonzero)},{place.get(v.above, -1)},{int(v.order is not None and v.order.strict)},"
        f"{int(v.rotation)},{string(v.name)},{string(key(v.name))},{string(v.bound.rule)}}}"
        for v in settings
    )
    return f"static const fmu_setting m_setting[]={{\n{rows}\n}};\n"


def key(name: str) -> str:
    """What a refusal calls a parameter: the last key of its path."""
    path = parse_path(name)
    return called(path) if path else name


def _outcomes(model: Model) -> str:
    """The C table of outcomes: status, name and advice. A joint is named when no other can be the cause."""
    frictional = model.system.frictional
    rows = []
    for status, name in NAMES.items():
        where = f" in joint {frictional[0].name}" if name == "no_solution" and len(frictional) == 1 else ""
        rows.append(f"{{{status},{string(name + where)},{string(ADVICE[name])}}}")
    rows.append('{0,"failed","please report this"}')
    return "static const fmu_outcome m_outcome[]={\n" + ",\n".join(rows) + "\n};\n"
