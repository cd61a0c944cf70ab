"""Replaces variable-length arrays by arrays of their largest length, because not every C99 compiler accepts variable lengths.

The length of an array is a size of the mechanism, such as ``k->neta``, which is known at export. The length can also be a count
whose upper bound is such a size (``array_length_bounds``). Exported sources define these sizes as macros, such as
``TR_MAX_NETA``."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from trunnion.fmu.c_text.array_length_bounds import BOUNDS, CALLS, FIELDS
from trunnion.fmu.c_text.dead_code_and_ascii import definitions
from trunnion.runtime.abi.kernel_records import KERNEL

KINDS = r"double|int|char|tr_\w+"
DECLARED = re.compile(rf"^( +)(?:const )?({KINDS}) ([^;]*);", re.MULTILINE)
NUMBERS = re.compile(r"\b(?:const )?int (?!\*)([^;()]*(?:\([^;]*\)[^;()]*)*);")
WORD = re.compile(r"TR_DOUBLES\(\w+\)|(?:[A-Za-z]\w*(?:->|\.))*(?:[a-z]\w*\(\w*\)|[A-Za-z_]\w*)")


class BoundMissing(ValueError):
    """The length of an array has no known bound. Add a bound in ``fmu/c_text/array_length_bounds.py``."""


@dataclass
class Function:
    """A C function. numbers: for each local integer that is never assigned again, its name and initial expression. lengths: for
    each array, its name and the expression of its length in the source."""

    name: str
    body: str
    numbers: dict[str, str] = field(default_factory=dict)
    lengths: dict[str, str] = field(default_factory=dict)


def fixed(text: str, checked: bool = False) -> str:
    """The text without variable-length arrays. checked: whether the macro ``TR_FITS`` checks each length against its bound at run
    time. If so, the user who compiles the text must define this macro. BoundMissing for a length without a known bound."""
    out, at = [], 0
    for d in definitions(text):
        made = Function(d.name, text[d.body : d.end])
        made.numbers = _numbers(made.body)
        out += [text[at : d.body], _without(made, checked)]
        at = d.end
    return "".join(out) + text[at:]


def _numbers(body: str) -> dict[str, str]:
    """The local integers that never change, with their initial values."""
    found: dict[str, str] = {}
    for declared in NUMBERS.finditer(body):
        for one in split(declared[1]):
            name, _, value = one.partition(" = ")
            if value and name.isidentifier():
                found[name] = "" if name in found else value
    changed = {
        n for n in found if re.search(rf"(?<![\w.>])(?:{n} [-+*/]?= |{n}\+\+|\+\+{n}\b|{n}--|--{n}\b)", _assignments(body, n))
    }
    return {n: v for n, v in found.items() if v and n not in changed}


def _assignments(body: str, name: str) -> str:
    """The body, with the initialization of the variable ``name`` in its declaration removed."""
    return re.sub(rf"(int [^;]*?)\b{name} = ", r"\1", body, count=1)


def split(declarators: str) -> list[str]:
    """The parts of a list whose separators are commas. Commas inside brackets do not separate parts."""
    out, depth, begin = [], 0, 0
    for i, c in enumerate(declarators):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            out.append(declarators[begin:i].strip())
            begin = i + 1
    return [*out, declarators[begin:].strip()]


def _without(made: Function, checked: bool) -> str:
    """The body of a function with arrays of fixed length."""

    def declaration(found: re.Match[str]) -> str:
        if "[" not in found[3]:
            return found[0]
        before = set(made.lengths)
        items = [_declarator(made, one) for one in split(found[3])]
        new = [n for n in made.lengths if n not in before]
        if not new:
            return found[0]
        line = found[0][: found.start(3) - found.start()] + ", ".join(items) + ";"
        firsts = "".join(f"{first(i)} = " for i in items if "[TR_ROOM(" in i) if found[2] in ("double", "int") else ""
        checks = "".join(f" TR_FITS({made.lengths[n]}, {most(made, made.lengths[n])});" for n in new) if checked else ""
        return f"{line}{f' {firsts}0;' if firsts else ''}{checks}"

    body = DECLARED.sub(declaration, made.body)
    for name, length in made.lengths.items():
        body = re.sub(rf"\bsizeof {name}\b", f"(sizeof {name}[0] * (size_t)({length}))", body)
    return _all_used(made, body)


def _all_used(made: Function, body: str) -> str:
    """The body, with a statement ``(void)x;`` for each variable x that only array lengths used. Without this statement, compilers
    would report x as unused."""
    named = {w for length in made.lengths.values() for w in re.findall(r"(?<![\w>.])(?!size_t)[a-z]\w*\b(?!\()", length)}
    for word in sorted(named):
        it = rf"(?<![\w>.]){word}\b"
        if len(re.findall(it, body)) == 1:
            body = re.sub(rf"^( +[^;\n]*{it}[^;]*;)", rf"\1 (void){word};", body, count=1, flags=re.MULTILINE)
    return body


def first(declarator: str) -> str:
    """The C expression for the first element of an array. The exported text initialises this element, so that compilers do not
    report the array as uninitialised."""
    name, *sizes = re.split(r"\[", declarator.partition("[TR_ROOM(")[0] + "[")
    return name + "[0]" * len(sizes)


def _declarator(made: Function, one: str) -> str:
    """A declarator in which the length of a variable-length array is replaced by a constant. Other declarators are unchanged."""
    found = re.match(r"(\w+)((?:\[\w+\])*)\[(.+?)\]( = .*)?$", one)
    if not found or re.fullmatch(r"[\dA-Z_ +*]*|TR_DOUBLES\(\w+\)|[A-Z_]+ \+ 1", found[3]):
        return one
    length = found[3]
    made.lengths[found[1]] = length
    return f"{found[1]}{found[2]}[TR_ROOM({most(made, length)})]{found[4] or ''}"


def most(made: Function, length: str) -> str:
    """Upper bound of an array length, as a C constant."""

    def word(found: re.Match[str]) -> str:
        it = found[0]
        if it.isupper() or it == "size_t" or it.startswith("TR_DOUBLES("):
            return it
        if it in BOUNDS.get(made.name, {}):
            return f"({BOUNDS[made.name][it]})"
        if it in made.numbers:
            return f"({most(made, made.numbers[it])})"
        if it in CALLS:
            return CALLS[it]
        owner, _, name = it.rpartition("->")
        if owner in ("k", "s->k") and name in KERNEL.integers:
            return f"TR_MAX_{name.upper()}"
        if it in FIELDS:
            return FIELDS[it]
        raise BoundMissing(f"{made.name}: {it} of [{length}]")

    return re.sub(r"(?<!\w)\((TR_\w+)\)", r"\1", WORD.sub(word, length))
