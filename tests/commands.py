"""Commands run as a user runs them, and their results."""

import contextlib
import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
from contextlib import nullcontext
from functools import partial
from typing import NamedTuple

import numpy as np

from quadstep.commands import cli
from quadstep.io import user_code
from quadstep.report.progress import Progress
from tests.patience import PATIENCE

LINE = '[path]\ntype = "minimum-jerk"\nend = [1.0, 0.5, 0.5]\nduration = 1.0\n'


class Run(NamedTuple):
    """What a command gave back."""

    code: int
    out: str
    err: str

    @property
    def refused(self):
        """Whether it ended as bad input must: exit code 2, one line, nothing else said."""
        line = re.fullmatch(r"quadstep: error: [^\n]+\n", self.err)
        return self.code == 2 and line is not None and not self.out


def quadstep(*arguments):
    """Run a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    handler, given, refused = signal.getsignal(signal.SIGTERM), sys.argv, user_code.refused
    sys.argv = ["quadstep", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            cli.main()
    except SystemExit as end:
        return Run(end.code or 0, out.getvalue(), err.getvalue())
    finally:
        sys.argv = given
        user_code.refuse(refused)  # as `serve` does for its process
        signal.signal(signal.SIGTERM, handler)
    raise AssertionError("main returned")


def quadstep_process(*arguments, cwd=None):
    """The command line of a process of its own."""
    environment = {**os.environ, "COLUMNS": "120"}
    return subprocess.run(
        [sys.executable, "-m", "quadstep", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=environment,
        check=False,
        timeout=PATIENCE,
    )


def replace(monkeypatch, place, function):
    """Replace a function of the package by one that is not taken for a user's, after which laws would be traced anew."""
    monkeypatch.setattr(place, partial(function))


def without_figures(monkeypatch):
    """Leave out the figures, which need processes of their own and seconds, where they are not the point."""
    replace(monkeypatch, "quadstep.mission.schema.flight_jobs", lambda *_: [])
    for module in ("fly", "interface"):
        replace(monkeypatch, f"quadstep.studies.{module}.drawing_pool", lambda *_: nullcontext())


def without_grade(monkeypatch):
    """Leave out the grade of the loop at rest, which takes up to seconds for each new loop, where it is not the point."""
    replace(monkeypatch, "quadstep.linear.grade.quick_grade", lambda _: {})


ISSUE_COLUMNS = """t[s] x[m] y[m] z[m] psi[rad] theta[rad] phi[rad] x_d[m] y_d[m] z_d[m] psi_d[rad] theta_d[rad] phi_d[rad]
u[N] tau_psi[N_m] tau_theta[N_m] tau_phi[N_m] f1[N] f2[N] f3[N] f4[N]""".replace("N_m", "N#m").split()


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def columns(folder, name="flight.csv"):
    """The columns of a CSV by header."""
    with (folder / name).open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def strict_json(path):
    """JSON without the NaN and infinities that Python would let pass."""

    def refuse(constant):
        raise AssertionError(f"{constant} in {path}")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def metrics(folder):
    return strict_json(folder / "metrics.json")


def write(folder, text, name="mission.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


class Listener(Progress):
    """Collects how far a run is, as pairs of done and total."""

    def __init__(self):
        self.heard = []

    def to(self, done, total=None, note=""):
        self.heard.append((done, total))


def heeding_interrupts():
    """A child of a shell's background job would ignore SIGINT."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
