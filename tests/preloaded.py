"""m2pem as processes that need not import it first: forked from one process that has.

`Preloaded.start` makes what `python -m m2pem` makes, a process of its own with its own standard
streams, working folder, environment, signals and exit status. Only what Python itself does at its
start, most of the time that a short command takes, has been done before, once for all tests.
"""

import atexit
import fcntl
import gc
import importlib
import io
import json
import os
import pkgutil
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import termios
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

from m2pem_plugin_ros import fork_server

from m2pem.plugins import PluginManager

REPOSITORY = Path(__file__).parents[1]
MOST_BYTES = 100_000
"""Of a request to start a process."""


# --- in the tests ---------------------------------------------------------------------------------


@dataclass(slots=True)
class Process:
    """Like a `subprocess.Popen`, but a child of another process, which tells how it ended."""

    pid: int
    returncode: int | None = None
    _ended: socket.socket = field(kw_only=True)

    def poll(self) -> int | None:
        """The exit status, negative for a signal; None while it runs."""
        return self._look(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Raises `TimeoutError` after `timeout` seconds."""
        status = self._look(timeout)
        if status is None:
            raise TimeoutError(f"{self.pid} runs still after {timeout} s")
        return status

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def _look(self, timeout_s: float | None) -> int | None:
        if self.returncode is None:
            self._ended.settimeout(timeout_s)
            try:
                said = self._ended.recv(64)
            except (BlockingIOError, TimeoutError):
                return None
            assert said, "the process that all others are forked from has ended"
            self.returncode = int(said)
            self._ended.close()
        return self.returncode


class Preloaded:
    """The process that has imported m2pem and its plugins. It ends with this one.

    `environment`: what it has besides this one's.
    """

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            subprocess.Popen(
                [sys.executable, "-m", "tests.preloaded", str(theirs.fileno())],
                cwd=REPOSITORY,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **(environment or {})},
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
            )

    def start(
        self,
        words: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        streams: tuple[int, int, int],
        *,
        at_terminal: bool = False,
    ) -> Process:
        """Start `m2pem WORDS` in the folder, or `python -c CODE` where that is what `words` are.

        `streams`: its standard input, output and error. `at_terminal`: the input is to be the
        terminal that controls it.
        """
        ended, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        request = json.dumps([list(words), str(folder), dict(environment), at_terminal]).encode()
        assert len(request) < MOST_BYTES
        with theirs:
            socket.send_fds(self._control, [request], [theirs.fileno(), *streams])
        pid = ended.recv(64)
        assert pid, "m2pem could not be imported: standard error says why"
        return Process(int(pid), _ended=ended)


@cache
def preloaded() -> Preloaded:
    """The one of this process."""
    return Preloaded()


# --- in the process that has m2pem ----------------------------------------------------------------


def _import_all() -> None:
    for module in pkgutil.walk_packages(importlib.import_module("m2pem").__path__, "m2pem."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for point in entry_points(group="m2pem"):
        point.load()
    plugins = PluginManager()  # their hooks import what they register
    for offers in (plugins.arbiters, plugins.ocus, plugins.services):
        offers()
    if find_spec("rclpy"):
        for name in fork_server.PRELOADED:
            importlib.import_module(name)


def _become(
    streams: list[int],
    words: list[str],
    folder: str,
    environment: dict[str, str],
    at_terminal: bool,
) -> None:
    """Make of this process one that was just started; it runs m2pem to its end."""
    if at_terminal:
        os.setsid()
        fcntl.ioctl(streams[0], termios.TIOCSCTTY, 0)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin = io.TextIOWrapper(open(0, "rb", closefd=False))  # noqa: SIM115
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(
            open(number, "wb", closefd=False),  # noqa: SIM115
            errors=errors,
            line_buffering=number == 2 or os.isatty(number),
        )
        for number, errors in ((1, "strict"), (2, "backslashreplace"))
    )
    # What Python puts before its own library.
    here = next(n for n, place in enumerate(sys.path) if place.endswith(".zip"))
    sys.path[:here] = [folder, *filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))]
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = ["m2pem", *words]
    try:
        if words[:1] == ["-c"]:
            exec(words[1], {"__name__": "__main__"})
            sys.exit(0)
        runpy.run_module("m2pem", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        # As Python ends, but for its modules: to take them to pieces takes longer than a command.
        threading._shutdown()
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(end.code)


def _serve(control: socket.socket) -> None:
    """Fork for each request, and tell of each process how it has ended."""
    running: dict[int, tuple[int, socket.socket]] = {}
    with selectors.DefaultSelector() as selector:
        selector.register(control, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fd != control.fileno():
                    selector.unregister(key.fd)
                    pid, ended = running.pop(key.fd)
                    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                    os.close(key.fd)
                    with ended:
                        ended.send(str(status).encode())
                    continue
                request, descriptors, _, _ = socket.recv_fds(control, MOST_BYTES, 4)
                if not request:
                    return
                ended = socket.socket(fileno=descriptors[0])
                pid = os.fork()
                if pid == 0:
                    for descriptor, (_, other) in running.items():
                        os.close(descriptor)
                        other.close()
                    ended.close()
                    selector.close()
                    control.close()
                    _become(descriptors[1:], *json.loads(request))
                for descriptor in descriptors[1:]:
                    os.close(descriptor)
                ended.send(str(pid).encode())
                watched = os.pidfd_open(pid)
                running[watched] = pid, ended
                selector.register(watched, selectors.EVENT_READ)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _import_all()
    gc.collect()
    gc.freeze()  # what is here stays: those that are forked need not look through it
    _serve(socket.socket(fileno=int(sys.argv[1])))
