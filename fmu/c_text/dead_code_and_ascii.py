"""Removes unused code from C text and converts the text to ASCII, so that any compiler accepts the text without warnings."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

COMMENT = r"(?:/\*(?:[^*]|\*(?!/))*\*/\n)?"
HEAD = re.compile(COMMENT + r"^(?!typedef|struct|enum|extern|#)([A-Za-z_][^;={}#\"]*?\b(\w+)\(([^;{}]*)\)) ?\{", re.MULTILINE)
BRACE = re.compile(r'[{}]|"(?:[^"\\\n]|\\.)*"|/\*.*?\*/', re.DOTALL)
WORD = re.compile(r"[A-Za-z_]\w*")
SIGNS = {
    "MINUS SIGN": "-", "EN DASH": "-", "MIDDLE DOT": "*", "MULTIPLICATION SIGN": "x", "RIGHTWARDS ARROW": "->",
    "LEFTWARDS ARROW": "<-",
    "LESS-THAN OR EQUAL TO": "<=", "GREATER-THAN OR EQUAL TO": ">=", "PLUS-MINUS SIGN": "+-", "N-ARY SUMMATION": "sum",
    "PARTIAL DIFFERENTIAL": "d", "SQUARE ROOT": "sqrt", "SUPERSCRIPT TWO": "^2", "SUPERSCRIPT THREE": "^3",
    "MODIFIER LETTER CAPITAL T": "^T", "SUPERSCRIPT PLUS SIGN": "^+", "SUPERSCRIPT MINUS": "^-",
}  # fmt: skip
"""ASCII replacements of signs, by Unicode name."""
PROTOTYPE = re.compile(COMMENT + r"^static [^;{}=#()]*\b(\w+)\([^;{}]*\);\n", re.MULTILINE)
CONSTANT = re.compile(r"^static const [^=;(]*?\b(\w+)(?:\[\w*\])? = [^;]*;\n", re.MULTILINE)
TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|/\*.*?\*/|[A-Za-z_]\w*', re.DOTALL)
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"|/\*.*?\*/', re.DOTALL)


@dataclass(frozen=True)
class Definition:
    """A function definition. start, head, body, end: positions in the text of its comment, its head, its body and its end."""

    start: int
    head: int
    body: int
    end: int
    name: str
    parameters: str
    static: bool


def definitions(text: str) -> Iterator[Definition]:
    """The function definitions of a text, in order."""
    at = 0
    while found := HEAD.search(text, at):
        end = _closing(text, found.end())
        yield Definition(found.start(), found.start(1), found.end(), end, found[2], found[3], found[1].startswith("static"))
        at = end


def _closing(text: str, at: int) -> int:
    """The position after the closing brace of the block that contains the position ``at``. A line break after the brace is skipped,
    too."""
    depth = 1
    for found in BRACE.finditer(text, at):
        depth += (found[0] == "{") - (found[0] == "}")
        if depth == 0:
            return found.end() + (text[found.end() : found.end() + 1] == "\n")
    raise ValueError("a brace is never closed")


def used_only(text: str) -> str:
    """The text without unused static functions, their prototypes, and tables that only unused functions use."""
    counts, gone = _words(text), list[tuple[int, int]]()
    told = defaultdict(list)
    for m in PROTOTYPE.finditer(text):
        told[m[1]].append(m.span())
    pieces = {m[1]: [m.span()] for m in CONSTANT.finditer(text)}
    pieces |= {d.name: [(d.start, d.end), *told[d.name]] for d in definitions(text) if d.static}
    while idle := [name for name, spans in pieces.items() if counts[name] == len(spans)]:
        cut = [span for name in idle for span in pieces.pop(name)]
        for start, end in cut:
            counts.subtract(_words(text[start:end]))
        gone += cut
    for start, end in sorted(gone, reverse=True):
        text = text[:start] + text[end:]
    return text


def _words(text: str) -> Counter[str]:
    """How often each word occurs outside of strings and comments."""
    return Counter(WORD.findall(STRING.sub("", text)))


def nothing_unused(text: str) -> str:
    """The text, with a statement ``(void)x;`` for each unused parameter and each generated array x, so that compilers do not report
    x as unused."""
    out, at = [], 0
    for d in definitions(text):
        body = text[d.body : d.end]
        names = [WORD.findall(p)[-1] for p in d.parameters.split(",") if len(WORD.findall(p)) > 1 and "(" not in p]
        idle = set(names) - set(WORD.findall(STRING.sub("", body)))
        body = re.sub(r"^(double (\w+)\[\d+\];)$", r"\1 (void)\2;", body, flags=re.MULTILINE)
        out += [text[at : d.body], "".join(f" (void){n};" for n in names if n in idle), body]
        at = d.end
    return "".join(out) + text[at:]


def ascii_only(text: str) -> str:
    """The text in ASCII. A letter outside ASCII is spelled out in comments, and becomes octal escapes of its bytes in strings."""

    def spelt(found: re.Match[str]) -> str:
        part = found[0]
        if part.startswith('"'):
            return "".join(c if ord(c) < 128 else "".join(f"\\{b:03o}" for b in c.encode()) for c in part)
        return "".join(c if ord(c) < 128 else _in_ascii(c) for c in part)

    return STRING.sub(spelt, text)


def _in_ascii(letter: str) -> str:
    """ASCII text for a letter in a comment: the name of a Greek letter, or the letter without its accent."""
    name = unicodedata.name(letter, "")
    if name.startswith("GREEK"):
        word = name.partition(" WITH ")[0].split()[-1].lower()
        return word.capitalize() if " CAPITAL " in name else word
    return SIGNS.get(name) or unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()


def renamed(text: str, names: dict[str, str]) -> str:
    """The text with identifiers renamed, except in strings and comments. names: new names by old names."""
    return TOKEN.sub(lambda found: names.get(found[0], found[0]), text)
