"""Texts of C that are filled with words."""

import re
from collections.abc import Mapping
from pathlib import Path


def filled(path: Path, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced, where it stands by itself or within a name."""
    text = path.read_text(encoding="utf-8")
    return re.sub("|".join(map(re.escape, sorted(words, key=len, reverse=True))), lambda found: words[found[0]], text)
