"""Steps for real time (METHOD, "Bounded steps"): what a scene asks for, what cannot be had, and what came of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from engine.abi import Overrun
from engine.basics.problems import Problem
from engine.friction import REGISTRY as LAWS
from engine.integrators import AUTO, METHODS, Rosenbrock
from engine.integrators import REGISTRY as INTEGRATORS
from engine.joints import REGISTRY as JOINTS
from engine.kernel.operations import Work, most, work
from engine.scene.model import Scene

if TYPE_CHECKING:
    from engine.simulation.model import Model

ITERATIONS, ITERATIONS_A_FREEDOM = 46, 8
"""Iterations of Newton's method that a step may take where nothing is said: some, and more for each freedom that rubs. Measured
over examples 8.1 to 8.3: a step with an event takes 40 to 50 with one of them, 45 to 60 with three, 60 to 75 with four."""
WHOLE = 1e-9
"""Of a step: how far the spacing of rows may be from a whole number of steps."""
COUNTERS = {Overrun.BY_IMPULSES: "by_impulses", Overrun.RELAXED: "relaxed"}


def bounds_of(scene: Scene) -> dict[str, Any]:
    """Fields of ``Settings`` for the steps that a scene asks for; none where it does not ask for bounded ones."""
    asked = scene.simulation.realtime
    if asked is None:
        return {}
    rubbing = sum(JOINTS[j.type].nv for j in scene.joints.values() if j.friction)
    iterations = ITERATIONS + ITERATIONS_A_FREEDOM * rubbing if asked.iterations is None else asked.iterations
    counts = {"events": int(asked.events), "evaluations": int(asked.evaluations), "iterations": int(iterations)}
    return {"step": float(asked.step), **counts}


def method_of(scene: Scene, method: str) -> str:
    """The method of a run: that of bounded steps, where they are asked for and nobody has chosen one."""
    return AUTO.loose.name if scene.simulation.realtime is not None and method == METHODS[0] else method


def problems(scene: Scene, method: str, every: float, step: float) -> Iterator[Problem]:
    """What bounded steps cannot do of what is asked for. every: spacing of rows, s (0: a row a step); step: another, s, or 0."""
    asked = scene.simulation.realtime
    if asked is None:
        return
    laws = sorted({law for j in scene.joints.values() if j.friction if not LAWS[law := scene.law_of(j.friction)].steps})
    if laws:
        able = " or ".join(name for name, law in LAWS.items() if law.steps)
        why = f"law {laws[0]} is stiff near rest, which fixed steps do not resolve"
        yield Problem("simulation.realtime", why, f"use law {able}")
    if method in {m.name for m in INTEGRATORS if isinstance(m, Rosenbrock)}:
        yield Problem("method", f"steps of {method} have no bound", f"use {', '.join(able_methods())}, or auto")
    if step > 0.0 and step != asked.step:
        yield Problem("step", f"simulation.realtime.step = {asked.step:g} s says otherwise", "give one of them")
    ratio = every / float(asked.step)
    if abs(ratio - round(ratio)) > WHOLE * max(ratio, 1.0) or (0.0 < ratio < 0.5):
        why = f"{every:g} s is no whole number of steps of {asked.step:g} s"
        yield Problem("every", why, "rows come at the ends of bounded steps")


def able_methods() -> list[str]:
    """Names of the methods that make bounded steps."""
    return [m.name for m in INTEGRATORS if not isinstance(m, Rosenbrock)]


def overruns(counters: Mapping[str, int]) -> dict[str, int]:
    """Bounded steps that ended otherwise than they should, by the name of what was done instead; counters: those of the runtime."""
    return {kind.name.lower(): counters[name] for kind, name in COUNTERS.items() if counters.get(name)}


def note(counters: Mapping[str, int]) -> str:
    """A sentence about them; "" where there are none."""
    told = {COUNTERS[kind]: kind.about for kind in COUNTERS}
    found = [f"{counters[name]} {about}" for name, about in told.items() if counters.get(name)]
    return f"bounded steps of which a part was made otherwise: {'; '.join(found)}" if found else ""


def work_of(model: Model) -> Work | None:
    """Operations of the parts of a step; None where they are not counted (a model that is made of parts)."""
    operations = model.kernel.facts["operations"]
    return work(operations, model.kernel.sizes) if operations else None


def most_operations(model: Model) -> int | None:
    """The static bound: most floating-point operations of a bounded step, its output row included. None where steps have no
    bound, or operations are not counted."""
    asked, counted = bounds_of(model.built.scene), work_of(model)
    if not asked or counted is None:
        return None
    return most(counted, asked["evaluations"], asked["iterations"], model.kernel.sizes["nsliders"])


def promise(model: Model) -> str:
    """What an export says of its steps; "" where they have no bound that is known."""
    bound = most_operations(model)
    if bound is None:
        return ""
    asked = bounds_of(model.built.scene)
    counts = f"{asked['events']} events, {asked['evaluations']} evaluations, {asked['iterations']} iterations"
    return f"bounded steps of {asked['step']:g} s: at most {bound:,} floating-point operations each ({counts})"
