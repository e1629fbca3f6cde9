"""Errors in the user's terms: one line that says what is wrong, where, and what is allowed.

Of the exit codes of the command line: a flight that diverged ends with DIVERGED even where it was required to do something as
well: each code means the same with and without `--require`, and what was measured of a flight that ended early covers only a
part of it. OUTPUT_LOST, what a command had to say did not arrive, comes before all others.

Ctrl-C: what it leaves is said, and it is held back where a half-done step would leave something behind.
"""

import contextlib
import math
import re
import reprlib
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence

FAILED, BAD_INPUT, DIVERGED, UNMET, OUTPUT_LOST, INTERRUPTED = 1, 2, 3, 4, 5, 130


LONGEST, LONGEST_VALUE, LONGEST_LIST = 1000, 60, 250
"""Characters of a line, of a given value or name in it, and of what is allowed, where one name was probably meant."""


class UserError(Exception):
    """Bad input or an impossible request: one line of text that says what, where, and what is allowed.

    Of several mistakes the first is its text, and the others are notes, which Python prints with a traceback. The command line
    prints a line for each, and exits with 2.

    >>> from quadstep import Mission, UserError
    >>> try:
    ...     Mission(path={"type": "circle", "radius": 1.0})
    ... except UserError as error:
    ...     print(error)
    Mission: path.period is required: time of one turn [s]
    """

    def __init__(self, message: str, *others: str) -> None:
        super().__init__(one_line(message))
        for one in others:
            self.add_note(one_line(one))

    @property
    def lines(self) -> list[str]:
        """What each mistake is."""
        return [str(self), *getattr(self, "__notes__", ())]


class MissingExtraError(UserError):
    """A package that is not installed, and how to install it: an extra brings it."""


class ToolError(UserError):
    """A program outside the package that fails although it is there: mended, it may give what it did not."""


class InterruptedRun(Exception):  # noqa: N818 (it is no error)
    """Ctrl-C in a run whose results so far are kept; the message says where and how to go on."""


@contextlib.contextmanager
def errors_in(source: object, about: str = "") -> Iterator[None]:
    """A UserError of this block says first, and once, where it is, and then what it is about if that is given."""
    try:
        yield
    except UserError as error:
        said = [line.removeprefix(f"{source}: ") for line in error.lines]
        raise UserError(*(f"{source}: {about and f'{about}: '}{one}" for one in said)) from None


def unknown_name(what: str, value: object, names: Iterable[str], other: str = "") -> str:
    """What is said of a name that is none of these: which one was probably meant, and the names as `listed` has them.

    >>> unknown_name("preset", "x50", ["crazyflie", "x500"])
    "unknown preset 'x50'; did you mean x500? Allowed: crazyflie, x500"
    >>> unknown_name("mapping", "y", [], "a file")
    "unknown mapping 'y'; allowed: a file"
    """
    known = list(names)
    return f"unknown {what} {shorten(value)}{meant_of(value, known, f'allowed: {listed(known, other)}')}"


def listed(names: Iterable[str], other: str = "") -> str:
    """The names that are allowed, and what else is."""
    known = ", ".join(names)
    return f"{known}, or {other}" if known and other else known or other or "none"


def meant_of(value: object, names: Sequence[str], allowed: str) -> str:
    """The end of a refusal: which of the names was probably meant, if one is like it; what is allowed, unless that is long."""
    meant = did_you_mean(value, names)
    short = f" {allowed[0].upper()}{allowed[1:]}" if len(allowed) <= LONGEST_LIST else ""
    return f"{meant}{short}" if meant else f"; {allowed}"


def did_you_mean(value: object, names: Sequence[str]) -> str:
    """Which of the names was probably meant: the one with the fewest letters amiss, at most one in four; else the only one
    that begins with it, or has all its words or no others. Nothing where there is none.

    >>> did_you_mean("raduis", ["radius", "ramp"]), did_you_mean("jpg", ["png"]), did_you_mean("mass_kg", ["arm", "mass"])
    ('; did you mean radius?', '', '; did you mean mass?')
    """
    if not isinstance(value, str) or not value or len(value) > LONGEST_VALUE:
        return ""
    given, most = value.lower(), max(1, len(value) // 4)
    amiss = {name: edits(given, name.lower()) for name in names if abs(len(name) - len(given)) <= most}
    near = [name for name, count in amiss.items() if count <= most and 2 * count < max(len(name), len(given))]
    if near:
        return f"; did you mean {min(near, key=amiss.__getitem__)}?"
    parts = words_of(given)
    akin = [name for name in names if name.lower().startswith(given) or parts <= words_of(name) or words_of(name) <= parts]
    return f"; did you mean {akin[0]}?" if parts and len(akin) == 1 else ""


def words_of(name: str) -> set[str]:
    """The words that a name is made of."""
    return set(re.findall(r"[^\W_]+", name.lower())) or {""}


def edits(a: str, b: str) -> int:
    """The fewest letters to insert, leave out, change or swap with the next one for `a` to become `b`."""
    earlier: list[int] = []
    before, row = earlier, [*range(len(b) + 1)]
    for i, x in enumerate(a):
        earlier, before, row = before, row, [i + 1]
        for j, y in enumerate(b):
            least = min(before[j] + (x != y), before[j + 1] + 1, row[j] + 1)
            swapped = i and j and (x, a[i - 1]) == (b[j - 1], y)
            row.append(min(least, earlier[j - 1] + 1) if swapped else least)
    return row[-1]


class ShortRepr(reprlib.Repr):
    """Values as Python writes them, of a few levels and entries only."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother, self.maxlist = 3, LONGEST_VALUE, LONGEST_VALUE, 12

    def repr_int(self, x: int, level: int) -> str:
        """Python refuses to write numbers of very many digits."""
        return repr(x) if x.bit_length() < 4 * LONGEST_VALUE else "a very large number"


def shorten(value: object) -> str:
    """A given value, cut to fit a line."""
    text = ShortRepr().repr(value)
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def number_in(text: str) -> float:
    """The number that a text is; NaN, which no range holds, where it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def one_line(text: str) -> str:
    """Text as one line that is safe in a terminal, of at most `LONGEST` characters: the middle of a longer one is left out.

    What does not print (control characters, marks that change the direction of text, half of a surrogate pair) is shown as
    Python escapes it.
    """
    line = " ".join(cut(text, 4 * LONGEST).split())
    return cut(line if line.isprintable() else "".join(map(visible, line)), LONGEST)


def visible(sign: str) -> str:
    """A character, or how Python escapes it where it does not print."""
    return sign if sign.isprintable() else sign.encode("unicode_escape").decode("ascii")


def cut(text: str, most: int) -> str:
    """Text of at most so many characters; most of its beginning and some of its end stay."""
    if len(text) <= most:
        return text
    end = most // 3
    return f"{text[: most - end - 5]} ... {text[-end:]}"


@contextlib.contextmanager
def interrupts_deferred() -> Iterator[None]:
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
