"""Commands as users run them: in a pseudo-terminal, or with streams that are full, closed or left early."""

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
from contextlib import ExitStack
from typing import NamedTuple

from tests.forked import Command
from tests.patience import PATIENCE

ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
SPOKEN_FOR = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "PYTHONIOENCODING", "PYTHONUTF8")
ASCII = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
CTRL_C = b"\x03"


class Shown(NamedTuple):
    """What a command wrote. raw: with the escape sequences that draw colours and bars."""

    code: int
    raw: str
    err: str = ""

    @property
    def text(self):
        """Everything that could be read at some time."""
        return ESCAPE.sub("", self.raw).replace("\r\n", "\n")

    @property
    def lines(self):
        """What stays on the screen: what a bar has drawn is drawn over."""
        raw = self.raw.replace("\r\n", "\n").replace("\x1b[?25h", "").replace("\n\r\x1b[1A\x1b[2K", "\r\x1b[2K")
        kept = re.sub(r"\r(?!\n)", "\n\x00", raw.replace("\x1b[2K", "\x1b[2K\x01"))
        lines = [ESCAPE.sub("", line) for line in kept.split("\n")]
        drawn_over = {i for i, line in enumerate(lines) if i + 1 < len(lines) and lines[i + 1].startswith("\x00")}
        return [re.sub("[\x00\x01]", "", line) for i, line in enumerate(lines) if i not in drawn_over]


def environment(changes):
    """This process's environment without what would speak for the terminal; None removes."""
    kept = {key: value for key, value in os.environ.items() if key not in SPOKEN_FOR}
    kept |= {"TERM": "xterm-256color", "LC_ALL": "C.UTF-8", **changes}
    return {key: value for key, value in kept.items() if value is not None}


def in_terminal(*arguments, columns=80, cwd=None, stop_at=None, program="", **changes):
    """A command whose streams are all a terminal of this width. changes: of the environment.

    stop_at: press Ctrl-C once this has been read. program: a text of Python to run instead of the command line.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = Command(os.ttyname(theirs), program, arguments, cwd, environment(changes))
    os.close(theirs)
    received = bytearray()
    try:
        while part := read(ours):
            received += part
            if stop_at and stop_at.encode() in received:
                os.write(ours, CTRL_C)
                stop_at = None
        code = process.wait()
    finally:
        os.close(ours)
        if process.returncode is None:
            process.kill()
            process.wait()
    return Shown(code, received.decode(errors="replace"))


def read(descriptor):
    """What there is to read; nothing once the other side is closed, which Linux says with an error."""
    if not select.select([descriptor], [], [], PATIENCE)[0]:
        raise TimeoutError(f"nothing in {PATIENCE} s")
    try:
        return os.read(descriptor, 65536)
    except OSError:
        return b""


def with_streams(*arguments, out="pipe", err="pipe", cwd=None, **changes):
    """A command with its streams redirected. out, err: pipe; full (a full disk); closed; out also left (after one line)."""
    with ExitStack() as stack:
        full = stack.enter_context(open("/dev/full", "wb"))  # noqa: PTH123 (no path of ours)
        streams = {"pipe": subprocess.PIPE, "left": subprocess.PIPE, "full": full, "closed": None}
        closed = [number for number, kind in ((1, out), (2, err)) if kind == "closed"]

        def close():
            for number in closed:
                os.close(number)

        process = subprocess.Popen(
            [sys.executable, "-m", "quadstep", *map(str, arguments)],
            stdin=subprocess.DEVNULL, stdout=streams[out], stderr=streams[err], cwd=cwd, env=environment(changes),
            preexec_fn=close,  # noqa: PLW1509 (set before any thread of the child)
        )  # fmt: skip
        if out == "left":
            first = process.stdout.readline()
            process.stdout.close()
            process.stdout = None
            _, said = process.communicate(timeout=PATIENCE)
            return Shown(process.returncode, first.decode(errors="replace"), (said or b"").decode(errors="replace"))
        wrote, said = process.communicate(timeout=PATIENCE)
    return Shown(process.returncode, (wrote or b"").decode(errors="replace"), (said or b"").decode(errors="replace"))
