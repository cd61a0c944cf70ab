"""Every mistake of meaning is found, at its place, in words that say it; a valid scene has none."""

from __future__ import annotations

import pytest

from engine.scene import checked, problems, scene_from_dict
from engine.scene.laws import AVAILABLE_LAWS
from engine.scene.model import Body, Joint, Scene

from .making import GONE, VALID, edited, problems_of

BOX = {"box": [1, 1, 1], "mass": 1}
CASES = {
    # names
    "dangling body": ({"joints.socket.inboard": "amr.tip"}, "joints.socket.inboard", 'no body "amr" (did you mean "arm"?)'),
    "dangling body of a side": ({"joints.cross.outboard.body": "bal"}, "joints.cross.outboard.body", '"ball"'),
    "dangling point": ({"joints.socket.inboard": "arm.tp"}, "joints.socket.inboard", '(did you mean "tip"?)'),
    "dangling ground point": ({"joints.hinge.inboard": "ground.hok"}, "joints.hinge.inboard", 'ground has no point "hok"'),
    "dangling point of a side": ({"joints.cross.outboard.point": "x"}, "joints.cross.outboard.point", 'no point "x"'),
    "force on nothing": ({"forces.push.on": "arn"}, "forces.push.on", 'no body "arn"'),
    "spring to nothing": ({"forces.rubber.between": ["sled.x", "ground"]}, "forces.rubber.between[1]", 'no point "x"'),
    "dangling input": ({"joints.hinge.effort": {"input": "moter"}}, "joints.hinge.effort.input", '"motor"'),
    "force on the ground": ({"forces.push.on": "ground"}, "forces.push.on", "ground cannot be pushed"),
    "body called ground": ({"bodies.ground": BOX}, "bodies.ground", "reserved"),
    "joint called time": ({"joints.time": {**VALID["joints"]["flight"], "start": None}}, "joints.time", "reserved"),
    "same name twice": ({"forces.hinge": VALID["forces"]["rubber"]}, "forces.hinge", "taken already by one of the joints"),
    "name with a dot": ({"inputs.a-b": {}}, "inputs.a-b", "cannot be a name"),
    "name of a point": ({"bodies.arm.points": {"tip": [1, 0, 0], "2nd": [0, 0, 0]}}, "bodies.arm.points.2nd", "cannot be"),
    "input in no unit": ({"inputs.wind.unit": "bananas"}, "inputs.wind.unit", "unknown unit"),
    "input not in SI": ({"inputs.wind.unit": "kN"}, "inputs.wind.unit", "SI units"),
    "input of another dimension": ({"joints.hinge.effort": {"input": "wind"}}, "joints.hinge.effort.input", "is in N; N*m"),
    # bodies
    "no bodies": ({"bodies": {}, "joints": {}, "forces": {}, "outputs": ["*"]}, "bodies", "no bodies"),
    "two shapes": ({"bodies.arm.sphere": 0.1}, "bodies.arm.sphere", "two shapes: box and sphere"),
    "size zero": ({"bodies.arm.box": [1, 0, 1]}, "bodies.arm.box", "positive"),
    "radius negative": ({"bodies.link.cylinder.radius": -1}, "bodies.link.cylinder", "positive"),
    "density and mass": ({"bodies.arm.mass": 3}, "bodies.arm.density", "twice"),
    "density and inertia": ({"bodies.arm.inertia": [1, 1, 1]}, "bodies.arm.density", "twice"),
    "density without shape": ({"bodies.sled": {"density": 3}}, "bodies.sled.density", "needs a shape"),
    "nothing said about mass": ({"bodies.arm.density": GONE}, "bodies.arm", "no mass"),
    "mass without inertia": ({"bodies.sled.inertia": GONE}, "bodies.sled", "[0, 0, 0] makes it a point mass"),
    "mass zero": ({"bodies.sled.mass": 0}, "bodies.sled.mass", "positive"),
    "density negative": ({"bodies.arm.density": -1}, "bodies.arm.density", "positive"),
    "four inertias": ({"bodies.sled.inertia": [1, 1, 1, 1]}, "bodies.sled.inertia", "3 or 6"),
    "negative inertia": ({"bodies.sled.inertia": [1, 1, -0.1]}, "bodies.sled.inertia", "negative"),
    "indefinite inertia": ({"bodies.sled.inertia": [1, 1, 1, 2, 0, 0]}, "bodies.sled.inertia", "negative"),
    "triangle inequality": ({"bodies.sled.inertia": [1, 1, 2.0001]}, "bodies.sled.inertia", "exceeds the sum"),
    # connections
    "loose body": ({"joints.flight": GONE}, "bodies.flyer", "no joint ties this body to anything (a body that flies"),
    "loose group": ({"joints.hinge": GONE, "outputs": ["*"]}, "bodies.arm", "to the ground: arm, link, ball"),
    "joint with itself": ({"joints.wrong": {"type": "fixed", "inboard": "arm", "outboard": "arm.tip"}}, "joints.wrong", "both"),
    "rigid loop": (
        {
            "joints.fix1": {"type": "fixed", "inboard": "ground", "outboard": "sled"},
            "joints.fix2": {"type": "fixed", "inboard": "sled", "outboard": "ground.hook"},
        },
        "joints.fix2",
        "impossible loop closure",
    ),
    "cut in a tree": ({"joints.rail.cut": True}, "joints.rail.cut", "leave a body loose"),
    "nothing left to cut": (
        {
            "joints.hinge.cut": False,
            "joints.socket.cut": False,
            "joints.back": {"type": "spherical", "inboard": "ground", "outboard": "link", "cut": False},
        },
        "joints.back.cut",
        "close a loop",
    ),
    "cut screw": (
        {"joints.flight": {"type": "screw", "inboard": "ground", "outboard": "flyer", "axis": "z", "pitch": 1, "cut": True}},
        "joints.flight.cut",
        "cannot be cut",
    ),
    # frames
    "no axis": ({"joints.hinge.axis": GONE}, "joints.hinge.axis", "needs an axis"),
    "axis on one side only": ({"joints.cross.axis": GONE}, "joints.cross.inboard.axis", "axis on both sides"),
    "axis zero": ({"joints.rail.axis": [0, 0, 0]}, "joints.rail.axis", "zero length"),
    "reference zero": ({"joints.rail.reference": [0, 0, 0]}, "joints.rail.reference", "zero length"),
    "start axis zero": ({"joints.socket.start.q.axis": [0, 0, 0]}, "joints.socket.start.q.axis", "zero length"),
    "reference along axis": ({"joints.rail.reference": [0, 3, 4]}, "joints.rail.reference", "parallel"),
    "universal reference along axis": ({"joints.cross.reference": "-x"}, "joints.cross.reference", "second axis"),
    "reference of a side along axis": (
        {"joints.cross.outboard.reference": "x"},
        "joints.cross.outboard.reference",
        "parallel",
    ),
    "reference without axis": ({"joints.socket.reference": "x"}, "joints.socket.reference", "without an axis"),
    "screw without pitch": ({"joints.hinge": {"type": "screw", "inboard": "ground", "outboard": "arm", "axis": "y"}},
                            "joints.hinge.pitch", "needs a pitch"),
    "pitch of a hinge": ({"joints.hinge.pitch": 0.1}, "joints.hinge.pitch", "has no pitch"),
    # friction
    "friction of a free joint": ({"joints.flight.friction": {"mu": 0.1}}, "joints.flight.friction", "no friction element"),
    "journal without radius": ({"joints.hinge.friction.radius": GONE}, "joints.hinge.friction.radius", "is missing"),
    "journal without length": ({"joints.hinge.friction.half_length": GONE}, "joints.hinge.friction.half_length", "missing"),
    "ball without radius": ({"joints.socket.friction.radius": GONE}, "joints.socket.friction.radius", "is missing"),
    "sleeve without width": ({"joints.rail.friction.half_width": GONE}, "joints.rail.friction.half_width", "is missing"),
    "ball with length": ({"joints.socket.friction.half_length": 1}, "joints.socket.friction.half_length", "has no half_"),
    "ball with thrust": ({"joints.socket.friction.thrust_radius": 1}, "joints.socket.friction.thrust_radius", "has no"),
    "two radii of a hinge": ({"joints.hinge.friction.radius": [1, 2]}, "joints.hinge.friction.radius", "has one radius"),
    "radius zero": ({"joints.socket.friction.radius": 0}, "joints.socket.friction.radius", "positive"),
    "second radius zero": ({"joints.cross.friction.radius": [1, 0]}, "joints.cross.friction.radius", "positive"),
    "mu missing": ({"joints.hinge.friction.mu": GONE}, "joints.hinge.friction.mu", 'law "regularized" needs mu'),
    "mu negative": ({"joints.hinge.friction.mu": -0.1}, "joints.hinge.friction.mu", "not be negative"),
    "mu_static below mu": ({"joints.hinge.friction.mu_static": 0.1}, "joints.hinge.friction.mu_static", "below"),
    "viscosity missing": ({"joints.socket.friction.viscosity": GONE}, "joints.socket.friction.viscosity", "needs viscosity"),
    "law to come": ({"joints.hinge.friction.law": "coulomb"}, "joints.hinge.friction.law", "not available in this version"),
    "law of the scene to come": ({"friction.law": "lugre"}, "friction.law", 'law "lugre" is not available'),
    "v_eps zero": ({"joints.hinge.friction.v_eps": 0}, "joints.hinge.friction.v_eps", "positive"),
    "v_eps of the scene zero": ({"friction.v_eps": 0}, "friction.v_eps", "positive"),
    # start values
    "too many coordinates": ({"joints.hinge.start.q": [1, 2]}, "joints.hinge.start.q", "has 1 coordinate, not 2"),
    "one number for a ball": ({"joints.socket.start.q": 1}, "joints.socket.start.q", "has 4 coordinates, not 1"),
    "axis and angle of a hinge": ({"joints.hinge.start.q": {"axis": "x", "angle": 1}}, "joints.hinge.start.q", "spherical and free"),
    "rates of a shaft": ({"joints.shaft.start.qd": 1}, "joints.shaft.start.qd", "has 2 rates, not 1"),
    "quaternion zero": ({"joints.socket.start.q": [0, 0, 0, 0]}, "joints.socket.start.q", "no rotation"),
    "quaternion zero of a free joint": ({"joints.flight.start.q": [1, 2, 3, 0, 0, 0, 0]}, "joints.flight.start.q", "no rotation"),
    # devices
    "springs too few": ({"joints.shaft.spring": {"stiffness": 1}}, "joints.shaft.spring", "2 freedoms, not 1"),
    "dampings too many": ({"joints.hinge.damping": [1, 1]}, "joints.hinge.damping", "one freedom, not 2"),
    "stops too many": ({"joints.hinge.stops": [None, None]}, "joints.hinge.stops", "one freedom, not 2"),
    "drives too few": ({"joints.shaft.drive": {"constant": {"rate": 1}}}, "joints.shaft.drive", "2 freedoms"),
    "efforts too few": ({"joints.cross.effort": 1}, "joints.cross.effort", "2 freedoms, not 1"),
    "drive of a ball": ({"joints.socket.drive": [{"constant": {"rate": 1}}, None, None]}, "joints.socket.drive[1]", "rotation"),
    "spring of a ball": ({"joints.socket.spring": [None, None, {"stiffness": 1}]}, "joints.socket.spring[3]", "rotation"),
    "drive of a flight's rotation": (
        {"joints.flight.drive": [None, None, None, {"constant": {"rate": 1}}, None, None]},
        "joints.flight.drive[4]",
        "rotation",
    ),
    "stops crossed": ({"joints.hinge.stops.lower": 2}, "joints.hinge.stops.lower", "not below"),
    "stops nowhere": ({"joints.hinge.stops": {"stiffness": 1}}, "joints.hinge.stops", "lower, upper or both"),
    "stop without stiffness": ({"joints.hinge.stops.stiffness": 0}, "joints.hinge.stops.stiffness", "positive"),
    "stop with negative damping": ({"joints.hinge.stops.damping": -1}, "joints.hinge.stops.damping", "negative"),
    "negative damping": ({"joints.hinge.damping": -1}, "joints.hinge.damping", "negative"),
    "empty drive": ({"joints.rail.drive": {}}, "joints.rail.drive", "empty drive"),
    "two drives in one": ({"joints.rail.drive.constant": {"rate": 1}}, "joints.rail.drive.table", "constant or table, not both"),
    "empty signal": ({"joints.hinge.effort": {}}, "joints.hinge.effort", "empty signal"),
    "ramp at once": ({"forces.twist.torque[3].ramp.duration": 0}, "forces.twist.torque[3].ramp.duration", "positive"),
    "origin of a load": ({"forces.twist.torque[3].ramp.origin": 1}, "forces.twist.torque[3].ramp.origin", "for drives"),
    "negative frequency": (
        {"joints.cross.effort[1].harmonic.frequency": -1},
        "joints.cross.effort[1].harmonic.frequency",
        "negative",
    ),
    "table not increasing": ({"joints.rail.drive.table.time": [0, 1, 1]}, "joints.rail.drive.table.time[3]", "must increase"),
    "table uneven": ({"joints.rail.drive.table.value": [0, 1]}, "joints.rail.drive.table.value", "3 times but 2 values"),
    "table too short": ({"joints.rail.drive.table": {"time": [0], "value": [1]}}, "joints.rail.drive.table.time", "two entries"),
    # loads
    "spring on one body": ({"forces.rubber.between": ["arm", "arm.tip"]}, "forces.rubber.between", "both ends"),
    "spring with negative damping": ({"forces.rubber.damping": -1}, "forces.rubber.damping", "negative"),
    "spring with negative length": ({"forces.rubber.length": -1}, "forces.rubber.length", "negative"),
    # dimensions that depend on the joint
    "hinge in millimetres": ({"joints.hinge.start.q": "30 mm"}, "joints.hinge.start.q", "is a length; an angle is wanted"),
    "shaft travel in degrees": ({"joints.shaft.start.q": ["3 deg", 0]}, "joints.shaft.start.q[1]", "a length is wanted"),
    "shaft rate": ({"joints.shaft.start.qd": [0, "1 m/s"]}, "joints.shaft.start.qd[2]", "an angular velocity is wanted"),
    "ball rate": ({"joints.socket.start.qd": [0, 0, "1 m/s"]}, "joints.socket.start.qd[3]", "an angular velocity"),
    "quaternion in metres": ({"joints.flight.start.q": [0, 0, 0, "1 m", 0, 0, 0]}, "joints.flight.start.q[4]", "plain number"),
    "hinge spring": ({"joints.hinge.spring.stiffness": "3 N/m"}, "joints.hinge.spring.stiffness", "rotational stiffness"),
    "shaft spring": ({"joints.shaft.spring[1].stiffness": "3 N*m"}, "joints.shaft.spring[1].stiffness", "a stiffness is"),
    "spring rest": ({"joints.hinge.spring.rest": "1 m"}, "joints.hinge.spring.rest", "an angle is wanted"),
    "hinge damping": ({"joints.hinge.damping": "3 N*s/m"}, "joints.hinge.damping", "rotational damping"),
    "stop damping": ({"joints.hinge.stops.damping": "1 s/m"}, "joints.hinge.stops.damping", "a time per angle"),
    "stop bound": ({"joints.hinge.stops.upper": "2 m"}, "joints.hinge.stops.upper", "an angle is wanted"),
    "effort": ({"joints.hinge.effort": "3 N"}, "joints.hinge.effort", "a torque is wanted"),
    "harmonic effort": ({"joints.cross.effort[1].harmonic.amplitude": "3 N"}, "joints.cross.effort[1].harmonic.amplitude", "torque"),
    "drive rate": ({"joints.shaft.drive[2].constant.rate": "1 m/s"}, "joints.shaft.drive[2].constant.rate", "angular velocity"),
    "drive start": ({"joints.shaft.drive[2].constant.start": "1 m"}, "joints.shaft.drive[2].constant.start", "an angle"),
    "drive ramp": ({"joints.rail.drive": {"ramp": {"start": "1 m", "end": 1, "duration": 1}}}, "joints.rail.drive.ramp.start", "velocity"),
    "drive table": ({"joints.rail.drive.table.value": [0, "1 s", 0]}, "joints.rail.drive.table.value[2]", "a length"),
    "force in N m": ({"forces.push.force": ["1 N*m", 0, 0]}, "forces.push.force[1]", "a force is wanted"),
    "torque in N": ({"forces.twist.torque": ["1 N", 0, 0]}, "forces.twist.torque[1]", "a torque is wanted"),
    "input start": ({"inputs.wind.start": "1 s"}, "inputs.wind.start", "a force is wanted"),
    "axis in seconds": ({"joints.rail.axis": ["1 s", 0, 0], "joints.rail.reference": "y"}, "joints.rail.axis[1]", "plain number"),
    # run
    "until zero": ({"simulation.until": 0}, "simulation.until", "after its start"),
    "every zero": ({"simulation.every": 0}, "simulation.every", "positive"),
    "rtol one": ({"simulation.rtol": 1}, "simulation.rtol", "between 0 and 1"),
    "output of nothing": ({"outputs": ["amr.position[1]"]}, "outputs[1]", '(did you mean "arm"?)'),
    "tunable of nothing": ({"tunable": ["body.arm.mass"]}, "tunable[1]", '(did you mean "bodies"?)'),
}  # fmt: skip


def test_a_scene_with_one_of_everything_has_no_problem():
    assert problems_of(VALID) == []


@pytest.mark.parametrize("case", CASES)
def test_a_mistake_is_found_at_its_place_and_alone(case):
    changes, where, words = CASES[case]
    found = problems_of(edited(changes))
    assert [p.where for p in found] == [where], found
    assert words in str(found[0])


LIMITS = {
    "point mass": {"bodies.sled.inertia": [0, 0, 0]},
    "thin rod": {"bodies.sled.inertia": [0, 1, 1]},
    "flat plate": {"bodies.sled.inertia": [1, 1, 2]},
    "rounded flat plate": {"bodies.sled.inertia": [1, 1, 2.000000001]},
    "mass, inertia and a shape to draw": {"bodies.sled.box": [1, 1, 1]},
    "shape with mass": {"bodies.arm.density": GONE, "bodies.arm.mass": 3},
    "friction of size zero": {"joints.hinge.friction.mu": 0},
    "frequency zero": {"joints.cross.effort[1].harmonic.frequency": 0},
    "axis given by lengths": {"joints.rail.axis": ["1 mm", "2 mm", 0]},
    "coordinates of one freedom as a list": {"joints.hinge.start.q": ["3 deg"], "joints.hinge.spring": [None]},
    "ground on the outboard side": {"joints.hinge.inboard": "arm", "joints.hinge.outboard": "ground.hook"},
    "closed loop": {"joints.back": {"type": "spherical", "inboard": "ground", "outboard": "link.end", "cut": True}},
    "damping of a ball": {"joints.socket.damping": [1, 1, 1], "joints.socket.effort": [0, None, 1]},
    "stiffness without the unspoken radian": {"joints.hinge.spring.stiffness": "5 N*m"},
    "input of no unit": {"inputs.motor.unit": "1", "inputs.motor.start": 0},
    "lower stop alone": {"joints.hinge.stops.upper": GONE},
    "screw": {"joints.flight": {"type": "screw", "axis": "z", "pitch": "-5 mm", "inboard": "ground", "outboard": "flyer"}},
}


@pytest.mark.parametrize("case", LIMITS)
def test_what_is_only_unusual_is_accepted(case):
    assert problems_of(edited(LIMITS[case])) == []


def test_problems_of_form_and_of_meaning_are_reported_together():
    changes = {
        "bodies.arm.masss": 3,  # form
        "joints.hinge.friction.mu": "3 deg",  # form
        "joints.socket.inboard": "amr.tip",  # meaning
        "simulation.until": -1,  # meaning
        "joints.rail.type": "prism",  # form
    }
    assert {p.where for p in problems_of(edited(changes))} == {
        "bodies.arm.masss",
        "joints.hinge.friction.mu",
        "joints.socket.inboard",
        "simulation.until",
        "joints.rail.type",
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"bodies.arm.points.tip": [1, 2]},
        {"bodies.arm.points": 3},
        {"bodies.arm": "heavy"},
        {"bodies.arm.mass": "3 m", "bodies.arm.density": GONE},
        {"bodies.link.cylinder.radius": GONE},
        {"joints.hinge.axis": "w"},
        {"joints.hinge.outboard": 3},
        {"joints.hinge.friction.radius": "x"},
        {"inputs.wind": 3},
        {"ground.points.hook": "there"},
        {"joints.rail.drive": {"ramp": {"start": "x", "end": 0, "duration": 1}}},
        {"joints.hinge.stops": {"stiffness": 1, "upper": "x"}},
        {"joints.hinge.friction": {"mu": 1, "radus": 1, "half_length": 1}},
        {"bodies.arm.density": GONE, "bodies.arm.densty": 7800},
        {"joints.hinge.friction.mu": GONE, "joints.hinge.friction.law": "viscos", "joints.hinge.friction.viscosity": 1},
        {"joints.hinge.axis": GONE, "joints.hinge.axes": "y"},
        {"joints.hinge": "revolute"},
    ],
)
def test_a_mistake_of_form_is_not_followed_by_its_consequences(changes):
    found = problems_of(edited(changes))
    assert len(found) == 1, found


def test_an_unrelated_mistake_of_form_hides_nothing():
    changes = {"bodies.sled.inertia": GONE, "bodies.sled.colr": 1, "bodies.sled.points": {"a": 3}}
    assert {p.where for p in problems_of(edited(changes))} == {
        "bodies.sled",
        "bodies.sled.colr",
        "bodies.sled.points.a",
    }


def test_scenes_made_in_python_are_checked_by_the_same_rules():
    scene = Scene(bodies={"a": Body(box=(1, 1, 1), density=1)}, joints={"j": Joint("revolute", "ground", "b", axis="z")})
    assert [p.where for p in problems(scene)] == ["joints.j.outboard"]
    assert checked(scene_from_dict(VALID)).name == "one_of_everything"


def test_the_laws_a_scene_may_name_are_those_the_engine_has():
    registry = pytest.importorskip("engine.friction").REGISTRY
    assert set(registry) == AVAILABLE_LAWS


def test_the_sizes_checked_are_those_of_the_contact_elements():
    from engine.joints import REGISTRY
    from engine.scene.check.friction import GEOMETRY

    assert {k.friction for k in REGISTRY.values() if k.friction} == set(GEOMETRY)
