"""Connections as the server takes them: a request's head has to come in time; and without keys only this account's are taken."""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_SECONDS = 10.0
"""Time for the head of a request, from its first byte or from when the connection was made."""
LATE = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
STRANGER = b"this server takes no keys, and belongs to another account of this machine: start it with --keys to share it\n"
REFUSED = b"HTTP/1.1 403 Forbidden\r\nconnection: close\r\ncontent-type: text/plain\r\ncontent-length: %d\r\n\r\n%s" % (
    len(STRANGER),
    STRANGER,
)
TABLES = ("/proc/net/tcp", "/proc/net/tcp6")


class Timely(H11Protocol):
    """A connection whose requests have to begin in time."""

    head: asyncio.TimerHandle | None = None
    own_only = False

    def connection_made(self, transport: Any) -> None:
        """Take a connection; without keys, only of this account."""
        super().connection_made(transport)
        if self.own_only and self.client is not None and another_account(*self.client):
            transport.write(REFUSED)
            transport.close()
            return
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Take bytes; from the first of a head on, the rest of it has so long."""
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._came()
        elif self.head is None and self.timeout_keep_alive_task is None:
            self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._came()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self.head = self.loop.call_later(HEAD_SECONDS, self._late)

    def _came(self) -> None:
        if self.head is not None:
            self.head.cancel()
            self.head = None

    def _late(self) -> None:
        self.head = None
        if not self.transport.is_closing():
            self.transport.write(LATE)
            self.transport.close()


class OwnOnly(Timely):
    """A connection that is taken from this account of the machine, and from its administrator."""

    own_only = True


def another_account(host: str, port: int) -> bool:
    """Whether a connection from this machine comes from another account. Where the system does not say so, it does not."""
    if sys.platform != "linux":
        return False
    for table in TABLES:
        try:
            lines = Path(table).read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            fields = line.split()
            if int(fields[1].rpartition(":")[2], 16) == port and _is(fields[1], host) and int(fields[7]) not in (0, os.geteuid()):
                return True
    return False


def _is(entry: str, host: str) -> bool:
    """Whether an entry of the system's table is of this address (IPv4, also as it stands in IPv6's table, or ::1)."""
    import ipaddress

    digits = entry.rpartition(":")[0]
    packed = b"".join(bytes.fromhex(digits[i : i + 8])[::-1] for i in range(0, len(digits), 8))
    there = ipaddress.ip_address(packed)
    plain = getattr(there, "ipv4_mapped", None) or there
    return plain == ipaddress.ip_address(host.partition("%")[0])
