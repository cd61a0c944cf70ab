"""Model exchange: states, event indicators, and the check that a scene allows model exchange."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from trunnion.basics.errors import Problem, raise_problems
from trunnion.fmu.variables.outputs_inputs_parameters import Variable, followed
from trunnion.kernel.interface.runtime_tables import names_of_powers
from trunnion.runtime.integrators import REGISTRY, Impulses
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names
from trunnion.system.structure.bodies_and_joints import System, state_coordinates

KINDS = {"cs": 1, "me": 2, "both": 3}
"""{type of FMU: bits FMU_COSIMULATION and FMU_EXCHANGE of ``model_and_instance.h``}."""
NOMINAL = 0.1
"""Nominal values of states relative to the scales of the scene (``tr_nominal``)."""
UNITS = {"angle": "rad", "length": "m", "quaternion": "1"}
RATES = {"rad": "rad/s", "m": "m/s", "1": "1/s", "rad/s": "rad/s^2", "m/s": "m/s^2", "J": "W"}
"""Units of the time derivatives of states, by unit of the state."""


@dataclass(frozen=True)
class ModelExchangeVariables:
    """The variables of model exchange. states: in the order of ``tr_states``. rates: their time derivatives. indicators: event
    indicators."""

    states: tuple[Variable, ...] = ()
    rates: tuple[Variable, ...] = ()
    indicators: tuple[Variable, ...] = ()

    @property
    def all(self) -> tuple[Variable, ...]:
        """All variables of model exchange, in order of their value references. The value references of other variables come
        first."""
        return (*self.states, *self.rates, *self.indicators)


def does(kind: str, bit: str) -> bool:
    """Whether a type of FMU includes ``bit``: co-simulation ("cs") or model exchange ("me")."""
    return bool(KINDS[kind] & KINDS[bit])


def exchanged(model: Model) -> ModelExchangeVariables:
    """The variables of model exchange. Raises SceneError with all reasons when the scene does not allow model exchange."""
    wrong = refusals(model)
    raise_problems(wrong)
    n = model.built.numbers
    size = {"m": n.length, "rad/s": n.rate, "m/s": n.length * n.rate, "J": n.energy}
    states = []
    for name, unit, text in _states(model):
        nominal = NOMINAL * size.get(unit, 1.0)
        states.append(Variable(f"states.{name}", unit, text, "local", "continuous", "calculated", None, nominal=nominal))
    rates = [
        Variable(f"der({s.name})", RATES[s.unit], f"time derivative: {s.description}", "local", "continuous", "calculated", None,
                 rate_of=s.name)
        for s in states
    ]  # fmt: skip
    told = [Variable(f"indicators.{n}", "1", t, "local", "continuous", "calculated", None) for n, t in _indicators(model)]
    return ModelExchangeVariables(tuple(states), tuple(rates), tuple(told))


def _states(model: Model) -> Iterator[tuple[str, str, str]]:
    """(name, unit, description) of states: coordinates, rates, bristles, works (``tr_states``)."""
    system = model.system
    for j in system.tree:
        for i in state_coordinates(j):
            yield f"{j.name}.q[{i + 1}]", UNITS[j.kind.coordinates[i]], f"coordinate {i + 1} of joint {j.name}"
    for j in system.tree:
        for k in j.free:
            yield f"{j.name}.qd[{k + 1}]", "rad/s" if j.kind.turns(k) else "m/s", f"rate {k + 1} of joint {j.name}"
    for j in system.frictional:
        if j.friction is not None and j.friction.bristles:
            for k, _ in enumerate(e for s in j.friction.sliders for e in s.eta):
                yield f"{j.name}.bristle[{k + 1}]", "1", f"friction ratio of the bristles of {j.name} along freedom {k + 1}"
    if any(c.quantity.integral for c in model.columns):
        for name in names_of_powers(system):
            yield f"work.{name.replace(':', '.')}", "J", f"work of {name.replace(':', ' in joint ')}"


def _indicators(model: Model) -> Iterator[tuple[str, str]]:
    """(name, description) of event indicators (``tr_evaluate_indicators``)."""
    for name, part in slider_names(model.system):
        yield (
            f"{name}.mode[{part}]",
            f"sliding pair {part} of joint {name} keeps its mode (stick or slip) while the indicator is positive",
        )
        yield (
            f"{name}.branch[{part}]",
            f"sliding pair {part} of joint {name} keeps its branch or direction while the indicator is positive",
        )
    yield from _of_stops(model.system)
    if model.system.frictional:
        yield "answer", "the friction equations have a solution in the present modes while the indicator is positive"


def _of_stops(system: System) -> list[tuple[str, str]]:
    """(name, description) of the event indicators of end stops and latches, in order of their flags."""
    found: dict[int, tuple[str, str]] = {}
    for j in system.joints:
        for k, d in enumerate(j.devices):
            of = f"of freedom {k + 1} of joint {j.name}"
            for side, flag in zip(("lower", "upper"), d.stop.flags if d.stop else (-1, -1), strict=True):
                if flag >= 0:
                    text = f"the {side} end stop {of} stays engaged or released while the indicator is positive"
                    found[flag] = f"{j.name}.end_stop.{side}[{k + 1}]", text
            if d.latch is not None:
                name = f"{j.name}.latch.{{}}[{k + 1}]"
                found[d.latch.pressed] = (
                    name.format("pressed"),
                    f"the latch {of} stays pressed or free while the indicator is positive",
                )
                told = f"the hook of the latch {of} stays up or down while the indicator is positive"
                found[system.hook(d.latch.hook)] = name.format("hook"), told
    return [found[i] for i in sorted(found)]


def refusals(model: Model) -> list[Problem]:
    """The reasons why a scene does not allow model exchange. For each reason, the motion depends on more than time and state."""
    sim = model.built.scene.simulation
    out = []
    if any(m.name == sim.method and isinstance(m, Impulses) for m in REGISTRY):
        why = f"method {sim.method} computes impulses over its own steps, but the importing tool's solver chooses the steps"
        out.append(Problem("simulation.method", f"no model exchange: {why}", "--set simulation.method=auto, or --type cs"))
    if sim.realtime is not None:
        why = (
            "the scene requires bounded steps (simulation.realtime), but in model exchange the importer's solver chooses the steps"
        )
        out.append(Problem("simulation.realtime", f"no model exchange: {why}", "omit simulation.realtime, or choose --type cs"))
    if sim.jams == "impact":
        why = (
            "a jam that ends by an impact occurs where friction has no solution, and no event indicator detects such a state early"
        )
        out.append(Problem("simulation.jams", f"no model exchange: {why}", "--set simulation.jams=end, or --type cs"))
    for j in model.system.unilateral:
        why = "an impact changes rates, and only internal steps find the end of accumulating impacts"
        out.append(Problem(f"joints.{j.name}.unilateral", f"no model exchange: {why}", "--type cs"))
    for name in followed(model):
        why = f"the motion that follows input {name} depends on the input's values at communication points"
        out.append(Problem(f"inputs.{name}", f"no model exchange: {why}", "write effort: {input: …} in that joint, or --type cs"))
    return out
