"""Bounded steps for real-time use: settings, checks, static bounds of operations (theory, "Bounded steps")."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from trunnion.basics.errors import Problem
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.kernel.interface.operation_counts import Work, most, work
from trunnion.runtime.abi import Overrun
from trunnion.runtime.integrators import AUTO, METHODS, Rosenbrock
from trunnion.runtime.integrators import REGISTRY as INTEGRATORS
from trunnion.scene.data_classes.scene import Scene

if TYPE_CHECKING:
    from trunnion.kernel.shared_libraries import Kernel

ITERATIONS, ITERATIONS_A_FREEDOM = 46, 8
"""Default limit of Newton iterations in a step: a constant, plus a number for each freedom with friction. In examples 8.1 to 8.3 of
the paper, a step with an event takes 40 to 50 iterations if one freedom has friction, 45 to 60 for three freedoms, and 60 to 75 for
four."""
STEPPED = " or ".join(name for name, law in LAWS.items() if law.steps)
"""The friction laws that fixed steps resolve."""
WHOLE = 1e-9
"""Largest allowed deviation of (spacing of rows / step) from a whole number, relative to the whole number."""
COUNTERS = {Overrun.BY_IMPULSES: "by_impulses", Overrun.RELAXED: "relaxed"}


def bounds_of(scene: Scene) -> dict[str, Any]:
    """Fields of ``Settings`` for a scene's bounded steps; empty if the scene has no bounded steps."""
    asked = scene.simulation.realtime
    if asked is None:
        return {}
    rubbing = sum(JOINTS[j.type].nv for j in scene.joints.values() if j.friction)
    iterations = ITERATIONS + ITERATIONS_A_FREEDOM * rubbing if asked.iterations is None else asked.iterations
    counts = {"events": int(asked.events), "evaluations": int(asked.evaluations), "iterations": int(iterations)}
    return {"step": float(asked.step), **counts}


def method_of(scene: Scene, method: str) -> str:
    """The method of a run. If the scene has bounded steps and ``method`` is "auto", this is the default method of bounded steps."""
    return AUTO.loose.name if scene.simulation.realtime is not None and method == METHODS[0] else method


def stiff_laws(scene: Scene) -> list[str]:
    """The friction laws of the scene that fixed steps do not resolve."""
    return sorted({law for j in scene.joints.values() if j.friction if not LAWS[law := scene.law_of(j.friction)].steps})


def step_problems(scene: Scene, method: str, every: float, step: float) -> Iterator[Problem]:
    """Contradictions between a scene's bounded steps and a request. every: spacing of rows, s; 0: a row at each step. step:
    requested step, s, or 0."""
    asked = scene.simulation.realtime
    if asked is None:
        return
    if laws := stiff_laws(scene):
        why = f"the friction law {laws[0]} is stiff near rest, and fixed steps do not resolve this"
        yield Problem("simulation.realtime", why, f"use law {STEPPED}")
    if method in {m.name for m in INTEGRATORS if isinstance(m, Rosenbrock)}:
        able = ", ".join(m.name for m in INTEGRATORS if not isinstance(m, Rosenbrock))
        yield Problem("method", f"the work of a step of {method} has no upper bound", f"use {able}, or auto")
    if step > 0.0 and step != asked.step:
        yield Problem("step", f"contradicts simulation.realtime.step = {asked.step:g} s", "give only one of the two")
    ratio = every / float(asked.step)
    if abs(ratio - round(ratio)) > WHOLE * max(ratio, 1.0) or (0.0 < ratio < 0.5):
        why = f"{every:g} s is not a multiple of the step, {asked.step:g} s"
        yield Problem("every", why, "rows are written at the ends of steps: give a multiple of the step")


def overrun_note(counters: Mapping[str, int]) -> str:
    """A note about bounded steps that reached a limit; "" if none did. counters: counters of the runtime, by name."""
    found = [f"{counters[name]} {kind.about}" for kind, name in COUNTERS.items() if counters.get(name)]
    return f"bounded steps that reached a limit of their work: {'; '.join(found)}" if found else ""


def work_of(kernel: Kernel) -> Work | None:
    """Number of operations of each part of a step. None for a bytecode kernel, whose operations are not counted."""
    operations = kernel.facts["operations"]
    return work(operations, kernel.sizes) if operations else None


def most_operations(scene: Scene, kernel: Kernel) -> int | None:
    """Static upper bound of the number of floating-point operations in a bounded step, including its output row. None if steps have
    no bound, or if operations are not counted."""
    asked, counted = bounds_of(scene), work_of(kernel)
    if not asked or counted is None:
        return None
    return most(counted, asked["evaluations"], asked["iterations"], kernel.sizes["nsliders"])


def promise(scene: Scene, kernel: Kernel) -> str:
    """The note of an export about the cost of bounded steps; "" if the cost has no bound."""
    bound = most_operations(scene, kernel)
    if bound is None:
        return ""
    asked = bounds_of(scene)
    counts = f"{asked['events']} events, {asked['evaluations']} evaluations, {asked['iterations']} iterations"
    return f"bounded steps of {asked['step']:g} s: at most {bound:,} floating-point operations each ({counts})"
