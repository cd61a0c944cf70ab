"""What an FMU tells about itself: one list of variables, from which the model description, the C tables, the documentation page and
both flavours are made."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from engine.kernel.columns import Column
from engine.scene.model import Scene
from engine.scene.overrides import list_parameters
from engine.simulation.run import Model
from engine.system.curves import Outside
from engine.system.structure import state_coordinates

NUMBER, START_Q, START_QD, BANDWIDTH, TOLERANCE, STEP, MAX_STEPS = range(7)
"""What a parameter stands for (``fmu_setting_kind``)."""
HUGE = 1e300
"""Bound of what has none."""
NOT_OFFERED = re.compile(r"\.ramp\.(begin|duration)$")
"""Their changes would move the kinks the integrator stops at, which are laid down at export."""
TUNABLE = re.compile(
    r"\.friction\.|^friction\.|\.spring(\[\d\])?\.|\.damping(\[\d\])?$|\.effort|^forces\.|^gravity|\.stops(\[\d\])?\.(stiffness|damping)$"
)
"""Numbers that may change while the mechanism moves: nothing stored in the state depends on them. Masses, lengths, drives and stop
positions are fixed: a change would create momentum or open a loop."""
POSITIVE = re.compile(r"\.(mass|half_length|v_eps|radius|length)$")
NOT_NEGATIVE = re.compile(r"\.(mu\w*|damping(\[\d\])?|viscosity|thrust_radius|stiffness|half_\w+)$")
DIRECT = ("acceleration", "qdd", "reaction", "drive", "friction", "contact", "extra")
"""Keys of columns on which forces act at once; the others follow by integration."""
STEPS = ("state", "extra")


@dataclass(frozen=True)
class Variable:
    """One variable; its value reference is its place in the list. ``role``, ``index``: what a parameter stands for."""

    name: str
    unit: str
    description: str
    causality: str
    variability: str
    initial: str
    start: float | None
    minimum: float = -HUGE
    maximum: float = HUGE
    nominal: float = 1.0
    role: int = -1
    index: int = 0
    direct: bool = False

    @property
    def tunable(self) -> bool:
        """Whether it may change during the run."""
        return self.variability == "tunable"


def variables(model: Model, step: float, rtol: float) -> list[Variable]:
    """Outputs, inputs, parameters."""
    scales = _Scales(model)
    return [*(_output(c, scales) for c in model.columns), *_inputs(model), *_numbers(model), *_starts(model), *_solver(step, rtol)]


class _Scales:
    """Nominal sizes by unit, from the scene's length, rate and mass."""

    def __init__(self, model: Model):
        n, table = model.built.numbers, model.built.parameters
        mass = sum(v for p, v in zip(table.paths, table.values, strict=True) if re.fullmatch(r"bodies\.\w+\.mass", p)) or 1.0
        length, rate = n.length, n.rate
        force = mass * length * rate**2
        self.of = {
            "m": length, "m/s": length * rate, "m/s^2": length * rate**2, "rad/s": rate, "rad/s^2": rate**2, "N": force,
            "N*m": force * length, "J": force * length,
        }


def _output(c: Column, scales: _Scales) -> Variable:
    steps = c.key[0] in STEPS and (c.name.endswith(".state") or ".state[" in c.name or c.name.startswith("events."))
    low, high = -HUGE, HUGE
    if c.name.endswith((".normal_force", "events.count")):
        low = 0.0
    nominal = float(f"{scales.of.get(c.unit, 1.0):.2g}")
    return Variable(c.name, c.unit, c.description, "output", "discrete" if steps else "continuous", "calculated", None, low, high,
                    nominal, direct=c.key[0] in DIRECT)


def _inputs(model: Model) -> Iterator[Variable]:
    scene = model.built.scene
    for name, given in scene.inputs.items():
        text = given.description or f"external input {name}"
        yield Variable(name, given.unit, text, "input", "continuous", "", float(given.start))


def _numbers(model: Model) -> Iterator[Variable]:
    """Numbers of the scene that are run-time numbers of the equations with the same meaning."""
    scene, table = model.built.scene, model.built.parameters
    own = {p.path: p.value for p in list_parameters(scene)}
    for i, (path, value, unit) in enumerate(zip(table.paths, table.values, table.units, strict=True)):
        derived = re.fullmatch(r"bodies\.\w+\.mass|joints\.\w+\.friction\.\w+", path)
        if NOT_OFFERED.search(path) or (own.get(path) != value and not derived):
            continue
        low = 1e-30 if POSITIVE.search(path) and ".spring" not in path and not path.startswith("forces") else -HUGE
        low = 0.0 if NOT_NEGATIVE.search(path) and low < 0 else low
        variability = "tunable" if TUNABLE.search(path) else "fixed"
        yield Variable(path, unit, describe(path, scene), "parameter", variability, "exact", value, low, role=NUMBER, index=i)


def describe(path: str, scene: Scene) -> str:
    """A path in words: "coefficient of friction of joint ball"."""
    parts = path.split(".")
    words = {"mu": "coefficient of friction", "v_eps": "sliding speed at which friction saturates", "qd": "rate",
             "half_length": "half length of the bearing", "radius": "radius of the pin"}
    what = words.get(parts[-1], " ".join(parts[2:] or parts).replace("_", " "))
    owner = {"bodies": "body", "joints": "joint", "forces": "load"}.get(parts[0])
    if owner and parts[-1] == "mass":
        return f"mass of body {parts[1]} (its inertia goes with it where a shape gives it)"
    return f"{what} of {owner} {parts[1]}" if owner else what


def _starts(model: Model) -> Iterator[Variable]:
    """Start coordinates and rates of the tree joints."""
    n = model.built.numbers
    units = {"angle": "rad", "length": "m", "quaternion": "1"}
    for j in model.system.tree:
        for at, i in enumerate(state_coordinates(j)):
            unit = units[j.kind.coordinates[i]]
            yield Variable(f"joints.{j.name}.start.q[{i + 1}]", unit, f"start coordinate {i + 1} of joint {j.name}", "parameter",
                           "fixed", "exact", float(n.q[j.q0 + at]), role=START_Q, index=j.q0 + at)
        for at, k in enumerate(j.free):
            unit = "rad/s" if j.kind.turns(k) else "m/s"
            yield Variable(f"joints.{j.name}.start.qd[{k + 1}]", unit, f"start rate {k + 1} of joint {j.name}", "parameter",
                           "fixed", "exact", float(n.v[j.v0 + at]), role=START_QD, index=j.v0 + at)
    for i, given in enumerate(n.tables):
        if isinstance(given, Outside) and given.tracked:
            name = model.system.inputs[i]
            yield Variable(f"inputs.{name}.bandwidth", "rad/s", f"how fast the motion follows input {name} (critically damped)",
                           "parameter", "tunable", "exact", given.bandwidth, 1e-6, role=BANDWIDTH, index=i)


def _solver(step: float, rtol: float) -> list[Variable]:
    return [
        Variable("solver.tolerance", "1", "relative tolerance of the steps (unless the host gives one)", "parameter", "fixed",
                 "exact", rtol, 1e-14, 0.1, role=TOLERANCE),
        Variable("solver.step", "s", "internal step; 0: chosen by error control; > 0: fixed, for real time", "parameter", "fixed",
                 "exact", step, 0.0, role=STEP),
        Variable("solver.max_steps", "1", "internal steps allowed in one communication step; 0: any number", "parameter", "tunable",
                 "exact", 0.0, 0.0, 1e9, role=MAX_STEPS),
    ]
