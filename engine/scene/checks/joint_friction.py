"""Checks of friction: joints that support friction, sizes of the pin, numbers that the law needs. The laws and contact elements
declare required numbers and allowed combinations; ``checks.number_bounds`` checks the values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from trunnion.elements.contact import GIVEN, ContactElement, Size, element_of, sizes
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import FIXED, OVERLAP
from trunnion.elements.contact.journal import PRELOAD
from trunnion.elements.contact.registry import BY_LOAD, WRAPPED
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes.scene import Friction, Joint, Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.queries.joint_contact_elements import defaults_to_one, is_constant, named, touching


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about friction."""
    for name, j in scene.joints.items():
        if j.ends is not None:
            yield from _ends(name, j)
        if j.friction is None:
            continue
        path: Path = ("joints", name, "friction")
        element = touching(j)
        if element is None:
            yield Finding(path, *_impossible(j, j.friction))
            continue
        yield from _sizes(path, j, j.friction, element)
        yield from _coefficients(path, j.friction, element, scene.law_of(j.friction))


def _impossible(j: Joint, f: Friction) -> tuple[str, str]:
    """(cause, hint) for a joint whose type does not support the given kind of friction."""
    if REGISTRY[j.type].keeps_distance:
        return f"the ends of a {j.type} are ideal", "for friction, replace it by a body with a spherical joint at each end"
    if WRAPPED & named(f):
        able = ", ".join(k.name for k in REGISTRY.values() if k.banded)
        return f"no band or belt is wrapped around parts of a {j.type} joint", f"joints that support it: {able}"
    if BY_LOAD & named(f):
        able = ", ".join(k.name for k in REGISTRY.values() if k.loaded)
        what = f"a {j.type} joint has no friction that depends on the transmitted load ({' or '.join(sorted(BY_LOAD))})"
        return what, f"joints that support it: {able}"
    if GIVEN & named(f):
        able = ", ".join(k.name for k in REGISTRY.values() if element_of("", k.freely_rubbed, GIVEN))
        return f"a {j.type} joint has no constant friction ({' or '.join(sorted(GIVEN))})", f"joints that support it: {able}"
    able = ", ".join(k.name for k in REGISTRY.values() if k.friction)
    return f"a {j.type} joint cannot have friction", f"joints that support friction: {able}"


def _ends(name: str, j: Joint) -> Iterator[Finding]:
    path: Path = ("joints", name, "ends")
    wanted = OVERLAP if j.ends == OVERLAP else FIXED
    able = [k.name for k in REGISTRY.values() if k.friction and any(_ended(s, wanted) for s in CONTACTS[k.friction].sizes)]
    if j.type not in able:
        what = f"ends: {j.ends} does not apply to a {j.type} joint"
        yield Finding(path, what, f"remove it; it applies to {', '.join(able)}")
    elif j.friction is None:
        yield Finding(path, "without friction the joint has no contacts, so ends has no effect", "remove ends, or add friction")


def _ended(s: Size, ends: str) -> bool:
    return s.ends == ends and s.count == 1


def _sizes(path: Path, j: Joint, f: Friction, element: ContactElement) -> Iterator[Finding]:
    own = {s.name: s for s in element.sizes if s.ends in ("", OVERLAP if j.ends == OVERLAP else FIXED)}
    needed = [s.name for s in own.values() if s.needed and not s.derived]
    what = "constant friction" if is_constant(element) else "friction"
    if element.one_of and sum(getattr(f, name) is not None for name in element.one_of) != 1:
        yield Finding(path, f"{what} of a {j.type} joint needs either {' or '.join(element.one_of)}", own[element.one_of[0]].hint)
    for name in needed:
        if getattr(f, name) is None:
            said = f"{what} of a {j.type} joint needs {' and '.join(needed)}: {name} is missing"
            yield Finding((*path, name), said, own[name].hint)
    for name in sizes():
        value = getattr(f, name)
        if value is None:
            continue
        if name not in own:
            yield Finding((*path, name), f"{what} of a {j.type} joint has no {name}", _instead(j, own, element, name))
        elif isinstance(value, tuple) and len(value) != own[name].count:
            several = ", ".join(k.name for k in REGISTRY.values() if k.friction and _counts(k.friction, name) == len(value))
            yield Finding((*path, name), f"a {j.type} joint has one {name}", f"{len(value)} values are for {several} joints")


def _instead(j: Joint, own: Iterable[str], element: ContactElement, name: str) -> str:
    """The hint for a size that the friction of a joint does not have. The hint names the allowed sizes."""
    usual = REGISTRY[j.type].friction
    if not is_constant(element) and name == PRELOAD.name:
        able = ", ".join(k.name for k in REGISTRY.values() if k.friction and _counts(k.friction, name))
        return f"this joint supports no preload; joints with a preload: {able}; allowed here: {', '.join(own) or 'no sizes'}"
    if not is_constant(element) or not usual:
        return f"allowed here: {', '.join(own)}"
    loads = "preload" in {s.name for s in CONTACTS[usual].sizes}
    constant = ", and preload for the part of the friction that does not depend on the load" if loads else ""
    return f"allowed here: {', '.join(own)}; for friction that depends on the load give sizes{constant}"


def _counts(element: str, name: str) -> int:
    """Number of entries of the size ``name`` of a contact element; 0 when the element has no such size."""
    return next((s.count for s in CONTACTS[element].sizes if s.name == name), 0)


def _coefficients(path: Path, f: Friction, element: ContactElement, law: str) -> Iterator[Finding]:
    """Findings for missing numbers that the law needs. Numbers of other laws are allowed: these numbers take effect if a run
    changes the law."""
    laws: tuple[Path, ...] = ((*path, "law"), ("friction", "law"))
    for n in LAWS[law].numbers:
        if getattr(f, n.name) is not None or n.default is not None or defaults_to_one(element, n, law):
            continue
        if n.needed:
            yield Finding((*path, n.name), f'law "{law}" needs {n.name}', n.hint, about=laws)
        elif n.needed_with and getattr(f, n.needed_with) is not None:
            what = f'with {n.needed_with} the law "{law}" needs {n.name}'
            yield Finding((*path, n.name), what, n.hint, about=laws)
