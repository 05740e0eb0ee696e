"""What tests of simulated vehicles watch and do over DDS, from another process."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Twist
from m2pem_plugin_ros.runtime import RosRuntime, qos
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters

COMMAND = Path(__file__).with_name("ros_sim_command.py")
AMPLE_S = 40.0
LOOK_S = 0.01


async def until(condition: Callable[[], Any]) -> Any:
    """Wait until something is so, or fail."""
    async with asyncio.timeout(AMPLE_S):
        while not (value := condition()):  # noqa: ASYNC110  # what is heard has no event
            await asyncio.sleep(LOOK_S)
        return value


class Heard:
    """All messages of a topic, the newest last."""

    def __init__(
        self, ros: RosRuntime, kind: Any, topic: str, quality: Any = qos.TELEMETRY
    ) -> None:
        self.messages: list[Any] = []
        ros.subscribe(kind, topic, self.messages.append, quality)

    def __len__(self) -> int:
        return len(self.messages)

    @property
    def last(self) -> Any:
        return self.messages[-1] if self.messages else None

    async def next(self, that: Callable[[Any], object] = lambda _: True) -> Any:
        """The next one from now on of which that holds."""
        seen = len(self.messages)

        def found() -> Any:
            return next((each for each in self.messages[seen:] if that(each)), None)

        return await until(found)

    async def silence(self, seconds: float) -> None:
        """Wait until nothing has come for so long."""
        async with asyncio.timeout(AMPLE_S):
            seen = -1
            while seen != len(self.messages):
                seen = len(self.messages)
                await asyncio.sleep(seconds)


class Joystick:
    """Publishes cmd_vel at 20 Hz while its block lasts."""

    def __init__(self, ros: RosRuntime, topic: str, forward: float, yaw: float = 0.0) -> None:
        self._publisher = ros.node.create_publisher(Twist, topic, qos.COMMANDS)
        self._message = Twist()
        self._message.linear.x, self._message.angular.z = forward, yaw
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> None:
        self._task = asyncio.create_task(self._run())

    async def __aexit__(self, *_: object) -> None:
        assert self._task is not None
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        while True:
            self._publisher.publish(self._message)
            await asyncio.sleep(0.05)


async def insist(ros: RosRuntime, fault: str, heard: Heard) -> Any:
    """Have a fault happen until what it does is heard, and return that: what is said just when DDS
    has two find each other may be lost."""
    async with asyncio.timeout(AMPLE_S):
        while not heard.last:
            assert (await switch(ros, fault)).successful
            await asyncio.sleep(0.2)
    return heard.last


async def switch(ros: RosRuntime, fault: str) -> Any:
    """Have a fault happen now; what the simulation says to that."""
    client = ros.client(SetParameters, "/m2pem_sim/set_parameters")
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=fault)
    request = SetParameters.Request(parameters=[Parameter(name="fault", value=value)])
    answer = await ros.call(client, request, AMPLE_S)
    return answer.results[0]
