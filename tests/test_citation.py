"""CITATION.cff states the version, the licence, and the paper."""

from pathlib import Path

import yaml

from quadstep import __version__

ROOT = Path(__file__).parent.parent


def test_the_citation_is_true():
    content = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (content["cff-version"], content["type"]) == ("1.2.0", "software")
    assert {"message", "title", "authors"} <= set(content)  # what CFF 1.2.0 requires
    assert content["version"] == __version__
    assert content["license"] in (ROOT / "LICENSE").read_text()
    assert content["authors"] == [{"name": "The quadstep developers"}]
    (paper,) = content["references"]
    assert (paper["year"], paper["volume"], paper["start"], paper["end"]) == (2009, 56, 127, 151)
    assert [author["family-names"] for author in paper["authors"]] == ["Das", "Lewis", "Subbarao"]
    assert "CITATION.cff" in (ROOT / "README.md").read_text(encoding="utf-8")
