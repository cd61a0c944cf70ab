"""All kinds of output columns, in the order of a result. A new kind needs a file in ``kinds`` and a line in FILES."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby

from trunnion.basics.objects_by_import_path import objects
from trunnion.columns.declaration import ColumnKind, registered
from trunnion.columns.subjects import Subject, items
from trunnion.system.structure.bodies_and_joints import System

FILES = (
    "mass_centre",
    "body_acceleration",
    "orientation",
    "angular_velocity",
    "body_point",
    "joint_coordinate",
    "joint_rate",
    "joint_acceleration",
    "reaction",
    "axial_force",
    "gap",
    "gearbox_input",
    "gearbox_output",
    "drive",
    "device",
    "latch_state",
    "joint_friction",
    "band_tension",
    "sliding_state",
    "bristle_deflection",
    "friction_work",
    "contact",
    "coupling_effort",
    "spring_damper",
    "bushing",
    "energy",
    "dissipated_energy",
    "energy_residual",
    "audit_and_event_counts",
    "last_event",
)
KINDS = objects("trunnion.columns.kinds", (f"{file}.KIND" for file in FILES))
REGISTRY: dict[str, ColumnKind] = registered(*(replace(kind, name=file) for file, kind in zip(FILES, KINDS, strict=True)))
CONTACT = REGISTRY["contact"]


def subjects(system: System) -> Iterator[tuple[ColumnKind, Subject]]:
    """All pairs of a kind and a subject, in the order of a result: bodies, joints, couplings, loads, the system. The pairs of one
    item are adjacent. Pairs of consecutive kinds with ``SubjectType.by_freedom`` are sorted by freedom."""
    for scope, kinds in groupby(REGISTRY.values(), key=lambda kind: kind.of.scope):
        runs = [(by, list(run)) for by, run in groupby(kinds, key=lambda kind: kind.of.by_freedom)]
        for number, item in enumerate(items(system, scope)):
            for by_freedom, run in runs:
                found = [(kind, s) for kind in run for s in kind.of.found(number, item)]
                yield from sorted(found, key=lambda pair: pair[1].freedom) if by_freedom else found


def shown(kind: ColumnKind, s: Subject) -> Iterator[tuple[int, int | None, int | None]]:
    """The indices (quantity, item, component), from 0, for each column of a subject. The item is None if the kind does not repeat.
    The component is None for a scalar."""
    for item in range(kind.repeats(s)) if kind.repeats else (None,):
        for number, q in enumerate(kind.quantities):
            if q.given(s):
                yield from ((number, item, k if q.size > 1 else None) for k in range(q.size))
