"""A comparison as a page of Markdown: what was found, for a repository or a site."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from quadstep.io.version import __version__
from quadstep.report.units import counted
from quadstep.studies.comparison import tables, words
from quadstep.studies.comparison.found import Comparison


def markdown(found: Comparison, drawn: Mapping[str, Path]) -> str:
    """The page. drawn: the figure of each vehicle, without its ending."""
    first, *others = words.sentences(found)
    parts = [f"# {found.name}", f"Made by quadstep {__version__} from `{Path(found.source).name}`, seed {found.seed}.", first]
    if found.limitations:
        parts += ["## Limitations", bullets(found.limitations)]
    for vehicle in dict.fromkeys(one.vehicle for one in found.situations):
        metric = words.title(found.metrics[found.metric])
        parts += [
            f"## {vehicle or 'Missions'}",
            f"{metric}: median (95 % quantile) of {counted(found.seeds, 'flight')}; a lost flight ranks worse than any other.",
            f"![{metric} for every situation and controller]({drawn[vehicle].as_posix()}.png)",
            table(*turned(*tables.matrix(found, vehicle))),
        ]
    if found.margins:
        parts += [
            "## Margins",
            "A disturbance is increased until flights fail, that is, are lost or exceed the error limit.",
            table(tables.MARGIN_HEADER, tables.margin_rows(found)),
        ]
    parts += ["## Situation by situation", bullets(others), " ".join(filter(None, (words.METHOD, words.searches(found))))]
    if len(found.controllers) > 1:
        ranked = [[name, f"{rank:.2f}"] for name, rank in found.overall().items()]
        parts += ["## Mean ranks", table(("controller", f"over {words.ranked_in(found)}, from 0 (best) to 1"), ranked)]
    parts += ["## Gains and cost", table(tables.WHO_HEADER, tables.who_rows(found)), *words.uncounted(found)]
    return "\n\n".join(parts) + "\n"


def turned(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]]]:
    """A table with its rows as columns: controllers are many, situations few."""
    first, *names = header
    return [first, *(row[0] for row in rows)], [[name, *(row[i + 1] for row in rows)] for i, name in enumerate(names)]


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Of text."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def bullets(lines: Sequence[str]) -> str:
    """A list."""
    return "\n".join(f"- {line}" for line in lines)
