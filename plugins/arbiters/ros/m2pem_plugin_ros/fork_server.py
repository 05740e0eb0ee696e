"""Starts Python programs that find ROS and m2pem imported: each is forked from one process.

To import them takes longer than most programs of tests run. A forked program is a process of its
own, with its own arguments, environment and standard streams. Linux only.

`python -m m2pem_plugin_ros.fork_server FD` is the server; FD is its end of a socket pair.
"""

import gc
import importlib
import json
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO

PRELOADED = (
    "click",
    "m2pem_interfaces.action",
    "m2pem_interfaces.srv",
    "m2pem_plugin_ros.onboard.action_server",
    "m2pem_plugin_ros.onboard.node",
    "m2pem_plugin_ros.simulator.command_line",
    "m2pem_plugin_ros.simulator.simulation",
    "rclpy.action",
)
"""They start no threads, which would not be there after a fork (numpy: OPENBLAS_NUM_THREADS)."""

REQUEST_BYTES = 200_000
NUMBER_BYTES = 4
ENDED = "the fork server has ended"


@dataclass(frozen=True, slots=True)
class Request:
    """A program to run: its file, arguments, working folder and environment."""

    program: str
    arguments: list[str]
    folder: str
    environment: dict[str, str]


class ForkServer:
    """The server, for the process that uses it. It ends with that process, or by `close`."""

    def __init__(self) -> None:
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(theirs.fileno())],
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
            )

    def start(
        self,
        program: Path | str,
        arguments: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
        *,
        writes: bool = False,
    ) -> "ForkedProgram":
        """Start a program. `writes`: its standard input is a pipe, not that of this process.

        Raises:
            RuntimeError: the server has ended.
        """
        variables = dict(os.environ if environment is None else environment)
        request = Request(str(program), list(arguments), str(Path.cwd()), variables)
        stdin, our_stdin = os.pipe() if writes else (os.dup(0), None)
        our_stdout, stdout = os.pipe()
        our_status, status = os.pipe()
        try:
            words = json.dumps(asdict(request)).encode()
            socket.send_fds(self._channel, [words], [stdin, stdout, 2, status])
        except OSError as error:
            for descriptor in (our_stdin, our_stdout, our_status):
                if descriptor is not None:
                    os.close(descriptor)
            raise RuntimeError(ENDED) from error
        finally:
            for descriptor in (stdin, stdout, status):
                os.close(descriptor)
        return ForkedProgram(our_stdin, our_stdout, our_status)

    def close(self) -> None:
        """End the server. Its programs go on."""
        self._channel.close()
        self._process.wait()


class ForkedProgram:
    """A program that runs, with the methods of `subprocess.Popen`. Its output is text."""

    def __init__(self, stdin: int | None, stdout: int, status: int) -> None:
        self.stdin: IO[str] | None = None if stdin is None else os.fdopen(stdin, "w")
        self.stdout: IO[str] = os.fdopen(stdout)
        self.returncode: int | None = None
        self._status = os.fdopen(status, "rb", buffering=0)
        self._turn = threading.Lock()
        self.pid = self._read()

    def poll(self) -> int | None:
        """Return its exit status, or None: it runs. Minus a signal: that has ended it."""
        return self._wait(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit status when it has ended.

        Raises:
            subprocess.TimeoutExpired: it did not end within `timeout` (s).
        """
        status = self._wait(timeout)
        if status is None:
            raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
        return status

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it has not ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it, if it has not ended."""
        self.send_signal(signal.SIGKILL)

    def _wait(self, timeout_s: float | None) -> int | None:
        with self._turn:
            if self.returncode is None:
                with selectors.DefaultSelector() as selector:
                    selector.register(self._status, selectors.EVENT_READ)
                    if not selector.select(timeout_s):
                        return None
                self.returncode = self._read()
                self._status.close()
            return self.returncode

    def _read(self) -> int:
        number = self._status.read(NUMBER_BYTES)
        if len(number) < NUMBER_BYTES:
            raise RuntimeError(ENDED)
        return int.from_bytes(number, "big", signed=True)


_server: ForkServer | None = None
_starting = threading.Lock()


def fork_server() -> ForkServer:
    """Return the server of this process. The first call starts it."""
    global _server  # noqa: PLW0603  # one for the process
    with _starting:
        if _server is None:
            _server = ForkServer()
        return _server


# --- the server ----------------------------------------------------------------------------------


def main(channel: socket.socket) -> None:
    """Fork programs until the other end of the channel is closed. A fork runs its program here."""
    for module in PRELOADED:
        importlib.import_module(module)
    gc.freeze()  # what is imported stays: forks need not look at it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    request = _serve(channel)
    if request is not None:
        _run(request)


def _serve(channel: socket.socket) -> Request | None:
    """Return the request to run, in a fork; None, in the server: it is not needed any more."""
    with selectors.DefaultSelector() as selector:
        selector.register(channel, selectors.EVENT_READ)
        statuses: dict[int, tuple[int, int]] = {}
        while True:
            for key, _ in selector.select():
                if key.fd in statuses:
                    _tell_the_end(key.fd, *statuses.pop(key.fd), selector)
                    continue
                words, descriptors, _, _ = socket.recv_fds(channel, REQUEST_BYTES, 4)
                if not words:
                    return None
                *streams, status = descriptors
                if (process := os.fork()) == 0:
                    for number, stream in enumerate(streams):
                        os.dup2(stream, number)
                    own = [channel.fileno(), *statuses, *(each for _, each in statuses.values())]
                    for descriptor in (*own, *descriptors):
                        os.close(descriptor)
                    channel.detach()
                    return Request(**json.loads(words))
                for stream in streams:
                    os.close(stream)
                os.write(status, process.to_bytes(NUMBER_BYTES, "big", signed=True))
                ended = os.pidfd_open(process)
                statuses[ended] = process, status
                selector.register(ended, selectors.EVENT_READ)


def _tell_the_end(ended: int, process: int, status: int, selector: selectors.BaseSelector) -> None:
    selector.unregister(ended)
    os.close(ended)
    _, wait_status = os.waitpid(process, 0)
    code = os.waitstatus_to_exitcode(wait_status)
    try:
        os.write(status, code.to_bytes(NUMBER_BYTES, "big", signed=True))
    except BrokenPipeError:  # nobody waits for it
        pass
    finally:
        os.close(status)


def _run(request: Request) -> None:
    """Run a program as `python PROGRAM` would."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(request.folder)
    os.environ.clear()
    os.environ.update(request.environment)
    sys.argv[:] = [request.program, *request.arguments]
    sys.path[0] = str(Path(request.program).parent)
    runpy.run_path(request.program, run_name="__main__")


if __name__ == "__main__":
    main(socket.socket(fileno=int(sys.argv[1])))
