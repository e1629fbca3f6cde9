"""The front end's build tools, where they are installed beside its sources."""

import json
from pathlib import Path

FRONTEND = Path(__file__).parent.parent / "frontend"


def build_tools():
    """Whether every package of the lock that is installed has the lock's version, and none that is needed is missing."""
    installed = FRONTEND / "node_modules" / ".package-lock.json"
    if not installed.exists():
        return False
    there = json.loads(installed.read_text())["packages"]
    wanted = json.loads((FRONTEND / "package-lock.json").read_text())["packages"]
    return all(
        name in there and there[name].get("integrity") == package.get("integrity")
        for name, package in wanted.items()
        if name and not package.get("optional")
    )
