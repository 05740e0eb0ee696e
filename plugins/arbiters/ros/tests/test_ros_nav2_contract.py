"""The contract of arbiters, with simulated vehicles that have Nav2, over real DDS."""

import asyncio
import threading
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import replace
from typing import Any, ClassVar
from uuid import UUID

import pytest
from m2pem_plugin_ros.arbiter import RosArbiter
from m2pem_plugin_ros.runtime import RosRuntime, qos
from m2pem_plugin_ros.testing import Peer
from ros_nav2_bench import at
from ros_sim_watch import COMMAND, switch, until
from std_msgs.msg import UInt32

from m2pem.api import ArbiterContext, Connection, ResourceId
from m2pem.testing import ArbiterCase, ArbiterContract

A, B = ResourceId("ugv1"), ResourceId("ugv2")
SPEED = 5.0
JOURNAL = UUID("7a4f3c52-6d0e-5c6d-9a3b-2d8a6d7e9f10")
"""The same after a restart."""

WORDS = [
    *("sim", "ros", "--driver", "nav2", "--ground", "2"),
    *("--speed", f"{SPEED:g}", "--home", "38.1075,-77.3192,60"),
]


class Watcher:
    """Sees and does what the arbiter does not, in a thread and loop of its own."""

    def __init__(self, domain: int) -> None:
        self.motions: dict[ResourceId, int] = {}
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="watcher", daemon=True)
        self._thread.start()
        self._ros: RosRuntime = self.do(lambda: self._open(domain))

    def do(self, work: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
        return asyncio.run_coroutine_threadsafe(work(), self._loop).result(30.0)

    def silence(self, vehicle: ResourceId) -> None:
        assert self.do(lambda: switch(self._ros, f"{vehicle}: kill")).successful

    def close(self) -> None:
        self.do(self._ros.close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _open(self, domain: int) -> RosRuntime:
        ros = RosRuntime("watcher", domain_id=domain)
        for vehicle in (A, B):
            ros.subscribe(
                UInt32,
                f"/{vehicle}/motions",
                lambda message, vehicle=vehicle: self.motions.update({vehicle: message.data}),
                qos.STATUS,
            )
        await until(lambda: len(self.motions) == 2)
        return ros


@pytest.mark.long
class TestVehiclesWithNav2(ArbiterContract):
    unsupported: ClassVar = {"virtual clock": "vehicles are told over real DDS"}
    speed = SPEED

    @pytest.fixture
    def watcher(self, ros_domain: int) -> Iterator[Watcher]:
        with Peer(COMMAND, ros_domain, WORDS):
            watcher = Watcher(ros_domain)
            yield watcher
            watcher.close()

    @pytest.fixture
    def make_arbiter(
        self, ros_domain: int, watcher: Watcher
    ) -> Callable[[ArbiterContext], RosArbiter]:
        def make(context: ArbiterContext) -> RosArbiter:
            connections = {
                vehicle: Connection(
                    vehicle,
                    "ground",
                    {"namespace": f"/{vehicle}", "driver": "nav2", "domain_id": ros_domain},
                    lost_after_s=8.0,
                    sitl=True,
                )
                for vehicle in (A, B)
            }
            return RosArbiter(connections, replace(context, journal=JOURNAL))

        return make

    @pytest.fixture
    def cut_link(self, watcher: Watcher) -> Callable[[object, ResourceId], None]:
        return lambda _, vehicle: watcher.silence(vehicle)

    @pytest.fixture
    def effects(self, watcher: Watcher) -> Callable[[object, ResourceId], int]:
        return lambda _, vehicle: watcher.motions[vehicle]

    @pytest.fixture
    def case(self) -> ArbiterCase:
        return ArbiterCase(
            vehicle=A,
            other=B,
            long=("goto", {"target": at(2.0, 300.0), "speed": 2.0}),
            short=("goto", {"target": at(3.0, 10.0), "speed": 2.0}),
            bad=("speed", -1.0),
            short_s=20.0,
        )
