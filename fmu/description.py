"""What an FMU tells about itself: one list of variables, from which the model description, the C tables, the documentation page and
both flavours are made."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

from engine.basics.numbers import ANY, NOT_NEGATIVE, Bound, Order
from engine.basics.settings import RTOL
from engine.contact import sizes
from engine.friction import numbers as law_numbers
from engine.kernel.columns import Column
from engine.scene.contexts import bound_of, order_of
from engine.scene.finding import Path, dotted, parse_path
from engine.scene.overrides import list_parameters
from engine.simulation.run import Model
from engine.system.curves import Outside
from engine.system.structure import state_coordinates

NUMBER, START_Q, START_QD, BANDWIDTH = "FMU_NUMBER", "FMU_START_Q", "FMU_START_QD", "FMU_BANDWIDTH"
PARAMETER = "FMU_PARAMETER"
TOLERANCE, STEP, MAX_STEPS = "FMU_TOLERANCE", "FMU_STEP", "FMU_MAX_STEPS"
"""What a parameter stands for: names of ``fmu_setting_kind`` (``native/fmu.h``), which alone knows their numbers."""
HUGE = 1e300
"""Magnitude written as the bound of a number that has none."""
NOT_OFFERED = (("ramp", "begin"), ("ramp", "duration"), ("move", "begin"), ("move", "duration"))
"""Ends of paths whose changes would move the kinks the integrator stops at, which are laid down at export."""
TUNABLE_SECTIONS = ("friction", "forces", "gravity")
TUNABLE_OF_JOINTS = ("friction", "spring", "damping", "effort")
TUNABLE_OF_STOPS = ("stiffness", "damping")
"""Numbers that may change while the mechanism moves: nothing stored in the state depends on them. Masses, lengths, drives and stop
positions are fixed: a change would create momentum or open a loop."""


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU; its value reference is its place in the list. role, index: what a parameter stands for. above: the
    name of a smaller parameter that this one must exceed, as ``order`` says. rotation: whether a quaternion begins here."""

    name: str
    unit: str
    description: str
    causality: str
    variability: str
    initial: str
    start: float | None
    bound: Bound = ANY
    nominal: float = 1.0
    role: str = ""
    index: int = 0
    direct: bool = False
    above: str = ""
    order: Order | None = None
    rotation: bool = False

    @property
    def minimum(self) -> float:
        """Smallest value allowed; where the bound itself is excluded, the next ordinary number."""
        least = self.bound.least
        if least == -math.inf:
            return -HUGE
        return max(math.nextafter(least, math.inf), sys.float_info.min if least == 0.0 else least) if self.bound.open else least

    @property
    def maximum(self) -> float:
        """Largest value allowed."""
        return min(self.bound.most, HUGE)

    @property
    def tunable(self) -> bool:
        """Whether it may change during the run."""
        return self.variability == "tunable"


def variables(model: Model, step: float, rtol: float) -> list[Variable]:
    """All variables in the order of their value references: outputs, inputs, parameters."""
    scales = _Scales(model)
    return [*(_output(c, scales) for c in model.columns), *_inputs(model), *_numbers(model), *_starts(model), *_solver(step, rtol)]


class _Scales:
    """Nominal sizes of variables by unit, from the scene's length, rate and mass."""

    def __init__(self, model: Model):
        n, table = model.built.numbers, model.built.parameters
        mass = sum(v for p, v in zip(table.paths, table.values, strict=True) if (parse_path(p) or ())[2:] == ("mass",)) or 1.0
        length, rate = n.length, n.rate
        force = mass * length * rate**2
        self.of = {
            "m": length, "m/s": length * rate, "m/s^2": length * rate**2, "rad/s": rate, "rad/s^2": rate**2, "N": force,
            "N*m": force * length, "J": force * length,
        }


def _output(c: Column, scales: _Scales) -> Variable:
    nominal = float(f"{scales.of.get(c.unit, 1.0):.2g}")
    return Variable(c.name, c.unit, c.description, "output", "discrete" if c.quantity.steps else "continuous", "calculated", None,
                    c.bound, nominal, direct=c.quantity.direct)


def _inputs(model: Model) -> Iterator[Variable]:
    scene = model.built.scene
    for name, given in scene.inputs.items():
        text = given.description or f"external input {name}"
        yield Variable(name, given.unit, text, "input", "continuous", "", float(given.start))


def _numbers(model: Model) -> Iterator[Variable]:
    """Parameters for the numbers of the scene that the equations use at run time with the same meaning."""
    scene, table = model.built.scene, model.built.parameters
    own = {p.path: p.value for p in list_parameters(scene)}
    found = []
    for i, (text, value, unit) in enumerate(zip(table.paths, table.values, table.units, strict=True)):
        path = parse_path(text)
        if path is None or path[-2:] in NOT_OFFERED or (own.get(text) != value and not _derived(path)):
            continue
        variability = "tunable" if _tunable(path) else "fixed"
        made = Variable(text, unit, describe(path, text), "parameter", variability, "exact", value, bound_of(path),
                        role=NUMBER, index=i)
        order = order_of(path)
        found.append(made if order is None else replace(made, above=dotted((*path[:-1], order.low)), order=order))
    names = {v.name for v in found}
    yield from (v if v.above in names else replace(v, above="", order=None) for v in found)


def _derived(path: Path) -> bool:
    """Whether a number of the equations keeps its meaning though the scene says it in another way: a mass from a density, friction
    from the scene's defaults."""
    return (path[0] == "bodies" and path[2:] == ("mass",)) or (path[0] == "joints" and path[2] == "friction")


def _tunable(path: Path) -> bool:
    """Whether a number may change while the mechanism moves."""
    if path[0] != "joints":
        return path[0] in TUNABLE_SECTIONS
    return path[2] in TUNABLE_OF_JOINTS or (path[2] == "stops" and path[-1] in TUNABLE_OF_STOPS)


def describe(path: Path, text: str) -> str:
    """A path in words: "coefficient of (sliding) friction of joint ball"."""
    owner = {"bodies": "body", "joints": "joint", "forces": "load"}.get(str(path[0]))
    if owner is None:
        return text.replace("_", " ")
    if path[0] == "bodies" and path[2:] == ("mass",):
        return f"mass of body {path[1]} (its inertia goes with it where a shape gives it)"
    what = dotted(path[2:]).replace("_", " ").replace(".", " ")
    if path[0] == "joints" and path[2] == "friction":
        number, _ = (law_numbers() | sizes())[str(path[3])]
        what = number.text + (f" {int(path[4]) + 1}" if len(path) > 4 else "")
    return f"{what} of {owner} {path[1]}"


def _starts(model: Model) -> Iterator[Variable]:
    """Parameters for the start coordinates and rates of the tree joints."""
    n = model.built.numbers
    units = {"angle": "rad", "length": "m", "quaternion": "1"}
    for j in model.system.tree:
        for at, i in enumerate(state_coordinates(j)):
            unit, rotation = units[j.kind.coordinates[i]], i == j.kind.quaternion
            yield Variable(f"joints.{j.name}.start.q[{i + 1}]", unit, f"start coordinate {i + 1} of joint {j.name}", "parameter",
                           "fixed", "exact", float(n.q[j.q0 + at]), role=START_Q, index=j.q0 + at, rotation=rotation)
        for at, k in enumerate(j.free):
            unit = "rad/s" if j.kind.turns(k) else "m/s"
            yield Variable(f"joints.{j.name}.start.qd[{k + 1}]", unit, f"start rate {k + 1} of joint {j.name}", "parameter",
                           "fixed", "exact", float(n.v[j.v0 + at]), role=START_QD, index=j.v0 + at)
    for i, given in enumerate(n.tables):
        if isinstance(given, Outside) and given.tracked:
            name = model.system.inputs[i]
            yield Variable(f"inputs.{name}.bandwidth", "rad/s", f"how fast the motion follows input {name} (critically damped)",
                           "parameter", "tunable", "exact", given.bandwidth, bound_of(("inputs", name, "bandwidth")),
                           role=BANDWIDTH, index=i)


def _solver(step: float, rtol: float) -> list[Variable]:
    return [
        Variable("solver.tolerance", "1", "relative tolerance of the steps (unless the host gives one)", "parameter", "fixed",
                 "exact", rtol, RTOL, role=TOLERANCE),
        Variable("solver.step", "s", "internal step; 0: chosen by error control; > 0: fixed, for real time", "parameter", "fixed",
                 "exact", step, NOT_NEGATIVE, role=STEP),
        Variable("solver.max_steps", "1", "internal steps allowed in one communication step; 0: any number", "parameter", "tunable",
                 "exact", 0.0, Bound(0.0, 1e9), role=MAX_STEPS),
    ]
