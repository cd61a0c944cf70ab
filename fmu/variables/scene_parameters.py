"""Offers the parameters of a scene as parameters of its FMU. The FMU computes the numbers that depend on these parameters, by the
expressions of the scene. The dependent numbers are not parameters of the FMU. The export omits and reports a scene parameter that
affects fixed properties of an FMU."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from trunnion.basics.errors import Problem, raise_problems
from trunnion.elements.joints import REGISTRY
from trunnion.fmu.variables.input_sums import Sums, with_input_sources
from trunnion.fmu.variables.outputs_inputs_parameters import PARAMETER, Variable
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.formula_parser import FUNCTIONS, Call, Formula, Name, Node, Number
from trunnion.scene.expressions.parameter_dependence import DependentNumbers
from trunnion.scene.expressions.parameter_evaluation import NAMED
from trunnion.scene.queries.numbers_by_path import unit_of

OPERATIONS = {
    "+": "ADD", "-": "SUBTRACT", "*": "MULTIPLY", "/": "DIVIDE", "^": "POWER", "neg": "NEGATE",
    **{f: f.upper() for f in FUNCTIONS},
}  # fmt: skip
"""Names in the C enumeration ``fmu_operation`` (``model_and_instance.h``) without their prefix, by function."""


@dataclass(frozen=True)
class FmuVariables:
    """The variables of an FMU. listed: variables in order of value references. followers: computed parameters, which come after
    ``listed`` and have no value references. programs: stack code of each computed parameter. left_out: parameters of the scene that
    are not parameters of the FMU. sums: inputs that are sums of sources."""

    listed: list[Variable]
    followers: list[Variable]
    programs: list[list[str]]
    left_out: tuple[str, ...]
    sums: Sums = field(default_factory=dict)


def arranged(scene: Scene, listed: Sequence[Variable]) -> FmuVariables:
    """The variables of the FMU. In this list, parameters of the scene replace the numbers that depend on them. listed: all possible
    variables."""
    following = DependentNumbers(scene)
    known = {v.name: v for v in listed if v.causality == "parameter"}
    places = {path: found for path in following.numbers if (found := _place(scene, path, known)) is not None}
    base = [n for n in scene.parameters if n not in following.named]
    offered = [n for n in base if following.of([n]) and all(p in places for p in following.of([n]))]
    moved = following.of(offered)
    inside = {places[p] for p in moved}
    own = [_parameter(scene, n, [known[places[p]] for p in following.of([n])]) for n in offered]
    first = next((i for i, v in enumerate(listed) if v.causality == "parameter"), len(listed))
    kept = [v for v in listed[first:] if v.name not in inside]
    settings = {n: i for i, n in enumerate(offered)}
    programs = [_code(following.numbers[p], following, settings) for p in moved]
    return FmuVariables(
        [*listed[:first], *own, *kept], [known[places[p]] for p in moved], programs, tuple(n for n in base if n not in offered)
    )


def begun(all_: FmuVariables, starts: Mapping[str, float]) -> FmuVariables:
    """The variables with these start values of parameters, by name. Raises SceneError for values that are not allowed."""
    given = {v.name: starts[v.name] for v in all_.listed if v.causality == "parameter" and v.name in starts}
    bounds = {v.name: v.bound for v in all_.listed}
    wrong = [Problem(n, bounds[n].refusal(n.rpartition(".")[2], x)) for n, x in given.items() if not bounds[n].holds(x)]
    raise_problems(wrong)
    return replace(all_, listed=[replace(v, start=given.get(v.name, v.start)) for v in all_.listed])


def summed(all_: FmuVariables, sums: Sums, columns: int) -> FmuVariables:
    """The variables with the sources of inputs that are sums. columns: number of outputs."""
    return replace(all_, listed=with_input_sources(all_.listed, sums, columns), sums=sums)


def _place(scene: Scene, path: str, known: dict[str, Variable]) -> str | None:
    """The name of the FMU variable for a number of the scene; None if there is no such variable."""
    steps = path.split(".")
    if steps[0] == "joints" and steps[2:3] == ["start"] and REGISTRY[scene.joints[steps[1]].type].quaternion >= 0:
        return None  # not a parameter, because the components of a quaternion are normalised together
    return next((n for n in (path, f"{path}[1]") if n in known), None)


def _parameter(scene: Scene, name: str, followers: list[Variable]) -> Variable:
    text = f"parameter {name} of the scene: {len(followers)} numbers of the scene depend on it"
    variability = "tunable" if all(v.tunable for v in followers) else "fixed"
    start, unit = float(scene.parameters[name]), unit_of(scene, (NAMED, name))
    return Variable(f"{NAMED}.{name}", unit, text, "parameter", variability, "exact", start, role=PARAMETER)


def _code(f: Formula, following: DependentNumbers, settings: dict[str, int]) -> list[str]:
    """The stack code of an expression. settings: positions of the scene parameters in the table of FMU parameters."""
    out: list[str] = []

    def put(node: Node) -> None:
        if isinstance(node, Number):
            out.extend(("FMU_VALUE", repr(node.value)))
        elif isinstance(node, Name) and node.name in settings:
            out.extend(("FMU_SETTING", str(settings[node.name])))
        elif isinstance(node, Name) and node.name in following.named:
            put(following.named[node.name].root)
        elif isinstance(node, Name):
            out.extend(("FMU_VALUE", repr(following.base[node.name])))
        else:
            assert isinstance(node, Call)
            for i, a in enumerate(node.arguments):
                put(a)
                if i and node.function in ("min", "max"):
                    out.append(f"FMU_{OPERATIONS[node.function]}")
            if node.function not in ("min", "max"):
                out.append(f"FMU_{OPERATIONS[node.function]}")

    put(f.root)
    return out


def depth(program: Sequence[str]) -> int:
    """The largest stack depth of a program."""
    now = most = 0
    words = iter(program)
    for word in words:
        if word in ("FMU_VALUE", "FMU_SETTING"):
            next(words)
            now += 1
        elif word in BINARY:
            now -= 1
        most = max(most, now)
    return most


BINARY = {f"FMU_{OPERATIONS[f]}" for f in ("+", "-", "*", "/", "^", "atan2", "min", "max")}


def left_out(all_: FmuVariables) -> tuple[str, ...]:
    """A note that names the parameters of the scene that the FMU lacks. Without such parameters, there is no note."""
    if not all_.left_out:
        return ()
    names, one = ", ".join(all_.left_out), all_.left_out[0]
    why = (
        "they have no effect, or change shapes, points, axes or rotations, which are fixed in an FMU; to change them, export again"
    )
    return (f"not parameters of the FMU: {names}: {why} with --set parameters.{one}=…",)
