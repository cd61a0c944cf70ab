"""C tables of an exported model (``fmu_model`` in ``model_and_instance.h``)."""

from __future__ import annotations

from itertools import accumulate

from trunnion.basics.errors import Problem, SceneError
from trunnion.fmu.c_source.failure_message_tables import cause_tables, causes
from trunnion.fmu.c_text.literals import doubles, integers, number, string, strings
from trunnion.fmu.variables.input_sums import source_table
from trunnion.fmu.variables.outputs_inputs_parameters import ERRORS, Variable, followed
from trunnion.fmu.variables.scene_parameters import FmuVariables, depth
from trunnion.fmu.variables.variable_types import derivatives as column_rates
from trunnion.scene.findings.findings_and_paths import last_key, parse_path
from trunnion.simulation.global_error.column_error_kinds import kinds
from trunnion.simulation.global_error.error_estimate import SAFETY
from trunnion.simulation.global_error.tighter_run_settings import companion
from trunnion.simulation.results.audit import VIOLATIONS
from trunnion.simulation.results.outcome import NAMES
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import METHODS, Settings
from trunnion.simulation.settings.realtime_steps import method_of
from trunnion.system.signals.signal_tables import table_block

FACES, FACES_OF_SCALARS = ("m_width", "m_type", "&m_clocks"), ("0", "0", "0")
"""The fields ``width``, ``type`` and ``clocks`` of ``fmu_model``: names of C tables for FMI 3.0, and 0 for FMI 2.0."""
STACK = 256
"""Largest stack depth of an expression (``FMU_STACK``)."""
HEAD = (
    '#include <math.h>\n#include "instance/model_and_instance.h"\n'
    'extern const tr_kernel trunnion_kernel;\nextern const tr_outputs trunnion_outputs;\n'
    "extern const tr_jacobian trunnion_jacobian;\nextern const tr_linear trunnion_linear;\n"
)


COSTLY = (("extra", "contraction"), ("extra", "complement"), ("extra", "closure"))
"""Keys of the columns that an FMU computes only when a host reads one of them."""


def model_text(model: Model, all_: FmuVariables, guid: str, linear: bool, faces: str = "", types: int = 1) -> str:
    """The C source that defines ``fmu_the_model``. faces: C text of the tables that only FMI 3.0 needs; "" for FMI 2.0. types: bits
    of ``KINDS``."""
    n, sizes, sim = model.built.numbers, model.kernel.sizes, model.built.scene.simulation
    listed = all_.listed
    settings = [*(v for v in listed if v.causality == "parameter"), *all_.followers]
    begin = list(accumulate((len(p) for p in all_.programs), initial=0))
    tables = table_block(n.tables)
    given = len(model.built.scene.inputs)
    begin_of = len(model.columns) + given
    derivatives = [v.index for v in listed[begin_of : begin_of + 2 * len(followed(model))]]
    source, sources = source_table(listed, all_.sums)
    rates = {base: i for i, base in column_rates(model).items()}
    next_ones = [-2 if c.quantity.steps else rates.get(i, -1) for i, c in enumerate(model.columns)]
    arrays = [
        doubles("m_p", model.built.parameters.values), doubles("m_breaks", n.break_records()), doubles("m_tables", tables),
        doubles("m_q", n.q), doubles("m_v", n.v), doubles("m_qg", n.q_given_by_rate), doubles("m_vg", n.v_given),
        _settings(settings), cause_tables(model), _code(all_.programs), integers("m_begin", begin),
        integers("m_derivative", derivatives),
        integers("m_whole", [int(v.type != "") for v in listed]), integers("m_rates", next_ones),
        integers("m_integral", [int(c.quantity.integral) for c in model.columns]),
        integers("m_costly", [int(c.key in COSTLY) for c in model.columns]),
        strings("m_joint", [j.name for j in model.system.frictional]), strings("m_law", VIOLATIONS.values()),
        _erring(model, listed), source,
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
        *(FACES if faces else FACES_OF_SCALARS), *_certified(model, listed), sources, "m_source",
        "m_costly",
    ]
    return HEAD + "".join([*arrays, faces]) + f"const fmu_model fmu_the_model={{{','.join(map(str, values))}}};\n"


def _erring(model: Model, listed: list[Variable]) -> str:
    """The C table that states how the error of each output is estimated; "" if the FMU lacks the parameter ``solver.errors``."""
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
    """The fields ``erring``, ``tighter`` and ``larger`` of ``fmu_model``. ``erring`` is the table of ``_erring``. ``tighter`` is
    the tolerance of the run divided by the tolerance of the second run. ``larger`` is the error divided by the difference of the
    two runs."""
    if not any(v.role == ERRORS for v in listed):
        return "0", "1", "1"
    sim = model.built.scene.simulation
    tight, larger = companion(Settings(float(sim.rtol), sim.method), {})
    return "m_erring", number(float(sim.rtol) / tight.rtol), number(SAFETY * larger)


def events_kept(watched: int) -> int:
    """The number of events that the memory block of a simulation can store. watched: number of friction pairs and end stops."""
    return 4 * watched + 16


def _code(programs: list[list[str]]) -> str:
    """The C array with the stack code of all expressions. Raises SceneError when an expression needs too large a stack."""
    most = max((depth(p) for p in programs), default=1)
    if most > STACK:
        what = f"an expression needs a stack of {most} values, more than {STACK}"
        raise SceneError([Problem("parameters", what, "divide the expression")])
    return f"static const double m_code[]={{{','.join(w for p in programs for w in p) or '0'}}};\n"


def _settings(settings: list[Variable]) -> str:
    """The C table of parameters: role, bounds, and the texts of error messages."""
    place = {v.name: i for i, v in enumerate(settings)}
    rows = ",\n".join(
        f"{{{v.role},{v.index},{v.also},{int(v.tunable)},{number(v.start or 0.0)},{number(v.bound.least)},{number(v.bound.most)},"
        f"{int(v.bound.open)},{int(v.bound.nonzero)},{place.get(v.above, -1)},{int(v.order is not None and v.order.strict)},"
        f"{int(v.rotation)},{string(v.name)},{string(key(v.name))},{string(v.bound.rule)}}}"
        for v in settings
    )
    return f"static const fmu_setting m_setting[]={{\n{rows}\n}};\n"


def key(name: str) -> str:
    """The name of a parameter in an error message: the last key of its path."""
    path = parse_path(name)
    return last_key(path) if path else name
