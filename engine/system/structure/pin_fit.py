"""How the two parts of a joint fit into each other."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fit:
    """Which part of a joint is inside, and which has the ends that contacts sit at. pin_out: the outboard part carries the pin;
    ends: "pin", "bearing" (the part around it has them) or "overlap" (they are where two finite parts end to touch)."""

    pin_out: bool = False
    ends: str = "pin"

    @property
    def label(self) -> str:
        """In names of C functions."""
        return ("pin_out" if self.pin_out else "pin_in") + ("" if self.ends == "pin" else f"_{self.ends}")

    @property
    def ends_out(self) -> bool:
        """Whether the outboard part has the ends."""
        return self.pin_out != (self.ends == "bearing")

    @property
    def sign(self) -> int:
        """+1 where the inboard part carries the pin, −1 where the outboard part does."""
        return -1 if self.pin_out else 1
