"""What went wrong in the user's terms: one line, what and where and what is allowed."""


class UserError(Exception):
    """Bad input or an impossible request; the command line prints it as one line and exits with 2."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
