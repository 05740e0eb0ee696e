"""From `MissionControl` to all members of a team: how soon the last of them hears of it.

python -m bench.programs.team_orders memory|sqlite <ROS vehicles> <MAVLink vehicles> <n>

An executive, a process of ground vehicles with nodes in plain rclpy, over DDS on 127.0.0.1, and a
process of rovers over UDP; all tell of themselves meanwhile. All are one team, and its behavior
(`area_observe`) is begun, paused, resumed and cancelled n times. The time begins in another thread,
with the wish to call `MissionControl`, and ends when the last member has the first command of its
own: in rclpy's callback, or by the kernel's time stamp of the vehicle's socket. Needs Linux.
"""

import asyncio
import json
import queue
import random
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.routed_link import RoutedLink, open_link
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.url import parse_url

from bench.graphs import file
from bench.programs import mavlink_command, mavlink_rovers, ros_command, ros_stage
from bench.programs.commanding import PATIENCE_S, PAUSE_S, Got, Orders
from bench.programs.stage import Plugins, flows, opened
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Team, Vehicle
from m2pem.journal import Journal
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point

ROS_RATE_HZ, MAVLINK_RATE_HZ = 10, 50
RNG = random.Random(6)
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Kind:
    """Members that are reached alike: what one gets when it is to go, stand, go on and end."""

    prefix: str
    orders: Orders
    cancel: tuple[int, ...]


CANCEL = 2
ROS = Kind("v", ros_command.ORDERS, (CANCEL,))
MAVLINK = Kind("w", mavlink_command.ORDERS, (mavlink_rovers.SET_MODE,))


def fleet(ros: int, rovers: int, domain: int) -> Fleet:
    """A team of ROS vehicles v0, v1 and so on, and of rovers w0, w1 and so on."""
    found = ros_stage.fleet(ros, domain)
    latitude, longitude = mavlink_rovers.place(0)
    more = [
        Vehicle(
            ResourceId(f"{MAVLINK.prefix}{number}"),
            Domain.GROUND,
            "mavlink",
            {"url": mavlink_command.URL, "system_id": mavlink_rovers.address(number).system},
            sitl=True,
        )
        for number in range(rovers)
    ]
    vehicles = {**found.vehicles, **{each.id: each for each in more}}
    members = tuple(vehicles)
    return replace(
        found,
        vehicles=vehicles,
        teams={"all": Team("all", members, members[0])},
        geometries={"far": Point((latitude + 0.01, longitude, None))},
    )


MISSION = file(
    '<process id="TEAM" isExecutable="true"><startEvent id="start"/>'
    '<scriptTask id="watch"><extensionElements><m2pem:behavior type="team" name="area_observe">'
    '<m2pem:properties><m2pem:property name="target" value="far"/></m2pem:properties>'
    '<m2pem:resources><m2pem:role name="watchers" team="all"/></m2pem:resources>'
    '</m2pem:behavior></extensionElements></scriptTask><endEvent id="end"/>'
    f"{flows(['start', 'watch', 'end'])}</process>"
)


@dataclass(slots=True)
class Members:
    """What all members get, in the order in which it is seen here."""

    kinds: Mapping[str, Kind]
    got: "queue.SimpleQueue[tuple[str, int, int]]" = field(default_factory=queue.SimpleQueue)

    def listen(self, kind: Kind, receive: Callable[[], Got]) -> None:
        """Take note of what those of a kind get, for as long as anything comes."""

        def go_on() -> None:
            while True:
                try:
                    number, order, came_ns = receive()
                except (queue.Empty, EOFError, OSError):
                    return
                self.got.put((f"{kind.prefix}{number}", order, came_ns))

        threading.Thread(target=go_on, daemon=True).start()

    def expect(self, wanted: Callable[[Kind], tuple[int, ...]]) -> int:
        """When the last member had the first of these orders, once every member has had all.

        Raises:
            queue.Empty: they did not come for long.
        """
        left = {member: list(wanted(kind)) for member, kind in self.kinds.items()}
        last_ns = 0
        while any(left.values()):
            member, order, came_ns = self.got.get(timeout=PATIENCE_S)
            orders = left[member]
            assert orders, f"{member} was told {order}, and should have been told nothing more"
            assert order == orders[0], f"{member} was told {order}, and should have been {orders}"
            if len(orders) == len(wanted(self.kinds[member])):
                last_ns = max(last_ns, came_ns)
            orders.pop(0)
        return last_ns


@dataclass(frozen=True, slots=True)
class Commander:
    """Calls `MissionControl` from a thread of its own."""

    running: Executive
    members: Members
    loop: asyncio.AbstractEventLoop

    def rounds(self, times: int) -> dict[str, list[float]]:
        """Milliseconds from each wish to the last member's command."""
        control = self.running.control
        took: dict[str, list[float]] = {"start": [], "hold": [], "resume": [], "cancel": []}
        for _ in range(times):
            began_ns = time.time_ns()
            run = self._ask(control.start(MISSION))
            last_ns = self.members.expect(lambda kind: kind.orders.go)
            took["start"].append((last_ns - began_ns) / 1e6)
            took["hold"].append(self._order(control.pause(run), lambda kind: kind.orders.hold))
            took["resume"].append(self._order(control.resume(run), lambda kind: kind.orders.resume))
            took["cancel"].append(self._order(control.stop(run), lambda kind: kind.cancel))
            self._ask(control.wait(run))
        return took

    def _order(
        self, wish: Coroutine[Any, Any, None], orders: Callable[[Kind], tuple[int, ...]]
    ) -> float:
        time.sleep(RNG.uniform(0, PAUSE_S))
        wished_ns = time.time_ns()
        asked = asyncio.run_coroutine_threadsafe(wish, self.loop)
        took_ms = (self.members.expect(orders) - wished_ns) / 1e6
        asked.result(PATIENCE_S)
        return took_ms

    def _ask(self, wish: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(wish, self.loop).result(PATIENCE_S)


async def measure(
    journal: Journal, team: Fleet, times: int, members: Members, pipe: Connection
) -> dict[str, float]:
    """The median and the worst of each order."""
    # The arbiter uses the same endpoint; whoever opens it first knows its port before.
    link: RoutedLink = await open_link(
        mavlink_rovers.address(0), [mavlink_command.URL], SystemClock()
    )
    endpoint = shared_hub().endpoint(parse_url(mavlink_command.URL))
    assert isinstance(endpoint, UdpEndpoint)
    pipe.send([endpoint.port])
    async with Executive(team, journal, Plugins(), SystemClock()) as running:
        commander = Commander(running, members, asyncio.get_running_loop())
        took = await asyncio.to_thread(commander.rounds, times)
    pipe.send("stop")
    await link.close()
    await journal.close()
    figures = {}
    for name, took_ms in took.items():
        figures[f"{name}_p50_ms"] = sorted(took_ms)[len(took_ms) // 2]
        figures[f"{name}_max_ms"] = max(took_ms)
    return figures


def main() -> None:
    """The command."""
    kind, *numbers = sys.argv[1:]
    ros, count, times = map(int, numbers)
    rovers, pipe = mavlink_rovers.started(count, MAVLINK_RATE_HZ)
    with (
        tempfile.TemporaryDirectory(dir=Path.cwd()) as scratch,
        ros_stage.own_domain() as domain,
        ros_stage.Vehicles(domain, ros, ROS_RATE_HZ, endless=True) as vehicles,
    ):
        team = fleet(ros, count, domain)
        members = Members(
            {member: ROS if member.startswith(ROS.prefix) else MAVLINK for member in team.vehicles}
        )
        vehicles.listen()
        members.listen(ROS, vehicles.received)
        members.listen(MAVLINK, lambda: mavlink_command.received(pipe))
        journal = opened(kind, Path(scratch))
        print(json.dumps(asyncio.run(measure(journal, team, times, members, pipe))))
    rovers.join()


if __name__ == "__main__":
    main()
