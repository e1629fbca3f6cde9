"""A figure as a job for another process."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError
from quadstep.report.panel import EventMark, Panel, Track
from quadstep.report.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class FigureJob(NamedTuple):
    """A figure to be drawn. name: file name without ending; caption: what to see in it; panels share the time t [s], column
    by column.

    log_time: a logarithmic time axis, for what happens within the first second and long after. track: a flight in space, drawn
    instead of panels. moments: marked on the time axis, those that matter most first.
    """

    name: str
    caption: str
    t: NDArray[np.float64]
    panels: list[Panel]
    columns: int = 1
    log_time: bool = False
    track: Track | None = None
    moments: Sequence[EventMark] = ()

    def draw(self, folder: Path, sheet: Sheet | None = None) -> None:
        """Write it into a folder, in the sheet's formats. Raises OSError, and UserError for what goes wrong in drawing."""
        try:
            from quadstep.report.figures import save  # noqa: PLC0415 (matplotlib loads only where figures are drawn)

            more = self.log_time, self.track, self.moments
            save(folder / self.name, self.t, self.panels, self.columns, sheet or Sheet(), *more)
        except OSError:
            raise
        except Exception as error:
            raise UserError(f"figure {self.name!r} cannot be drawn: {type(error).__name__}: {error}") from error

    def picture(self) -> "Figure":
        """It as a figure of Matplotlib, which belongs to no window."""
        from quadstep.report.figures import picture  # noqa: PLC0415 (as above)

        return picture(self.t, self.panels, self.columns, self.log_time, self.track, self.moments)
