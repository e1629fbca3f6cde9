"""The connection to a Ray cluster: the one at RAY_ADDRESS, or one of this machine's cores that nobody else can reach.

Whoever controls a cluster can run any Python on its nodes and in the driver. So a cluster is joined only if named, and one
that is started here listens on the loopback interface only and requires a token that only its own processes know.
"""

import logging
import os
import re
import secrets
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

from quadstep.io.errors import UserError

QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is sent anywhere
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".*",  # messages about lost workers are not for the user's screen
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # else Ray warns about graphics processors, unasked
}
"""Settings that Ray reads when it is imported."""

OWN = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # Ray's switch for nodes at 127.0.0.1, on Linux too
    "RAY_AUTH_MODE": "token",
    "RAY_AUTH_TOKEN": secrets.token_hex(32),
}
"""The same for a cluster of this machine's cores. Other users of the machine reach its loopback interface, hence a token.
Ray keeps the first token that it reads, hence one token per process.
"""

ANSWER = 5.0
"""Longest time for a head node to accept a connection [s]."""

JOINING = 60.0
"""Longest time for it to admit a driver [s]. Ray itself would try for minutes, and then end the process."""

TRIAL = "import logging, sys, ray; ray.init(address=sys.argv[1], log_to_driver=False, logging_level=logging.CRITICAL)"


@contextmanager
def connected() -> Iterator[ModuleType]:
    """The module of Ray, connected: to the cluster of RAY_ADDRESS, else to one of this machine's cores, which ends with the
    block. A program around this one that is connected already stays so. Raises UserError.
    """
    loaded = sys.modules.get("ray")
    if loaded and loaded.is_initialized():
        yield loaded
        return
    given = os.environ.get("RAY_ADDRESS", "")  # blanks are an address, and a wrong one
    own = given in ("", "local")
    quiet = {name: os.environ.get(name, value) for name, value in QUIET.items()}
    with environment({**quiet, **(OWN if own else {})}):
        address = "local" if own else cluster_at(given)
        import ray  # noqa: PLC0415 (an extra, loaded where it is used)

        try:
            with own_handler():
                join(ray, address)
            yield ray
        finally:
            with own_handler():
                ray.shutdown()


def join(ray: ModuleType, address: str) -> None:
    """Connect, or start Ray on this machine where the address is "local". Raises UserError."""
    if address == "local":
        where = ray.util.get_node_ip_address()
        if where not in ("127.0.0.1", "::1"):
            raise UserError(
                f"--engine ray: this program has imported ray itself, and Ray would now listen on {where}; call ray.init() "
                "first, or leave the import to quadstep"
            )
    started = {"include_dashboard": False} if address == "local" else {}
    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR, **started)
    except (Exception, SystemExit) as error:  # Ray ends the process where its head does not answer
        wrong = "Ray could not be started on this machine" if started else f"the cluster at {address} cannot be joined"
        raise UserError(f"--engine ray: {wrong}: {first_line(error)}") from None


@contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for the duration of the block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


# A cluster elsewhere


def cluster_at(address: str) -> str:
    """The address, if a cluster accepts drivers there. Raises UserError.

    A process of its own finds out: where something is wrong, Ray writes to the error stream, tries for minutes, and may abort.
    """
    if address != "auto":
        reach(address)
    wrong = f"--engine ray: the cluster at RAY_ADDRESS = {address} cannot be joined"
    try:
        trial = subprocess.run(
            [sys.executable, "-P", "-c", TRIAL, address],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=JOINING,
            check=False,
            stdin=subprocess.DEVNULL,
            env={**os.environ, "RAY_NUM_REDIS_GET_RETRIES": "5"},
        )
    except subprocess.TimeoutExpired:
        raise UserError(f"{wrong}: Ray did not answer within {JOINING:g} s") from None
    if "AuthToken" in trial.stderr or "AuthenticationError" in trial.stderr:
        raise UserError(f"{wrong}: it requires its token; set RAY_AUTH_MODE=token and RAY_AUTH_TOKEN or RAY_AUTH_TOKEN_PATH")
    if "Could not find any running Ray instance" in trial.stderr:
        raise UserError(f"{wrong}: no Ray was started on this machine; allowed: HOST:PORT of the head node, or local")
    if trial.returncode:
        last = trial.stderr.strip().rpartition("\n")[2]
        raise UserError(f"{wrong}: {shortened(last) or 'Ray gave up without a message'}")
    return address


def reach(address: str) -> None:
    """Raises UserError for an address where nothing listens."""
    host, _, port = address.rpartition(":")
    if not re.fullmatch(r"[^\s:/]+|\[[0-9a-fA-F:]+\]", host) or not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > 65535:
        raise UserError(
            f"--engine ray: RAY_ADDRESS = {address[:80]!r}: should be HOST:PORT of the head node (usually HOST:6379), auto or "
            "local"
        )
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=ANSWER).close()
    except OSError as error:
        raise UserError(
            f"--engine ray: the cluster at RAY_ADDRESS = {address} cannot be reached: {error.strerror or error}; is its head "
            "node running (ray status)?"
        ) from None


@contextmanager
def own_handler() -> Iterator[None]:
    """Restore the handler of SIGTERM that Ray replaces."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def cores(ray: ModuleType) -> int:
    """Of all nodes that are alive."""
    return int(ray.cluster_resources().get("CPU", 0))


def first_line(error: BaseException) -> str:
    return shortened(f"{type(error).__name__}: {error}")


def shortened(text: str) -> str:
    """The first line of a text, as a part of one."""
    return text.strip().partition("\n")[0][:300]
