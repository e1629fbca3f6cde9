"""JUnit files checked against what CI services take."""

import re
import xml.etree.ElementTree as ET

SUITE = {"name", "timestamp", "hostname", "tests", "failures", "errors", "time", "package", "id"}


def checked(text):
    """The suite of a JUnit file that keeps to Ant's schema, read strictly; its cases as name and failure message."""
    root = ET.fromstring(text)
    assert (root.tag, root.attrib) == ("testsuites", {})
    (suite,) = root
    assert suite.tag == "testsuite"
    assert set(suite.attrib) == SUITE
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", suite.get("timestamp"))
    first, *cases, out, err = suite
    assert (first.tag, out.tag, err.tag) == ("properties", "system-out", "system-err")
    for one in first:
        assert (one.tag, set(one.attrib)) == ("property", {"name", "value"})
        assert one.get("name")
    found = {}
    for case in cases:
        assert (case.tag, set(case.attrib)) == ("testcase", {"name", "classname", "time"})
        float(case.get("time"))
        assert len(case) <= 1
        for failure in case:
            assert (failure.tag, set(failure.attrib)) == ("failure", {"message", "type"})
        found[case.get("name")] = case[0].get("message") if len(case) else None
    assert len(found) == len(cases) == int(suite.get("tests"))
    assert sum(message is not None for message in found.values()) == int(suite.get("failures"))
    return suite, found


def properties(suite):
    return {one.get("name"): one.get("value") for one in suite[0]}
