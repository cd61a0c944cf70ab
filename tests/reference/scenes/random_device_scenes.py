"""Random scenes in which devices interact, by family. Nearly every joint has friction. Under the loads, pairs stick, slip, release
and engage within a short run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.random import Generator

from tests.reference.scenes import random_contact_scenes as contacts
from tests.reference.scenes import random_gearbox_scenes as drives
from tests.reference.scenes import random_linkage_scenes as linkages
from tests.reference.scenes import random_rod_load_rotor_scenes as fields
from tests.reference.scenes import random_wheel_scenes as wheels
from tests.reference.scenes.random_streams import stream
from trunnion import Scene, scene_from_dict

FAMILIES: dict[str, Callable[[Generator], dict[str, Any]]] = {
    f.__name__: f
    for f in (
        wheels.gear_trains, wheels.planets, wheels.belts, wheels.racks, wheels.bevel_differentials, wheels.cams,
        linkages.screws_in_loops, linkages.screw_levers, linkages.hooks_in_loops, linkages.ratchets_in_loops,
        linkages.freewheels_in_four_bars, linkages.grippers, linkages.slots, linkages.stops_beside_sticking_pairs,
        linkages.five_bars, linkages.drives_that_die, linkages.blocks_on_belts,
        drives.geared_linkages, drives.winches, drives.worm_drives, drives.loaded_arms, drives.locked_feeds,
        fields.rod_loops, fields.hung_frames, fields.valve_trains, fields.curved_rows, fields.spinning_rotors,
        fields.started_linkages,
    )
}  # fmt: skip
"""The function that draws a scene of each family."""
CONTACTS: dict[str, Callable[[Generator], dict[str, Any]]] = {
    f.__name__: f
    for f in (
        contacts.dropped_levers, contacts.lifting_tappets, contacts.pulled_boxes, contacts.slotted_wheels, contacts.braked_wheels,
    )
}  # fmt: skip
"""Families with contacts that begin and end, which time stepping and lanes refuse."""


def crossed_dict(family: str, seed: int) -> dict[str, Any]:
    """A random scene of a family, as in a scene file. It depends only on family and seed."""
    return (FAMILIES | CONTACTS)[family](stream("crossed", family, seed)) | {"name": f"{family}_{seed}"}


def crossed(family: str, seed: int) -> Scene:
    """A random scene of a family."""
    return scene_from_dict(crossed_dict(family, seed))
