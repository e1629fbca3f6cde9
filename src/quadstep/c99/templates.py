"""Texts of C that are filled with words."""

import re
from collections.abc import Mapping
from pathlib import Path


def filled(path: Path, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced, where it stands by itself or begins a name."""
    text = path.read_text(encoding="utf-8")
    known = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
    return re.sub(rf"\b(?:{known})", lambda found: words[found[0]], text)
