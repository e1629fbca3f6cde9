"""What went wrong in the user's terms: one line, what and where and what is allowed."""


class UserError(Exception):
    """Bad input or an impossible request; the command line prints it as one line and exits with 2."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


class InterruptedRun(Exception):  # noqa: N818 (it is no error)
    """Ctrl-C in a run whose results so far are kept; the message says where and how to go on."""
