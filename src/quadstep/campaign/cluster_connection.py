"""The connection to a Ray cluster: whichever there is, quietly, and left as it was found."""

import logging
import os
import re
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from quadstep.errors import UserError

ENVIRONMENT = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is sent anywhere
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".*",  # what becomes of lost workers is not for the user's screen
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # else a warning about graphics processors that nobody asked for
}
"""What Ray reads as it is imported."""

ANSWER = 5.0
"""How long a head node may take to take a connection [s]. Ray itself would try for minutes, and then end the process."""


@contextmanager
def connected() -> Iterator[Any]:
    """The module of Ray, connected: to the cluster of RAY_ADDRESS, else to one that this machine is a node of, else to one of
    this machine's cores, which ends with the block. Raises UserError.
    """
    for name, value in ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    import ray  # noqa: PLC0415 (an extra, loaded where it is used)

    if ray.is_initialized():  # by a program around this one, which goes on with it
        yield ray
        return
    try:
        with own_handler():
            join(ray, os.environ.get("RAY_ADDRESS", "").strip())
        yield ray
    finally:
        with own_handler():
            ray.shutdown()


def join(ray: Any, address: str) -> None:
    """Connect. Raises UserError."""
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    local: dict[str, Any] = {"address": "local", "include_dashboard": False}
    if address not in ("", "auto", "local"):
        reach(address)
    try:
        if address:
            ray.init(**(local if address == "local" else {"address": address}), **quiet)
            return
        try:
            ray.init(address="auto", **quiet)
        except ConnectionError:
            ray.init(**local, **quiet)
    except (Exception, SystemExit) as error:  # Ray ends the process where its head does not answer
        where = f"the cluster at RAY_ADDRESS = {address}" if address else "a cluster of this machine's cores"
        said = "no Ray answers there" if isinstance(error, SystemExit) else first_line(error)
        raise UserError(f"--engine ray: {where} cannot be joined: {said}") from None


def reach(address: str) -> None:
    """Raises UserError for an address where nobody listens."""
    host, _, port = address.rpartition(":")
    if not re.fullmatch(r"[^\s:/]+|\[[0-9a-fA-F:]+\]", host) or not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > 65535:
        raise UserError(
            f"--engine ray: RAY_ADDRESS = {address:.80}: should be HOST:PORT of the head node (as a rule HOST:6379), auto or "
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
    """What was to be done on SIGTERM stays to be done, after Ray has put its own handler there."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def cores(ray: Any) -> int:
    """Of all nodes that are alive."""
    return int(ray.cluster_resources().get("CPU", 0))


def first_line(error: BaseException) -> str:
    """What an error says first."""
    return f"{type(error).__name__}: {error}".strip().partition("\n")[0][:300]
