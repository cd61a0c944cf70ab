"""Characters that are not allowed in text that other users will see in terminals and pages. These characters are control
characters, line separators, and characters that change the direction of writing."""

from __future__ import annotations

import re

HIDDEN = r"\u0000-\u001f\u007f-\u009f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""The excluded characters, as a class of regular expressions."""
PLAIN = rf"^[^{HIDDEN}]*$"
"""The pattern of a text without excluded characters."""
_HIDDEN = re.compile(f"[{HIDDEN}]")


def visible(text: str) -> str:
    """The text with each excluded character as its escape sequence, such as \\\\u202e."""
    return _HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
