"""Importer of MJCF: builds the scene of the mechanism. Notes list omitted contacts, actuators and fluid forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trunnion.importers.intermediate_linkage import Linkage, listed
from trunnion.importers.mjcf.bodies import Bodies
from trunnion.importers.mjcf.equalities_and_tendons import Closing
from trunnion.importers.mjcf.includes_and_defaults import Model
from trunnion.importers.mjcf.joints import RATIO
from trunnion.importers.xml_reader import existing
from trunnion.scene.data_classes.scene import Scene


def scene_of_mjcf(file: str | Path, stops: float | None = None) -> tuple[Scene, list[str]]:
    """(scene, notes on omissions).

    Joints keep their names; coordinates are zero in the file's initial pose. armature becomes ``rotor_inertia``, frictionloss
    becomes constant friction, and connect and weld become joints that close loops. The scene starts in the first keyframe.
    ``stops`` is the stiffness of end stops at joint limits, N/m and N m/rad; None omits the limits. SceneError lists everything
    that a scene cannot represent, with file and line."""
    linkage, model, _ = linkage_of_mjcf(Path(file))
    return linkage.scene(stops), model.found.notes


def linkage_of_mjcf(file: Path) -> tuple[Linkage, Model, Bodies]:
    """(linkage, model, bodies) of an MJCF file. SceneError if the file cannot be read or nothing in it moves."""
    model = Model(existing(file))
    gravity, notes = _gravity(model), model.found.notes
    linkage = Linkage(model.name or file.stem, model.found, gravity)
    bodies = Bodies(model, linkage)
    if not linkage.links:
        model.found.add(model.root, "worldbody", "nothing in it moves")
        model.found.end()
    Closing(bodies)
    _actuators(model, bodies)
    _keyframe(model, bodies)
    bodies.complete_masses()
    linkage.limits = {f.name: f.limits for f in bodies.freedoms if f.limits is not None}
    notes.append("contacts are left out")
    return linkage, model, bodies


def _gravity(model: Model) -> tuple[float, float, float]:
    """The file's gravity, m/s²; adds notes on omitted options that change the motion."""
    g = np.array([0.0, 0.0, -9.81])
    for e in model.sections("option"):
        g = model.three(e, e.attributes, "gravity", " ".join(map(str, g)))
        counts = {"density": (1,), "viscosity": (1,), "wind": (3,)}
        given = {k: model.found.numbers(e, k, e.get(k, ""), n) for k, n in counts.items() if e.get(k, "")}
        fluid = [k for k, values in given.items() if any(values or ())]
        if fluid:
            model.found.notes.append(f"fluid forces left out ({', '.join(fluid)})")
        for flag in e.all("flag"):
            if flag.get("gravity") == "disable":
                g = np.zeros(3)
    return float(g[0]), float(g[1]), float(g[2])


def _actuators(model: Model, bodies: Bodies) -> None:
    """Add rotor inertias and damping of actuators to their joints, and a note that the actuators are omitted."""
    every = model.entries("actuator")
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
    """Set the start values to the first keyframe with coordinates, if there is one."""
    key = next((k for k in model.entries("keyframe") if k.tag == "key" and k.get("qpos")), None)
    if key is None:
        return
    total = sum(f.kind.nq for f in bodies.freedoms)
    q = model.found.numbers(key, "qpos", key.get("qpos"), (total,))
    at = 0
    for f in bodies.freedoms if q is not None else ():
        own = (q or [])[at : at + f.kind.nq]
        at += len(own)
        if len(own) > 1 or own[0] != f.ref:
            bodies.linkage.ties[f.name].more["start"] = {"q": own if len(own) > 1 else own[0] - f.ref}
    model.found.notes.append(f"starts in keyframe {key.get('name') or 1}")
