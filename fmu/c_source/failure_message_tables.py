"""C tables from which an FMU makes the failure messages of ``trunnion.simulation.execution.failure_diagnosis``."""

from __future__ import annotations

from collections.abc import Iterable

from trunnion.fmu.c_text.literals import integers, number, string, strings
from trunnion.runtime.abi import EventKind, Why
from trunnion.simulation.execution.failure_diagnosis import WHY, describe_loop, loop_joint
from trunnion.simulation.results.outcome import ADVICE, NAMES
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names, stop_names


def cause_tables(model: Model) -> str:
    """C tables of three kinds: outcomes by status and by reason; the joint of each friction pair, multiplier, loop, rate and end
    stop; names of event kinds."""
    system, sizes = model.system, model.kernel.sizes
    joints = [j.name for j in system.frictional]
    etas = [-1] * sizes["neta"]
    for i, j in enumerate(system.frictional):
        for slider in j.friction.sliders if j.friction else ():
            for e in slider.eta:
                etas[e] = i
    rows = [-1] * sizes["rows"]
    for i, cut in enumerate(system.cuts):
        rows[cut.rows : cut.rows + cut.kind.rows] = [i] * cut.kind.rows
    told = [(cut.name, loop_joint(system, cut, gimbal=True).name, describe_loop(system, cut)) for cut in system.cuts]
    loops = [f"{{{','.join(map(string, words))}}}" for words in told]
    length = model.built.numbers.length
    rates = [
        f"{{{j.v0 + i},{number(1.0 if j.kind.turns(k) else 1.0 / length)},{string(j.name)}}}"
        for j in system.tree
        for i, k in enumerate(j.free)
    ]
    events = {e.value: e.name.lower().replace("_", " ") for e in EventKind}
    whys = [(Why.UNDECIDED, "undecided"), *WHY.items()]
    return "".join([
        _records("fmu_outcome", "m_outcome", [*_outcomes(NAMES.items()), '{0,"failed","please report this"}']),
        _records("fmu_outcome", "m_why", [*_outcomes(whys), '{-1,"",""}']),
        integers("m_pair_joint", [joints.index(name) for name, _ in slider_names(system)]), integers("m_eta_joint", etas),
        integers("m_row_loop", rows), _records("fmu_loop", "m_loop", loops or ['{"","",""}']),
        _records("fmu_rate", "m_rate", rates or ['{0,0,""}']),
        strings("m_joint_of", [name for name, _ in (*slider_names(system), *stop_names(system))]),
        strings("m_event", [events.get(i, "") for i in range(max(events) + 1)]),
    ])  # fmt: skip


def causes(model: Model) -> list[str | int]:
    """The values of the fields ``why`` to ``joints`` of the C struct ``fmu_model``: names of tables from ``cause_tables``, and
    counts."""
    rates = sum(len(j.free) for j in model.system.tree)
    tables = ["m_why", "m_pair_joint", "m_eta_joint", "m_row_loop", "m_loop"]
    return [*tables, rates, "m_rate", "m_joint_of", "m_event", len(model.system.frictional)]


def _outcomes(named: Iterable[tuple[int, str]]) -> list[str]:
    """The C records (number, name, advice) of statuses or reasons."""
    return [f"{{{int(status)},{string(name)},{string(ADVICE[name])}}}" for status, name in named]


def _records(kind: str, name: str, rows: list[str]) -> str:
    """A constant C array of records."""
    return f"static const {kind} {name}[]={{\n" + ",\n".join(rows) + "\n};\n"
