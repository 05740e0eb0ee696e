"""Sees what simulated heads do, by their own joints, and makes them fall silent."""

import asyncio
import math
import threading
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from m2pem_plugin_ros.runtime import RosRuntime, qos
from ptz_ros_world import until
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from m2pem.api import ResourceId

STOOD = 10
"""A head that has said so often that it stands begins a new motion when it moves. Time does not
tell: who looks, or the head itself, may be late."""


class Watcher:
    """Sees and does what the arbiter does not, in a thread and loop of its own. `namespaces`: of
    the joints of each camera."""

    def __init__(self, domain: int, namespaces: Mapping[ResourceId, str]) -> None:
        self.motions = dict.fromkeys(namespaces, 0)
        self._namespaces = namespaces
        self._at: dict[ResourceId, tuple[float, ...]] = {}
        self._stood = dict.fromkeys(namespaces, STOOD)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="watcher", daemon=True)
        self._thread.start()
        self._ros: RosRuntime = self.do(lambda: self._open(domain))

    def do(self, work: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
        return asyncio.run_coroutine_threadsafe(work(), self._loop).result(30.0)

    def silence(self, camera: ResourceId) -> None:
        async def switch() -> None:
            topic = f"{self._namespaces[camera]}/sim_fault"
            publisher = self._ros.node.create_publisher(String, topic, qos.COMMANDS)
            await until(publisher.get_subscription_count)
            publisher.publish(String(data="silent"))

        self.do(switch)

    def close(self) -> None:
        self.do(self._ros.close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _open(self, domain: int) -> RosRuntime:
        ros = RosRuntime("watcher", domain_id=domain)
        for camera, namespace in self._namespaces.items():
            topic = f"{namespace}/joint_states"
            ros.subscribe(
                JointState,
                topic,
                lambda message, camera=camera: self._on_message(camera, tuple(message.position)),
                qos.TELEMETRY,
            )
        await until(lambda: len(self._at) == len(self._namespaces))
        return ros

    def _on_message(self, camera: ResourceId, at: tuple[float, ...]) -> None:
        before = self._at.get(camera, at)
        self._at[camera] = at
        if math.dist(before, at) > 1e-6:
            self.motions[camera] += self._stood[camera] >= STOOD
            self._stood[camera] = 0
        else:
            self._stood[camera] += 1
