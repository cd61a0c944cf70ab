"""Friction: which joints can have it, the geometry of the pin, the coefficients a law needs, laws that are built."""

from __future__ import annotations

from collections.abc import Iterator

from engine.joints import REGISTRY
from engine.scene.finding import Finding, Path
from engine.scene.laws import AVAILABLE_LAWS, NEEDS
from engine.scene.model import Friction, Joint, Scene

GEOMETRY = {
    "ball": ("radius",),
    "journal": ("radius", "half_length"),
    "shaft": ("radius", "half_length"),
    "universal": ("radius", "half_length"),
    "sleeve": ("half_length", "half_width", "half_height"),
}
"""Contact element → sizes it needs."""
OPTIONAL = {"journal": ("thrust_radius",)}
EXAMPLES = {"viscosity": "0.2 s/m", "mu_static": "0.4", "v_eps": '"1e-4 m/s"', "v_stribeck": '"1 mm/s"',
            "bristle_stiffness": '"1e5 1/m"'}
"""What a missing or wrong number could be; 0.3 for the rest."""
SIZES = ("radius", "half_length", "half_width", "half_height", "thrust_radius")


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about friction."""
    yield from _law(("friction", "law"), scene.friction.law)
    if scene.friction.v_eps <= 0:
        yield Finding(("friction", "v_eps"), "v_eps must be positive", 'for example "1e-4 m/s"')
    for name, j in scene.joints.items():
        if j.friction is None:
            continue
        path: Path = ("joints", name, "friction")
        if not REGISTRY[j.type].friction:
            able = ", ".join(k.name for k in REGISTRY.values() if k.friction)
            yield Finding(path, f"a {j.type} joint has no friction element", f"joints that can rub: {able}")
            continue
        yield from _sizes(path, j, j.friction)
        yield from _coefficients(path, j.friction, j.friction.law or scene.friction.law)


def _law(path: Path, law: str) -> Iterator[Finding]:
    if law not in AVAILABLE_LAWS:
        yield Finding(
            path, f'law "{law}" is not available in this version', f"available: {', '.join(sorted(AVAILABLE_LAWS))}"
        )


def _sizes(path: Path, j: Joint, f: Friction) -> Iterator[Finding]:
    element = REGISTRY[j.type].friction
    needed = GEOMETRY[element]
    missing = [s for s in needed if getattr(f, s) is None]
    for size in missing:
        yield Finding(
            (*path, size),
            f"friction of a {j.type} joint needs {' and '.join(needed)}: {size} is missing",
            f'for example {size}: "20 mm"',
        )
    for size in SIZES:
        value = getattr(f, size)
        if value is None:
            continue
        if size not in (*needed, *OPTIONAL.get(element, ())):
            yield Finding((*path, size), f"friction of a {j.type} joint has no {size}", f"it has: {', '.join(needed)}")
        elif isinstance(value, tuple) and element != "universal":
            yield Finding((*path, size), f"a {j.type} joint has one {size}", "two are for universal joints")
        elif any(v <= 0 for v in (value if isinstance(value, tuple) else (value,))):
            yield Finding((*path, size), f"{size} must be positive")


def _coefficients(path: Path, f: Friction, law: str) -> Iterator[Finding]:
    if f.law is not None:
        yield from _law((*path, "law"), f.law)
    laws: tuple[Path, ...] = ((*path, "law"), ("friction", "law"))
    for needed in NEEDS.get(law, ("mu",)):
        if getattr(f, needed) is None:
            hint = f"for example {needed}: {EXAMPLES.get(needed, '0.3')}"
            yield Finding((*path, needed), f'law "{law}" needs {needed}', hint, about=laws)
    if law == "lugre" and f.mu_static is not None and f.v_stribeck is None:
        missing = "with mu_static the law \"lugre\" needs v_stribeck"
        yield Finding((*path, "v_stribeck"), missing, f"for example v_stribeck: {EXAMPLES['v_stribeck']}", about=laws)
    for key in ("mu", "mu_static", "viscosity", "bristle_damping"):
        value = getattr(f, key)
        if value is not None and value < 0:
            yield Finding((*path, key), f"{key} must not be negative", "friction opposes sliding by itself")
    if f.mu_static is not None and f.mu is not None and 0 <= f.mu_static < f.mu:
        yield Finding((*path, "mu_static"), "static friction below sliding friction", "mu_static is mu or more")
    for speed in ("v_eps", "v_stribeck", "bristle_stiffness"):
        value = getattr(f, speed)
        if value is not None and value <= 0:
            yield Finding((*path, speed), f"{speed} must be positive", f"for example {EXAMPLES[speed]}")
