"""The C tables of an exported model (``fmu_model`` of ``native/fmu.h``)."""

from __future__ import annotations

from itertools import accumulate

from engine.basics.problems import Problem, SceneError
from engine.scene.finding import called, parse_path
from engine.simulation.audit import SAID
from engine.simulation.block import METHODS, Settings
from engine.simulation.bounded import method_of
from engine.simulation.certainty.companion import companion
from engine.simulation.certainty.estimate import SAFETY
from engine.simulation.certainty.kinds import kinds
from engine.simulation.outcome import NAMES
from engine.simulation.run import Model
from engine.system.curves import table_block
from fmu.causes import cause_tables, causes
from fmu.description import ERRORS, Variable
from fmu.following import Arrangement, depth
from fmu.literals import doubles, integers, number, string, strings
from fmu.types import derivatives as column_rates

FACES, FACES_OF_SCALARS = ("m_width", "m_type", "&m_clocks"), ("0", "0", "0")
"""Tables of FMI 3.0: arrays, types, clocks; FMI 2.0 has no use for them."""
STACK = 256
"""Values an expression may keep (``FMU_STACK``)."""
HEAD = '#include <math.h>\n#include "fmu.h"\nextern const tr_kernel trunnion_kernel;\nextern const tr_outputs trunnion_outputs;\n' \
       "extern const tr_jacobian trunnion_jacobian;\nextern const tr_linear trunnion_linear;\n"


def model_text(model: Model, all_: Arrangement, guid: str, linear: bool, faces: str = "", types: int = 1) -> str:
    """The C source that defines ``fmu_the_model``. faces: the tables that FMI 3.0 needs besides; "" for FMI 2.0. types: what it
    is for (``exchange.KINDS``)."""
    n, sizes, sim = model.built.numbers, model.kernel.sizes, model.built.scene.simulation
    listed = all_.listed
    settings = [*(v for v in listed if v.causality == "parameter"), *all_.followers]
    begin = list(accumulate((len(p) for p in all_.programs), initial=0))
    tables = table_block(n.tables)
    given = len(model.built.scene.inputs)
    derivatives = [v.index for v in [v for v in listed if v.causality == "input"][given:]]
    rates = {base: i for i, base in column_rates(model).items()}
    next_ones = [-2 if c.quantity.steps else rates.get(i, -1) for i, c in enumerate(model.columns)]
    arrays = [
        doubles("m_p", model.built.parameters.values), doubles("m_breaks", n.breaks), doubles("m_tables", tables),
        doubles("m_q", n.q), doubles("m_v", n.v), doubles("m_qg", n.q_given_by_rate), doubles("m_vg", n.v_given),
        _settings(settings), cause_tables(model), _code(all_.programs), integers("m_begin", begin),
        integers("m_derivative", derivatives),
        integers("m_whole", [int(v.type != "") for v in listed]), integers("m_rates", next_ones),
        integers("m_integral", [int(c.quantity.integral) for c in model.columns]),
        strings("m_joint", [j.name for j in model.system.frictional]), strings("m_law", SAID.values()), _erring(model, listed),
    ]
    counts = [len(model.columns), given, len(derivatives)]
    values = [
        string(guid), string(model.built.scene.name), types, *counts, len(settings), len(all_.followers), "m_derivative", "m_whole",
        "m_rates", "m_integral", "&trunnion_kernel", "&trunnion_outputs",
        "&trunnion_jacobian", "&trunnion_linear" if linear else "0", "m_p", len(n.breaks), len(tables), "m_breaks", "m_tables",
        "m_q", "m_v", "m_qg", "m_vg", number(n.length), number(n.rate), number(n.energy),
        METHODS[method_of(model.built.scene, sim.method)], int(model.system.bounded),
        int(sim.jams == "impact"), events_kept(sizes["nsliders"] + sizes["nstops"]), len(NAMES) + 1,
        "m_setting", "m_outcome", *causes(model)[:-1], "m_code", "m_begin", causes(model)[-1], "m_joint", "m_law",
        *(FACES if faces else FACES_OF_SCALARS), *_certified(model, listed),
    ]
    return HEAD + "".join([*arrays, faces]) + f"const fmu_model fmu_the_model={{{','.join(map(str, values))}}};\n"


def _erring(model: Model, listed: list[Variable]) -> str:
    """The C table of how errors of outputs are told, where they are."""
    if not any(v.role == ERRORS for v in listed):
        return ""
    k = kinds(model.columns, model.built.numbers)
    tells = k.states if k.states.any() else k.errs & ~k.jumps
    rows = (
        f"{{{int(k.errs[i])},{int(k.jumps[i])},{int(k.wraps[i])},{int(tells[i])},{number(float(k.scale[i]))}}}"
        for i in range(len(model.columns))
    )
    return f"static const fmu_erring m_erring[]={{{','.join(rows)}}};\n"


def _certified(model: Model, listed: list[Variable]) -> tuple[str, str, str]:
    """Where errors of outputs are told: that table, and how a second run is tighter and counts."""
    if not any(v.role == ERRORS for v in listed):
        return "0", "1", "1"
    sim = model.built.scene.simulation
    tight, larger = companion(Settings(float(sim.rtol), sim.method), {})
    return "m_erring", number(float(sim.rtol) / tight.rtol), number(SAFETY * larger)


def events_kept(watched: int) -> int:
    """Events that a block keeps until they are told. watched: pairs and stops."""
    return 4 * watched + 16


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
        f"{{{v.role},{v.index},{v.also},{int(v.tunable)},{number(v.start or 0.0)},{number(v.bound.least)},{number(v.bound.most)},"
        f"{int(v.bound.open)},{int(v.bound.nonzero)},{place.get(v.above, -1)},{int(v.order is not None and v.order.strict)},"
        f"{int(v.rotation)},{string(v.name)},{string(key(v.name))},{string(v.bound.rule)}}}"
        for v in settings
    )
    return f"static const fmu_setting m_setting[]={{\n{rows}\n}};\n"


def key(name: str) -> str:
    """What a refusal calls a parameter: the last key of its path."""
    path = parse_path(name)
    return called(path) if path else name
