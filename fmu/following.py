"""Parameters of a scene as parameters of its FMU: what follows them is computed inside, by the same expressions, and is then no
parameter by itself. One that acts on anything an FMU cannot change is left out, and so named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from engine.joints import REGISTRY
from engine.scene.contexts import unit_of
from engine.scene.following import Following
from engine.scene.model import Scene
from engine.scene.written.formula import Call, Formula, Name, Node, Number
from engine.scene.written.parameters import NAMED
from fmu.description import PARAMETER, Variable

OPERATIONS = {
    "+": "ADD", "-": "SUBTRACT", "*": "MULTIPLY", "/": "DIVIDE", "^": "POWER", "neg": "NEGATE",
    **{f: f.upper() for f in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "abs", "min", "max")},
}  # fmt: skip
"""Names of ``fmu_operation`` (``native/fmu.h``) by function."""


@dataclass(frozen=True)
class Arrangement:
    """The variables of an FMU. listed: those it has, in the order of their value references; followers: parameters inside, which
    come after those listed; programs: for each of them what computes it, words of C for a stack; left_out: parameters of the scene
    that are none of the FMU."""

    listed: list[Variable]
    followers: list[Variable]
    programs: list[list[str]]
    left_out: tuple[str, ...]


def arranged(scene: Scene, listed: Sequence[Variable]) -> Arrangement:
    """The variables when those that follow parameters of the scene give way to these. listed: every variable that there can be."""
    following = Following(scene)
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
    return Arrangement(
        [*listed[:first], *own, *kept], [known[places[p]] for p in moved], programs, tuple(n for n in base if n not in offered)
    )


def _place(scene: Scene, path: str, known: dict[str, Variable]) -> str | None:
    """The name of the variable that a number of the scene is, None where it is none."""
    steps = path.split(".")
    if steps[0] == "joints" and steps[2:3] == ["start"] and REGISTRY[scene.joints[steps[1]].type].quaternion >= 0:
        return None  # rotations are normalised together
    return next((n for n in (path, f"{path}[1]") if n in known), None)


def _parameter(scene: Scene, name: str, followers: list[Variable]) -> Variable:
    text = f"parameter {name} of the scene: {len(followers)} of its numbers follow it"
    variability = "tunable" if all(v.tunable for v in followers) else "fixed"
    start, unit = float(scene.parameters[name]), unit_of(scene, (NAMED, name))
    return Variable(f"{NAMED}.{name}", unit, text, "parameter", variability, "exact", start, role=PARAMETER)


def _code(f: Formula, following: Following, settings: dict[str, int]) -> list[str]:
    """The words that leave the value of an expression on a stack."""
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
    """How many values a program keeps at most."""
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


def left_out(all_: Arrangement) -> tuple[str, ...]:
    """A note that names the parameters of the scene that the FMU does not have."""
    if not all_.left_out:
        return ()
    names, one = ", ".join(all_.left_out), all_.left_out[0]
    why = "they act on what an FMU cannot change (shapes, points, axes, rotations, nothing); other values: export again"
    return (f"no parameters of the FMU: {names}: {why} with --set parameters.{one}=…",)
