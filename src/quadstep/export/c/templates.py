"""Templates of C code with words to be filled in."""

import re
from collections.abc import Mapping
from pathlib import Path


def filled(path: Path, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced, where it stands alone or begins a name."""
    text = path.read_text(encoding="utf-8")
    known = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
    return re.sub(rf"\b(?:{known})", lambda found: words[found[0]], text)
