"""The real Betaflight, told its settings and flown in a network namespace, since it listens on every address."""

import contextlib
import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

from tests.autopilots import CIRCLE
from tests.commands import write
from tests.needs import BETAFLIGHT

GUSTY = f"""{CIRCLE.replace("30.0", "12.0")}
[wind]
mean = [3.0, 1.0, 0.0]
turbulence = {{ intensity = "moderate" }}
"""


def real_flight(folder: Path, mission: str, more: str = "") -> subprocess.CompletedProcess[str]:
    """A mission under it, in a folder. more: lines for its command line; what it then sends from UART2 is in blackbox.bbl."""
    place = write(folder, mission)
    (folder / "more.txt").write_text(more, encoding="utf-8")
    shutil.copy(BETAFLIGHT, folder / "betaflight_SITL")
    there = f"ip link set lo up && exec {sys.executable} -m tests.betaflight_flight {place}"
    line = ["unshare", "-rn", "sh", "-c", there]
    return subprocess.run(line, cwd=Path(__file__).parents[1], capture_output=True, text=True, timeout=300, check=False)


def flown(mission: Path) -> int:
    """Refused, told its settings, and flown: what docs/autopilot.md says."""
    folder = mission.parent
    more = (folder / "more.txt").read_text(encoding="utf-8")
    fly = [sys.executable, "-m", "quadstep", "fly", str(mission), "--autopilot", "betaflight", "--pilot"]
    fly += ["--out", str(folder / "out"), "--connect-timeout"]
    null = subprocess.DEVNULL
    for fresh in (True, False, False, False):  # on a busy machine it may begin deaf
        one = subprocess.Popen(["./betaflight_SITL"], cwd=folder, stdout=null, stderr=null)
        try:
            time.sleep(1.0)
            if more and not fresh:
                threading.Thread(target=logged, args=(folder / "blackbox.bbl",), daemon=True).start()
            code = subprocess.run([*fly, "5" if fresh else "20"], check=False).returncode
            if fresh:
                assert code == 2
                told((folder / "betaflight.txt").read_text(encoding="utf-8").replace("save", f"{more}save"))
                one.wait(30.0)  # it ends where a board starts again
        finally:
            one.kill()
            one.wait()
        if not fresh and code == 0:
            break
    return code


def real_answers(folder: Path, *texts: str) -> list[str]:
    """What it says to each of these in its command line, started again for each, in a folder."""
    shutil.copy(BETAFLIGHT, folder / "betaflight_SITL")
    (folder / "asked.json").write_text(json.dumps(texts), encoding="utf-8")
    there = f"ip link set lo up && exec {sys.executable} -m tests.betaflight_flight {folder / 'asked.json'}"
    line = ["unshare", "-rn", "sh", "-c", there]
    done = subprocess.run(line, cwd=Path(__file__).parents[1], capture_output=True, text=True, timeout=300, check=True)
    return [str(one) for one in json.loads(done.stdout)]


def answered(asked: Path) -> list[str]:
    """The same, where its ports are nobody else's."""
    found, null = [], subprocess.DEVNULL
    for text in json.loads(asked.read_text(encoding="utf-8")):
        one = subprocess.Popen(["./betaflight_SITL"], cwd=asked.parent, stdout=null, stderr=null)
        try:
            while True:
                with contextlib.suppress(ConnectionError):
                    found.append(told(text))
                    break
                time.sleep(0.1)
            if "save" in text:
                one.wait(30.0)
        finally:
            one.kill()
            one.wait()
    return found


def told(settings: str) -> str:
    """Pasted into its command line, each line after a prompt; what it said, once it has ended, as after `save`."""
    heard = ""
    with socket.create_connection(("127.0.0.1", 5761)) as console, contextlib.suppress(ConnectionError):
        console.settimeout(30.0)
        for line in ["#", *settings.splitlines(keepends=True)]:
            console.sendall(line.encode())
            said = b""
            while not said.endswith(b"\n# "):
                more = console.recv(4096)
                if not more:
                    return heard + said.decode().replace("\r", "")
                said += more
            heard += said.decode().replace("\r", "")
    return heard


def logged(place: Path) -> None:
    """What it sends from UART2, as soon as it listens there."""
    with socket.socket() as blackbox, place.open("wb") as file:
        while blackbox.connect_ex(("127.0.0.1", 5762)):
            time.sleep(0.1)
        while more := blackbox.recv(65536):
            file.write(more)
            file.flush()


if __name__ == "__main__":
    named = Path(sys.argv[1])
    if named.suffix == ".json":
        sys.stdout.write(json.dumps(answered(named)))
    else:
        sys.exit(flown(named))
