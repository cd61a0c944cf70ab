"""Checks of wheels that roll on each other: their sizes, and keys that only wheels have."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.wheel_sizes import FINEST, rolls_of, whole_number_ratio

OWN = ("teeth", "module", "radii", "lead_angle", "internal", "crossed")
"""Keys that only wheels have."""
WHOLE = 1e-9
"""Accepted deviation of a number of teeth from a whole number, for numbers computed from parameters."""


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about wheels."""
    for name, j in scene.joints.items():
        path: Path = ("joints", name)
        if REGISTRY[j.type].slips and j.friction is None:
            hint = "for example friction: {mu: 0.3, pretension: 300 N}; a belt that does not slide is of type belt"
            yield Finding((*path, "friction"), f"a {j.type} holds by friction alone, which is missing", hint)
        if not REGISTRY[j.type].rolls:
            rolling = ", ".join(k.name for k in REGISTRY.values() if k.rolls)
            for key in OWN:
                if getattr(j, key) and not (key == "internal" and REGISTRY[j.type].follows == "point"):
                    yield Finding((*path, key), f"a {j.type} joint has no wheels", f"remove it; joints with wheels: {rolling}")
            continue
        yield from _sized(path, j)
        yield from _lead(path, j)
        for key, has in (("internal", "wheel with its teeth inside"), ("crossed", "belt that could be crossed")):
            if getattr(j, key) and rolls_of(j).choice != key:
                yield Finding((*path, key), f"a {j.type} has no {has}", "remove it")


def _lead(path: Path, j: Joint) -> Iterator[Finding]:
    """Findings about the lead angle of a worm, and about radii of a worm: radii do not determine a worm."""
    worm = rolls_of(j).touch == "skew"
    if worm and not j.lead_angle:
        yield Finding((*path, "lead_angle"), f"a {j.type} needs a lead angle, not 0", "for example lead_angle: 10 deg")
    if worm and j.radii is not None:
        yield Finding((*path, "radii"), f"radii do not determine a {j.type}", "give teeth: [1, 40], module and lead_angle")
    if not worm and j.lead_angle is not None:
        able = ", ".join(k.name for k in REGISTRY.values() if k.rolls and k.rolls.touch == "skew")
        yield Finding((*path, "lead_angle"), f"a {j.type} has no lead angle", f"remove it, or use type: {able}")


def _sized(path: Path, j: Joint) -> Iterator[Finding]:
    """Findings about sizes. A pair of wheels gives one entry per wheel: radii, or teeth with a module (for a belt or chain, with a
    pitch)."""
    step, count = rolls_of(j).size, rolls_of(j).wheels
    usual = "teeth: [20, 40]" if count == 2 else "teeth: [20]"
    hint = f"{usual} and {step}: 2 mm, or radii"
    if step == "radii":
        hint = "radii: [50 mm, 100 mm]"
        if j.teeth is not None or j.radii is None:
            yield Finding((*path, "radii"), f"a {j.type} has no teeth: it needs its radii", hint)
            return
    if (j.teeth is None) == (j.radii is None):
        yield Finding(path, f"a {j.type} needs {'either teeth or radii, not both' if j.teeth else 'its teeth or radii'}", hint)
        return
    key = "teeth" if j.teeth is not None else "radii"
    given = j.teeth or j.radii or ()
    if len(given) != count:
        yield Finding((*path, key), f"a {j.type} has {'one wheel' if count == 1 else 'two wheels'}, not {len(given)}", hint)
        return
    for other in ("module", "pitch"):
        if getattr(j, other) is not None and (key == "radii" or other != step):
            yield Finding((*path, other), f"a {j.type} with {key} has no {other}", f"remove it; for example {hint}")
    if key == "teeth":
        if getattr(j, step) is None:
            yield Finding((*path, step), f"the size of its teeth is missing: a {j.type} with teeth needs a {step}", hint)
        elif step == "pitch" and float(j.pitch or 0.0) < 0.0:
            yield Finding((*path, step), "the distance between teeth must be positive", hint)
        for k, z in enumerate(given):
            if abs(float(z) - round(float(z))) > WHOLE or not float(z) > 0.5:
                yield Finding((*path, key, k), f"{float(z):g} is not a valid number of teeth", "give a whole number, at least 1")
    elif step != "radii" and all(float(r) > 0.0 for r in given) and whole_number_ratio(tuple(map(float, given))) is None:
        what = f"the ratio of the radii is not a ratio of whole numbers up to {FINEST}"
        yield Finding((*path, key), what, "give teeth, or radii with a simpler ratio")
    if j.internal and count == 2 and float(given[0]) == float(given[1]):
        yield Finding((*path, key), "the wheel with internal teeth must be larger than the other wheel", hint)
