"""The independent check: absolute coordinates, one dense solve, contacts as numerical roots. numpy and scipy only.

    state = forward(scene, q, qd, t)     poses and velocities from a spanning tree of joint coordinates
    result = solve(state)                accelerations, reactions, friction, contacts, drives, energy
    case = random_tree(seed)             random scenes with consistent states (case.scene, case.q, case.qd)
It shares nothing with the engine but the Scene classes.
"""

from .bodies import Part, joint_frames, parts
from .dynamics import Result, every_root, solve, solve_scene
from .friction import NoRoot
from .kinematics import State, closure, forward, measured

__all__ = [
    "NoRoot",
    "Part",
    "Result",
    "State",
    "closure",
    "every_root",
    "forward",
    "joint_frames",
    "measured",
    "parts",
    "solve",
    "solve_scene",
]
