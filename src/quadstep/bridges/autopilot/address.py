"""Addresses of sockets, as users write them: PORT or HOST:PORT, on 127.0.0.1 unless told otherwise."""

from typing import NamedTuple

from quadstep.io.errors import UserError

HERE = "127.0.0.1"


class Address(NamedTuple):
    """Of a socket."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


def refuse_strange(text: str, colons: int, allowed: str) -> None:
    """Refuses an address with spaces or of IPv6. colons: as many as an address may have. Raises UserError."""
    if any(sign.isspace() for sign in text):
        raise UserError(f"{text!r}: should have no spaces; allowed: {allowed}")
    if text.count(":") > colons or "[" in text:
        raise UserError(f"{text}: IPv6 is not supported; allowed: {allowed}, HOST a name or an IPv4 address")


def address(text: str, usual: int) -> Address:
    """The address that a text means. usual: the port where none is said. Raises UserError."""
    refuse_strange(text, 1, "PORT or HOST:PORT")
    host, _, port = text.rpartition(":") if ":" in text else ("", "", text) if text.isdigit() else (text, "", "")
    if port and not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise UserError(f"{text}: the port should be a number from 1 to 65535; allowed: PORT or HOST:PORT")
    return Address(host or HERE, int(port) if port else usual)
