"""A client of the face in plain rclpy, in a thread of the test's process, and a fleet."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, Self

import rclpy
from m2pem_interfaces.action import ExecuteBehavior, ExecuteMission
from m2pem_interfaces.msg import BehaviorCommand, KeyValue
from m2pem_plugin_ros.face.face import RosFace
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

from m2pem.api import ArbiterContext, Connection, FaceSettings, Fleet, FleetBus, ResourceId
from m2pem.executive.control import Control
from m2pem.simulation.arbiters import SimArbiter
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STATIC = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DEEP = QoSProfile(depth=1000)
WITHIN_S = 40.0
LOOK_EVERY_S = 0.01


async def until(true: Callable[[], Any], what: Callable[[], object] = lambda: "") -> Any:
    """Wait for something that DDS does."""
    try:
        async with asyncio.timeout(WITHIN_S):
            while not (found := true()):  # noqa: ASYNC110  # rclpy has no event for it
                await asyncio.sleep(LOOK_EVERY_S)
            return found
    except TimeoutError:
        raise AssertionError(f"not within {WITHIN_S:g} s: {what()}") from None


class Sent:
    """A goal that was sent."""

    def __init__(self, handle: Any, feedback: list[Any]) -> None:
        self.handle = handle
        self.feedback = feedback
        self._result = handle.get_result_async() if handle.accepted else None

    @property
    def accepted(self) -> bool:
        return bool(self.handle.accepted)

    async def end(self) -> tuple[int, Any]:
        """Wait for the end; returns the status of the goal and the result."""
        await until(self._result.done, lambda: self.feedback[-3:])
        answer = self._result.result()
        return answer.status, answer.result

    async def cancel(self) -> None:
        future = self.handle.cancel_goal_async()
        await until(future.done)


class Client:
    """A node of its own context. `async with` ends it."""

    def __init__(self, domain: int) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = rclpy.create_node("client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()
        self._heard: dict[str, list[Any]] = {}
        self._clients: dict[str, Any] = {}

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        rclpy.try_shutdown(context=self._context)
        await asyncio.to_thread(self._thread.join, 5)
        for client in self._clients.values():
            if isinstance(client, ActionClient):
                client.destroy()
        self.node.destroy_node()
        self._context.destroy()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return

    def hear(self, topic: str, kind: Any, qos: Any = 10) -> list[Any]:
        """Subscribe; returns the list of what comes."""
        heard = self._heard.setdefault(topic, [])
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    async def hears(
        self, topic: str, kind: Any, qos: Any = 10, wanted: Callable[[Any], bool] = lambda _: True
    ) -> Any:
        """Wait for a message like that."""
        heard = self._heard.get(topic)
        if heard is None:
            heard = self.hear(topic, kind, qos)
        return await until(
            lambda: next((each for each in list(heard) if wanted(each)), None),
            lambda: f"{topic} said {heard[-2:]}",
        )

    async def send(self, name: str, goal: Any) -> Sent:
        """Send a goal."""
        kind = ExecuteMission if isinstance(goal, ExecuteMission.Goal) else ExecuteBehavior
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = ActionClient(
                self.node,
                kind,
                name,
                goal_service_qos_profile=DEEP,
                result_service_qos_profile=DEEP,
            )
        await until(client.server_is_ready, lambda: f"there is no action {name}")
        feedback: list[Any] = []
        future = client.send_goal_async(goal, lambda each: feedback.append(each.feedback))
        await until(future.done)
        return Sent(future.result(), feedback)

    async def call(self, kind: Any, name: str, **fields: Any) -> Any:
        """Call a service."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(kind, name)
        await until(client.service_is_ready, lambda: f"there is no service {name}")
        future = client.call_async(kind.Request(**fields))
        await until(future.done)
        return future.result()


def behavior_goal(behavior: str, **parameters: Any) -> Any:
    """A goal with parameters as JSON."""
    pairs = [KeyValue(key=key, value=json.dumps(value)) for key, value in parameters.items()]
    command = BehaviorCommand(
        verb=BehaviorCommand.START, id="of the client", behavior=behavior, parameters=pairs
    )
    return ExecuteBehavior.Goal(command=command)


def point(north_deg: float, altitude_m: float | None = None) -> dict[str, Any]:
    """A place north of the origin, as GeoJSON."""
    latitude, longitude, _ = scenarios.ORIGIN
    place = [longitude, latitude + north_deg]
    if altitude_m is not None:
        place.append(altitude_m)
    return {"type": "Point", "coordinates": place}


def two_vehicles() -> Fleet:
    """Two simulated vehicles, one with a camera."""
    return scenarios.fleet("sim", {"ugv1": {}, "ugv2": {}, "ugv2/camera": {}})


class World:
    """An executive whose face serves, and a client."""

    def __init__(self, control: Control, bus: FleetBus, client: Client) -> None:
        self.control = control
        self.bus = bus
        self.client = client
        self.serving: asyncio.Task[None]


@asynccontextmanager
async def faced(
    domain: int,
    settings: Mapping[str, Any] | None = None,
    of: Fleet | None = None,
    **options: Any,
) -> AsyncIterator[World]:
    """A world in a ROS domain; `settings`: of the face."""
    lent: list[ArbiterContext] = []

    def simulated(
        connections: Mapping[ResourceId, Connection], context: ArbiterContext
    ) -> SimArbiter:
        lent.append(context)
        return SimArbiter(connections, context)

    arbiters = {"sim": simulated, **options.pop("arbiters", {})}
    fleet = of or two_vehicles()
    async with (
        run_executive(fleet, arbiters=arbiters, **{"speed": 10.0, **options}) as control,
        Client(domain) as client,
    ):
        face = RosFace(control, FaceSettings("ros", {"domain_id": domain, **(settings or {})}))
        world = World(control, lent[0].bus if lent else None, client)
        world.serving = asyncio.create_task(face.serve())
        try:
            yield world
        finally:
            world.serving.cancel()
            await asyncio.wait([world.serving])
            if not world.serving.cancelled():
                world.serving.result()
