"""MAVSDK as a client of a fleet on the MAVLink face."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import aclosing, asynccontextmanager
from pathlib import Path
from typing import Any

from mavlink_gcs import HOME, gateway
from mavlink_mavsdk_world import free_port
from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk

from m2pem.api import distance_m

ROVER1, UAV1 = 1, 2
PLACES = {ROVER1: HOME, UAV1: (38.1080, -77.3192), 3: (38.1070, -77.3192)}
WITHIN_S = 60.0

Plugin = Callable[[Any], Any]


class Client:
    """MAVSDK's plugins by system id, destroyed at the end in the order that MAVSDK wants."""

    def __init__(self, systems: dict[int, Any]) -> None:
        self.systems = systems
        self._made: list[Any] = []

    def plugin(self, kind: Plugin, system: int) -> Any:
        made = kind(self.systems[system])
        self._made.append(made)
        return made

    def release(self) -> None:
        for each in self._made:
            each.destroy()


@asynccontextmanager
async def client(port: int) -> AsyncIterator[Client]:
    """MAVSDK with all systems of the fleet."""
    mavsdk_log.log_subscribe(lambda *_: True)
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    found: dict[int, Any] = {}

    async def find(news: AsyncGenerator[None, None]) -> None:
        async with aclosing(news):
            async for _ in news:
                for each in await mavsdk.get_systems():
                    found[await each.get_system_id()] = each
                if found.keys() >= PLACES.keys():
                    return

    # Begun before the connection, so that no system is missed.
    finding = asyncio.create_task(find(mavsdk.on_new_system()))
    await asyncio.sleep(0)
    await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
    async with asyncio.timeout(WITHIN_S):
        await finding
    made = Client(found)
    try:
        yield made
    finally:
        made.release()
        await asyncio.to_thread(mavsdk.destroy)


async def first(stream: AsyncGenerator[Any, None], true: Callable[[Any], bool]) -> Any:
    async with asyncio.timeout(WITHIN_S), aclosing(stream):
        async for value in stream:
            if true(value):
                return value


def at(place: tuple[float, float], within_m: float) -> Callable[[Any], bool]:
    return lambda each: distance_m((each.latitude_deg, each.longitude_deg), place) < within_m


def fleet_on(
    folder: Path, main: Callable[[Any, Client], Any], speed: float = 5.0, **settings: Any
) -> None:
    """Run `main` with an executive that shows its fleet to MAVSDK."""

    async def run() -> None:
        port = free_port()
        settings["url"] = f"udpout://127.0.0.1:{port}"
        async with gateway(folder, speed=speed, **settings) as (control, _), client(port) as sdk:
            await main(control, sdk)

    asyncio.run(run())
