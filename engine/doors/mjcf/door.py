"""A scene from MJCF: the mechanism alone; contacts, actuators and fluid are left out, and told."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from engine.doors.linkage import Linkage, listed
from engine.doors.mjcf.bodies import Bodies
from engine.doors.mjcf.closing import Closing
from engine.doors.mjcf.joints import RATIO, Freedom
from engine.doors.mjcf.model import Model
from engine.scene.model import Scene


def scene_of_mjcf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on what was left out).

    Hinges, slides, balls and free joints keep their names; a coordinate is zero where the file draws the mechanism. Armature is
    ``rotor_inertia``, frictionloss constant friction, connect and weld are joints that close loops. It starts in its first
    keyframe. stops: stiffness of limits, N/m and N m/rad; None leaves them out.
    SceneError with all that cannot be represented, each with file and line.
    """
    linkage, model, _ = linkage_of_mjcf(Path(file))
    scene = linkage.scene(stops)
    return scene, model.found.notes


def linkage_of_mjcf(file: Path) -> tuple[Linkage, Model, Bodies]:
    """The linkage, the file as it was read, and what was made of its bodies. SceneError for a file that cannot be read at all."""
    from engine.basics.problems import Problem, SceneError

    if not file.is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    model = Model(file)
    gravity, notes = _gravity(model), model.found.notes
    linkage = Linkage(model.name or file.stem, model.found, gravity)
    bodies = Bodies(model, linkage)
    if not linkage.links:
        model.found.add(model.root, "worldbody", "nothing in it moves")
        model.found.end()
    Closing(bodies)
    _actuators(model, bodies)
    _keyframe(model, bodies)
    bodies.weigh()
    linkage.limits = {f.name: f.limits for f in bodies.freedoms if f.limits is not None}
    notes.append("contacts are left out")
    return linkage, model, bodies


def _gravity(model: Model) -> tuple[float, float, float]:
    """The file's gravity; notes of options that change the motion and are left out."""
    g = np.array([0.0, 0.0, -9.81])
    for e in model.sections("option"):
        g = model.three(e, e.attributes, "gravity", " ".join(map(str, g)))
        fluid = [k for k in ("density", "viscosity", "wind") if any(float(x) for x in e.get(k, "0").split())]
        if fluid:
            model.found.notes.append(f"forces of the fluid around left out ({', '.join(fluid)})")
        for flag in e.all("flag"):
            if flag.get("gravity") == "disable":
                g = np.zeros(3)
    return float(g[0]), float(g[1]), float(g[2])


def _actuators(model: Model, bodies: Bodies) -> None:
    """Rotors and dampers that actuators bring; a note of what else they would do."""
    every = [e for section in model.sections("actuator") for e in section.children]
    by_name = {j.get("name"): f for j, f in zip(bodies.elements, bodies.freedoms, strict=True)}
    for e in every:
        said = model.attributes(e, "")
        f = by_name.get(said.get("joint") or said.get("jointinparent") or "")
        ratio = (model.found.numbers(e, RATIO, said.get(RATIO, "1"), range(1, 7)) or [1.0])[0]
        for key, name in (("armature", "rotor_inertia"), ("damping", "damping")):
            if key in said and f is not None and f.kind.nv == 1:
                value = (model.found.numbers(e, key, said[key], (1, 2, 3)) or [0.0])[0]
                tie = bodies.linkage.ties[f.name]
                tie.more[name] = tie.more.get(name, 0.0) + ratio * ratio * value
    if every:
        names = [e.get("name") or e.get("joint") or e.tag for e in every]
        model.found.notes.append(f"{len(every)} actuators left out (give joints an effort or a drive): {listed(names)}")


def _keyframe(model: Model, bodies: Bodies) -> None:
    """Start in the first keyframe that says where."""
    key = next((k for section in model.sections("keyframe") for k in section.all("key") if k.get("qpos")), None)
    if key is None:
        return
    total = sum(f.kind.nq for f in bodies.freedoms)
    q = model.found.numbers(key, "qpos", key.get("qpos"), (total,))
    at = 0
    for f in bodies.freedoms if q is not None else ():
        own = (q or [])[at : at + f.kind.nq]
        at += len(own)
        _start(bodies, f, own)
    model.found.notes.append(f"starts in keyframe {key.get('name') or 1}")


def _start(bodies: Bodies, f: Freedom, own: list[float]) -> None:
    tie = bodies.linkage.ties[f.name]
    if len(own) == 1:
        if own[0] != f.ref:
            tie.more["start"] = {"q": own[0] - f.ref}
    else:
        tie.more["start"] = {"q": own}
