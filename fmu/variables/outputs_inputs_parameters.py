"""The list of variables of an FMU. The model description, the C tables and the documentation page are generated from this list."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.number_declarations import ANY, NOT_NEGATIVE, Bound, Order
from trunnion.basics.setting_declarations import RTOL
from trunnion.elements.contact import sizes
from trunnion.elements.friction import numbers as law_numbers
from trunnion.fmu.variables.variable_types import HOST, INTEGER, derivatives, type_of
from trunnion.scene.data_classes.realtime_steps import EVALUATIONS, EVENTS, ITERATIONS
from trunnion.scene.findings.findings_and_paths import Path, dotted, parse_path
from trunnion.scene.overrides import list_parameters
from trunnion.scene.queries.numbers_by_path import bound_of, order_of
from trunnion.simulation.run import Model
from trunnion.simulation.settings.realtime_steps import bounds_of
from trunnion.system.signals.signal_tables import ExternalInput
from trunnion.system.structure.bodies_and_joints import state_coordinates

NUMBER, START_Q, START_QD, BANDWIDTH = "FMU_NUMBER", "FMU_START_Q", "FMU_START_QD", "FMU_BANDWIDTH"
PARAMETER, SOURCE = "FMU_PARAMETER", "source"
TOLERANCE, HOST_TOLERANCE = "FMU_TOLERANCE", "FMU_HOST_TOLERANCE"
STEP, MAX_STEPS, ERRORS = "FMU_STEP", "FMU_MAX_STEPS", "FMU_ERRORS"
BOUNDS = {"events": "FMU_MOST_EVENTS", "evaluations": "FMU_MOST_EVALUATIONS", "iterations": "FMU_MOST_ITERATIONS"}
"""Roles of parameters: names in the C enumeration ``fmu_setting_kind`` (``model_and_instance.h``). SOURCE is the role of
sources of inputs (``input_sums``)."""
BRIEF = ("point", "q", "qd", "drive", "friction", ("contact", "force"), ("extra", "verdict"), ("extra", "events"),
         ("extra", "overrun"), ("extra", "overruns"))
"""Keys of columns that are outputs by default: points, coordinates and rates, efforts of drives, friction, normal forces, audit. A
text is the first part of a key; a pair is a whole key, or the first and last part of a key."""
HUGE = 1e300
"""The bound that is used for a number without a bound."""
TUNABLE_SECTIONS = ("friction", "forces", "gravity")
TUNABLE_OF_JOINTS = ("friction", "spring", "damping", "effort", "motor")
TUNABLE_OF_END_STOPS = ("stiffness", "damping")
"""Path keys of numbers that may change during the run, because no stored state depends on them. Masses, lengths, drives and stop
positions are fixed, because a change during the run would create momentum or open a loop."""


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU; its value reference is its index in the list.

    role, index: the meaning of a parameter (``fmu_setting``). also: index of another engine parameter with the same value, −1 if
    there is none. type: the type of a variable that is not real (``variable_types``). rate_of: name of the variable whose time
    derivative this variable is. above: name of a parameter that is a lower bound of this parameter; ``order`` states whether
    equality is allowed. rotation: whether this is the first component of a quaternion."""

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
        """The smallest allowed value: the lower bound or, if the bound itself is excluded, the next larger normal floating-point
        number."""
        least = self.bound.least
        if least == -math.inf:
            return -HUGE
        return max(math.nextafter(least, math.inf), sys.float_info.min if least == 0.0 else least) if self.bound.open else least

    @property
    def maximum(self) -> float:
        return min(self.bound.most, HUGE)

    @property
    def tunable(self) -> bool:
        return self.variability == "tunable"


def variables(
    model: Model, step: float, rtol: float, brief: bool = False, own_steps: bool = True, certify: bool = False
) -> list[Variable]:
    """All variables in the order of their value references: columns, inputs, parameters. brief: whether columns outside ``BRIEF``
    are local variables. own_steps: whether there are parameters for internal steps, which exist only in co-simulation. certify:
    whether to add ``solver.errors``."""
    asked = bounds_of(model.built.scene)
    solver = [v for v in _solver(float(asked.get("step", step)), rtol) if own_steps or v.role not in (STEP, MAX_STEPS)]
    if certify and asked:
        what = "error estimates need a second run, and a scene with real-time steps (simulation.realtime) has none"
        raise SceneError([Problem("--certify", what, "omit simulation.realtime, or omit --certify")])
    told = "1: each output is its global error, estimated by a second run with a tighter tolerance; NaN if there is no estimate"
    solver += [_solving("errors", "1", told, 0.0, Bound(0.0, 1.0), ERRORS, INTEGER)] if certify else []
    solver += [_bound(name, asked[name], role) for name, role in BOUNDS.items() if asked]
    return [*_outputs(model, brief), *_inputs(model), *_numbers(model), *_starts(model), *solver]


class _Scales:
    """Nominal values by unit, from the length, rate and mass of the scene."""

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
            text, unit = f"{kind} of input {name}; 0: unknown", scene.inputs[name].unit + per
            yield Variable(f"inputs.{name}.{kind}", unit, text, "input", "continuous", "", 0.0, index=at + k)


def followed(model: Model) -> dict[str, ExternalInput]:
    """The inputs that motions follow, by name."""
    tables = zip(model.system.inputs, model.built.numbers.tables, strict=False)
    return {name: given for name, given in tables if isinstance(given, ExternalInput) and given.tracked}


def _numbers(model: Model) -> Iterator[Variable]:
    """FMU parameters for the numbers of the scene that the equations use without any conversion. Numbers that move the times of
    kinks are omitted, because the export fixes these times."""
    scene, table = model.built.scene, model.built.parameters
    own = {p.path: p.value for p in list_parameters(scene)}
    found = []
    for i, (text, value, unit) in enumerate(zip(table.paths, table.values, table.units, strict=True)):
        path = parse_path(text)
        if path is None or table.moves_kinks(i) or (own.get(text) != value and not _derived(path)):
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
    """The parameters. Several parameters become one if the scene gives one number for them. For example, "radius" of a universal
    joint sets two radii."""
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
    """Whether a number that the scene does not give directly may be a parameter. Examples are a mass computed from a density, and
    friction taken from the defaults of the scene."""
    return (path[0] == "bodies" and path[2:] == ("mass",)) or (path[0] == "joints" and path[2] == "friction")


def _tunable(path: Path) -> bool:
    """Whether a number may change during the run."""
    if path[0] != "joints":
        return path[0] in TUNABLE_SECTIONS
    return path[2] in TUNABLE_OF_JOINTS or (path[2] == "end_stops" and path[-1] in TUNABLE_OF_END_STOPS)


def describe(path: Path, text: str) -> str:
    """A description of the number at a path, such as "coefficient of (sliding) friction of joint ball"."""
    owner = {"bodies": "body", "joints": "joint", "forces": "load"}.get(str(path[0]))
    if owner is None:
        return text.replace("_", " ")
    if path[0] == "bodies" and path[2:] == ("mass",):
        return f"mass of body {path[1]} (inertia computed from a shape changes in proportion)"
    what = dotted(path[2:]).replace("_", " ").replace(".", " ")
    if path[0] == "joints" and path[2] == "friction":
        number, _ = (law_numbers() | sizes())[str(path[3])]
        what = " ".join([number.text, *(str(int(p) + 1) if str(p).isdigit() else str(p).replace("_", " ") for p in path[4:])])
    return f"{what} of {owner} {path[1]}"


def _starts(model: Model) -> Iterator[Variable]:
    """Parameters for start coordinates and rates of the tree joints."""
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
        text = f"bandwidth with which the motion follows input {name} (critically damped)"
        bound, place = bound_of(("inputs", name, "bandwidth")), model.system.inputs.index(name)
        yield Variable(f"inputs.{name}.bandwidth", "rad/s", text, "parameter", "tunable", "exact", given.bandwidth, bound,
                       role=BANDWIDTH, index=place)


def _solver(step: float, rtol: float) -> Iterator[Variable]:
    """Parameters of the solver."""
    one = _solving
    yield one("tolerance", "1", "relative tolerance of the steps (a tighter host tolerance is used instead)", rtol, RTOL, TOLERANCE)
    yield one("host_tolerance", "1", "whether the tolerance of the host is used", 1.0, Bound(0.0, 2.0), HOST_TOLERANCE, HOST)
    yield one("step", "s", "internal step; 0: chosen by error control; > 0: fixed step, for real time", step, NOT_NEGATIVE, STEP)
    most = "largest number of internal steps in one communication step; 0: no limit"
    yield one("max_steps", "1", most, 0.0, Bound(0.0, 1e9), MAX_STEPS, INTEGER)


def _solving(name: str, unit: str, text: str, start: float, bound: Bound, role: str, kind: str = "") -> Variable:
    variability = "tunable" if role == MAX_STEPS else "fixed"
    return Variable(f"solver.{name}", unit, text, "parameter", variability, "exact", start, bound, role=role, type=kind)


def _bound(name: str, start: float, role: str) -> Variable:
    """A bound of real-time steps."""
    bound, about = {
        "events": (EVENTS, "largest number of events located in a bounded step"),
        "evaluations": (EVALUATIONS, "largest number of evaluations of the equations of motion in a bounded step"),
        "iterations": (ITERATIONS, "largest number of iterations of Newton's method in a bounded step"),
    }[name]
    return Variable(f"solver.{name}", "1", about, "parameter", "tunable", "exact", start, bound, role=role, type=INTEGER)
