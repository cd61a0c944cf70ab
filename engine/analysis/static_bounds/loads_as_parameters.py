"""Loads and drive efforts as parameters of one kernel. In the scene for statics, unknown efforts replace the drives, and each load
is constant with its amount at the start."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY
from trunnion.kernel.interface.output_columns import columns
from trunnion.parts.layout.signal_evaluation import value
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.loads_and_signals import VARYING, each
from trunnion.simulation.execution.drive_motion import external
from trunnion.system.construction.system_builder import Built
from trunnion.system.structure.device_load_signal_data import Signal as Follows


@dataclass(frozen=True)
class Load:
    """A load or drive effort as a parameter.

    Attributes:
        name: path in the scene.
        unit: unit of its amount.
        now: amount at the start; NaN for drives.
        paths: (path, share) of each parameter that the load changes; the parameter changes by share times the amount.
        drive: (joint, freedom) of a drive; None for other loads.
    """

    name: str
    unit: str
    now: float
    paths: tuple[tuple[str, float], ...]
    drive: tuple[str, int] | None = None


def release_drives(scene: sm.Scene, built: Built, poses: dict[str, tuple[float, ...]]) -> tuple[sm.Scene, tuple[Load, ...]]:
    """(the scene with an effort in place of every drive and a constant amount in place of every load; the loads of this scene,
    those in place of drives first).

    built: the given scene after ``build``; poses: {joint with drives: start coordinates, rad or m}.
    """
    known = _start_amounts(built)
    joints, loads, drives = dict(scene.joints), [], []
    uses: dict[str, list[tuple[str, float]]] = {name: [] for name in scene.inputs}
    for name, j in scene.joints.items():
        made, own, found = _joint(name, j, known, uses)
        joints[name] = replace(made, start=sm.Start(q=poses[name]), cut=False) if own else made
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
    name: str, j: sm.Joint, known: dict[str, float], uses: dict[str, list[tuple[str, float]]]
) -> tuple[sm.Joint, list[Load], list[Load]]:
    """(the joint without drives, the loads that replace its drives, the loads that are its efforts)."""
    nv, turns = REGISTRY[j.type].nv, REGISTRY[j.type].turns
    given = each(j.effort, nv)
    moved = each(j.drive, nv)
    efforts: list[float | None] = [None] * nv
    drives: list[Load] = []
    loads: list[Load] = []
    for k in range(nv):
        path, unit = f"joints.{name}.effort" + ("" if nv == 1 else f"[{k + 1}]"), "N*m" if turns(k) else "N"
        if isinstance(moved[k], sm.Drive):
            efforts[k] = known.get(f"{name}.{k}", 0.0)
            label = f"joints.{name}.drive" + ("" if nv == 1 else f"[{k + 1}]")
            drives.append(Load(label, unit, float("nan"), ((path, 1.0),), (name, k)))
        elif given[k] is not None:
            efforts[k] = known[f"{name}.{k}"]
            effort = given[k]
            if isinstance(effort, sm.FromInput) and effort.curve is None:
                uses[effort.input].append((path, 1.0))
            else:
                loads.append(Load(path, unit, known[f"{name}.{k}"], ((path, 1.0),)))
    for device, signal in (("motor", "signal"), ("latch", "release")):  # replace these signals by their values at the start
        own = getattr(j, device)
        if own is None:
            continue
        still = [d and replace(d, **{signal: known[f"{name}.{device}.{k}"]}) for k, d in enumerate(each(own, nv))]
        put: dict[str, Any] = {device: tuple(still) if isinstance(own, tuple) else still[0]}
        j = replace(j, **put)
    j = replace(j, friction=_fixed_friction(name, j.friction, known)) if j.friction is not None else j
    if all(e is None for e in efforts):
        return replace(j, drive=None), drives, loads
    return replace(j, drive=None, effort=efforts[0] if nv == 1 else tuple(efforts)), drives, loads


def _fixed_friction(name: str, f: sm.Friction, known: dict[str, float]) -> sm.Friction:
    """Friction in which each signal is replaced by its value at the start."""
    out: dict[str, Any] = {}
    for n in VARYING:
        given = getattr(f, n)
        several = given if isinstance(given, tuple) else (given,)
        now = tuple(
            max(known[f"{name}.friction.{n}" + (f"[{k + 1}]" if isinstance(given, tuple) else "")], 0.0)
            if isinstance(g, sm.FromInput | sm.Signal) else g for k, g in enumerate(several)
        )  # fmt: skip
        if now != several:
            out[n] = now if isinstance(given, tuple) else now[0]
    if {"mu", "mu_static"} & set(out) and f.mu_static is not None:
        both = {n: out.get(n, getattr(f, n)) for n in ("mu", "mu_static")}
        out["mu_static"] = max(both.values())
    return replace(f, **out)


def _force(
    name: str, f: sm.Applied, known: dict[str, float], uses: dict[str, list[tuple[str, float]]]
) -> tuple[sm.Applied, list[Load]]:  # fmt: skip
    """(the force with constant components, list with one load: the amount of the force along its direction at the start)."""
    if not isinstance(f, sm.Force | sm.Torque):
        return f, []
    given, field = (f.force, "force") if isinstance(f, sm.Force) else (f.torque, "torque")
    now = [known[f"forces.{name}.{k}"] for k in range(3)]
    own = [0.0 if isinstance(g, sm.FromInput) and g.curve is None else v for g, v in zip(given, now, strict=True)]
    for k, g in enumerate(given):
        if isinstance(g, sm.FromInput) and g.curve is None:
            uses[g.input].append((f"forces.{name}.{field}[{k + 1}]", 1.0))
    size = float(np.linalg.norm(own))
    paths = tuple((f"forces.{name}.{field}[{k + 1}]", v / size) for k, v in enumerate(own) if v)
    load = [Load(f"forces.{name}", "N" if field == "force" else "N*m", size, paths)] if paths else []
    vector = (now[0], now[1], now[2])
    return replace(f, force=vector) if isinstance(f, sm.Force) else replace(f, torque=vector), load


def _start_amounts(built: Built) -> dict[str, float]:
    """Values at t = 0 of all signals of loads, motors, latches and friction, by keys such as "joint.freedom" and
    "forces.name.component". Efforts and forces are in N or N m."""
    signals = {f"{j.name}.{k}": d.effort for j in built.system.joints for k, d in enumerate(j.devices) if d.effort is not None}
    signals |= {f"{j.name}.motor.{k}": d.motor.signal for j in built.system.joints for k, d in enumerate(j.devices) if d.motor}
    signals |= {f"{j.name}.latch.{k}": d.latch.release for j in built.system.joints for k, d in enumerate(j.devices) if d.latch}
    loads = {f"forces.{load.name}.{k}": s for load in built.system.loads if load.kind in ("force", "torque")
             for k, s in enumerate(load.vector)}  # fmt: skip
    p, x = np.array(built.parameters.values, float), external(built, 0.0)
    rubs: dict[str, Follows | None] = {
        f"{j.name}.friction.{n}": s for j in built.system.frictional if j.friction for n, s in j.friction.numbers
        if isinstance(s, Follows)
    }  # fmt: skip
    return {name: 0.0 if s is None else value(s, built.system.external, p, x) for name, s in (signals | loads | rubs).items()}


def pose_columns(built: Built) -> list[str]:
    """Names of the coordinate columns of joints with drives."""
    driven = {j.name for j in built.system.joints if j.driven}
    return [c.name for c in columns(built.system) if c.key[0] == "q" and c.key[1] in driven]
