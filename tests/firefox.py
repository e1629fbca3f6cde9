"""Firefox for tests: Debian's `firefox-esr`, driven through Marionette, the protocol that it speaks itself.

Marionette is JSON over a socket, each message with its length in front: [0, number, command, arguments] is answered by
[1, number, error, result]. https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html
"""

import contextlib
import itertools
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from tests.needs import FIREFOX_PROGRAM
from tests.patience import PATIENCE

PREFERENCES = {
    "marionette.port": 0,  # one that is free, told in the profile
    "webgl.force-enabled": True,
    "ui.prefersReducedMotion": 1,
    "app.normandy.enabled": False,
    "app.update.disabledForTesting": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.server": "",
}

CONSOLE = """
return Services.console.getMessageArray().filter((one) => one instanceof Ci.nsIScriptError
  && !(one.flags & Ci.nsIScriptError.warningFlag) && one.sourceName.startsWith(arguments[0])).map((one) => one.errorMessage);
"""
"""Errors of a page, as Firefox keeps them: what was thrown, and what its content security policy forbade."""


class Firefox:
    """One window."""

    def __init__(self) -> None:
        self.profile = Path(tempfile.mkdtemp())
        lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items())
        (self.profile / "user.js").write_text("\n".join(lines))
        command = [FIREFOX_PROGRAM or "firefox", "--headless", "--marionette", "--no-remote", "-remote-allow-system-access"]
        self.process = subprocess.Popen(
            [*command, "--profile", str(self.profile)],
            env={**os.environ, "HOME": str(self.profile)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.numbers, self.opened = itertools.count(1), contextlib.ExitStack()
        try:
            self.socket = self.opened.enter_context(socket.create_connection(("127.0.0.1", self.port())))
            self.socket.settimeout(PATIENCE)
            self.stream = self.opened.enter_context(self.socket.makefile("rb"))
            self.read()
            self.ask("WebDriver:NewSession")
            self.ask("WebDriver:SetTimeouts", script=1000 * PATIENCE, pageLoad=1000 * PATIENCE)
        except BaseException:
            self.close()
            raise

    def port(self) -> int:
        """Where it listens, once it does."""
        told, until = self.profile / "MarionetteActivePort", time.monotonic() + PATIENCE
        while self.process.poll() is None and time.monotonic() < until:
            with contextlib.suppress(OSError, ValueError):
                return int(told.read_text())
            time.sleep(0.1)
        raise RuntimeError(f"Firefox does not listen; exit code {self.process.poll()}")

    def read(self) -> Any:
        """The next message."""
        length = b""
        while (character := self.stream.read(1)) != b":":
            if not character:
                raise RuntimeError("Firefox has hung up")
            length += character
        return json.loads(self.stream.read(int(length)))

    def ask(self, command: str, **arguments: Any) -> Any:
        """What Firefox answers. Raises RuntimeError with its words."""
        message = json.dumps([0, next(self.numbers), command, arguments]).encode()
        self.socket.sendall(str(len(message)).encode() + b":" + message)
        _, _, error, result = self.read()
        if error:
            raise RuntimeError(f"{command}: {error['message']}")
        return result.get("value") if isinstance(result, dict) else result

    def open(self, page: Path, fragment: str = "") -> None:
        """Load a page from disk."""
        self.ask("WebDriver:Navigate", url=page.as_uri() + fragment)

    def evaluate(self, script: str, *arguments: Any) -> Any:
        """What the body of a function returns in the page; of a promise, what it comes to."""
        return self.ask("WebDriver:ExecuteScript", script=script, args=list(arguments), sandbox=None)

    def errors(self, page: Path) -> list[str]:
        """What the page complained of in the console so far."""
        self.ask("Marionette:SetContext", value="chrome")
        try:
            return self.ask("WebDriver:ExecuteScript", script=CONSOLE, args=[page.as_uri()])
        finally:
            self.ask("Marionette:SetContext", value="content")

    def press(self, selector: str, keys: str) -> None:
        """Type into an element."""
        (element,) = self.ask("WebDriver:FindElement", using="css selector", value=selector).values()
        self.ask("WebDriver:ElementSendKeys", id=element, text=keys)

    def close(self) -> None:
        """End it, and forget its profile."""
        self.opened.close()
        self.process.terminate()
        try:
            self.process.wait(20.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.profile, ignore_errors=True)
