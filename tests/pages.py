"""Pages for tests: their data read back, and their laws flown in Node.js as a browser would."""

import base64
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from tests.needs import NODE as NODE_JS
from tests.needs import needs, program

NODE = program("node")
needs_node = needs(NODE_JS)
CLIENT = Path(__file__).parent / "page_client.cjs"

STAND_IN = (
    "<!doctype html><title>quadstep</title>"
    '<script id="quadstep-data" type="application/json">{}</script><script id="quadstep-laws">0</script>'
)


def data_of(text: str) -> dict[str, Any]:
    """What a page is told, references resolved."""
    (content,) = re.findall(r'<script id="quadstep-data" type="application/json">(.*?)</script>', text, re.DOTALL)
    data = json.loads(content)

    def resolve(value: Any) -> Any:
        if isinstance(value, list):
            return [resolve(part) for part in value]
        if isinstance(value, dict):
            return data["shared"][value["$"]] if "$" in value else {key: resolve(part) for key, part in value.items()}
        return value

    return {**data, "flights": resolve(data["flights"])}


def run_node(script: str, *arguments: str, given: str = "") -> str:
    """What a script prints."""
    command = [NODE or "node", *(["-e", script] if script else []), *arguments]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def fly_page(path: Path, *requests: dict[str, Any]) -> list[dict[str, Any]]:
    """Flights of a page by its own laws. A request names flight, controller (its place) and values of controls."""
    answers = json.loads(run_node("", str(CLIENT), str(path), given=json.dumps(requests)))
    for answer in answers:
        answer["parameters"] = np.frombuffer(base64.b64decode(answer["parameters"]))
        answer["values"] = np.frombuffer(base64.b64decode(answer["values"])).reshape(-1, len(answer["columns"]))
    return answers
