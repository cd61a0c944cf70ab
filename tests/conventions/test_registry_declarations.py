"""Laws, contact elements and joints are declared in one place, and no other code names them. Importing an inconsistent declaration
fails."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.conventions.parsed_sources import syntax_of
from trunnion.basics.number_declarations import NOT_NEGATIVE, POSITIVE, Bound, Number, merged
from trunnion.elements import contact, friction, joints
from trunnion.elements.contact.registry import registered as registered_elements
from trunnion.elements.friction import Law, Rest
from trunnion.elements.friction.registry import registered as registered_laws

ROOT = Path(__file__).resolve().parents[2]
OWN = {"engine/elements", "engine/importers/schemas"}
"""Folders that declare these names, or the items of other programs' formats."""
PRODUCT = [p for top in ("engine", "fmu", "service") for p in sorted((ROOT / top).rglob("*"))
           if p.suffix in (".py", ".js", ".html", ".txt", ".h", ".c") and "_models" not in p.parts]  # fmt: skip
OF_OTHERS = {("engine/importers/mjcf/joints.py", "ball"), ("engine/importers/sdf/joints.py", "ball")}
"""Words of other programs that are also names in this project, in the files that translate these words."""
LAW = re.compile(rf"\b({'|'.join(friction.REGISTRY)})\b")
NAMED = re.compile("|".join([*friction.REGISTRY, *contact.REGISTRY]))


def texts(file: Path) -> Iterator[str]:
    """Texts in a file that a machine or a user reads: string constants of Python; in other languages, everything except
    comments."""
    text = file.read_text(encoding="utf-8")
    if file.suffix != ".py":
        bare = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)
        yield from (line for line in bare.splitlines() if not line.startswith("#include"))
        return
    if NAMED.search(text):
        yield from syntax_of(file).shown


@cache
def elsewhere() -> tuple[tuple[str, str], ...]:
    """(file, text) of all text outside the folders in which laws, contact elements and joints declare themselves."""
    names = {file.relative_to(ROOT).as_posix(): file for file in PRODUCT}
    others = {name: file for name, file in names.items() if not any(name.startswith(f"{own}/") for own in OWN)}
    return tuple((name, text) for name, file in others.items() for text in texts(file))


def test_no_file_outside_its_folder_names_a_law() -> None:
    assert [(file, text[:80]) for file, text in elsewhere() if LAW.search(text)] == []


def test_no_file_outside_its_folder_names_a_contact_element() -> None:
    assert [(file, text) for file, text in elsewhere() if text in contact.REGISTRY and (file, text) not in OF_OTHERS] == []


def test_the_scan_finds_a_name_where_there_is_one(tmp_path: Path) -> None:
    name = next(iter(friction.REGISTRY))
    file = tmp_path / "a.py"
    file.write_text(f'"""{name}"""\nX = f"law {name} {{1}}"\n', encoding="utf-8")
    assert [bool(LAW.search(t)) for t in texts(file)].count(True) == 1


def test_a_joints_freedoms_are_those_its_contact_element_rubs_along() -> None:
    for kind in joints.REGISTRY.values():
        if kind.friction:
            element = contact.REGISTRY[kind.friction]
            assert sum(map(len, element.pairs)) + len(element.bound) == kind.nv


# -- wrong declarations ---------------------------------------------------------------------------------------------------------


def law(**changed: Any) -> type[Law]:
    """A valid declaration of a law, with the given changes."""
    mu = Number("mu", "1", "coefficient", NOT_NEGATIVE)
    right: dict[str, Any] = {
        "name": "trial", "numbers": (mu,), "rest": Rest.SMOOTH, "formula": "μ v", "at_rest": "0",
        "slope": lambda self, speed2: self.value["mu"],
    }  # fmt: skip
    return type("Trial", (Law,), right | changed)


def element(**changed: Any) -> contact.ContactElement:
    """A valid declaration of a contact element, with the given changes."""
    return replace(next(iter(contact.REGISTRY.values())), name="trial", **changed)


MU = Number("mu", "1", "coefficient", NOT_NEGATIVE)
SIZES = next(iter(contact.REGISTRY.values())).sizes
MU_SIZE = replace(SIZES[0], name="mu")
WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "a bound without numbers": (lambda: Bound(1.0, 1.0), "no number lies between"),
    "a number without a name": (lambda: Number("Mu", "1", "text"), "cannot be the name"),
    "a number that says nothing": (lambda: Number("mu", "1", ""), "has no description"),
    "a default out of bounds": (lambda: Number("mu", "1", "text", POSITIVE, default=0.0), "its default 0 must be positive"),
    "none of a number": (lambda: Number("mu", "1", "text", count=0), "count 0 must be at least 1"),
    "a law without rest": (lambda: law(rest=None), "does not declare its behaviour at rest"),
    "a law without name": (lambda: law(name=""), "its name"),
    "a law without numbers": (lambda: law(numbers=()), "declares no numbers"),
    "numbers that are none": (lambda: law(numbers=(MU, "v_eps")), "a tuple of Number"),
    "one number twice": (lambda: law(numbers=(MU, MU)), "two numbers are called mu"),
    "a scale that is none": (lambda: law(scale="viscosity"), "proportional to viscosity"),
    "a scale that may be missing": (lambda: law(numbers=(replace(MU, needed=False),)), "proportional to mu"),
    "a law without a formula": (lambda: law(formula=""), "formula"),
    "a kink without speed": (lambda: law(rest=Rest.KINK), "a kink speed"),
    "bristles without state": (lambda: law(rest=Rest.BRISTLES), "drift, carried and state_scale"),
    "a set-valued law without level": (lambda: law(rest=Rest.SET_VALUED), r"law trial \(class Trial in .*\): .*define level\(\)"),
    "a kink between one branch": (lambda: law(rest=Rest.KINK, kink=property(lambda self: 1)), r"define level\(\)"),
    "a smooth law of no friction": (lambda: law(slope=Law.slope), r"define level\(\).* or slope\(\)"),
    "a set-valued law that smooths": (lambda: law(rest=Rest.SET_VALUED, exact="other"), "cannot smooth another law"),
    "a number beside one there is not": (lambda: law(numbers=(replace(MU, not_below="nu"),)), "which is not one of its numbers"),
    "needed always and sometimes": (
        lambda: law(numbers=(MU, replace(MU, name="nu", needed_with="mu"))), "not both"),
    "two laws of one name": (lambda: registered_laws([law(), law()]), "two laws are called trial"),
    "a twin of no law": (lambda: registered_laws([law(exact="nobody")]), "not the name of a set-valued law"),
    "a twin that is not set-valued": (lambda: registered_laws([law(), law(name="other", dry="trial")]), "not the name of a"),
    "one number, two units": (lambda: merged({"a": (MU,), "b": (replace(MU, unit="m"),)}), "another unit in b than in a"),
    "one number, two bounds": (lambda: merged({"a": (MU,), "b": (replace(MU, bound=POSITIVE),)}), "another bound"),
    "pairs that leave a freedom out": (lambda: element(pairs=((1,),)), "every freedom"),
    "more places than contacts": (lambda: element(count=1), "2 places for 1 contacts"),
    "no pin": (lambda: element(pins=lambda g: []), "no pin"),
    "a part there is not": (lambda: element(ideal="middle"), "unknown"),
    "a place on no part": (lambda: element(places=lambda g: [contact.Place("axle", 0, 0.0, 1.0)]), "unknown part"),
    "a component there is not": (lambda: element(needs=lambda numbers, adams: ("f4",)), "components other than"),
    "two elements of one name": (lambda: registered_elements([element(), element()]), "two contact elements"),
    "a size with a law's name": (lambda: registered_elements([element(sizes=(*SIZES, MU_SIZE))]), "of friction"),
    "a place by a size there is not": (lambda: element(sizes=SIZES[:1]), "half_length, which is not one of its sizes"),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_declaration_cannot_be_imported(what: str) -> None:
    make, words = WRONG[what]
    with pytest.raises(ValueError, match=words):
        make()


def test_all_that_is_wrong_with_a_law_is_reported_at_once() -> None:
    with pytest.raises(ValueError, match=r"(?s)formula.*define level\(\)"):
        law(rest=Rest.SET_VALUED, formula="")


def test_a_right_declaration_is_registered() -> None:
    assert registered_laws([law()])["trial"].numbers == (MU,)
    assert registered_elements([element()])["trial"].count == 2


def test_a_unit_that_scenes_do_not_know_is_refused() -> None:
    from trunnion.scene.data_classes.friction_keys import annotation

    with pytest.raises(ValueError, match="there is no unit 'furlong'"):
        annotation(replace(MU, unit="furlong"), 1)
