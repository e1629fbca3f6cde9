"""Commands in a terminal, forked from a process that has loaded what they load: a second of a processor less for each.

Run as a program it is that process: it reads a request a line, and answers with the command's process and with how it ended.
"""

import atexit
import functools
import gc
import json
import os
import signal
import subprocess
import sys
import types

spent = []
"""[s] of a processor, of each command that has ended."""


class Command:
    """One that runs, as far as `subprocess.Popen` has it. program: a text of Python to run instead of the command line."""

    def __init__(self, terminal, program, arguments, cwd, environment):
        self.server, self.returncode = server(), None
        request = (terminal, program, ["quadstep", *map(str, arguments)], os.fspath(cwd or os.curdir), environment)
        self.server.stdin.write(json.dumps(request) + "\n")
        self.server.stdin.flush()
        self.pid = int(self.server.stdout.readline())

    def wait(self):
        """The exit code."""
        if self.returncode is None:
            code, seconds = self.server.stdout.readline().split()
            self.returncode = int(code)
            spent.append(float(seconds))
        return self.returncode

    def kill(self):
        os.kill(self.pid, signal.SIGKILL)


@functools.cache
def server():
    """The process to fork from, of this process."""
    line = [sys.executable, "-m", "tests.forked"]
    running = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(running.communicate)
    return running


def main():
    """Serve requests for as long as there are any."""

    from matplotlib.artist import Artist

    import quadstep.engines.kernel
    import quadstep.identify.run
    import quadstep.linear.run
    import quadstep.report.figures
    import quadstep.studies.campaign.report
    import quadstep.studies.comparison.run
    import quadstep.studies.fly
    import quadstep.studies.paper.reproduce  # noqa: F401
    from quadstep.commands import cli
    from quadstep.control import registry
    from quadstep.interfaces.controller import Measured
    from quadstep.report.canvas import Typeset

    Typeset.draw = Artist.draw  # nothing: a terminal shows no figure; those of a flight are drawn, by other processes
    cli.built()
    registry.names(Measured)
    gc.freeze()
    for line in sys.stdin:
        terminal, *asked = json.loads(line)
        streams = os.open(terminal, os.O_RDWR | os.O_NOCTTY)
        child = os.fork()
        if not child:
            become(streams, *asked)
            return
        os.close(streams)
        print(child, flush=True)  # noqa: T201
        _, status, used = os.wait4(child, 0)
        print(os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, flush=True)  # noqa: T201


def become(streams, program, words, folder, environment):
    """Run the command in this process, whose terminal this becomes."""
    os.login_tty(streams)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    encoding = environment.get("PYTHONIOENCODING", "utf-8")
    sys.stdin, sys.stdout, sys.stderr = (open(one, mode, encoding=encoding) for one, mode in enumerate("rww"))  # noqa: PTH123, SIM115
    sys.__stdin__, sys.__stdout__, sys.__stderr__ = sys.stdin, sys.stdout, sys.stderr
    sys.argv, sys.path[0] = words, ""
    sys.modules["__main__"] = types.ModuleType("__main__")
    exec(program or "from quadstep.__main__ import main; main()", vars(sys.modules["__main__"]))


if __name__ == "__main__":
    main()
