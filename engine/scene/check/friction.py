"""Checks of friction: which joints can have it, the sizes of the pin, the numbers a law needs. Laws and contact elements
declare what is needed and what may stand beside what; the values themselves are checked with all others in ``numbers``."""

from __future__ import annotations

from collections.abc import Iterator

from engine.contact import REGISTRY as CONTACTS
from engine.contact import sizes
from engine.friction import REGISTRY as LAWS
from engine.joints import REGISTRY
from engine.scene.finding import Finding, Path
from engine.scene.model import Friction, Joint, Scene


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about friction."""
    for name, j in scene.joints.items():
        if j.ends is not None:
            yield from _ends(name, j)
        if j.friction is None:
            continue
        path: Path = ("joints", name, "friction")
        if not REGISTRY[j.type].friction:
            able = ", ".join(k.name for k in REGISTRY.values() if k.friction)
            yield Finding(path, f"a {j.type} joint has no friction element", f"joints that can rub: {able}")
            continue
        yield from _sizes(path, j, j.friction)
        yield from _coefficients(path, j.friction, scene.law_of(j.friction))


def _ends(name: str, j: Joint) -> Iterator[Finding]:
    able = [k.name for k in REGISTRY.values() if k.friction and CONTACTS[k.friction].ended]
    if j.type not in able:
        what = f"the contacts of a {j.type} joint have no ends that either part could have"
        yield Finding(("joints", name, "ends"), what, f"leave it out; joints with ends: {', '.join(able)}")


def _sizes(path: Path, j: Joint, f: Friction) -> Iterator[Finding]:
    own = {s.name: s for s in CONTACTS[REGISTRY[j.type].friction].sizes}
    needed = [s.name for s in own.values() if s.needed]
    for name in needed:
        if getattr(f, name) is None:
            what = f"friction of a {j.type} joint needs {' and '.join(needed)}: {name} is missing"
            yield Finding((*path, name), what, own[name].hint)
    for name in sizes():
        value = getattr(f, name)
        if value is None:
            continue
        if name not in own:
            yield Finding((*path, name), f"friction of a {j.type} joint has no {name}", f"it has: {', '.join(own)}")
        elif isinstance(value, tuple) and len(value) != own[name].count:
            several = ", ".join(k.name for k in REGISTRY.values() if k.friction and _counts(k.friction, name) == len(value))
            yield Finding((*path, name), f"a {j.type} joint has one {name}", f"{len(value)} are for joints of type {several}")


def _counts(element: str, name: str) -> int:
    """How many entries a contact element's size of this name has."""
    return next((s.count for s in CONTACTS[element].sizes if s.name == name), 0)


def _coefficients(path: Path, f: Friction, law: str) -> Iterator[Finding]:
    """Mistakes for numbers that the law needs and that are not given. Numbers of other laws may be given too: they are used
    when their law is chosen."""
    laws: tuple[Path, ...] = ((*path, "law"), ("friction", "law"))
    for n in LAWS[law].numbers:
        if getattr(f, n.name) is not None or n.default is not None:
            continue
        if n.needed:
            yield Finding((*path, n.name), f'law "{law}" needs {n.name}', n.hint, about=laws)
        elif n.needed_with and getattr(f, n.needed_with) is not None:
            what = f'with {n.needed_with} the law "{law}" needs {n.name}'
            yield Finding((*path, n.name), what, n.hint, about=laws)
