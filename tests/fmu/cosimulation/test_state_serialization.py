"""An FMU accepts the bytes of a state only if they are complete and come from the same FMU. The FMU refuses all other bytes, and
the run continues."""

from __future__ import annotations

import random
import struct
from contextlib import suppress
from functools import reduce
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu.cosimulation.test_parts_kernel import of_parts
from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export

SEAL, MODE = 16, 48
"""Number of bytes of the mark and the checksum before a state; place of the mode in the state."""
KNEE = ("knee.q[1]", "knee.qd[1]", "events.count")


def checksum(body: bytes) -> int:
    """Checksum of a state, written independently of the FMU."""
    words = struct.unpack(f"<{len(body) // 8}Q", body)

    def mix(total: int, word: int) -> int:
        total = (total ^ word) * 0x100000001B3 % 2**64
        return total ^ total >> 29

    return reduce(mix, words, 0xCBF29CE484222325)


def forged(state: bytes, at: int, value: bytes) -> bytes:
    """The state with other bytes at a place of its body, and with a correct checksum."""
    body = state[SEAL : SEAL + at] + value + state[SEAL + at + len(value) :]
    return state[:8] + struct.pack("<Q", checksum(body)) + body


def places(host: Host, state: bytes) -> int:
    """Positions at which a state stores the places of its arrays. The first place is 0; the second place begins after the
    parameters."""
    count = sum(v.causality == "parameter" for v in host.md.modelVariables)
    return state[SEAL:].index(struct.pack("<2i", 0, count))


def flipped(state: bytes, bit: int) -> bytes:
    """The state with one inverted bit."""
    changed = bytearray(state)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def midway(file: Path) -> tuple[Host, bytes]:
    """A host in the middle of a run, and its state as bytes."""
    host = Host(file, stop=1.0)
    host.run(0.0, 10, 0.01)
    return host, host.fmu.serializeFMUState(host.fmu.getFMUState())


def refusal(host: Host, state: bytes) -> str:
    """The message about refused bytes; "" if the FMU accepted the bytes."""
    host.log.clear()
    with suppress(FMICallException):
        host.fmu.deSerializeFMUstate(state)
        return ""
    assert host.log[-1][0] == 3
    return host.log[-1][1]


def test_no_bit_of_a_state_can_be_turned_unseen_and_the_run_continues() -> None:
    host, state = midway(exported("arm"))
    chance = random.Random(8)
    for bit in [8 * (SEAL + places(host, state) + 3) + 5, *(chance.randrange(8 * len(state)) for _ in range(10_000))]:
        said = refusal(host, flipped(state, bit))
        assert said.startswith("these bytes are")
        assert bit // 8 < 8 or said == "these bytes are a damaged state: the checksum is wrong; use an undamaged copy"
    same, _ = midway(exported("arm"))
    assert host.run(0.1, 20, 0.01, *KNEE) == same.run(0.1, 20, 0.01, *KNEE)


@pytest.mark.parametrize("made", [exported, of_parts], ids=["compiled", "parts"])
def test_the_same_state_is_the_same_bytes_in_every_instance(made) -> None:
    """The bytes contain no address of a process."""
    assert midway(made("arm"))[1] == midway(made("arm"))[1]


def test_states_of_other_lengths_and_of_another_version_are_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.fmu"
    export("spherical_pendulum", other, overrides={"joints.ball.friction.mu": 0.5})
    (host, state), (_, foreign) = midway(exported("spherical_pendulum")), midway(other)
    assert len(state) == len(foreign)
    assert refusal(host, foreign) == "these bytes are a state of another FMU, or of another export of this FMU"
    for wrong in (b"", state[:-1], state[: len(state) // 2], state + b"\0"):
        assert refusal(host, wrong).startswith("these bytes are not a state of this FMU: their number is wrong")
    assert refusal(host, state) == ""


def test_places_of_a_state_are_computed_again_and_its_numbers_are_checked() -> None:
    """A forged state has a correct checksum. The FMU ignores its places of arrays, and refuses numbers out of range."""
    host, state = midway(exported("arm"))
    expected = host.run(0.1, 20, 0.01, *KNEE)
    assert forged(state, MODE, state[SEAL + MODE : SEAL + MODE + 4]) == state
    assert "out of range" in refusal(host, forged(state, MODE, struct.pack("<i", 9)))
    moved = forged(state, places(host, state), struct.pack("<4i", 1 << 20, -5, 7, 1 << 29))
    host.fmu.setFMUState(host.fmu.deSerializeFMUstate(moved))
    assert host.run(0.1, 20, 0.01, *KNEE) == expected
