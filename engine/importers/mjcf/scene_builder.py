"""Importer of MJCF: builds the scene of the mechanism. Notes list omitted contacts, actuators and fluid forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trunnion.importers.intermediate_linkage import Linkage, floats
from trunnion.importers.mjcf.bodies import BodyConverter
from trunnion.importers.mjcf.equalities_and_tendons import EqualitiesAndTendons
from trunnion.importers.mjcf.includes_and_defaults import Model
from trunnion.importers.mjcf.joints import RATIO, MjcfJoint, add_damping
from trunnion.importers.pose_matrices import inverse, of_quaternion, pose, to_quaternion
from trunnion.importers.xml_reader import Element, existing
from trunnion.scene.data_classes.scene import Scene


def scene_of_mjcf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions).

    Joints keep their names. Coordinates are zero in the file's initial pose. The attribute ``armature`` becomes ``rotor_inertia``,
    and ``frictionloss`` becomes constant friction. The elements ``connect`` and ``weld`` become joints that close loops. The scene
    starts in the first keyframe. Content that <flag> disables is omitted. ``stops`` is the stiffness of end stops at joint limits,
    N/m and N m/rad; None omits the limits. SceneError lists everything that a scene cannot represent, with file and line."""
    linkage, model, _ = linkage_of_mjcf(Path(file))
    return linkage.scene(stops), model.found.notes


def linkage_of_mjcf(file: Path) -> tuple[Linkage, Model, BodyConverter]:
    """(linkage, model, bodies) of an MJCF file. SceneError if the file cannot be read, or if the mechanism cannot move."""
    model = Model(existing(file))
    linkage = Linkage(model.name or file.stem, model.found, _gravity(model))
    bodies = BodyConverter(model, linkage)
    if not linkage.links:
        model.found.add(model.root, "worldbody", "nothing in it moves")
        model.found.end()
    EqualitiesAndTendons(bodies)
    _actuators(model, bodies)
    _keyframe(model, bodies)
    bodies.complete_masses()
    linkage.limits = {f.name: f.limits for f in bodies.freedoms if f.limits is not None}
    return linkage, model, bodies


def _gravity(model: Model) -> tuple[float, float, float]:
    """The file's gravity, m/s²."""
    g = np.array([0.0, 0.0, -9.81])
    for e in model.sections("option"):
        g = model.three(e, e.attributes, "gravity", " ".join(map(str, g)))
    if "gravity" in model.disabled:
        g = np.zeros(3)
    return float(g[0]), float(g[1]), float(g[2])


def _actuators(model: Model, bodies: BodyConverter) -> None:
    """Add rotor inertias and damping of actuators to their joints."""
    by_name = {j.get("name"): f for j, f in zip(bodies.elements, bodies.freedoms, strict=True) if j.get("name")}
    for e in model.entries("actuator"):
        f = by_name.get(e.get("joint") or e.get("jointinparent"))
        if f is None or f.kind.nv != 1:
            continue
        said = model.attributes(e, "")
        ratio = (model.found.numbers(e, RATIO, said.get(RATIO, "1"), range(1, 7)) or [1.0])[0]
        more = bodies.linkage.joints[f.name].more
        add_damping(model, e, said, 1, more, ratio * ratio)
        if "armature" in said:
            rotor = model.found.number(e, "armature", said["armature"], 0.0)
            more["rotor_inertia"] = more.get("rotor_inertia", 0.0) + ratio * ratio * rotor


def _keyframe(model: Model, bodies: BodyConverter) -> None:
    """Set the start values to the first keyframe with coordinates or rates, if the file has such a keyframe."""
    key = next((k for k in model.entries("keyframe") if k.tag == "key" and (k.get("qpos") or k.get("qvel"))), None)
    if key is None:
        return
    q, qd = _key_numbers(model, key, bodies.freedoms, "qpos"), _key_numbers(model, key, bodies.freedoms, "qvel")
    for k, f in enumerate(bodies.freedoms):
        more = bodies.linkage.joints[f.name].more
        at = q[k] if q else f.start if f.start else [f.ref] if f.kind.nv == 1 else [1.0, 0.0, 0.0, 0.0]
        rates = qd[k] if qd else [0.0] * f.kind.nv
        if f.kind.nv > 1:
            if q and f.frame is None:
                what = "starts with its principal axes of inertia in a pose of the keyframe, and MuJoCo chooses these axes"
                model.found.add(key, f.name, what, 'give <inertial> with diaginertia, or align="false"')
            at, rates = _body_start(f, at, rates)
            more["start"] = {"q": at}
        elif at[0] != f.ref or "mimic" in more:
            more["start"] = {"q": at[0] - f.ref}
        if any(rates):
            more["start"] = more.get("start", {}) | {"qd": rates if f.kind.nv > 1 else rates[0]}
    model.found.notes.append(f"starts in keyframe {key.get('name') or 1}")


def _key_numbers(model: Model, key: Element, freedoms: list[MjcfJoint], name: str) -> list[list[float]] | None:
    """The coordinates (qpos) or rates (qvel) of each joint in a keyframe; None if the keyframe does not give these numbers."""
    counts = [f.kind.nq if name == "qpos" else f.kind.nv for f in freedoms]
    given = model.found.numbers(key, name, key.get(name), (sum(counts),)) if key.get(name) else None
    ends = np.cumsum(counts)
    return None if given is None else [given[e - n : e] for e, n in zip(ends, counts, strict=True)]


def _body_start(f: MjcfJoint, at: list[float], rates: list[float]) -> tuple[list[float], list[float]]:
    """(coordinates, rates) of a ball or a free joint in the scene. MuJoCo gives angular velocities in the axes of the moving body.
    Scenes give angular velocities in the axes of the inboard part. The coordinates of an aligned free joint place the frame
    ``f.frame``."""
    moved = of_quaternion(at[-4:])
    spin = moved @ rates[-3:]
    if len(rates) == 3:
        return at, floats(spin)
    frame = np.eye(4) if f.frame is None else f.frame
    body = pose(at[:3], moved) @ inverse(frame)
    speed = np.array(rates[:3]) + np.cross(spin, body[:3, 3] - at[:3])
    turned = at[-4:] if np.array_equal(frame[:3, :3], np.eye(3)) else to_quaternion(body[:3, :3])
    return [*floats(body[:3, 3]), *turned], [*floats(speed), *floats(spin)]
