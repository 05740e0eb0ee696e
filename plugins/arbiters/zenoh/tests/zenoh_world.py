"""Hosts with simulated vehicles in processes of their own, and a link that can be cut."""

import asyncio
import os
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

from m2pem.api import (
    ArbiterContext,
    Connection,
    CutOffPolicy,
    Host,
    HostedArbiter,
    ResourceId,
)
from m2pem.simulation.arbiters import SimArbiter
from tests.command_line import REPOSITORY, CommandLine, Program

HERE = Path(__file__).parent
UGV1, UGV2 = ResourceId("ugv1"), ResourceId("ugv2")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def hosted_simulation(
    port: int,
    folder: Path,
    policy: CutOffPolicy = CutOffPolicy(),  # noqa: B008  # it is frozen
    lost_after_s: float | None = None,
    round_trip_s: float = 1.0,
    connect: str = "",
) -> HostedArbiter:
    """Two simulated vehicles at a host, which listens at the port, or at one that leads to it.

    `connect`: the endpoint of a router, to which the executive connects instead.
    """
    settings = {"state": str(folder / "vehicles.sqlite"), "telemetry_hz": 10}
    connections = {
        vehicle: Connection(vehicle, "ground", settings, lost_after_s=lost_after_s)
        for vehicle in (UGV1, UGV2)
    }
    endpoint = connect or f"tcp/127.0.0.1:{port}"
    host = Host("pi", (endpoint,), telemetry_hz=50.0, round_trip_s=round_trip_s)

    def make(context: ArbiterContext) -> SimArbiter:
        return SimArbiter(connections, context)

    return HostedArbiter(
        "fleet", host, "sim", connections, dict.fromkeys(connections, policy), make
    )


class HostProcess:
    """A host in a process of its own. It obeys lines at its standard input: cut, mend, effects.

    `speed`: of its clock. `policy`: what it does alone, and after how long. `lost_after_s`: of its
    vehicles. `connect`: to the endpoint of a router; it listens at the port if there is none.
    `inside`: the words before its command, if it does not run here.
    """

    program = "zenoh_host_process.py"

    def __init__(
        self,
        port: int,
        folder: Path,
        speed: float = 1.0,
        policy: str = "hold:10",
        lost_after_s: float = 3.0,
        round_trip_s: float = 1.0,
        connect: str = "",
        inside: Sequence[str] = (),
    ) -> None:
        self.port = port
        words = [self.program, str(port), str(folder), str(speed), policy, str(lost_after_s)]
        words += [str(round_trip_s), connect]
        self._inside = inside
        self._code = (
            f"import runpy, sys; sys.argv[:] = {words!r}; "
            f"runpy.run_path({str(HERE / self.program)!r}, run_name='__main__')"
        )
        more = os.environ.get("PYTHONPATH", "").split(os.pathsep)
        modules = os.pathsep.join(map(str, (HERE, REPOSITORY, *filter(None, more))))
        self._command_line = CommandLine(folder, {"PYTHONPATH": modules})
        self._process = self._start()

    def _start(self) -> Program:
        process = self._started()
        process.until(lambda line: "listens" in line or "connects" in line)
        return process

    def _started(self) -> Program:
        if not self._inside:
            return self._command_line.start("-c", self._code)
        return self._command_line.start_other(*self._inside, sys.executable, "-c", self._code)

    def say(self, words: str) -> str:
        """Have it do something; returns what it answers."""
        self._process.type(words)
        return self._process.stdout.readline().strip()

    def kill(self) -> None:
        """End it at once, as a power failure would."""
        self._process.kill()

    def restart(self) -> None:
        """Start it again, as systemd would."""
        self._process = self._start()

    def close(self) -> None:
        self._command_line.end()


def warm_up() -> None:
    """Have Zenoh start what it keeps until the process ends, so that a test for leaks sees none."""
    import zenoh

    port = free_port()

    def config(mode: str, side: str) -> "zenoh.Config":
        config = zenoh.Config()
        config.insert_json5("mode", f'"{mode}"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("listen/endpoints", "[]")
        config.insert_json5(f"{side}/endpoints", f'["tcp/127.0.0.1:{port}"]')
        return config

    with zenoh.open(config("peer", "listen")), zenoh.open(config("client", "connect")):
        pass


class Wire:
    """A TCP proxy: delays what passes, or lets nothing pass while both ends stay connected.

    `delay_s`: on each way. `cut`: what is sent meanwhile arrives afterwards, as over a radio.
    """

    def __init__(self, port: int, to_port: int) -> None:
        self.port = port
        self.delay_s = 0.0
        self._to_port = to_port
        self._passes = asyncio.Event()
        self._passes.set()
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def cut(self) -> bool:
        return not self._passes.is_set()

    @cut.setter
    def cut(self, cut: bool) -> None:
        if cut:
            self._passes.clear()
        else:
            self._passes.set()

    async def __aenter__(self) -> "Wire":
        self._server = await asyncio.start_server(self._connected, "127.0.0.1", self.port)
        return self

    async def __aexit__(self, *_: object) -> None:
        assert self._server is not None
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            await self._passes.wait()  # nobody is reached while it is cut
            there = await asyncio.open_connection("127.0.0.1", self._to_port)
        except (OSError, asyncio.CancelledError):
            writer.close()
            return
        ways = [self._pass(reader, there[1]), self._pass(there[0], writer)]
        pumps = [asyncio.create_task(way) for way in ways]
        self._tasks.update(pumps)
        try:
            await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for end in (writer, there[1]):
                end.close()
            for pump in pumps:
                pump.cancel()

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        loop = asyncio.get_running_loop()

        async def send() -> None:
            while True:
                at_s, content = await waiting.get()
                await asyncio.sleep(at_s - loop.time())
                await self._passes.wait()
                writer.write(content)

        sending = asyncio.create_task(send())
        self._tasks.add(sending)
        try:
            while content := await reader.read(65_536):
                waiting.put_nowait((loop.time() + self.delay_s, content))
        except OSError:
            pass
        finally:
            sending.cancel()
