"""HTTP connections. The head of a request must arrive in time. A server without keys accepts only connections from its own account
and from the administrator."""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_SECONDS = 10.0
"""Longest time in which the head of a request must arrive, s, from its first byte or from the start of the connection."""
TIMEOUT_RESPONSE = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
OTHER_ACCOUNT = b"this server takes no keys and belongs to another account of this machine: start it with --keys to share it\n"
REFUSED = b"HTTP/1.1 403 Forbidden\r\nconnection: close\r\ncontent-type: text/plain\r\ncontent-length: %d\r\n\r\n%s" % (
    len(OTHER_ACCOUNT),
    OTHER_ACCOUNT,
)
TABLES = ("/proc/net/tcp", "/proc/net/tcp6")


class TimedConnection(H11Protocol):
    """A connection that is closed when the head of a request does not arrive in time."""

    head: asyncio.TimerHandle | None = None
    same_account_only = False

    def connection_made(self, transport: Any) -> None:
        """Accept a connection. If ``same_account_only``, refuse connections from other accounts of this machine."""
        super().connection_made(transport)
        if self.same_account_only and self.client is not None and is_other_account(*self.client):
            transport.write(REFUSED)
            transport.close()
            return
        self._start_timer()

    def data_received(self, data: bytes) -> None:
        """Receive bytes, and start or stop the timer for the head of a request."""
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._stop_timer()
        elif self.head is None and self.timeout_keep_alive_task is None:
            self._start_timer()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_timer()
        super().connection_lost(exc)

    def _start_timer(self) -> None:
        self.head = self.loop.call_later(HEAD_SECONDS, self._time_out)

    def _stop_timer(self) -> None:
        if self.head is not None:
            self.head.cancel()
            self.head = None

    def _time_out(self) -> None:
        self.head = None
        if not self.transport.is_closing():
            self.transport.write(TIMEOUT_RESPONSE)
            self.transport.close()


class SameAccountConnection(TimedConnection):
    """A connection that is accepted only from the server's own account and from the administrator of the machine."""

    same_account_only = True


def is_other_account(host: str, port: int) -> bool:
    """Whether another account of this machine opened the connection that comes from this address. False if the system does not
    report the account."""
    if sys.platform != "linux":
        return False
    for table in TABLES:
        try:
            lines = Path(table).read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            fields = line.split()
            if (
                int(fields[1].rpartition(":")[2], 16) == port
                and _is_address(fields[1], host)
                and int(fields[7]) not in (0, os.geteuid())
            ):
                return True
    return False


def _is_address(entry: str, host: str) -> bool:
    """Whether an entry of the system's connection table has this address. The address can be IPv4 (also in the table of IPv6) or
    ::1."""
    import ipaddress

    digits = entry.rpartition(":")[0]
    packed = b"".join(bytes.fromhex(digits[i : i + 8])[::-1] for i in range(0, len(digits), 8))
    there = ipaddress.ip_address(packed)
    plain = getattr(there, "ipv4_mapped", None) or there
    return plain == ipaddress.ip_address(host.partition("%")[0])
