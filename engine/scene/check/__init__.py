"""Mistakes in a scene that need more than one field to see. Every module yields findings on one topic; a new topic is
a new module and one line in TOPICS."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from engine.basics.problems import Problem
from engine.scene.check import (
    bodies,
    cams,
    curves,
    devices,
    following,
    frames,
    friction,
    loads,
    mimics,
    names,
    numbers,
    poses,
    run,
    starts,
    tied,
    topology,
    wheels,
)
from engine.scene.finding import Finding, error_of
from engine.scene.model import Scene

TOPICS: tuple[Callable[[Scene], Iterator[Finding]], ...] = (
    names.check,
    bodies.check,
    topology.check,
    frames.check,
    poses.check,
    wheels.check,
    cams.check,
    curves.check,
    mimics.check,
    tied.check,
    friction.check,
    starts.check,
    devices.check,
    following.check,
    loads.check,
    numbers.check,
    run.check,
)


def findings(scene: Scene) -> list[Finding]:
    """All mistakes of meaning, topic by topic, each once."""
    return list(dict.fromkeys(f for topic in TOPICS for f in topic(scene)))


def problems(scene: Scene) -> list[Problem]:
    """All mistakes of meaning as an error lists them: the first ones, and how many more there are. A scene made in Python has
    no lines."""
    return list(error_of(findings(scene), {}).problems)


def checked(scene: Scene) -> Scene:
    """The scene itself; SceneError when it has problems."""
    found = findings(scene)
    if found:
        raise error_of(found, {})
    return scene
