"""Addresses of sockets, as users write them: PORT or HOST:PORT, on 127.0.0.1 unless told otherwise."""

from typing import NamedTuple

from quadstep.errors import UserError

HERE = "127.0.0.1"


class Address(NamedTuple):
    """Of a socket."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


def address(text: str, usual: int) -> Address:
    """The address that a text means. usual: the port where none is said. Raises UserError."""
    host, _, port = text.rpartition(":") if ":" in text else ("", "", text) if text.isdigit() else (text, "", "")
    if port and not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise UserError(f"{text}: the port should be a number from 1 to 65535; allowed: PORT or HOST:PORT")
    return Address(host or HERE, int(port) if port else usual)
