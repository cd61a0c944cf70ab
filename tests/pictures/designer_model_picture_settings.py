"""Settings of the pictures of the designs, the mechanisms of ``models/designer``."""

from __future__ import annotations

from tests.pictures.picture_settings import Choice, Plot

DESIGNS: dict[str, Choice] = {
    "door_closer": Choice(
        1.5,
        "Shut after 5.9 s: the damper lets the spring close it evenly, and the drag of the seal does not stop it",
        (
            Plot("Opening of the door", "angle", ("hinge.q[1]",), True),
            Plot("Torques on the door", "torque", ("hinge.spring.effort[1]", "hinge.damper.effort[1]")),
        ),
        until=6.0,
        every=0.01,
        aside=(35.0, 25.0),
    ),
    "drawer": Choice(
        0.3,
        "Pulled 300 mm off the middle, its runners press so hard that friction takes 60 % of the pull",
        ("Normal contact forces in runners", Plot("Speed of the drawer", "velocity", ("drawer.velocity[1]",))),
        aside=(30.0, 40.0),
    ),
    "folding_panel": Choice(
        0.85,
        "Let go at 0.2 s, the spring turns the panels flat, ever faster; the catch at the frame has them at 1.03 s",
        (
            Plot("Turn of the first panel", "angle", ("wall.q[1]",), True),
            Plot("Speed of trolley and panel", "velocity", ("trolley.velocity[1]", "leaf1_panel.velocity[1]")),
        ),
        until=1.5,
        every=0.002,
        aside=(30.0, 35.0),
    ),
    "gear_train": Choice(
        0.0,
        "The motor's pinion drives the sun; three planets walk round in the fixed ring, and their arm lifts the rack",
        (
            Plot("Height of the load", "position", ("rack.position[2]",)),
            Plot("Tooth forces of sun and planets", "force", tuple(f"planet{k}_inside.contact[1].normal_force" for k in (1, 2, 3))),
        ),
        aside=(20.0, 72.0),
    ),
    "quick_return": Choice(
        0.15,
        "The tool goes to the right for three fifths of a turn, slowly, and comes back in two fifths",
        (
            Plot("Place of the ram", "position", ("ram.position[1]",)),
            Plot("Speed of the ram", "velocity", ("ram.velocity[1]",)),
            Plot("Torque of the motor for a cut of 2 kN", "torque", ("motor.drive.effort[1]",)),
        ),
        until=1.0,
        every=0.002,
        aside=(20.0, 14.0),
        changes={"parameters.cut": "2 kN"},
    ),
    "robot_arm": Choice(
        0.45,
        "Lifting 5 kg in a second: most torque while it speeds up, and little on the way to rest, when the load pulls itself up",
        (
            Plot("Turn of the joints", "angle", ("shoulder.q[1]", "elbow.q[1]"), True),
            Plot("Torques of the motors", "torque", ("shoulder.drive.effort[1]", "elbow.drive.effort[1]")),
            Plot("Place of the tool", "position", ("fore.tool.position[1]", "fore.tool.position[3]")),
        ),
        aside=(25.0, 18.0),
    ),
    "scissor_lift": Choice(
        0.0,
        "Raised by 300 rpm: the steeper the links, the less torque the same load takes",
        (
            Plot("Height of the platform", "position", ("platform.position[3]",)),
            Plot("Torque of the motor", "torque", ("motor.drive.effort[1]",)),
        ),
        until=8.0,
        every=0.02,
        aside=(25.0, 14.0),
        changes={"parameters.speed": "300 rpm"},
    ),
    "stewart_platform": Choice(
        0.0,
        "All legs grow by 100 mm/s: the platform rises straight, fast at first, as the legs stand up",
        (
            Plot("Height of the platform", "position", ("platform.position[3]",)),
            Plot("Force of a leg", "force", ("pair1_leg1_ram.drive.effort[1]",)),
        ),
        changes={"parameters.speed": 0.1},
        aside=(30.0, 18.0),
    ),
    "toggle_press": Choice(
        0.0,
        "Closing at 20 mm/s: the nearer the links come to a line, the less force closes them",
        (
            Plot("Force of the carriage", "force", ("push.drive.effort[1]",)),
            Plot("Turn of the upper link", "angle", ("head.q[1]",), True),
            "Friction torque of wrist",
        ),
        until=2.5,
        every=0.01,
        changes={"parameters.speed": -0.02},
        aside=(25.0, 14.0),
    ),
    "winch": Choice(
        1.0,
        "Lifting takes 2.38 N m at constant speed, lowering 0.98 N m; in between, the gear unit rests",
        (
            Plot("Height of the load", "position", ("load.position[2]",)),
            Plot("Torque of the motor", "torque", ("motor.drive.effort[1]",)),
            Plot("Torque and friction at the drum", "torque", ("unit.output_torque", "unit.friction.torque[1]")),
        ),
        aside=(30.0, 20.0),
    ),
    "wishbone_corner": Choice(
        0.0,
        "Both wheels lifted by 60 mm in a second: the springs carry the wheel load at ride height, and then more",
        (
            Plot("Height of the wheels' centres", "position", ("corner1_upright.position[3]",)),
            Plot("Torque that lifts the arms", "torque", ("corner1_pivot.drive.effort[1]",)),
        ),
        changes={"parameters.speed": "8.6 deg/s"},
        aside=(35.0, 14.0),
    ),
}
