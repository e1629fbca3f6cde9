"""What a machine is told of a run: whether it is good enough, point by point."""

from typing import NamedTuple


class Case(NamedTuple):
    """One point that a run is judged on. failure: why it is not met, in one line; None where it is."""

    name: str
    failure: str | None = None

    @property
    def sentence(self) -> str:
        """As a person reads it."""
        return f"NOT MET: {self.failure}" if self.failure else f"Met: {self.name}."


class Verdict(NamedTuple):
    """The outcome of a command.

    command: what was run. subject: the name of the mission or campaign. content: everything measured, as JSON can hold it.
    """

    command: str
    subject: str
    cases: tuple[Case, ...]
    content: dict[str, object]
    exit_code: int

    @property
    def passed(self) -> bool:
        """Whether every point is met."""
        return not any(case.failure for case in self.cases)

    def as_json(self) -> dict[str, object]:
        """The object that `--json` prints."""
        return {"command": self.command, **self.content, "passed": self.passed, "exit_code": self.exit_code}


def scalars(table: dict[str, object], prefix: str = "") -> dict[str, float | None]:
    """Numbers of nested tables by dotted name, as `position.x.rmse[m]`; None where a flight has no such number."""
    found: dict[str, float | None] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found |= scalars(value, f"{prefix}{key}.")
        elif value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
            found[f"{prefix}{key}"] = value
    return found
