"""A verdict as JUnit XML, which CI services show beside the change that was tested.

Written so that it is valid under the stricter of the schemas in use (Ant's, and the xUnit plugin's for Jenkins).
"""

import platform
import re
import xml.etree.ElementTree as ET
from datetime import UTC, datetime
from pathlib import Path

from quadstep.io.atomic import write_beside
from quadstep.io.version import __version__
from quadstep.metrics.judging.verdict import Verdict, scalars

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


def write_junit(path: Path, verdict: Verdict, seconds: float) -> None:
    """Write beside, then rename. Raises UserError."""
    write_beside(path, junit_xml(verdict, seconds), parents=True)
