"""Names inside a part: every place where it names a body, a point, an input or a parameter."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from engine.scene.finding import Path
from engine.scene.units import UnitError
from engine.scene.written.formula import formula, renamed
from engine.scene.written.parameters import inside, is_expression
from engine.scene.written.values import value

Renamer = Callable[[str, Path], str]
_BRACES = re.compile(r"\{([^{}]*)\}")


def read_on(data: dict[str, Any]) -> None:
    """Restore the key ``on`` of forces. In YAML 1.1 it is a word for true, so that tools of that version write it back as
    ``true:``."""
    forces = data.get("forces")
    for force in forces.values() if isinstance(forces, dict) else ():
        said = [k for k in ("true", "True") if k in force] if isinstance(force, dict) and "on" not in force else []
        if said:
            force["on"] = force.pop(said[0])


def mapped(section: str, name: str, part: Any, by: Renamer) -> Any:
    """A joint or load, in which every name of a body or of its point is what ``by`` makes of it."""
    path: Path = (section, name)
    if not isinstance(part, dict):
        return part
    if section == "joints":
        return {k: _side(v, (*path, k), by) if k in ("inboard", "outboard", "at") else v for k, v in part.items()}
    out = dict(part)
    if isinstance(part.get("on"), str):
        out["on"] = by(part["on"], (*path, "on"))
    if isinstance(part.get("between"), list):
        ends = enumerate(part["between"])
        out["between"] = [by(e, (*path, "between", i)) if isinstance(e, str) else e for i, e in ends]
    return out


def _side(side: Any, path: Path, by: Renamer) -> Any:
    if isinstance(side, str):
        return by(side, path)
    if not isinstance(side, dict) or not isinstance(side.get("body"), str):
        return side
    point = side.get("point")
    if not isinstance(point, str):
        return {**side, "body": by(side["body"], (*path, "body"))}
    body, _, found = by(f"{side['body']}.{point}", (*path, "point")).partition(".")
    return {**side, "body": body, "point": found}


def inputs(node: Any, names: dict[str, str]) -> Any:
    """What stands below a joint or load, with other names for inputs."""
    if isinstance(node, list):
        return [inputs(v, names) for v in node]
    if not isinstance(node, dict):
        return node
    return {k: names.get(v, v) if k == "input" and isinstance(v, str) else inputs(v, names) for k, v in node.items()}


def expressions(node: Any, names: dict[str, str]) -> Any:
    """Everything below a node, with other names for the parameters in expressions."""
    if isinstance(node, dict):
        return {k: expressions(v, names) for k, v in node.items()}
    if isinstance(node, list):
        return [expressions(v, names) for v in node]
    return "{" + renamed(inside(node), names) + "}" if is_expression(node) else node


def numbered(text: str, number: int) -> str:
    """A name in which {i}, {i+1}, … stand for numbers of copies. UnitError when there is no whole number between the braces."""

    def one(m: re.Match[str]) -> str:
        found = value(formula(renamed(m[1], {"i": str(number)})).root, {})
        if found != int(found):
            raise UnitError(f"{m[0]} is {found:g}, no whole number", "copies are counted from 1: {i}, {i-1}")
        return str(int(found))

    try:
        return _BRACES.sub(one, text)
    except KeyError as e:
        raise UnitError(f"{e.args[0]} in {text} is no number of a copy", "only i is known in a name") from e
