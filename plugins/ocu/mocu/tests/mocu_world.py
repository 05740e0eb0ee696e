"""An executive with its unit in this process, and operators' clients in processes of their own."""

import asyncio
import itertools
import json
import os
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mocu.ocu import MocuOcu
from m2pem_plugin_mocu.settings import NAMESPACE
from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.fork_server import fork_server
from m2pem_plugin_ros.testing import reserved_domain

from m2pem.api import ArbiterContext, Connection, FleetBus, MissionControl, ResourceId
from m2pem.fleet.fleet import Fleet
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing import scenarios
from m2pem.testing.contracts.ocu_harness import Faults
from m2pem.testing.harness import run_executive

PEER = Path(__file__).with_name("mocu_client_peer.py")
ONE, OTHER = "/m2pem", "/team_b/m2pem"
WITHIN_S = 30.0
LOOK_EVERY_S = 0.005

Message = dict[str, Any]


class Client:
    """A process with a client; what it printed stays in `said`, as JSON."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self.said: list[Message] = []
        self._numbers = itertools.count(1)
        environment = {**os.environ, **loopback.environment(domain)}
        self.process = fork_server().start(PEER, [ONE, OTHER], environment, writes=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.said.append(json.loads(line))

    def send(self, service: str, namespace: str = ONE, times: int = 1, **fields: Any) -> int:
        """Have it call a service; the id of the call."""
        assert self.process.stdin is not None
        number = next(self._numbers)
        order = {"id": number, "namespace": namespace, "service": service, "fields": fields}
        self.process.stdin.write(json.dumps({**order, "times": times}) + "\n")
        self.process.stdin.flush()
        return number

    async def call(self, service: str, namespace: str = ONE, **fields: Any) -> Message:
        """Have it call a service, and return the response."""
        number = self.send(service, namespace, **fields)
        (response,) = await self.responses(number, 1)
        return response

    async def responses(self, number: int, count: int) -> list[Message]:
        """Wait for so many responses to a call."""

        def come() -> list[Message]:
            return [each["response"] for each in list(self.said) if each.get("id") == number]

        await until(lambda: len(come()) >= count, lambda: f"{len(come())} responses came")
        return come()

    def heard(self, topic: str, namespace: str = ONE, since: int = 0) -> list[Message]:
        """What came by a topic, the latest last; `since`: a length of `said`."""
        return [
            each["message"]
            for each in list(self.said)[since:]
            if each.get("topic") == topic and each.get("namespace") in (namespace, "")
        ]

    async def hears(
        self, topic: str, wanted: Callable[[Message], bool], namespace: str = ONE, since: int = 0
    ) -> Message:
        """Wait for a message like this."""

        def come() -> list[Message]:
            return [each for each in self.heard(topic, namespace, since) if wanted(each)]

        await until(
            lambda: bool(come()),
            lambda: f"{topic} said {self.heard(topic, namespace, since)[-3:]}",
        )
        return come()[0]

    def close(self) -> None:
        """End it, as a power failure would."""
        self.process.kill()
        self.process.wait()
        self._reader.join()
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.stdout.close()


def values(diagnostics: Message, name: str = "m2pem: executive") -> dict[str, str]:
    """The values of a status, by their keys."""
    (found,) = [each for each in diagnostics["status"] if each["name"] == name]
    return {each["key"]: each["value"] for each in found["values"]}


async def until(true: Callable[[], bool], otherwise: Callable[[], str] = lambda: "") -> None:
    """Wait for something that a process or DDS does."""
    try:
        async with asyncio.timeout(WITHIN_S):
            while not true():  # noqa: ASYNC110  # other processes set no event
                await asyncio.sleep(LOOK_EVERY_S)
    except TimeoutError:
        raise AssertionError(f"not within {WITHIN_S:g} s: {otherwise()}") from None


def until_ready(client: Client) -> None:
    """Wait for its process, where no event loop runs."""
    asyncio.run(until(lambda: bool(client.said), lambda: "the client has not begun"))


def fleet() -> Fleet:
    """Two vehicles, simulated, and a camera."""
    return scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}, "ugv2/camera": {}})


class World:
    """An executive, the unit that serves operators of it, and what stands between the two."""

    def __init__(self, control: MissionControl, bus: FleetBus, domain: int) -> None:
        self.control = control
        self.bus = bus
        self.faults = Faults(control)
        self.domain = domain
        self.serving: asyncio.Task[None]

    def begin(self, namespace: str = ONE) -> MocuOcu:
        """Have a unit serve."""
        unit = MocuOcu(self.faults, environment={NAMESPACE: namespace}, domain_id=self.domain)
        self.serving = asyncio.create_task(unit.serve())
        return unit

    async def has_listeners(self, client: Client) -> None:
        """Wait until the session's clients hear what is told once, such as events."""
        await client.hears("diagnostics", lambda each: int(values(each)["listeners"]) >= 2)

    async def leave(self) -> None:
        """Cancel it, and see it end."""
        self.serving.cancel()
        done, _ = await asyncio.wait([self.serving], timeout=WITHIN_S)
        assert done, "the unit does not end"
        if not self.serving.cancelled():
            self.serving.result()

    async def asks(self, text: str = "Go on?", **options: Any) -> tuple[str, str]:
        """Start a mission that asks; the run and the prompt."""
        run = await self.control.start(scenarios.question(text, **options), by="test")
        await until(lambda: any(each.run == run for each in self.control.prompts()))
        return run, next(each.prompt for each in self.control.prompts() if each.run == run)

    async def drives(self, vehicle: str = "ugv1") -> str:
        """Start a mission in which a vehicle drives for long; the run."""
        north = f"[{scenarios.ORIGIN[0] + 0.1}, {scenarios.ORIGIN[1]}]"
        mission = scenarios.one_behavior("goto", ResourceId(vehicle), target=north)
        return await self.control.start(mission, by="test")


@asynccontextmanager
async def staged(domain: int, of: Fleet | None = None, **options: Any) -> AsyncIterator[World]:
    """A world whose unit serves. `of`: its fleet, in place of `fleet`."""
    lent: list[ArbiterContext] = []

    def simulated(
        connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> SimArbiter:
        lent.append(context)
        return SimArbiter(connections, context)

    arbiters = {"sim": simulated}
    async with run_executive(of or fleet(), speed=20.0, arbiters=arbiters, **options) as control:
        world = World(control, lent[0].bus, domain)
        world.begin()
        try:
            yield world
        finally:
            world.faults.mend()
            await world.leave()


@pytest.fixture(scope="session")
def clients() -> Iterator[list[Client]]:
    """Two clients in one ROS domain, for all tests, as they take a while to begin."""
    with reserved_domain() as domain:
        both = [Client(domain), Client(domain)]
        try:
            for client in both:
                until_ready(client)
            yield both
        finally:
            for client in both:
                client.close()


@pytest.fixture
def client(clients: list[Client]) -> Client:
    """One of them; it has heard nothing yet."""
    for each in clients:
        each.said.clear()
    return clients[0]


@pytest.fixture
async def world(client: Client) -> AsyncIterator[World]:
    """An executive with a unit, in the domain of the clients."""
    async with staged(client.domain) as world:
        yield world
