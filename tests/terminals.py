"""Commands in a real terminal (a pseudo-terminal), as a process of their own."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from typing import NamedTuple

COMMAND = (sys.executable, "-m", "quadstep.cli")
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Shown(NamedTuple):
    """What a terminal was sent. raw: with the escape sequences that draw colours and bars."""

    code: int
    raw: str

    @property
    def text(self):
        """What can be read."""
        return ESCAPE.sub("", self.raw).replace("\r\n", "\n")


def environment(**changes):
    """This process's environment without what would speak for the terminal; None removes."""
    kept = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR")}
    kept |= {"TERM": "xterm-256color", "LC_ALL": "C.UTF-8", **changes}
    return {key: value for key, value in kept.items() if value is not None}


def in_terminal(*arguments, columns=80, cwd=None, timeout=120, **changes):
    """A command whose streams are all a terminal of this width. changes: of the environment."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        stdin=theirs, stdout=theirs, stderr=theirs, cwd=cwd, env=environment(**changes), start_new_session=True,
    )  # fmt: skip
    os.close(theirs)
    received = bytearray()
    try:
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # how Linux says that the other side was closed
                break
            if not part:
                break
            received += part
        code = process.wait(timeout)
    finally:
        os.close(ours)
        if process.poll() is None:
            process.kill()
            process.wait()
    return Shown(code, received.decode(errors="replace"))
