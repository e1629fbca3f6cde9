"""How far a long computation is: what every run calls, and what a bar on a terminal is."""


class Progress:
    """Listens to a computation, and shows nothing of it."""

    def doing(self, what: str, unit: str | None = None) -> None:
        """A stage begins. unit: of what is counted in it, if another."""

    def to(self, done: float, total: float | None = None, note: str = "") -> None:
        """So much is done. total: as far as known. note: to be shown beside it."""


SILENT = Progress()


class Count:
    """Counts what is done, as engines report it: by how much more it is. Raises nothing."""

    def __init__(self, progress: Progress, total: float | None = None, done: int = 0, note: str = "") -> None:
        self.progress, self.total, self.done, self.note = progress, total, done, note
        self.add(0)

    def add(self, more: int) -> None:
        self.done += more
        self.progress.to(self.done if self.total is None else min(self.done, self.total), self.total, self.note)
