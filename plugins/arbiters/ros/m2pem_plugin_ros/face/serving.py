"""All that the face publishes and serves, on one node."""

import asyncio
import logging
from dataclasses import replace
from typing import Any

from geographic_msgs.msg import GeoPoint, GeoPointStamped

from m2pem.api import (
    Follower,
    LinkState,
    LocalFrame,
    MissionControl,
    PayloadState,
    ResourceId,
    Telemetry,
    VehicleState,
    ellipsoidal_m,
    shown_geometries,
)
from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import M2pemError
from m2pem_plugin_ros.face.behavior_actions import BehaviorActions
from m2pem_plugin_ros.face.diagnostics import DiagnosticsPublisher
from m2pem_plugin_ros.face.fleet_state import FleetStatePublisher
from m2pem_plugin_ros.face.frames_publisher import FramesPublisher
from m2pem_plugin_ros.face.hand_over import HandOver
from m2pem_plugin_ros.face.markers import MarkersPublisher
from m2pem_plugin_ros.face.mission_action import MissionAction
from m2pem_plugin_ros.face.names import Names
from m2pem_plugin_ros.face.run_watcher import RunWatcher
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.face.vehicle_topics import VehicleTopics
from m2pem_plugin_ros.interfaces.messages import time_of
from m2pem_plugin_ros.runtime import RosRuntime, qos

WATCH_EVERY_S = 0.5
SLOW_EVERY = 2
"""Diagnostics and markers are published in every second round."""

WAITING = 10_000
"""States that may wait to be published; the oldest are dropped."""

STATES_AT_ONCE_S = 0.005
"""For so long states are taken before other tasks run."""

log = logging.getLogger("m2pem.face.ros")


class Serving:
    """`open` it, then `run` goes on until cancelled."""

    def __init__(
        self,
        ros: RosRuntime,
        control: MissionControl,
        follower: Follower,
        watcher: RunWatcher,
        names: Names,
        options: Options,
    ) -> None:
        fleet, node = control.fleet(), ros.node
        self._ros = ros
        self._node = node
        self._control = control
        self._follower = follower
        self._names = names
        self._options = options
        self._frame = LocalFrame(fleet.origin)
        self._states: dict[ResourceId, VehicleState | PayloadState] = {}
        self._topics: dict[ResourceId, VehicleTopics] = {}
        self._frames = FramesPublisher(ros, self._frame, names, options.rates["tf"], self._now_us())
        self._diagnostics = DiagnosticsPublisher(
            node, [*fleet.vehicles, *fleet.payloads], options.namespace
        )
        self._markers = MarkersPublisher(node, fleet, self._frame, names)
        self._fleet_state = FleetStatePublisher(node, control, follower, names, options)
        self._origin = node.create_publisher(GeoPointStamped, "~/origin", qos.STATUS)
        self._actions = BehaviorActions(ros, control, watcher, options)
        self._mission = MissionAction(ros, control, follower, watcher, options)
        self._hand_over = HandOver(ros, control, options)

    async def open(self) -> None:
        """Make what each vehicle has, of one after the other: the loop does other things in
        between."""
        fleet = self._control.fleet()
        self._origin.publish(self._origin_message())
        for vehicle in fleet.vehicles:
            topics = VehicleTopics(
                self._node, vehicle, self._names, self._frame, self._options.rates
            )
            self._topics[vehicle] = topics
            self._frames.add(vehicle, topics)
            await asyncio.sleep(0)
        self._frames.publish_static()
        for resource in (*fleet.vehicles, *fleet.payloads):
            self._actions.serve(resource, self._names.action(resource))
            await asyncio.sleep(0)

    async def run(self) -> None:
        """Publish until cancelled, or until the executive ends."""
        following = asyncio.create_task(self._follower.run())
        tasks = [asyncio.create_task(self._listen()), asyncio.create_task(self._watch())]
        try:
            await asyncio.wait([following, *tasks], return_when=asyncio.FIRST_COMPLETED)
            for task in (following, *tasks):
                if task.done():
                    task.result()
        except M2pemError as error:
            log.warning("the fleet is in ROS no more: %s", error)
        finally:
            await cancel_and_wait(following, *tasks)
            self._close()

    # --- inside ---------------------------------------------------------------------------------

    def _close(self) -> None:
        """Publish nothing more: what waits for its time must not come after the node."""
        self._frames.close()
        for topics in self._topics.values():
            for publisher in topics.publishers():
                publisher.close()

    async def _listen(self) -> None:
        """Receive telemetry of the fleet."""
        now_s = asyncio.get_running_loop().time
        until_s = now_s() + STATES_AT_ONCE_S
        async for state in self._control.telemetry(WAITING):
            self._receive(state)
            if now_s() > until_s:
                await asyncio.sleep(0)
                until_s = now_s() + STATES_AT_ONCE_S

    def _receive(self, state: Telemetry) -> None:
        if self._ros.uses_sim_time:
            state = replace(state, time_us=self._ros.stamp_us(state.time_us))
        if isinstance(state, VehicleState) and state.resource in self._topics:
            self._states[state.resource] = state
            if state.link is not LinkState.LOST:  # where it is now, is not known
                self._topics[state.resource].put(state)
                self._frames.put(state)
        elif isinstance(state, PayloadState):
            vehicle = ResourceId(state.resource.partition("/")[0])
            if vehicle in self._topics:
                self._states[state.resource] = state
                self._topics[vehicle].put_payload(state)
                self._markers.put(state)

    async def _watch(self) -> None:
        """Look who subscribes and who else publishes, and publish what is not telemetry."""
        rounds = 0
        while True:
            try:
                for topics in self._topics.values():
                    for publisher in topics.publishers():
                        publisher.watch()
                    await asyncio.sleep(0)
                self._frames.watch()
                await self._fleet_state.publish(self._states, self._now_us())
                if rounds % SLOW_EVERY == 0:
                    self._diagnostics.publish(self._states, self._now_us())
                    self._markers.look(shown_geometries(self._control))
            except M2pemError:
                raise
            except Exception:  # what cannot be published now may be published later
                log.exception("a state cannot be published")
            rounds += 1
            await asyncio.sleep(WATCH_EVERY_S)

    def _origin_message(self) -> Any:
        latitude, longitude, _ = origin = self._frame.origin
        message = GeoPointStamped(
            position=GeoPoint(
                latitude=latitude, longitude=longitude, altitude=ellipsoidal_m(*origin)
            )
        )
        message.header.stamp = time_of(self._now_us())
        message.header.frame_id = self._names.map_frame
        return message

    def _now_us(self) -> int:
        """The time of the node: that of /clock with `use_sim_time`."""
        return int(self._node.get_clock().now().nanoseconds // 1000)
