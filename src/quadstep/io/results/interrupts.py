"""Ctrl-C: what it leaves is said, and it is held back where a half-done step would leave something behind."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator

from quadstep.io.errors import InterruptedRun


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Ctrl-C in this block takes effect after it. Processes started in it never see Ctrl-C at all (they inherit the mask).

    Both a handler and a mask: the mask is of this thread only, and a library's threads may receive the signal in its place.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pending: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pending.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, before)
    if pending:
        raise KeyboardInterrupt


@contextlib.contextmanager
def signals_ignored() -> Iterator[None]:
    """No request to end has any effect in this block: for a short last step that must be whole."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    with contextlib.suppress(ValueError):  # not in the main thread: nothing to hold back
        for number in handlers:
            signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        with contextlib.suppress(ValueError):
            for number, handler in handlers.items():
                signal.signal(number, handler)


@contextlib.contextmanager
def interruptible(kept: Callable[[], str]) -> Iterator[None]:
    """A block in which Ctrl-C ends the run with a sentence. kept: says what is kept and how to go on; empty for nothing.

    Raises InterruptedRun.
    """
    try:
        yield
    except KeyboardInterrupt:
        sentence = kept()
        if not sentence:
            raise
        raise InterruptedRun(sentence) from None
