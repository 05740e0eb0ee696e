"""The program of `m2pem ros onboard`: a managed node, with its clock, parameters and log."""

import asyncio
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

from m2pem.api import ArbiterContext, Clock, Connection, EpochFence, SystemClock
from m2pem.api.foreground import interrupted
from m2pem.errors import PluginError
from m2pem_plugin_ros.drivers.driver import Driver, DriverEvents, DriverSetup, make_driver
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.onboard.managed_node import ManagedNode, TransitionRefusedError
from m2pem_plugin_ros.onboard.node import LOGGER, OnboardNode
from m2pem_plugin_ros.onboard.parameters import declare_parameters, merged
from m2pem_plugin_ros.onboard.target_bus import TargetBus
from m2pem_plugin_ros.runtime import RosRuntime
from m2pem_plugin_ros.runtime.node_log import logging_with
from m2pem_plugin_ros.runtime.ros_clock import RosClock
from m2pem_plugin_ros.sensors.localization import TopicLocalization
from m2pem_plugin_ros.settings import Settings, read_settings

NODE = "m2pem_onboard"


@dataclass(frozen=True, slots=True)
class OnboardSetup:
    """What the command line says. `connection` was read as `settings`."""

    connection: Connection
    settings: Settings
    origin: tuple[float, float, float]
    epochs: EpochFence
    autostart: bool = True


class OnboardProgram:
    """Implements `Managed`. `ended` is set when the node is shut down."""

    def __init__(
        self,
        ros: RosRuntime,
        setup: OnboardSetup,
        clock: Clock,
        ended: asyncio.Event,
    ) -> None:
        self._ros, self._setup, self._clock = ros, setup, clock
        if isinstance(clock, RosClock):
            clock.on_jump = self.clock_jumped
        self._ended = ended
        title = ros.node.get_fully_qualified_name()
        self._inactive = (
            f"the node is inactive: `ros2 lifecycle set {title} activate` makes it obey"
        )
        self._node: OnboardNode | None = None
        self._before: frozenset[Any] = frozenset()

    async def configure(self) -> None:
        setup, ros = self._setup, self._ros
        self._before = ros.entities()
        targets = TargetBus()
        context = ArbiterContext(self._clock, targets, LOGGER, setup.origin)
        name = setup.connection.resource
        localization = TopicLocalization(ros, name, setup.settings, context)

        def make(events: DriverEvents) -> Driver:
            return make_driver(
                DriverSetup(setup.connection, setup.settings, context, ros, localization, events)
            )

        self._node = OnboardNode(
            ros,
            name,
            setup.settings.namespace,
            make,
            clock=self._clock,
            bus=targets,
            epochs=setup.epochs,
            node=ros.node,
            inactive=self._inactive,
            standstill=self._standstill,
        )
        try:
            await self._node.open()
        except BaseException:
            await self._drop()
            raise

    async def activate(self) -> None:
        if self._node is not None:
            self._node.activate()

    async def deactivate(self) -> None:
        if self._node is not None:
            self._node.deactivate(self._inactive)

    async def cleanup(self) -> None:
        if self._node is not None and self._node.busy:
            raise TransitionRefusedError("the vehicle has not stopped yet")
        await self._drop()

    async def shutdown(self) -> None:
        self._ended.set()

    async def close(self) -> None:
        """Stop the vehicle, publish the end of its behavior, and end."""
        if self._node is not None:
            await self._node.close()
            self._node = None

    def clock_jumped(self, seconds: float) -> None:
        """End the behavior, as the vehicle may be elsewhere after a reset of the simulation."""
        LOGGER.warning("/clock jumped back %.3f s: the vehicle is stopped", seconds)
        if self._node is not None:
            self._node.stop(f"/clock jumped back {seconds:.3f} s")

    def _standstill(self) -> str:
        return self._clock.stands if isinstance(self._clock, RosClock) else ""

    async def _drop(self) -> None:
        node, self._node = self._node, None
        if node is not None:
            await node.drop()
        self._ros.destroy_since(self._before)


async def serve(setup: OnboardSetup, say: Callable[[str], None]) -> None:
    """Run the node until it is interrupted or shut down.

    Raises:
        RosError: ROS, an argument of it or a parameter cannot be used.
    """
    ended = interrupted()
    with ExitStack() as log:
        async with RosRuntime(
            NODE,
            namespace=setup.settings.namespace,
            domain_id=setup.settings.domain_id,
            kind=ManagedNode,
            console=True,
            automatically_declare_parameters_from_overrides=True,
        ) as ros:
            node: Any = ros.node
            log.enter_context(logging_with(node.get_logger(), alone=True))
            setup = _with_parameters(node, setup)
            clock = RosClock(ros) if ros.uses_sim_time else SystemClock()
            program = OnboardProgram(ros, setup, clock, ended)
            node.manage(program)
            where, driver = setup.settings.namespace or "/", setup.settings.driver
            say(f"{setup.connection.resource}: {where}, an m2pem node that drives by {driver}")
            if setup.autostart:
                await _autostart(ros)
            say("ready")
            await ended.wait()
            await program.close()


async def _autostart(ros: RosRuntime) -> None:
    """Configure and activate the node, in the thread of ROS as every transition.

    Raises:
        Exception: what a transition failed with.
    """
    node: Any = ros.node
    for trigger in (node.trigger_configure, node.trigger_activate):
        await ros.wait(ros.executor.create_task(trigger))
        if node.failure is not None:
            raise node.failure


def _with_parameters(node: Any, setup: OnboardSetup) -> OnboardSetup:
    """Return the setup with the parameters of the node, and in its namespace."""
    known = setup.connection
    overrides, domain, origin = declare_parameters(node, setup.settings, known.domain, setup.origin)
    given: Mapping[str, Any] = merged(
        known.settings, {**overrides, "namespace": node.get_namespace()}
    )
    connection = replace(known, domain=domain, settings=given)
    try:
        settings = read_settings({connection.resource: connection})[connection.resource]
    except PluginError as error:
        raise RosError(f"{node.title}: parameter: {error}") from error
    return replace(setup, connection=connection, settings=settings, origin=origin)
