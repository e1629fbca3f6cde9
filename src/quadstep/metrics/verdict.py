"""The verdict on a run, for machines: whether it is good enough, point by point; grades of flights.

Also as JUnit XML, which CI services show beside the change that was tested. Written so that it is valid under the stricter of
the schemas in use (Ant's, and the xUnit plugin's for Jenkins).
"""

import math
import platform
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from enum import StrEnum
from typing import NamedTuple

from quadstep.io import __version__
from quadstep.metrics.registry import HELD, rest_of


class Case(NamedTuple):
    """One point that a run is judged on. failure: why it is not met, in one line; None where it is."""

    name: str
    failure: str | None = None

    @property
    def sentence(self) -> str:
        return f"NOT MET: {self.failure}" if self.failure else f"Met: {self.name}"


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
        return not any(case.failure for case in self.cases)

    def as_json(self) -> dict[str, object]:
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


class FlightGrade(StrEnum):
    """as commanded: to its end, and no rule is broken. flew, but: to its end, and a rule is broken. above the limit: to its
    end, but it fails by what is asked of many flights. lost: it ended early.
    """

    AS_COMMANDED = "as commanded"
    FLEW_BUT = "flew, but"
    ABOVE = "above the limit"
    LOST = "lost"


class Rule(NamedTuple):
    """A flight is as commanded while `metric`, as in metrics.json, is at most `most`.

    label: what is wrong with one that is not. text: the same as a clause, `{}` being the metric times `factor` in both.
    held: another clause where the path is a point. measured: whether it can be told; a flight of which it cannot is not as
    commanded, and has not failed by it.
    """

    metric: str
    most: float
    label: str
    text: str
    factor: float = 1.0
    measured: bool = True
    held: str = ""


LONGER = "A longer flight would show whether it settles."
"""Of what a flight that was merely cut while it moved does, too; not where more is wrong, or it is unstable at rest."""

HALF_TURN = 180.0 / 3.141592653589793

RULES = (
    Rule("relative_error", 0.1, "large error", "its error is large: {} % of the path's size (limit 10 %)", 100.0,
        held="its error is large: {} % of ten arm lengths, rms over its second half (limit 10 %)"),
    Rule("heading_error[rad]", 0.5235987755982988, "off its heading", "its nose was {}° rms off its heading (limit 30°)",
        HALF_TURN),
    Rule("overturned[rad]", 1.5707963267948966, "overturned", "it tilted to {}° (limit 90°)", HALF_TURN),
    Rule("shaking[rad]", 0.08726646259971647, "shaking", "its thrust axis swung by {}° rms in its second half (limit 5°)",
        HALF_TURN),
    Rule("saturated_share", 0.1, "rotors saturated", "its rotors were saturated {} % of the time (limit 10 %)", 100.0),
    Rule("error_growth", 2.0, "error still growing", "its error was still growing at the end (by a factor of {}; limit 2)"),
    Rule("rate_growth", 2.0, "angular rates still growing",
        "its angular rates were still growing at the end (by a factor of {}; limit 2)"),
)  # fmt: skip
"""In the order in which they are said."""


LEFT_PATH = (
    "The vehicle did not keep its path: it was {} from where it should have been, on a path that spans {}",
    "The vehicle did not hold its position: it was {} off",
    ", and it sank to z = {}, below z = 0",
)
"""What is said of a flight that left its path, of one that left the point to hold, and what follows where it sank."""


class Graded(NamedTuple):
    """reasons: why it is not as commanded, one clause each; empty for a flight that is, and for one that was lost. labels: the
    same in a word or two. advice: what would tell more.
    """

    grade: FlightGrade
    reasons: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    advice: str = ""

    def as_json(self) -> dict[str, object]:
        return {"grade": self.grade.value, "grade_reasons": list(self.reasons)}

    @property
    def sentence(self) -> str:
        """`However, its nose was 45° rms off its heading (limit 30°).`; empty where a flight was as commanded or lost."""
        return f"However, {together(self.reasons)}. {self.advice}".strip() if self.reasons else ""


def graded(metrics: Mapping[str, object], limits: Sequence[Rule] = ()) -> Graded:
    """The grade of a flight by its metrics. limits: above which it fails.

    >>> graded({"outcome": "completed", "relative_error": 0.02}).grade.value
    'as commanded'
    >>> graded({"outcome": "completed", "saturated_share": 0.431}).sentence
    'However, its rotors were saturated 43.1 % of the time (limit 10 %).'
    """
    if metrics.get("outcome") != "completed":
        return Graded(FlightGrade.LOST)
    measured = scalars(dict(metrics))
    values = ((rule, measured.get(rule.metric) if rule.measured else math.inf) for rule in (*limits, *RULES))
    broken = [(rule, value) for rule, value in values if value is not None and not value <= rule.most]
    texts = [rule.held * (HELD in metrics) or rule.text for rule, _ in broken]
    numbers = [above(rule.factor * value, rule.factor * rule.most) for rule, value in broken]
    reasons = tuple(map(str.format, texts, numbers))
    labels = tuple(rule.label for rule, _ in broken if rule not in limits)
    grew = bool(broken) and all(rule.metric.endswith("_growth") for rule, _ in broken)
    advice = LONGER if grew and rest_of(metrics).get("grade") != "unstable" else ""
    failed = any(rule in limits and rule.measured for rule, _ in broken)
    grade = FlightGrade.ABOVE if failed else FlightGrade.FLEW_BUT if reasons else FlightGrade.AS_COMMANDED
    return Graded(grade, reasons, labels, advice)


def error_limit(metrics: Mapping[str, float]) -> float:
    """The position RMSE above which a flight's error is large [m]; 0 where its metrics do not say, or judge another error."""
    share = 0.0 if metrics.get(HELD) else metrics.get("relative_error") or 0.0
    return RULES[0].most * metrics["position_rmse[m]"] / share if share > 0.0 else 0.0


def together(clauses: Sequence[str]) -> str:
    """Clauses in one sentence.

    >>> together(["a", "b", "c"])
    'a, b, and c'
    """
    return ", ".join([*clauses[:-1], f"and {clauses[-1]}" if clauses[1:] else clauses[0]])


def above(value: float, most: float) -> str:
    """A number above another, to three digits, or as many more as show that it is."""
    rounded = [float(f"{value:.{digits}g}") for digits in range(3, 15)]
    return f"{next((one for one in rounded if one > (1.0 + 1e-9) * most), rounded[0]):,.15g}"


NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 cannot hold, not even escaped."""


def junit_xml(verdict: Verdict, seconds: float) -> str:
    """The XML of a verdict. seconds: how long the command took."""
    count, failures = len(verdict.cases), sum(case.failure is not None for case in verdict.cases)
    root = ET.Element("testsuites")
    suite = ET.SubElement(
        root,
        "testsuite",
        name=clean(f"quadstep {verdict.command}: {verdict.subject}"),
        package="quadstep",
        id="0",
        hostname=clean(platform.node()) or "localhost",
        timestamp=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S"),
        tests=str(count),
        failures=str(failures),
        errors="0",
        time=f"{seconds:.3f}",
    )
    properties = ET.SubElement(suite, "properties")
    for name, value in {"version": __version__, **texts(verdict)}.items():
        ET.SubElement(properties, "property", name=clean(name), value=clean(value))
    for place, case in enumerate(verdict.cases):
        entry = ET.SubElement(
            suite,
            "testcase",
            name=clean(case.name),
            classname=clean(verdict.subject),
            time=f"{0.0 if place else seconds:.3f}",  # one run answers all of them
        )
        if case.failure:
            ET.SubElement(entry, "failure", message=clean(case.failure), type="requirement").text = clean(case.failure)
    ET.SubElement(suite, "system-out")
    ET.SubElement(suite, "system-err")
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def texts(verdict: Verdict) -> dict[str, str]:
    """What was measured, and the facts of the run, as text by dotted name."""
    facts = {name: value for name, value in verdict.content.items() if isinstance(value, str)}
    for name, value in verdict.content.items():  # why a grade is what it is, warnings
        if isinstance(value, list) and value and all(isinstance(one, str) for one in value):
            facts[name] = "; ".join(value)
    measured = {name: by_name(value) for name, value in verdict.content.items()}
    return facts | {name: repr(value) for name, value in scalars(measured).items() if value is not None}


def by_name(value: object) -> object:
    """With rows of tables, as the panels of an envelope, under their names or, where they have none, their places."""
    if isinstance(value, dict):
        return {name: by_name(one) for name, one in value.items()}
    if isinstance(value, list) and all(isinstance(one, dict) for one in value):
        return {str(one.get("name") or place): by_name(one) for place, one in enumerate(value)}
    return value


def clean(text: str) -> str:
    return NO_XML.sub("\ufffd", text)
