"""The starter scene: a pendulum on a frictional hinge; comments in the file show the other features of the format."""

from __future__ import annotations

import os
import re
from pathlib import Path

from trunnion.basics.problems import Problem, SceneError
from trunnion.elements.friction import DEFAULT, twin_of
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY

SCENE = """\
# A scene describes a mechanism: bodies, joints between them, loads.
# Numbers are SI (m, kg, s, rad, N); text with a unit is converted: "30 mm", "45 deg", "60 rpm", "2 kN/m".
# Change a number, then:   trunnion check {name}      trunnion simulate {name} --plot {name}.png

schema: 1
name: {name}
title: A pendulum on a hinge with friction
# author: Ada L.                  # also version: "1.0" and date: 2026-11-23; FMUs contain all three

# parameters: {{reach: 1 m}}          # then box: ["{{reach}}", 0.1, 0.1], center: ["{{reach/2}}", 0, 0]; --set parameters.reach=2

gravity: [0, 0, -9.81]

bodies:
  pendulum:
    box: [1 m, 100 mm, 100 mm]      # edges along x, y, z of the body's frame; also: cylinder, sphere
    density: 7800                   # or mass: 78; without a shape: mass and inertia: [xx, yy, zz]
    center: [0.5, 0, 0]             # mass centre (and middle of the shape) in the body's frame
    points: {{tip: [1, 0, 0]}}        # named points: places for joints and springs; pendulum.tip.position[1]

joints:
  hinge:
    type: revolute                  # {types}
    inboard: ground                 # the part the motion is measured from: "body" or "body.point"
    outboard: pendulum              # the part that moves; the hinge point is here the origin of its frame
    axis: y                         # x, y, z, -x, -y, -z or three numbers
    friction: {{mu: 0.3, radius: 20 mm, half_length: 50 mm}}   # leave it out and the joint is ideal
    #   for a brake write only torque: {{input: motor}}; for a freewheel write torque: 0.1, back_torque: 500.
    #   mu may depend on time (a table), on speed: {{speed: [0, 10 mm/s], value: [0.3, 0.2]}},
    #   or on an input: {{input: oil, curve: {{at: [20, 80], value: [0.3, 0.2]}}}}
    # wear: {{k: 1e-6 mm^3/(N*m)}}    # for trunnion wear
    # pin: outboard                 # the inner part; for a sleeve on a shaft also ends: outboard (the shorter part)
    start: {{q: 0 deg, qd: 0}}        # angle and rate at t = 0: horizontal, at rest
    # damping: 0.1                  # N*m*s/rad, independent of the contact force
    # rotor_inertia: 0.01           # kg*m^2 of a motor's rotor, times the square of its gear ratio
    # spring: {{stiffness: 5 N*m/rad, rest: 90 deg}}
    # end_stops: {{stiffness: 1e4, upper: 120 deg}}
    # latch: {{at: 90 deg, stiffness: 1e4, release: {{input: motor}}}}   # also: holds: 300 N*m, pitch: 15 deg (teeth), down: true
    # effort: {{input: motor}}        # or a number, or {{harmonic: {{amplitude: 5, frequency: 1 Hz}}}}
    # motor: {{stall: 5 N*m, no_load: 300 rpm, signal: 1}}   # torque falls with speed; the signal may be an input
    # drive: {{constant: {{rate: 30 rpm}}}}   # prescribes the motion (start is then unused); or move: from rest to rest

# A second link, hung on the first; its joint names points of both bodies:
#   bodies:
#     link: {{cylinder: {{radius: 20 mm, length: 0.4, axis: x}}, mass: 2, center: [0.2, 0, 0]}}
#   joints:
#     elbow: {{type: spherical, inboard: pendulum.tip, outboard: link, friction: {{mu: 0.2, radius: 15 mm}}}}

# Keys from other files, and parts that are repeated (copies: mirror, rotate, line). Bodies may have position and orientation.
# include: common.yaml
# assemblies:
#   arm: {{use: arm.yaml, with: {{reach: 0.5 m}}, copies: {{mirror: y}}}}

# Wheels that roll on each other; each turns on a joint of its own:
#   mesh: {{type: gear, inboard: pinion, outboard: wheel, axis: y, teeth: [20, 60], module: 2 mm}}   # internal: true: teeth inside
#   belt: {{type: belt, inboard: motor, outboard: drum, axis: y, radii: [40 mm, 100 mm]}}            # or crossed: true
# A cam given by a table, and its follower; each moves on a joint of its own. Without roller: a point follows the cam:
#   lift: {{type: cam, inboard: shaft, outboard: rocker.roller, axis: y, roller: 8 mm,            # type: flat_cam for a flat face
#          profile: {{angle: [0 deg, 120 deg, 240 deg, 360 deg], radius: [30 mm, 34 mm, 34 mm, 30 mm]}}}}
# A pin in a slot. The curve lies in the plane of e2 and e3 of the inboard frame; two points give a straight slot.
# closed: true connects the last point to the first:
#   slot: {{type: point_on_curve, inboard: link, outboard: crank.pin, axis: y, friction: {{mu: 0.1}},
#          curve: {{points: [[0, 0], [40 mm, 5 mm], [80 mm, 0]]}}, end_stops: {{stiffness: 1 MN/m}}}}   # at the ends of the slot

# A joint whose coordinate is a linear function of that of another joint:
#   finger: {{type: revolute, inboard: palm, outboard: tip, axis: y, mimic: {{joint: thumb, ratio: -1, offset: 0 deg}}}}

# forces:
#   push: {{type: force, on: pendulum.tip, force: [0, 0, 10], frame: world}}
#   rubber: {{type: spring_damper, between: [pendulum.tip, ground], stiffness: 200, damping: 2, length: 0.5}}
#   bush: {{type: bushing, between: [ground, pendulum.tip], stiffness: 2 kN/m, turning_stiffness: [8, 30, 30]}}   # also damping

# inputs:
#   motor: {{start: 0, unit: N*m, description: Torque of the motor}}

# friction: {{law: {smooth}, v_eps: 0.1 mm/s}}    # default: {law}; also {others}. A joint may have its own law

# outputs: ["pendulum.*", "hinge.*"]                # patterns of the requested columns; default: all

simulation:
  until: 5 s
  every: 10 ms
  # realtime: {{step: 1 ms}}      # fixed steps with bounded work; further keys: events, evaluations, iterations
"""

README = """\
# {name}

A pendulum on a hinge with friction, as a starting point. Edit `scene.yaml`; its comments explain every key.

    trunnion check {name}
    trunnion simulate {name} --plot {name}.png
    trunnion simulate {name} --set joints.hinge.friction.mu=0.1 -o {name}.csv

What to look at: `hinge.q[1]` (the angle), `hinge.friction.torque[1]`, and where pin and bearing touch:
`hinge.contact[1].angle` and `hinge.contact[1].normal_force`.
"""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


def starter_text(name: str) -> str:
    """The commented scene as YAML text."""
    smooth = twin_of(DEFAULT)
    others = ", ".join(law for law in LAWS if law not in (DEFAULT, smooth))
    return SCENE.format(name=name, law=DEFAULT, smooth=smooth, others=others, types=", ".join(REGISTRY))


def write_starter(name: str, directory: str | os.PathLike[str] = ".") -> Path:
    """Write NAME/scene.yaml and NAME/README.md into a directory; the result is the new folder. SceneError when the folder
    exists or cannot be written."""
    folder = Path(directory) / name
    if not _NAME.fullmatch(name):
        raise SceneError([Problem(name[:60], "cannot be the name of a scene", "a letter, then letters, digits and _")])
    if folder.exists():
        raise SceneError([Problem(name, "exists already", "choose another name, or remove it", str(folder))])
    try:
        folder.mkdir(parents=True)
        (folder / "scene.yaml").write_text(starter_text(name), encoding="utf-8")
        (folder / "README.md").write_text(README.format(name=name), encoding="utf-8")
    except OSError as e:
        raise SceneError([Problem(name, f"cannot write: {e.strerror or e}", "", str(folder))]) from e
    return folder
