"""Tables for a paper: LaTeX with the rules of the package booktabs."""

from collections.abc import Collection, Iterable, Sequence

SPECIAL = {char: f"\\{char}" for char in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": "$<$",
    ">": "$>$",
    "\u2212": "$-$",
    "\u00b0": r"\textdegree{}",
    "\u00b5": r"\textmu{}",
    "\u00b2": "$^2$",
    "\u00b3": "$^3$",
    "\u00a0": "~",
}


def escaped(text: str) -> str:
    """Text that LaTeX sets as it is."""
    return "".join(SPECIAL.get(char, char) for char in text)


def booktabs(
    header: Sequence[str],
    groups: Sequence[Sequence[Sequence[str]]],
    comments: Sequence[str] = (),
    bold: Collection[tuple[int, int, int]] = (),
) -> str:
    """A tabular with its first column to the left and the others to the right.

    groups: rows of cells, each set apart by a rule. comments: what the table shows. bold: group, row, column of cells.
    """
    parts = [f"% {escaped(line)}" for line in comments] + [r"% needs \usepackage{booktabs}"]
    parts += [rf"\begin{{tabular}}{{l{'r' * (len(header) - 1)}}}", r"\toprule", line(map(escaped, header))]
    for g, group in enumerate(groups):
        parts.append(r"\midrule")
        for r, row in enumerate(group):
            cells = [rf"\textbf{{{escaped(cell)}}}" if (g, r, c) in bold else escaped(cell) for c, cell in enumerate(row)]
            parts.append(line(cells))
    return "\n".join([*parts, r"\bottomrule", r"\end{tabular}", ""])


def line(cells: Iterable[str]) -> str:
    """A row of cells that LaTeX sets."""
    return f"{' & '.join(cells)} \\\\"
