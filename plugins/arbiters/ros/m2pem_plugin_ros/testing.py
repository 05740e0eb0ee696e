"""For tests over real DDS: a ROS domain for each test, and peers in other processes.

In a conftest: `keep_on_loopback()` of m2pem_plugin_ros.loopback first, then `from
m2pem_plugin_ros.testing import ros_domain  # noqa: F401`.
"""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import pytest

from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.fork_server import ForkedProgram, fork_server

DOMAINS = range(1, 101)
"""On Linux, the ports of higher domains are in the ephemeral range."""

FIRST_PORT = 18500
STOP_WITHIN_S = 30


@contextmanager
def reserved_domain() -> Iterator[int]:
    """Reserve a ROS domain for the block, among processes of this machine that use this function.

    A socket of 127.0.0.1 is the reservation, so that it ends with its process.
    """
    for domain in DOMAINS:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reservation:
            try:
                reservation.bind(("127.0.0.1", FIRST_PORT + domain))
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError(f"all {len(DOMAINS)} ROS domains are reserved")


@pytest.fixture
def ros_domain() -> Iterator[int]:
    """A ROS domain for one test."""
    with reserved_domain() as domain:
        yield domain


class Peer:
    """A Python program in another process, on 127.0.0.1, in a ROS domain.

    The block begins when the program has printed the line "ready". It ends the program by SIGTERM,
    or `kill`. `forked`: it finds ROS and m2pem imported (m2pem_plugin_ros.fork_server).
    """

    def __init__(
        self,
        program: Path | str,
        domain: int,
        arguments: Sequence[str] = (),
        *,
        forked: bool = True,
    ) -> None:
        environment = {**os.environ, **loopback.environment(domain)}
        self.process: subprocess.Popen[str] | ForkedProgram
        if forked:
            self.process = fork_server().start(program, arguments, environment)
        else:
            command = [sys.executable, str(program), *arguments]
            self.process = subprocess.Popen(
                command, env=environment, stdout=subprocess.PIPE, text=True
            )

    def __enter__(self) -> Self:
        self.wait_for("ready")
        return self

    def __exit__(self, *_: object) -> None:
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(STOP_WITHIN_S)
        except subprocess.TimeoutExpired:
            self.kill()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def wait_for(self, line: str) -> None:
        """Read its output until that line.

        Raises:
            RuntimeError: the process ended before.
        """
        assert self.process.stdout is not None
        for printed in self.process.stdout:
            if printed.strip() == line:
                return
        raise RuntimeError(f"the peer ended with {self.process.wait()} before it was '{line}'")

    def kill(self) -> None:
        """Kill the process, as a power failure would."""
        self.process.kill()
        self.process.wait()
