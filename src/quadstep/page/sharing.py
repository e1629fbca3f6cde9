"""Results for others in the same network: a random token in the link, and a QR code of it."""

import hmac
import io
import ipaddress
import secrets
import socket
from typing import NamedTuple

from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError

LOCAL = "127.0.0.1"
EVERYWHERE = ("0.0.0.0", "::")
ELSEWHERE = ("192.0.2.1", 9)
"""An address that no machine has (RFC 5737): asking the way there sends nothing, and tells which address others see."""

TOKEN_BYTES = 16
COOKIE = "quadstep"


class Access(NamedTuple):
    """Who may see the results. host: address that is listened on. token: in the link; none for this machine only."""

    host: str = LOCAL
    token: str = ""

    @property
    def shared(self) -> bool:
        return bool(self.token)

    def link(self, port: int) -> str:
        name = own_address() if self.host in EVERYWHERE else self.host
        place = f"[{name}]" if ":" in name else name
        return f"http://{place}:{port}/" + (f"?token={self.token}" if self.token else "")

    def opens(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), self.token.encode())


def access(host: str) -> Access:
    """For an address of this machine, or a name. Raises UserError."""
    if host in (LOCAL, "localhost"):
        return Access()
    try:
        ipaddress.ip_address(host)
    except ValueError:
        try:
            host = str(socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_STREAM)[0][4][0])
        except (OSError, UnicodeError):
            allowed = "an address of this machine, 0.0.0.0 for all of them, or 127.0.0.1"
            raise UserError(f"--host: {host!r:.60} is not an address; allowed: {allowed}") from None
    return Access(host, secrets.token_urlsafe(TOKEN_BYTES))


def own_address() -> str:
    """The address of this machine that others in the network most likely reach."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect(ELSEWHERE)
            return str(line.getsockname()[0])
        except OSError:
            return LOCAL


def qr_text(link: str) -> str:
    """A QR code of half blocks, for a dark terminal. Raises UserError without the extra that draws it."""
    with needed_by("the QR code"):
        import segno  # noqa: PLC0415 (optional)

    text = io.StringIO()
    segno.make(link, micro=False, error="m").terminal(out=text, border=2, compact=True)
    return text.getvalue().rstrip("\n")


def qr_drawing(link: str) -> str:
    """The same as SVG; empty without the extra."""
    try:
        import segno  # noqa: PLC0415 (optional)
    except ModuleNotFoundError:
        return ""
    return segno.make(link, micro=False, error="m").svg_inline(scale=4, border=3, dark="#000", light="#fff")
