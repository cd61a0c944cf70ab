"""Checks of cams: their profiles, and keys that only cams have."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.joint_couplings import Profile
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path

OWN = ("profile", "roller")
"""Keys that only cams have."""
CAMS = ("point", "face")
"""Kinds of followers of a cam."""
FEWEST = 3
"""Fewest values of a profile."""
MOST = 2000
"""Most values of a profile; each value adds code to a compiled kernel."""
TURN = 2 * math.pi * (1 + 1e-9)
"""One turn, rad, plus a tolerance for angles that are computed from parameters."""
USUAL = "{angle: [0 deg, 120 deg, 240 deg, 360 deg], radius: [30 mm, 40 mm, 40 mm, 30 mm]}"


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about cams."""
    able = ", ".join(k.name for k in REGISTRY.values() if k.follows in CAMS)
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        follows = REGISTRY[j.type].follows if REGISTRY[j.type].follows in CAMS else ""
        for key in OWN:
            if key == "roller" and REGISTRY[j.type].follows == "curve":
                continue
            if getattr(j, key) is not None and (not follows or (key == "roller" and follows != "point")):
                what = f"a {j.type} joint has no cam" if not follows else f"the follower of a {j.type} is a face, not a roller"
                hint = f"remove it; joints with cams: {able}" if not follows else "remove it, or use cam"
                yield Finding((*path, key), what, hint)
        if not follows:
            continue
        if j.profile is None:
            yield Finding(path, f"a {j.type} needs the profile of its cam", f"for example profile: {USUAL}")
        else:
            yield from _profile((*path, "profile"), j.profile, j)


def is_full_turn(p: Profile) -> bool:
    """Whether the angles of a profile cover a full turn."""
    return float(max(p.angle, default=0.0)) - float(min(p.angle, default=0.0)) > TURN - 2e-8


def _profile(path: Path, p: Profile, j: Joint) -> Iterator[Finding]:
    count = len(p.angle)
    if len(p.radius) != count:
        yield Finding((*path, "radius"), f"{len(p.radius)} radii for {count} angles", "give one radius for each angle")
        return
    if not FEWEST <= count <= MOST:
        yield Finding((*path, "angle"), f"a profile of {count} values", f"give {FEWEST} to {MOST} values")
        return
    for k, (a, b) in enumerate(itertools.pairwise(map(float, p.angle))):
        if not b > a:
            yield Finding((*path, "angle", k + 1), f"angles must increase: {b:g} rad follows {a:g} rad", "sort them")
            return
    around = float(p.angle[-1]) - float(p.angle[0])
    if around > TURN:
        yield Finding((*path, "angle"), f"the angles cover {around / (2 * math.pi):.3g} turns", "cover one turn at most")
    elif is_full_turn(p) and abs(float(p.radius[-1]) - float(p.radius[0])) > 1e-9 * float(p.radius[0]):
        what = "the angles cover a full turn, but the last radius differs from the first"
        hint = "the profile of a full turn is closed: repeat the first radius at the end"
        yield Finding((*path, "radius", count - 1), what, hint)
    if j.roller is not None and not j.internal and float(j.roller) >= min(map(float, p.radius)):
        what = "the roller is larger than its path around the cam's axis"
        yield Finding((*path[:-1], "roller"), what, "choose a smaller roller: the profile gives the path of the roller's centre")
