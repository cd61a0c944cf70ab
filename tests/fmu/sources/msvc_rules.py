"""Rules of Microsoft's C compiler, which is not available here. The search finds C text that this compiler refuses and other
compilers accept."""

from __future__ import annotations

import re

LACKED = {
    r"__(?:attribute|extension|typeof|asm|label)__|\btypeof\b|__builtin_\w+|\basm\b": "a word of GNU C",
    r"\b_(?:Complex|Imaginary|Thread_local|Generic|Atomic|Noreturn|Alignas|Alignof|Static_assert)\b": "a word beyond C99",
    r"\(\{": "a block that is an expression",
    r"\?\s*:": "a condition without its second operand",
    r"\bcase [^:;{}?]*\.\.\.": "a range of cases",
    r"[\]\w] = \{\s*\}|\)\{\s*\}": "an empty list of values",
    r"(?:double|int|char) \w+\[0\];": "an array of nothing",
    r"\bstatic (?:const )?\d+\]": "a least length of a parameter",
    r"\b(?:alloca|strdup|M_PI|M_E|ssize_t|unistd|pthread)\b": "a name of POSIX",
    r"\b0b[01]+\b": "a binary number",
    r"\brestrict\b(?!\n)": "restrict, which older ones spell otherwise",
}
"""Features of C that Microsoft's compiler lacks and others have, as patterns of code without comments and strings."""
LONGEST = 16_380
"""Longest string, in bytes, that Microsoft's compiler accepts (C2026)."""
PLAIN = re.compile(r'"(?:[^"\\\n]|\\.)*"|/\*.*?\*/', re.DOTALL)
CONSTANT = re.compile(r"\bsizeof\b.*|\bTR_DOUBLES\(\w+\)")  # TR_DOUBLES is a sizeof, counted in doubles
SIZED = re.compile(r"^ +(?:const )?(?:double|int|char|long|tr_\w+|fmu_\w+) [^;=()]*?\w\[([^\]]*[a-z][^\]]*)\]", re.MULTILINE)


def refused(text: str) -> list[str]:
    """Code in a C text that Microsoft's compiler would refuse: the feature, and its place."""
    code = PLAIN.sub(lambda found: '""' if found[0].startswith('"') else " ", text)
    wrong = [f"{what}: {m[0]!r}" for pattern, what in LACKED.items() for m in re.finditer(pattern, code)]
    lengths = ((m[0].strip(), CONSTANT.sub("", m[1])) for m in SIZED.finditer(code))
    wrong += [f"an array of variable length: {told}" for told, length in lengths if re.search("[a-z]", length)]
    wrong += [f"a string of {len(s)} bytes" for s in PLAIN.findall(text) if s.startswith('"') and len(s) > LONGEST]
    return wrong + [f"a letter beyond ASCII: {c!r}" for c in sorted(set(text)) if ord(c) > 127]
