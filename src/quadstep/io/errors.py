"""Errors in the user's terms: one line that says what is wrong, where, and what is allowed.

Of the exit codes of the command line: a flight that diverged ends with DIVERGED even where it was required to do something as
well: each code means the same with and without `--require`, and what was measured of a flight that ended early covers only a
part of it. OUTPUT_LOST, what a command had to say did not arrive, comes before all others.
"""

FAILED, BAD_INPUT, DIVERGED, UNMET, OUTPUT_LOST, INTERRUPTED = 1, 2, 3, 4, 5, 130


LONGEST = 1000
"""Characters of a line."""


class UserError(Exception):
    """Bad input or an impossible request: one line of text that says what, where, and what is allowed.

    The command line prints it and exits with 2.

    >>> from quadstep import Mission, UserError
    >>> try:
    ...     Mission(path={"type": "circle", "radius": 1.0})
    ... except UserError as error:
    ...     print(error)
    Mission: path.period: missing; it is needed
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class MissingExtraError(UserError):
    """A package that is not installed, and how to install it: an extra brings it."""


class ToolError(UserError):
    """A program outside the package that fails although it is there: mended, it may give what it did not."""


class InterruptedRun(Exception):  # noqa: N818 (it is no error)
    """Ctrl-C in a run whose results so far are kept; the message says where and how to go on."""


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
