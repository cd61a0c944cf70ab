"""``trunnion check``: a scene's problems, or what it is made of and what assembling it changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.check_files import SCENES, Files, write
from engine.cli.ends import left_behind
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import PICTURES, loaded, talk
from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.kernel.columns import Column
    from engine.scene.model import Scene


@dataclass(frozen=True)
class Holding:
    """What is asked of a scene at rest: whether it holds; with all that statics leaves open; the bound on self-stress, N or m;
    seconds for that."""

    asked: bool = False
    bounds: bool = False
    self_stress: float | None = None
    misfit: float | None = None
    budget: float | None = None


def check_command(
    words: list[str], outputs: bool, hold: Holding, files: Files, changes: Sequence[str], as_json: bool, verbose: bool
) -> int:
    """Report on a scene; the exit code (1: it is well formed but its loops cannot be closed; with ``hold``, it does not hold)."""
    talk(verbose)
    found = Findings()
    plot = options.destination(files.plot, PICTURES, "--plot", found)
    whole = options.destination(files.whole, SCENES, "-o", found)
    source = options.one_scene(words, found)
    scene = loaded(source, options.assignments(changes, found), None, found)
    if hold.bounds and not hold.asked:
        found.add("--bounds", "it is asked of what a scene holds", "write --hold --bounds")
    for name, given in (("--self-stress N", hold.self_stress), ("--misfit M", hold.misfit)):
        if given is not None and not hold.bounds:
            found.add(name.split()[0], "one answer has none", f"write --hold --bounds {name}")
    if hold.budget is not None and not hold.bounds:
        found.add("--budget", "one answer needs none", "write --hold --bounds --budget S")
    found.end()
    assert scene is not None
    written = write(scene, plot, whole)
    if hold.bounds:
        return _bounded(scene, hold, as_json)
    if hold.asked:
        return _held(scene, as_json)
    report, every = examined(scene)
    code = DONE if report["start"]["outcome"] in ("done", "ready") else FAILED
    if as_json:
        listed = [{"name": c.name, "unit": c.unit, "description": c.description} for c in every]
        print_json({"exit_code": code, "problems": []} | report | ({"outputs": listed} if outputs else {}) | {"files": written})
    else:
        lines = (
            report_lines(report)
            if not outputs
            else table(("column", "unit", "meaning"), [(c.name, c.unit, c.description) for c in every])
        )
        print("\n".join(_bare(line) for line in [*lines, *(f"written: {name}" for name in written)]))
    return code


def _held(scene: Scene, as_json: bool) -> int:
    from engine.cli.holding import hold_document, hold_lines
    from engine.simulation.hold import hold

    report = hold(scene)
    code = DONE if report.holds else FAILED
    if as_json:
        print_json({"exit_code": code, "problems": [], "scene": scene.name, "hold": hold_document(report)})
    else:
        print("\n".join(_bare(line) for line in hold_lines(scene.name, report)))
    return code


def _bounded(scene: Scene, asked: Holding, as_json: bool) -> int:
    from engine.bounds.api import hold
    from engine.cli.bounding import bounds_document, bounds_lines

    report = hold(scene, bounds=True, self_stress=asked.self_stress, misfit=asked.misfit, budget=asked.budget)
    code = DONE if report.holds == "certain" else FAILED
    if as_json:
        print_json({"exit_code": code, "problems": [], "scene": scene.name, "hold": bounds_document(report)})
    else:
        print("\n".join(_bare(line) for line in bounds_lines(scene.name, report)))
    return code


def _bare(line: str) -> str:
    from engine.cli.summary import plain

    return plain(line)


def examined(scene: Scene) -> tuple[dict[str, Any], list[Column]]:
    """(report as plain data, all columns) of a scene; its kernel is built, so that the first run finds it ready."""
    from engine.kernel.columns import columns
    from engine.simulation.run import Model

    model = Model(scene)
    every = columns(model.system)
    system = model.system
    cut = [j.name for j in system.joints if j.cut]
    report = {
        "scene": scene.name, "title": scene.title,
        "bodies": [_body(b, model) for b in system.bodies],
        "joints": [_joint(j, scene) for j in system.joints],
        "freedoms": {"tree": system.nv, "constraint_rows": system.rows, "driven": _driven(system)},
        "loops": len(cut), "cut": cut, "states": {"coordinates": system.nq, "rates": system.nv},
        "parameters": len(model.built.parameters.values), "inputs": list(system.inputs),
        "kernel": _kernel(system),
        "columns": {"available": len(every), "chosen": len(model.columns)},
        "start": _start(model),
    }  # fmt: skip
    return report, every


def _kernel(system: Any) -> dict[str, str]:
    """Which kernel a run has, and why; what many runs have, where that is another."""
    from engine.simulation.choosing import RUNS, kernel_of

    (one, why), (many, _) = kernel_of(system), kernel_of(system, RUNS)
    return {"kind": one, "why": why, "many": many}


def _driven(system: Any) -> int:
    return sum(len(j.driven) for j in system.joints)


def _body(body: Any, model: Any) -> dict[str, Any]:
    from engine.scene.mass import mass_properties

    mass, center, _ = mass_properties(model.built.scene.bodies[body.name])
    return {"name": body.name, "mass": mass, "center": list(center)}


def _joint(j: Any, scene: Scene) -> dict[str, Any]:
    from engine.scene.refs import body_of

    given = scene.joints[j.name]
    law = scene.law_of(given.friction) if given.friction is not None else ""
    sides = [body_of(given.inboard), body_of(given.outboard)]
    return {
        "name": j.name,
        "type": j.kind_name,
        "between": sides,
        "freedoms": j.kind.nv,
        "cut": j.cut,
        "driven": len(j.driven),
        "law": law,
    }


def _start(model: Any) -> dict[str, Any]:
    """What assembling and starting the scene says, as plain data: outcome, notes (values moved, redundant loops), freedoms."""
    from engine.scene.following import unused_notes
    from engine.scene.magnitudes import magnitude_notes
    from engine.simulation.block import Settings
    from engine.simulation.motions import beginning_notes
    from engine.simulation.run import run

    soon = 1e-9 * float(model.built.scene.simulation.until)
    sim = model.built.scene.simulation
    result = run(model, soon, soon, Settings(rtol=float(sim.rtol), method=sim.method))
    beginning = [n for n in beginning_notes(model.built, against_data=False) if n not in result.notes]
    notes = [*result.notes, *beginning, *left_behind(model.built.scene), *magnitude_notes(model.built.scene)]
    notes += unused_notes(model.built.scene)
    open_reactions = getattr(result, "redundancy", None)
    count = getattr(open_reactions, "count", 0)
    name = "ready" if result.outcome.ok else result.outcome.name
    freedoms = model.system.nv - model.system.rows + count
    about = {"outcome": name, "joint": result.outcome.joint, "advice": result.outcome.advice, "notes": notes}
    return about | {
        "redundant_rows": count,
        "not_unique": list(getattr(open_reactions, "joints", ())),
        "moving_freedoms": freedoms,
    }


def _told_kernel(kernel: dict[str, str]) -> str:
    many = f"; sweeps of many cases, charts and FMUs: {kernel['many']}" if kernel["many"] != kernel["kind"] else ""
    return f"{kernel['kind']} ({kernel['why']}{many})"


def report_lines(r: dict[str, Any]) -> list[str]:
    """The report as lines of text."""
    bodies = [(b["name"], f"{b['mass']:.6g}", "(" + ", ".join(f"{x:.4g}" for x in b["center"]) + ")") for b in r["bodies"]]
    joints = [
        (j["name"], j["type"], " – ".join(j["between"]), str(j["freedoms"]),
         ", ".join(w for w in (j["law"] and f"friction {j['law']}", j["driven"] and "driven", j["cut"] and "cut") if w))
        for j in r["joints"]
    ]  # fmt: skip
    start, free = r["start"], r["freedoms"]
    cut = f", cut at {', '.join(r['cut'])}" if r["cut"] else ""
    redundant = f", {start['redundant_rows']} redundant" if start["redundant_rows"] else ""
    lines = [
        f"{r['scene']}" + (f" — {r['title']}" if r["title"] else ""), "",
        *table(("body", "mass, kg", "mass centre, m"), bodies), "",
        *table(("joint", "type", "between", "freedoms", ""), joints), "",
        f"loops: {r['loops']}{cut}",
        f"freedoms: {free['tree']} in the tree, {free['constraint_rows']} constraint rows{redundant}: "
        + f"{start['moving_freedoms']} to move"
        + (f", {free['driven']} driven" if free["driven"] else ""),
        f"states: {r['states']['coordinates']} coordinates, {r['states']['rates']} rates; {r['parameters']} parameters"
        + (f"; inputs {', '.join(r['inputs'])}" if r["inputs"] else ""),
        f"kernel: {_told_kernel(r['kernel'])}",
        f"columns: {r['columns']['chosen']} of {r['columns']['available']} (list them with --outputs)",
        *(f"note: {n}" for n in start["notes"]),
    ]  # fmt: skip
    ready = start["outcome"] == "ready"
    where = f" in {start['joint']}" if start["joint"] else ""
    return [
        *lines,
        "",
        "no problems: ready to run" if ready else f"cannot start: {start['outcome']}{where}: {start['advice']}",
    ]
