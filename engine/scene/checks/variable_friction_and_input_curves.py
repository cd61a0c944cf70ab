"""Checks of variable numbers: friction over time, functions of inputs, coefficients of friction over speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from trunnion.basics.monotone_curves import KNOTS
from trunnion.elements.contact import sizes
from trunnion.elements.friction.coulomb import Coulomb
from trunnion.scene.data_classes.scene import ByLoad, BySpeed, Friction, FromInput, Scene, Signal
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.loads_and_signals import VARYING, entries, loads
from trunnion.scene.signals.registry import all_given

BY_LOAD = tuple(name for name, (n, _) in sizes().items() if n.by_load)
"""Names of the friction numbers that may be a table over load or speed."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about curves of inputs and variable friction."""
    for path, load in loads(scene):
        if isinstance(load, FromInput) and load.curve is not None:
            yield from _curve((*path, "curve"), "at", load.curve.at, load.curve.value)
    for name, j in scene.joints.items():
        if j.friction is None:
            continue
        at: Path = ("joints", name, "friction")
        for n in VARYING:
            for path, value in entries(getattr(j.friction, n), (*at, n)):
                yield from _opposes(path, value, float(scene.simulation.until))
        if isinstance(j.friction.mu, BySpeed):
            yield from _by_speed(at, j.friction, j.friction.mu, scene)
        for key in BY_LOAD:
            value = getattr(j.friction, key)
            if isinstance(value, ByLoad):
                yield from _by_load((*at, key), key, value, scene.law_of(j.friction))


def _curve(path: Path, key: str, at: Sequence[float], value: Sequence[float]) -> Iterator[Finding]:
    if len(at) != len(value):
        yield Finding((*path, "value"), f"{len(at)} entries of {key} but {len(value)} values", f"give one value for each {key}")
    if not 2 <= len(at) <= KNOTS:
        yield Finding((*path, key), f"a curve has 2 to {KNOTS} points, not {len(at)}", "remove some points" if len(at) > 2 else "")
    for i in range(1, len(at)):
        if not at[i - 1] < at[i]:
            yield Finding((*path, key, i), f"the entries must increase: {at[i]:g} follows {at[i - 1]:g}")
            break


def _by_speed(path: Path, f: Friction, c: BySpeed, scene: Scene) -> Iterator[Finding]:
    yield from _curve((*path, "mu"), "speed", c.speed, c.value)
    if c.speed and c.speed[0] != 0.0:
        yield Finding((*path, "mu", "speed", 0), "the first speed must be 0, for static friction", "begin with 0")
    law = scene.law_of(f)
    if law != Coulomb.name or scene.normal_force_of(f) == "adams":
        what = f"a coefficient that depends on the speed needs the law {Coulomb.name} with exact normal forces"
        yield Finding((*path, "mu"), what, f"law: {Coulomb.name}, or one number for the law {law}")
    if f.mu_static is not None:
        yield Finding((*path, "mu_static"), "the curve of mu already begins with the static coefficient", "remove mu_static")


def _by_load(path: Path, key: str, c: ByLoad, law: str) -> Iterator[Finding]:
    if (c.torque is None) == (c.speed is None):
        yield Finding(path, f"{key} is a table over torque or over speed", "give one of torque and speed, beside value")
        return
    over = "torque" if c.torque is not None else "speed"
    yield from _curve(path, over, c.torque or c.speed or (), c.value)
    wrong = [i for i, v in enumerate(c.value) if not sizes()[key][0].bound.holds(v)]
    if wrong:
        bound = sizes()[key][0].bound
        yield Finding((*path, "value", wrong[0]), bound.refusal(key, c.value[wrong[0]]), bound.advice)
    if law != Coulomb.name:
        yield Finding(path, f"a table needs the law {Coulomb.name}", f"law: {Coulomb.name}, or one number for the law {law}")


def _opposes(path: Path, value: object, until: float) -> Iterator[Finding]:
    """A finding for each friction signal that has a negative value."""
    if isinstance(value, FromInput) and value.curve is not None:
        said: dict[str, Sequence[float]] = {"curve.value": value.curve.value}
    elif isinstance(value, Signal):
        limited = value.limit.of if value.limit is not None else float
        extremes = ((kind.key, *x) for kind, data in all_given(value) for x in kind.values(data, until).items())
        said = {f"{kind}.{key}".rstrip("."): [limited(v) for v in values] for kind, key, values in extremes}
    else:
        return
    for key, values in said.items():
        if any(v < 0.0 for v in values):
            yield Finding((*path, *key.split(".")), f"friction must not be negative (it is {min(values):g})", "0 or more")
