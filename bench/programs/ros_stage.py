"""A fleet of ROS vehicles for the programs, and the process that they are in; all on 127.0.0.1."""

import contextlib
import os
import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from m2pem_plugin_ros import loopback
from m2pem_plugin_ros.testing import Peer, reserved_domain

from bench.programs.commanding import PATIENCE_S, PAUSED, Got
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Point

VEHICLES = Path(__file__).with_name("ros_vehicles.py")
ORIGIN = (47.397742, 8.545594, 0.0)
APART_DEG = 0.001
FAR_DEG = 0.01


def fleet(count: int, domain: int) -> Fleet:
    """Vehicles v0, v1 and so on, each with a point to go to."""
    latitude, longitude, _ = ORIGIN
    points: dict[str, Any] = {
        f"p{number}": Point((latitude, longitude + number * APART_DEG, None))
        for number in range(count)
    }
    points[f"p{PAUSED}"] = Point((latitude + FAR_DEG, longitude, None))
    vehicles = [
        Vehicle(
            ResourceId(f"v{number}"),
            Domain.GROUND,
            "ros",
            {"namespace": f"/v{number}", "domain_id": domain},
            sitl=True,
        )
        for number in range(count)
    ]
    every = {each.id: each for each in vehicles}
    return Fleet("bench", "bench.yaml", every, geometries=points, origin=ORIGIN)


@contextmanager
def own_domain() -> Iterator[int]:
    """A ROS domain of nobody else on this machine, for the block; nothing leaves 127.0.0.1."""
    loopback.keep_on_loopback()
    os.environ.pop("ROS_DOMAIN_ID", None)
    with reserved_domain() as domain:
        yield domain


class Vehicles(Peer):
    """A process of so many vehicles, which tell of themselves so often a second.

    `endless`: none of them gets to an end, not v0 alone, and cancels are told of, too.
    `began_ns`: when it began to make them (ns since the epoch).
    """

    def __init__(
        self, domain: int, count: int, rate_hz: float, first: int = 0, *, endless: bool = False
    ) -> None:
        arguments = [str(count), str(rate_hz), str(first), *["endless"] * endless]
        super().__init__(VEHICLES, domain, arguments, forked=False)  # what it imports is little
        assert self.process.stdout is not None
        self.began_ns = int(self.process.stdout.readline())
        self._got: queue.SimpleQueue[Got] = queue.SimpleQueue()

    def listen(self) -> None:
        """From now on, take note of what they are commanded."""
        threading.Thread(target=self._read, daemon=True).start()

    def received(self) -> Got:
        """What one of them was commanded next.

        Raises:
            queue.Empty: nothing came for long.
        """
        return self._got.get(timeout=PATIENCE_S)

    def _read(self) -> None:
        assert self.process.stdout is not None
        with contextlib.suppress(ValueError):  # closed at the end
            for line in self.process.stdout:
                number, verb, came_ns = map(int, line.split())
                self._got.put((number, verb, came_ns))
