"""Names of friction pairs, end stops and latches, in the order of their indices in the runtime."""

from __future__ import annotations

from trunnion.system.structure.bodies_and_joints import System


def slider_names(system: System) -> list[tuple[str, int]]:
    """(joint, number of the pair in the joint, from 1) for every friction pair, in the order of their flags."""
    out: list[tuple[str, int]] = []
    for j in system.frictional:
        assert j.friction is not None
        out += [(j.name, i + 1) for i, _ in enumerate(j.friction.sliders)]
    return out


def stop_names(system: System) -> list[tuple[str, int]]:
    """(joint, number of the freedom, from 1) for every flag, in the order of the flags. End stops, joints that only push, free
    ends of their walls, latch contacts and latch hooks have flags."""
    found: dict[int, tuple[str, int]] = {}
    for j in system.joints:
        if j.unilateral:
            found |= {f: (j.name, 1) for f in (j.unilateral.flag, j.unilateral.inside) if f >= 0}
        for k, d in enumerate(j.devices):
            if d.stop is not None:
                found |= {f: (j.name, k + 1) for f in d.stop.flags if f >= 0}
            if d.latch is not None:
                found |= dict.fromkeys((d.latch.pressed, system.hook(d.latch.hook)), (j.name, k + 1))
    return [found[i] for i in sorted(found)]
