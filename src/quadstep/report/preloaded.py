"""Loaded once by the server from which drawing processes are forked, so that they start with matplotlib in memory."""

import contextlib
import gc
import logging

logging.getLogger("matplotlib").setLevel(logging.ERROR)  # of caches and fonts, which are no concern of a flight's

gc.set_threshold(50_000)  # nearly nothing of a library is garbage, and looking for it is a fifth of the time

with contextlib.suppress(Exception):  # whoever draws loads it again, and says then what is wrong
    import quadstep.report.figures  # noqa: F401

gc.freeze()  # so that a collection in a forked process leaves the shared memory alone
