"""Where the command line starts, as `quadstep` and as `python -m quadstep`."""

import os
import signal
import sys
from importlib import import_module

from quadstep.io.errors import INTERRUPTED


def main() -> None:
    """Load the command line and run it; Ctrl-C while it loads is one line, as it is later."""
    # Matrices are small: more threads of BLAS gain nothing, and cost seven times as much on a busy machine.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        import_module("quadstep.commands.cli").main()
    except KeyboardInterrupt:
        sys.stderr.write("quadstep: interrupted; nothing was written\n")
        sys.exit(INTERRUPTED)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done, and the exit code is known


if __name__ == "__main__":
    main()
