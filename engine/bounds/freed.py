"""A scene made ready for statics: at rest, dry, drives replaced by efforts that nobody knows, loads by their values at the start.

So loads and efforts of drives are numbers of one kernel, which is asked with one of them changed at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine.joints import REGISTRY
from engine.kernel.columns import columns
from engine.parts.signals import value
from engine.scene.model import Applied, Bushing, Drive, Force, Friction, FromInput, Joint, Scene, Signal, SpringDamper, Start
from engine.scene.walk import VARYING, each
from engine.simulation.motions import external
from engine.system.acting import Signal as Follows
from engine.system.build import Built


@dataclass(frozen=True)
class Load:
    """A load whose amount may be asked for. name: its path in the scene; unit; now: its amount at the start (drives: not known,
    NaN); paths: the parameters it acts on and how much of it each of them is; drive: (joint, freedom) where it is a drive's."""

    name: str
    unit: str
    now: float
    paths: tuple[tuple[str, float], ...]
    drive: tuple[str, int] | None = None


def freed(scene: Scene, built: Built, poses: dict[str, tuple[float, ...]]) -> tuple[Scene, tuple[Load, ...]]:
    """The scene with every drive replaced by an effort and every load by its value at the start, and its loads: drives first.
    built: the scene as it is; poses: coordinates of joints that have drives, where they start."""
    known = _values(built)
    joints, loads, drives = dict(scene.joints), [], []
    uses: dict[str, list[tuple[str, float]]] = {name: [] for name in scene.inputs}
    for name, j in scene.joints.items():
        made, own, found = _joint(name, j, known, uses)
        joints[name] = replace(made, start=Start(q=poses[name]), cut=False) if own else made
        drives += own
        loads += found
    forces: dict[str, Any] = {}
    for name, f in scene.forces.items():
        forces[name], found = _force(name, f, known, uses)
        loads += found
    inputs = [Load(f"inputs.{n}", scene.inputs[n].unit, float(scene.inputs[n].start), tuple(u)) for n, u in uses.items() if u]
    every = (*drives, *loads, *inputs)
    tunable = (*scene.tunable, *(path for load in every for path, _ in load.paths))
    return replace(scene, joints=joints, forces=forces, inputs={}, tunable=tunable), every


def _joint(
    name: str, j: Joint, known: dict[str, float], uses: dict[str, list[tuple[str, float]]]
) -> tuple[Joint, list[Load], list[Load]]:
    """The joint without drives, the loads that stand for them, and those of its efforts."""
    nv, turns = REGISTRY[j.type].nv, REGISTRY[j.type].turns
    given = each(j.effort, nv)
    moved = each(j.drive, nv)
    efforts: list[float | None] = [None] * nv
    drives: list[Load] = []
    loads: list[Load] = []
    for k in range(nv):
        path, unit = f"joints.{name}.effort" + ("" if nv == 1 else f"[{k + 1}]"), "N*m" if turns(k) else "N"
        if isinstance(moved[k], Drive):
            efforts[k] = known.get(f"{name}.{k}", 0.0)
            label = f"joints.{name}.drive" + ("" if nv == 1 else f"[{k + 1}]")
            drives.append(Load(label, unit, float("nan"), ((path, 1.0),), (name, k)))
        elif given[k] is not None:
            efforts[k] = known[f"{name}.{k}"]
            effort = given[k]
            if isinstance(effort, FromInput) and effort.curve is None:
                uses[effort.input].append((path, 1.0))
            else:
                loads.append(Load(path, unit, known[f"{name}.{k}"], ((path, 1.0),)))
    for device, signal in (("motor", "signal"), ("latch", "release")):  # as it is at the start
        own = getattr(j, device)
        still = [d and replace(d, **{signal: known[f"{name}.{device}.{k}"]}) for k, d in enumerate(each(own, nv))]
        put: dict[str, Any] = {device: tuple(still) if isinstance(own, tuple) else still[0]}
        j = replace(j, **put) if own is not None else j
    j = replace(j, friction=_rubbing(name, j.friction, known)) if j.friction is not None else j
    if all(e is None for e in efforts):
        return replace(j, drive=None), drives, loads
    return replace(j, drive=None, effort=efforts[0] if nv == 1 else tuple(efforts)), drives, loads


def _rubbing(name: str, f: Friction, known: dict[str, float]) -> Friction:
    """Friction with plain numbers instead of those that follow time or an input."""
    out: dict[str, Any] = {}
    for n in VARYING:
        given = getattr(f, n)
        several = given if isinstance(given, tuple) else (given,)
        now = tuple(
            max(known[f"{name}.friction.{n}" + (f"[{k + 1}]" if isinstance(given, tuple) else "")], 0.0)
            if isinstance(g, FromInput | Signal) else g for k, g in enumerate(several)
        )  # fmt: skip
        if now != several:
            out[n] = now if isinstance(given, tuple) else now[0]
    if {"mu", "mu_static"} & set(out) and f.mu_static is not None:
        both = {n: out.get(n, getattr(f, n)) for n in ("mu", "mu_static")}
        out["mu_static"] = max(both.values())
    return replace(f, **out)


def _force(name: str, f: Applied, known: dict[str, float], uses: dict[str, list[tuple[str, float]]]) -> tuple[Applied, list[Load]]:
    """The force with plain numbers, and the load it is: its amount along the direction it has at the start."""
    if isinstance(f, SpringDamper | Bushing):
        return f, []
    given, field = (f.force, "force") if isinstance(f, Force) else (f.torque, "torque")
    now = [known[f"forces.{name}.{k}"] for k in range(3)]
    own = [0.0 if isinstance(g, FromInput) and g.curve is None else v for g, v in zip(given, now, strict=True)]
    for k, g in enumerate(given):
        if isinstance(g, FromInput) and g.curve is None:
            uses[g.input].append((f"forces.{name}.{field}[{k + 1}]", 1.0))
    size = float(np.linalg.norm(own))
    paths = tuple((f"forces.{name}.{field}[{k + 1}]", v / size) for k, v in enumerate(own) if v)
    load = [Load(f"forces.{name}", "N" if field == "force" else "N*m", size, paths)] if paths else []
    vector = (now[0], now[1], now[2])
    return replace(f, force=vector) if isinstance(f, Force) else replace(f, torque=vector), load


def _values(built: Built) -> dict[str, float]:
    """Every load of the scene at t = 0: "joint.freedom" and "forces.name.component" → N or N m."""
    signals = {f"{j.name}.{k}": d.effort for j in built.system.joints for k, d in enumerate(j.devices) if d.effort is not None}
    signals |= {f"{j.name}.motor.{k}": d.motor.signal for j in built.system.joints for k, d in enumerate(j.devices) if d.motor}
    signals |= {f"{j.name}.latch.{k}": d.latch.release for j in built.system.joints for k, d in enumerate(j.devices) if d.latch}
    loads = {f"forces.{load.name}.{k}": s for load in built.system.loads for k, s in enumerate(load.vector)}
    p, x = np.array(built.parameters.values, float), external(built, 0.0)
    rubs: dict[str, Follows | None] = {
        f"{j.name}.friction.{n}": s for j in built.system.frictional if j.friction for n, s in j.friction.numbers
        if isinstance(s, Follows)
    }  # fmt: skip
    return {name: 0.0 if s is None else value(s, built.system.external, p, x) for name, s in (signals | loads | rubs).items()}


def pose_columns(built: Built) -> list[str]:
    """Names of the columns that are coordinates of joints with drives."""
    driven = {j.name for j in built.system.joints if j.driven}
    return [c.name for c in columns(built.system) if c.key[0] == "q" and c.key[1] in driven]
