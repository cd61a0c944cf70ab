"""Roles of the two parts of a joint: pin and bearing."""

from __future__ import annotations

from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class Fit:
    """Roles of a joint's parts.

    pin_out   whether the outboard part carries the pin.
    ends      part at whose ends the contacts are: "pin", "bearing", or "overlap" (the region where two finite parts overlap)."""

    pin_out: bool = False
    ends: str = "pin"

    @property
    def label(self) -> str:
        """Suffix in names of C functions."""
        return ("pin_out" if self.pin_out else "pin_in") + ("" if self.ends == "pin" else f"_{self.ends}")

    @property
    def ends_out(self) -> bool:
        """Whether the contacts are at the ends of the outboard part."""
        return self.pin_out != (self.ends == "bearing")

    @property
    def sign(self) -> int:
        """+1 if the inboard part carries the pin, −1 if the outboard part carries it."""
        return -1 if self.pin_out else 1
