"""What an FMU tells about itself: one list of variables, from which the model description, the C tables, the documentation page and
both flavours are made."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

from engine.basics.numbers import ANY, NOT_NEGATIVE, Bound, Order
from engine.basics.problems import Problem, SceneError
from engine.basics.settings import RTOL
from engine.contact import sizes
from engine.friction import numbers as law_numbers
from engine.scene.contexts import bound_of, order_of
from engine.scene.finding import Path, dotted, parse_path
from engine.scene.overrides import list_parameters
from engine.scene.realtime import EVALUATIONS, EVENTS, ITERATIONS
from engine.simulation.bounded import bounds_of
from engine.simulation.run import Model
from engine.system.curves import Outside
from engine.system.structure import state_coordinates
from fmu.types import HOST, INTEGER, derivatives, type_of

NUMBER, START_Q, START_QD, BANDWIDTH = "FMU_NUMBER", "FMU_START_Q", "FMU_START_QD", "FMU_BANDWIDTH"
PARAMETER = "FMU_PARAMETER"
TOLERANCE, HOST_TOLERANCE = "FMU_TOLERANCE", "FMU_HOST_TOLERANCE"
STEP, MAX_STEPS, ERRORS = "FMU_STEP", "FMU_MAX_STEPS", "FMU_ERRORS"
BOUNDS = {"events": "FMU_MOST_EVENTS", "evaluations": "FMU_MOST_EVALUATIONS", "iterations": "FMU_MOST_ITERATIONS"}
"""What a parameter stands for: names of ``fmu_setting_kind`` (``native/fmu.h``), which alone knows their numbers."""
BRIEF = ("point", "q", "qd", "drive", "friction", ("contact", "force"), ("extra", "verdict"), ("extra", "events"),
         ("extra", "overrun"), ("extra", "overruns"))
"""Columns, by their keys or the ends of these, that are outputs where nobody has said which are wanted: points, coordinates and
rates, efforts of drives, friction, normal forces, and whether all is well."""
HUGE = 1e300
"""Magnitude written as the bound of a number that has none."""
NOT_OFFERED = (("ramp", "begin"), ("ramp", "duration"), ("move", "begin"), ("move", "duration"))
"""Ends of paths whose changes would move the kinks the integrator stops at, which are laid down at export."""
TUNABLE_SECTIONS = ("friction", "forces", "gravity")
TUNABLE_OF_JOINTS = ("friction", "spring", "damping", "effort", "motor")
TUNABLE_OF_STOPS = ("stiffness", "damping")
"""Numbers that may change while the mechanism moves: nothing stored in the state depends on them. Masses, lengths, drives and stop
positions are fixed: a change would create momentum or open a loop."""


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU; its value reference is its place in the list. role, index: what a parameter stands for.
    also: another number that is the same, −1 none. type: that of one that is not real (``types``). rate_of: the name of the
    variable whose time derivative it is. above: the name of a smaller parameter that this one must exceed, as ``order`` says.
    rotation: whether a quaternion begins here."""

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
    also: int = -1
    direct: bool = False
    above: str = ""
    order: Order | None = None
    rotation: bool = False
    type: str = ""
    rate_of: str = ""

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


def variables(
    model: Model, step: float, rtol: float, brief: bool = False, own_steps: bool = True, certify: bool = False
) -> list[Variable]:
    """All variables in the order of their value references: columns, inputs, parameters. brief: those columns that most hosts have
    no use for are local variables, not outputs. own_steps: it makes steps of its own, which have parameters. certify: the errors of
    outputs can be asked for."""
    asked = bounds_of(model.built.scene)
    solver = [v for v in _solver(float(asked.get("step", step)), rtol) if own_steps or v.role not in (STEP, MAX_STEPS)]
    if certify and asked:
        what = "bounded steps have no second run beside them, by which errors are told"
        raise SceneError([Problem("--certify", what, "leave simulation.realtime out, or --certify")])
    told = "1: outputs are the global errors of themselves, by a second, tighter run; not a number where none is promised"
    solver += [_solving("errors", "1", told, 0.0, Bound(0.0, 1.0), ERRORS, INTEGER)] if certify else []
    solver += [_bound(name, asked[name], role) for name, role in BOUNDS.items() if asked]
    return [*_outputs(model, brief), *_inputs(model), *_numbers(model), *_starts(model), *solver]


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


def _outputs(model: Model, brief: bool) -> Iterator[Variable]:
    scales, rates = _Scales(model), derivatives(model)
    for i, c in enumerate(model.columns):
        nominal = float(f"{scales.of.get(c.unit, 1.0):.2g}")
        kind, base = type_of(c), model.columns[rates[i]].name if i in rates else ""
        wanted = c.key[0] in BRIEF or c.key in BRIEF or (c.key[0], c.key[-1]) in BRIEF
        causality = "output" if wanted or not brief else "local"
        variability = "discrete" if c.quantity.steps else "continuous"
        yield Variable(c.name, c.unit, c.description, causality, variability, "calculated", None, c.bound, nominal,
                       direct=c.quantity.direct, type=kind, rate_of=base)


def _inputs(model: Model) -> Iterator[Variable]:
    scene = model.built.scene
    for name, given in scene.inputs.items():
        text = given.description or f"external input {name}"
        yield Variable(name, given.unit, text, "input", "continuous", "", float(given.start))
    for name in followed(model):
        at = 2 * model.system.inputs.index(name)
        for k, (kind, per) in enumerate((("rate", "/s"), ("acceleration", "/s^2"))):
            text, unit = f"{kind} of input {name}; left at 0 where it is not known", scene.inputs[name].unit + per
            yield Variable(f"inputs.{name}.{kind}", unit, text, "input", "continuous", "", 0.0, index=at + k)


def followed(model: Model) -> dict[str, Outside]:
    """The inputs that motions follow, by name."""
    tables = zip(model.system.inputs, model.built.numbers.tables, strict=False)
    return {name: given for name, given in tables if isinstance(given, Outside) and given.tracked}


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
    found = list(_joined(found, own))
    names = {v.name for v in found}
    yield from (v if v.above in names else replace(v, above="", order=None) for v in found)


def _joined(found: list[Variable], own: dict[str, float]) -> Iterator[Variable]:
    """The parameters, those one that the scene says with one number: "radius" of a universal joint stands for two."""
    first: dict[str, Variable] = {}
    for v in found:
        name = v.name.removesuffix("]").rpartition("[")[0]
        if v.name in own or name not in own:
            first[v.name] = v
        elif name not in first:
            path = parse_path(name) or ()
            first[name] = replace(v, name=name, description=describe(path, name), bound=bound_of(path))
        else:
            first[name] = replace(first[name], also=v.index)
    yield from first.values()


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
    for name, given in followed(model).items():
        text = f"how fast the motion follows input {name} (critically damped)"
        bound, place = bound_of(("inputs", name, "bandwidth")), model.system.inputs.index(name)
        yield Variable(f"inputs.{name}.bandwidth", "rad/s", text, "parameter", "tunable", "exact", given.bandwidth, bound,
                       role=BANDWIDTH, index=place)


def _solver(step: float, rtol: float) -> Iterator[Variable]:
    """Parameters of the stepping itself."""
    one = _solving
    yield one("tolerance", "1", "relative tolerance of the steps (a tighter one of the host counts)", rtol, RTOL, TOLERANCE)
    yield one("host_tolerance", "1", "what becomes of a tolerance that the host gives", 1.0, Bound(0.0, 2.0), HOST_TOLERANCE, HOST)
    yield one("step", "s", "internal step; 0: chosen by error control; > 0: fixed, for real time", step, NOT_NEGATIVE, STEP)
    most = "internal steps allowed in one communication step; 0: any number"
    yield one("max_steps", "1", most, 0.0, Bound(0.0, 1e9), MAX_STEPS, INTEGER)


def _solving(name: str, unit: str, text: str, start: float, bound: Bound, role: str, kind: str = "") -> Variable:
    variability = "tunable" if role == MAX_STEPS else "fixed"
    return Variable(f"solver.{name}", unit, text, "parameter", variability, "exact", start, bound, role=role, type=kind)


def _bound(name: str, start: float, role: str) -> Variable:
    """A bound of steps for real time."""
    bound, about = {
        "events": (EVENTS, "events that are located in a bounded step, at most"),
        "evaluations": (EVALUATIONS, "evaluations of the equations of motion in a bounded step, at most"),
        "iterations": (ITERATIONS, "iterations of Newton's method in a bounded step, at most"),
    }[name]
    return Variable(f"solver.{name}", "1", about, "parameter", "tunable", "exact", start, bound, role=role, type=INTEGER)
