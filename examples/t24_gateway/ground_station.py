"""What any ground station sees of a mixed fleet: four MAVLink systems; and a command to a rover.

MAVSDK alone: it knows nothing of m2pem. Ends with 0 when all systems were found, and the command
was refused (--refused), or has brought the rover there.
"""

import argparse
import asyncio
import math
import sys
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing, suppress
from typing import Any

from mavsdk import logging as mavsdk_log
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.telemetry import FlightMode

WITHIN_S = 60.0
DEGREE_M = 111_320.0


async def first(stream: AsyncGenerator[Any, None], true: Callable[[Any], bool]) -> Any:
    """The first value of a stream for which something is true."""
    async with asyncio.timeout(WITHIN_S), aclosing(stream):
        async for value in stream:
            if true(value):
                return value
    raise SystemExit("the stream of a vehicle has ended")


async def systems_of(mavsdk: Any, port: int, wanted: int) -> dict[int, Any]:
    """All systems by their ids, when so many were found."""
    found: dict[int, Any] = {}

    async def find(news: AsyncGenerator[None, None]) -> None:
        async with aclosing(news):
            async for _ in news:
                for each in await mavsdk.get_systems():
                    found[await each.get_system_id()] = each
                if len(found) >= wanted:
                    return

    finding = asyncio.create_task(find(mavsdk.on_new_system()))
    await asyncio.sleep(0)
    await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
    with suppress(TimeoutError):
        async with asyncio.timeout(WITHIN_S):
            await finding
    if len(found) < wanted:
        raise SystemExit(f"{len(found)} of {wanted} systems found: {sorted(found)}")
    return found


async def command(telemetry: Any, action: Any, place: tuple[float, float], refused: bool) -> None:
    """Send a rover somewhere."""
    said: list[str] = []

    async def listen() -> None:
        async for text in telemetry.subscribe_status_text():
            said.append(text.text)

    listening = asyncio.create_task(listen())
    try:
        await action.goto_location(*place, 60.0, math.nan)
    except ActionError as error:
        if not refused:
            raise SystemExit(f"the command was refused: {error}") from error
        async with asyncio.timeout(WITHIN_S):
            while not said:  # noqa: ASYNC110  # the stream of MAVSDK has no event
                await asyncio.sleep(0.05)
        print(f"MAVLink: refused: {said[-1]}", flush=True)
        return
    finally:
        listening.cancel()
    if refused:
        raise SystemExit("the command was not refused")

    def there(position: Any) -> bool:
        east = (position.longitude_deg - place[1]) * math.cos(math.radians(place[0]))
        return DEGREE_M * math.hypot(position.latitude_deg - place[0], east) < 2

    await first(telemetry.subscribe_position(), there)
    await first(telemetry.subscribe_flight_mode(), lambda mode: mode is FlightMode.HOLD)
    print("MAVLink: the rover is there, and holds", flush=True)


async def serve(arguments: argparse.Namespace) -> None:
    """Find the systems, print where they are, and command one."""
    mavsdk_log.log_subscribe(lambda *_: True)
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    made: list[Any] = []
    try:
        found = await systems_of(mavsdk, arguments.port, arguments.systems)
        telemetry = {number: TelemetryAsync(each) for number, each in sorted(found.items())}
        made += telemetry.values()
        for number, each in telemetry.items():
            position = await first(each.subscribe_position(), lambda _: True)
            print(
                f"MAVLink: system {number}: {position.latitude_deg:.6f}, "
                f"{position.longitude_deg:.6f}, {position.relative_altitude_m:.1f} m above home",
                flush=True,
            )
        if arguments.drive:
            action = ActionAsync(found[arguments.drive])
            made.append(action)
            latitude, longitude = map(float, arguments.to.split(","))
            place = (latitude, longitude)
            await command(telemetry[arguments.drive], action, place, arguments.refused)
    finally:
        for each in made:
            each.destroy()
        await asyncio.to_thread(mavsdk.destroy)


def main() -> None:
    """Read the options."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=14550)
    parser.add_argument("--systems", type=int, default=4, help="how many there are")
    parser.add_argument("--drive", type=int, metavar="SYSTEM", help="the rover to send to --to")
    parser.add_argument("--to", default="38.1074,-77.3194", help="latitude,longitude")
    parser.add_argument("--refused", action="store_true", help="the command must be refused")
    asyncio.run(serve(parser.parse_args()))


if __name__ == "__main__":
    sys.exit(main())
