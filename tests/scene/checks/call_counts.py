"""The work of reading as a function of the size of the text. Tests count calls and use no clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from cProfile import Profile
from typing import Any

from tests.scene.valid_scene import edited
from trunnion.basics.errors import SceneError

FEW, MANY = 110, 330
"""Compared sizes. Both exceed the number of problems that a report contains, so that a report costs the same at both sizes."""
LINEAR = 3.375
"""Allowed growth of work for three times the size: three times, and an eighth more for logarithms and growing tables."""


def calls(work: Callable[[], object]) -> int:
    """Number of calls of Python and C functions in ``work``, even if it ends in an error. The profiler counts the calls in C: a
    counter in Python would take several times as long as the work itself."""
    profiler = Profile()
    with suppress(SceneError), profiler:
        work()
    return sum(entry.callcount for entry in profiler.getstats())


def growth(made: Callable[[int], Any], work: Callable[[Any], object]) -> float:
    """Calls for MANY divided by calls for FEW. Results that are computed only once exist before."""
    few, many = made(FEW), made(MANY)
    work_of = {id(x): (lambda x=x: work(x)) for x in (few, many)}
    calls(work_of[id(few)])
    return calls(work_of[id(many)]) / calls(work_of[id(few)])


def extended(n: int, body: dict[str, Any] | None = None, joint: dict[str, Any] | None = None, to: str = "b{i}") -> dict[str, Any]:
    """The valid scene with n additional bodies. Each body is on a joint to ``to``. ``body`` and ``joint`` are keys that are added
    to each body and joint."""
    data = edited({})
    for i in range(n):
        data["bodies"][f"b{i}"] = {"mass": 1, "inertia": [0, 0, 0], **(body or {})}
        data["joints"][f"j{i}"] = {"type": "free", "inboard": "ground", "outboard": to.format(i=i), **(joint or {})}
    return data


def under(path: str, made: Callable[[int], Any]) -> Callable[[int], dict[str, Any]]:
    """A function n → the scene in which ``made(n)`` stands at this path."""
    return lambda n: edited({path: made(n)})


def times(key: str, value: Any) -> Callable[[int], dict[str, Any]]:
    """n keys with the same value."""
    return lambda n: {key.format(i=i): value for i in range(n)}


SCENES: dict[str, Callable[[int], dict[str, Any]]] = {
    "unknown keys of a body": lambda n: edited({f"bodies.arm.masss{i}": 1 for i in range(n)}),
    "unknown keys of the scene": lambda n: edited({f"masss{i}": 1 for i in range(n)}),
    "points of two numbers": lambda n: edited({f"bodies.arm.points.p{i}": [1, 2] for i in range(n)}),
    "a table of words": under("joints.rail.drive.table.time", lambda n: ["x"] * n),
    "joints to bodies that are not there": lambda n: extended(n, to="c{i}"),
    "joints with an unknown key": lambda n: extended(n, joint={"x": 1}),
    "bodies with an unknown key, joints to others": lambda n: extended(n, body={"masss": 1}, to="c{i}"),
    "loose bodies": lambda n: edited({f"bodies.b{i}": {"mass": 1, "inertia": [0, 0, 0]} for i in range(n)}),
    "outputs of nothing": under("outputs", lambda n: [f"nothing{i}.q" for i in range(n)]),
    "inputs in no unit": under("inputs", times("in{i}", {"unit": "parsec"})),
    "loads from inputs that are not there": lambda n: edited(
        {f"forces.f{i}": {"type": "force", "on": "arm", "force": [0, 0, {"input": f"gust{i}"}]} for i in range(n)}
    ),
    "a good scene": extended,
}


def lines(text: str) -> Callable[[int], str]:
    """A function n → a text with n lines of this form."""
    return lambda n: "a: 1\n" + "".join(text.format(i=i) for i in range(n))


TEXTS: dict[str, Callable[[int], str]] = {
    "keys": lines("k{i}: 1\n"),
    "the same key": lines("a: 1\n"),
    "anchors": lines("k{i}: &a{i} 1\n"),
    "comments": lines("# nothing\n"),
    "entries of a list": lambda n: f"a: [{'1, ' * n}1]",
    "entries of a group": lambda n: "a: {" + ", ".join(f"k{i}: 1" for i in range(n)) + "}",
    "aliases": lambda n: f"a: &a 1\nb: [{'*a, ' * n}1]",
    "long text in quotes": lambda n: f'a: "{"x" * 10 * n}"',
    "a long plain word": lambda n: f"a: {'x' * 10 * n}",
    "a long number": lambda n: f"a: {'1' * 10 * n}",
    "a long key": lambda n: f"{'x' * 10 * n}: 1",
    "many lines of text": lambda n: "a: |\n" + "  x\n" * n,
    "escapes": lambda n: f'a: "{chr(92)}n{chr(92)}ud800' + '"' + " " * n,
}
