"""Types of variables: integers, enumerations with the names of their values, quantities of real variables."""

from __future__ import annotations

from trunnion.kernel.interface.output_columns import Column
from trunnion.runtime.abi import EventKind, Overrun, Verdict
from trunnion.simulation.run import Model

INTEGER = "Integer"
STATE, CONTACT, EVENT, VERDICT, HOST = "SlidingState", "ContactState", "EventKind", "AuditVerdict", "HostTolerance"
OVERRUN = "Overrun"
ENUMERATIONS: dict[str, dict[int, tuple[str, str]]] = {
    STATE: {
        -1: ("slips back", "slips in the negative direction"),
        0: ("rests", "sticks, or is in the proportional zone of its law; also the value for laws without these states"),
        1: ("slips", "slips; for a single rate: in the positive direction"),
        2: ("turns in its cone", "spherical joint: turns without sliding"),
    },
    CONTACT: {0: ("open", "no contact force"), 1: ("touches", "a contact force acts")},
    EVENT: {0: ("none", "none yet")} | {e.value: (e.name.lower().replace("_", " "), e.about) for e in EventKind},
    VERDICT: {v.value: (v.name.lower(), v.about) for v in Verdict},
    OVERRUN: {o.value: (o.name.lower().replace("_", " "), o.about) for o in Overrun},
    HOST: {
        0: ("left aside", "solver.tolerance is used"),
        1: ("tighter counts", "the tighter of solver.tolerance and the host's tolerance is used"),
        2: ("counts", "the host's tolerance is used"),
    },
}
"""{enumeration: {value: (name of the value, meaning)}}."""
QUANTITIES = {
    "m": "Length", "m/s": "Velocity", "m/s^2": "Acceleration", "rad": "Angle", "rad/s": "AngularVelocity",
    "rad/s^2": "AngularAcceleration", "N": "Force", "N*m": "Torque", "J": "Energy", "W": "Power", "kg": "Mass",
    "kg*m^2": "MomentOfInertia", "s": "Time",
    "N/m": "TranslationalStiffness", "N*m/rad": "RotationalStiffness", "N*s/m": "TranslationalDamping",
    "N*m*s/rad": "RotationalDamping",
}  # fmt: skip
"""Names of the quantities of real variables, by unit."""


def type_of(c: Column) -> str:
    """The type of an output column; "" for a real variable."""
    if c.key[0] == "state":
        return STATE
    if c.key[0] == "contact" and c.key[-1] == "state":
        return CONTACT
    return {
        ("extra", "verdict"): VERDICT, ("extra", "events"): INTEGER, ("extra", "overruns"): INTEGER,
        ("extra", "overrun"): OVERRUN, ("last", "kind"): EVENT, ("last", "element"): INTEGER,
        ("last", "contact"): INTEGER, ("last", "marginal"): INTEGER,
    }.get(c.key, "")  # fmt: skip


def derivatives(model: Model) -> dict[int, int]:
    """Columns that are time derivatives of other columns: index of the derivative → index of the other column."""
    place = {c.key: i for i, c in enumerate(model.columns)}
    kinds = {j.name: j.kind for j in model.system.joints}
    found = {}
    for key, i in place.items():
        base: tuple = ()
        if key[0] in ("velocity", "acceleration"):
            base = ("position" if key[0] == "velocity" else "velocity", *key[1:])
        elif key[0] == "qdd":
            base = ("qd", *key[1:])
        elif key[0] == "qd":
            base = ("q", key[1], kinds[key[1]].coordinate_of(key[2]))
        if base in place:
            found[i] = place[base]
    return found
