"""The independent formulation that the engine is held against: absolute coordinates, one dense solve, contacts as numerical roots.

It uses numpy and scipy only, and shares nothing with the engine but the Scene classes. How it is used:

    state = forward(scene, q, qd, t)     poses and velocities from a spanning tree of joint coordinates
    result = solve(state)                accelerations, reactions, friction, contacts, drives, energy
    case = random_tree(seed)             random scenes with consistent states (case.scene, case.q, case.qd)

Coordinates and frames: ``bodies`` → ``kinematics``, ``joint_rows``, ``rotation``. Forces: ``loads``, ``signals``. Friction:
``laws`` → ``contacts`` → ``rubbing``, the same in plain numbers in ``sliding``. The solve: ``equations`` → ``friction`` →
``dynamics``. All ways to stick and slip are tried by ``deciding`` (any joint, loops too) and ``modes`` (chains of single freedoms);
``from_rows`` makes states of a run's rows. Scenes: ``random_parts`` → ``random_scenes``; ``transforms``, ``units`` and
``reversal`` say the same mechanism differently, ``values`` compares.
"""

from tests.reference.contact_and_friction.complement_equation_roots import NoRoot
from tests.reference.dynamics import Result, every_root, solve, solve_scene
from tests.reference.mechanics.body_properties import Part, joint_frames, parts
from tests.reference.mechanics.kinematics import State, closure, forward, measured

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
