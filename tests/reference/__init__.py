"""The independent formulation with which the engine is compared: absolute coordinates, one dense solve, contacts as numerical
roots.

The formulation uses only numpy and scipy, and shares only the Scene classes with the engine. Use of the package:

    state = forward(scene, q, qd, t)     poses and velocities from a spanning tree of joint coordinates
    result = solve(state)                accelerations, reactions, friction, contacts, drives, energy
    case = random_tree(seed)             random scenes with consistent states (case.scene, case.q, case.qd)

``mechanics``: coordinates and frames (``bodies_and_joint_frames`` → ``kinematics``, ``joint_constraints``, ``rotation``), forces
(``loads_and_devices``, ``time_signals``) and the equations of motion (``newton_euler_equations``). ``contact_and_friction``: laws
and contacts (``friction_laws`` → ``contact_roots`` → ``joint_friction``, with ``sliding_closed_forms``), the roots of the
complement equations, all ways to stick and slip (``mode_enumeration`` for any joint and loop, ``mode_enumeration_chains``), and
contacts as stiff springs. ``dynamics`` solves a state; ``states_from_columns`` makes states of a run's rows. ``compliant`` runs any
scene as a compliant mechanism and extrapolates to the rigid one. ``scenes``: ``random_components`` → ``random_scenes``;
``random_device_scenes`` draws scenes in which devices interact, by family (``random_wheel_scenes`` and others);
``frame_changes``, ``unit_changes`` and ``joint_side_swap`` describe a mechanism in other ways; ``result_table`` compares results.
"""

from tests.reference.contact_and_friction.complement_equation_roots import NoRoot
from tests.reference.dynamics import Result, every_root, solve, solve_scene
from tests.reference.mechanics.bodies_and_joint_frames import Part, joint_frames, parts
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
