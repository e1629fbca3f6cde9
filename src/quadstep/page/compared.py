"""Two results beside each other: what their metrics.json say, number by number."""

import math
from html import escape
from urllib.parse import urlencode

from quadstep.metrics.judging.verdict import scalars
from quadstep.metrics.registry import Metrics
from quadstep.page.cards import best, picture
from quadstep.page.folder import ResultFolder
from quadstep.page.model import identity
from quadstep.page.opened import name_in
from quadstep.report import page, units

MOST_ROWS = 400
RMSE = "position_rmse[m]"

STYLE = """<style>
.two { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: 12px; }
.two figure { margin: 0; }
</style>"""


def compared_page(results: tuple[ResultFolder, ResultFolder], contents: tuple[Metrics, Metrics]) -> str:
    """The page. contents: of their metrics.json."""
    first, second = (numbers(content) for content in contents)
    names = [one.name if results[0].name != results[1].name else one.place.as_posix() for one in results]
    shown = "".join(
        f'<figure><div class="drawn">{picture(one)}</div><figcaption><a href="{escape(best(one))}">{escape(name)}</a>'
        f"</figcaption></figure>"
        for one, name in zip(results, names, strict=True)
    )
    rows = [[words(key), *row(key, first.get(key), second.get(key))] for key in dict.fromkeys([*first, *second])][:MOST_ROWS]
    body = [
        page.summary(unlike(names, *contents) or answer(names, first, second), facts(names, first, second)),
        f'<div class="two">{shown}</div>',
    ]
    if all("flight.csv" in one.files for one in results):
        places = urlencode({"a": results[0].place.as_posix(), "b": results[1].place.as_posix()})
        if different(*contents):
            body.append(page.links([(f"/both?{places}", "Both flights on one page")]))
            body.append(page.paragraph(f"They fly different {different(*contents)}, so they are not overlaid."))
        else:
            front, behind = (name_in(content, one.place.name) for one, content in zip(results, contents, strict=True))
            behind = identity(behind, (identity(front, ()),))
            body.append(page.links([(f"/both?{places}#keep={behind}", "Both flights, overlaid")]))
    body += [page.heading("All numbers", "numbers")]
    body += [
        page.table(("", *names, "second / first"), rows, escape)
        if rows
        else page.paragraph("Neither result has numbers to compare.")
    ]
    return page.page_text(
        f"{names[0]} and {names[1]}", [*body, page.links([("/", "All results")])], "Comparison of two", STYLE
    )


def unlike(names: list[str], first: Metrics, second: Metrics) -> str:
    """Why the errors of two flights say nothing of which is better; empty where they may be compared."""
    if not all("outcome" in one for one in (first, second)):
        return ""
    lost = [name for name, one in zip(names, (first, second), strict=True) if one.get("outcome", "completed") != "completed"]
    if lost:
        return f"{' and '.join(lost)} {'was' if len(lost) == 1 else 'were'} lost, so the errors are not compared."
    things = different(first, second)
    if first.get("ended[s]") != second.get("ended[s]") and "paths" not in things:
        things = f"{things} and durations" if things else "durations"
    return f"{names[0]} and {names[1]} fly different {things}, so their errors do not say which is better." if things else ""


def different(first: Metrics, second: Metrics) -> str:
    """What two flights do not share that makes them unlike: "paths", "vehicles", both, or nothing."""
    sides = [mission if isinstance(mission := one.get("mission"), dict) else {} for one in (first, second)]
    return " and ".join(f"{part}s" for part in ("path", "vehicle") if sides[0].get(part) != sides[1].get(part))


def numbers(content: Metrics) -> dict[str, float]:
    """The numbers of a metrics.json by dotted name, without those of the mission."""
    kept = {key: value for key, value in content.items() if key != "mission"}
    found = {}
    for key, value in scalars(kept).items():
        if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
            found[key] = float(value)
    return found


def answer(names: list[str], first: dict[str, float], second: dict[str, float]) -> str:
    """Which is closer to its path, as far as that is known."""
    errors = [one.get(RMSE) for one in (first, second)]
    if errors[0] is None or errors[1] is None:
        return f"{names[0]} and {names[1]}: only their numbers can be compared."
    if errors[0] == errors[1]:
        return "Both are equally close to their paths."
    near, far = (0, 1) if errors[0] < errors[1] else (1, 0)
    ratio = errors[far] / errors[near] if errors[near] else math.inf  # type: ignore[operator]
    times = f"{units.number(ratio, 2)} times closer" if math.isfinite(ratio) else "closer"
    return f"{names[near]} is {times} to its path than {names[far]}."


def facts(names: list[str], first: dict[str, float], second: dict[str, float]) -> list[page.Fact]:
    errors = [(name, one[RMSE]) for name, one in zip(names, (first, second), strict=True) if RMSE in one]
    return [page.Fact(f"{name}: position RMSE", units.quantity(value, "m")) for name, value in errors]


def value(one: float, unit: str) -> str:
    """A number as people write it; a count as it is."""
    return f"{one:.0f}" if unit == "-" and one.is_integer() and abs(one) < 1e9 else units.quantity(one, unit, 4)


def words(key: str) -> str:
    """`position x RMSE` of `position.x.rmse[m]`."""
    return units.metric(key)[0].replace(".", " ")


def row(key: str, first: float | None, second: float | None) -> list[str]:
    _, unit = units.metric(key)
    shown = ["–" if one is None else value(one, unit) for one in (first, second)]
    ratio = units.number(second / first) if first and second is not None else "–"
    return [*shown, ratio]
