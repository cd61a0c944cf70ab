"""Bodies, joints, loops and start of a scene, as plain data and as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trunnion.cli.output.printed_output import table
from trunnion.cli.output.travel_beyond_contacts_note import contact_travel_notes

if TYPE_CHECKING:
    from trunnion.kernel.interface.output_columns import Column
    from trunnion.scene.data_classes.scene import Scene


def examined(scene: Scene) -> tuple[dict[str, Any], list[Column]]:
    """(report as plain data, all columns) of a scene. The function builds the scene's kernel. A later run reuses the kernel."""
    from trunnion.kernel.interface.output_columns import columns
    from trunnion.scene.queries.mass_properties import mass_properties
    from trunnion.simulation.run import Model
    from trunnion.simulation.settings.kernel_choice import RUNS, kernel_of

    model = Model(scene)
    system = model.system
    every = columns(system)
    masses = ((b.name, mass_properties(model.built.scene.bodies[b.name])) for b in system.bodies)
    bodies = [{"name": name, "mass": mass, "center": list(center)} for name, (mass, center, _) in masses]
    cut = [j.name for j in system.joints if j.cut]
    (one, why), (many, _) = kernel_of(system), kernel_of(system, RUNS)
    report = {
        "scene": scene.name, "title": scene.title, "bodies": bodies, "joints": [joint_data(j, scene) for j in system.joints],
        "freedoms": {
            "tree": system.nv, "constraint_rows": system.constraint_rows, "driven": sum(len(j.driven) for j in system.joints),
        },
        "loops": len(cut), "cut": cut, "states": {"coordinates": system.nq, "rates": system.nv},
        "parameters": len(model.built.parameters.values), "inputs": list(system.inputs),
        "kernel": {"kind": one, "why": why, "many": many},
        "columns": {"available": len(every), "chosen": len(model.columns)},
        "start": start_data(model),
    }  # fmt: skip
    return report, every


def joint_data(j: Any, scene: Scene) -> dict[str, Any]:
    """A joint of the system as plain data."""
    from trunnion.scene.queries.body_references import body_of

    given = scene.joints[j.name]
    return {
        "name": j.name, "type": j.kind_name, "between": [body_of(given.inboard), body_of(given.outboard)], "freedoms": j.kind.nv,
        "cut": j.cut, "driven": len(j.driven), "law": scene.law_of(given.friction) if given.friction is not None else "",
    }  # fmt: skip


def start_data(model: Any) -> dict[str, Any]:
    """The result of assembling and starting the scene: outcome, notes (changed values, redundant loops), and degrees of freedom."""
    from trunnion.scene.checks.sliding_contact_ends import contact_end_notes
    from trunnion.scene.checks.unusual_magnitudes import magnitude_notes
    from trunnion.scene.expressions.parameter_dependence import unused_notes
    from trunnion.simulation.execution.drive_motion import beginning_notes
    from trunnion.simulation.run import run
    from trunnion.simulation.runtime_interface.simulation_block import Settings

    scene = model.built.scene
    soon = 1e-9 * float(scene.simulation.until)
    result = run(model, soon, soon, Settings(rtol=float(scene.simulation.rtol), method=scene.simulation.method))
    beginning = [n for n in beginning_notes(model.built, against_data=False) if n not in result.notes]
    questions = [*magnitude_notes(scene), *contact_end_notes(scene)]
    return {
        "outcome": "ready" if result.outcome.ok else result.outcome.name,
        "joint": result.outcome.joint, "advice": result.outcome.advice,
        "notes": [*result.notes, *beginning, *contact_travel_notes(scene), *questions, *unused_notes(scene)],
        "redundant_rows": result.redundancy.count, "not_unique": list(result.redundancy.joints),
        "not_unique_columns": [*result.redundancy.columns, *result.redundancy.drives],
        "moving_freedoms": model.system.nv - model.system.constraint_rows + result.redundancy.count,
    }  # fmt: skip


def report_lines(r: dict[str, Any]) -> list[str]:
    """The report as text."""
    bodies = [(b["name"], f"{b['mass']:.6g}", "(" + ", ".join(f"{x:.4g}" for x in b["center"]) + ")") for b in r["bodies"]]
    joints = [
        (j["name"], j["type"], " – ".join(j["between"]), str(j["freedoms"]),
         ", ".join(w for w in (j["law"] and f"friction {j['law']}", j["driven"] and "driven", j["cut"] and "cut") if w))
        for j in r["joints"]
    ]  # fmt: skip
    start, free = r["start"], r["freedoms"]
    cut = f", cut at {', '.join(r['cut'])}" if r["cut"] else ""
    kernel = r["kernel"]
    many = f"; sweeps of many cases, charts and FMUs: {kernel['many']}" if kernel["many"] != kernel["kind"] else ""
    redundant = f", {start['redundant_rows']} redundant" if start["redundant_rows"] else ""
    lines = [
        f"{r['scene']}" + (f" — {r['title']}" if r["title"] else ""), "",
        *table(("body", "mass, kg", "mass centre, m"), bodies), "",
        *table(("joint", "type", "between", "degrees of freedom", ""), joints), "",
        f"loops: {r['loops']}{cut}",
        f"degrees of freedom: {free['tree']} in the tree, {free['constraint_rows']} constraint equations{redundant}: "
        + f"{start['moving_freedoms']} remain"
        + (f", {free['driven']} driven" if free["driven"] else ""),
        f"states: {r['states']['coordinates']} coordinates, {r['states']['rates']} velocities; {r['parameters']} parameters"
        + (f"; inputs {', '.join(r['inputs'])}" if r["inputs"] else ""),
        f"kernel: {kernel['kind']} ({kernel['why']}{many})",
        f"columns: {r['columns']['chosen']} of {r['columns']['available']} (--columns lists them)",
        *(f"note: {n}" for n in start["notes"]),
    ]  # fmt: skip
    ready = start["outcome"] == "ready"
    where = f" in {start['joint']}" if start["joint"] else ""
    return [
        *lines,
        "",
        "no problems: ready to run" if ready else f"cannot start: {start['outcome']}{where}: {start['advice']}",
    ]
