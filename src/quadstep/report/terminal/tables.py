"""Tables that fit: side by side where every column can be read, else as blocks of `name: value`."""

import textwrap
from collections.abc import Sequence

from rich import box
from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

from quadstep.report.terminal.screen import console, plain, say

KEY, PROSE, GAP = 28, 24, 2
"""Up to this width the first and any other column is never broken; beyond it, between words only. GAP: between columns."""


def show_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table. The first column holds the keys: they are never cut. title: may be empty."""
    cells = [[plain(cell) for cell in row] for row in rows]
    if title:
        console().print(Text(plain(title), style="bold"), soft_wrap=True)
    widths = fitted([header, *cells], console().width)
    if widths is None:
        show_blocks(header, cells)
        return
    broken = any(cell_len(cell) > width for row in cells for cell, width in zip(row, widths, strict=True))
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0), leading=int(broken))
    for name, width in zip(header, widths, strict=True):
        table.add_column(name, width=width)
    for row in cells:
        table.add_row(*row)
    screen = console()
    with screen.capture() as drawn:
        screen.print(table)
    screen.file.write("\n".join(line.rstrip() for line in drawn.get().splitlines()) + "\n")
    say("")


def fitted(rows: Sequence[Sequence[str]], columns: int) -> list[int] | None:
    """The width of each column of a table on a screen of this many columns; None where it cannot be read on one."""
    spare = columns + GAP
    natural, least = [], []
    for place, cells in enumerate(zip(*rows, strict=True)):
        natural.append(max(1, *map(cell_len, cells)))
        words = max(1, *(cell_len(word) for cell in cells for word in cell.split()), 1)
        whole = PROSE if place else KEY
        least.append(natural[-1] if natural[-1] <= whole else max(words, whole))
        spare -= least[-1] + GAP
    if spare < 0:
        return None
    widths = list(least)
    wanting = sorted((natural[i] - least[i], i) for i in range(len(least)) if natural[i] > least[i])
    for place, (lacking, i) in enumerate(wanting):
        more = min(lacking, spare // (len(wanting) - place))
        widths[i] += more
        spare -= more
    return widths


def show_blocks(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Each row as its key and a line for each value."""
    screen = console()
    wrapper = textwrap.TextWrapper(
        screen.width, initial_indent="  ", subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    for row in rows:
        say("")
        screen.print(Text(row[0], style="bold"), soft_wrap=True)
        for name, value in zip(header[1:], row[1:], strict=True):
            if value:
                screen.print(wrapper.fill(f"{name}: {value}"), soft_wrap=True)
    say("")
