"""Topic `shared_spaces`: who has places in the shared spaces of the fleet, and who waits."""

import math
from collections.abc import Callable
from typing import Any

from m2pem_interfaces import msg
from m2pem_plugin_ros import RosRuntime, messages, qos, sendable

from m2pem.api import MissionControl
from m2pem.api.allocation import SharedSpaceState, WaitingTask
from m2pem.fleet.fleet import Fleet
from m2pem.geo.geojson import as_geojson
from m2pem.mission.geometry import Area, Route
from m2pem.units import US_PER_S
from m2pem_plugin_mocu.publish_throttle import PublishThrottle


class SharedSpaceTopic:
    """Publishes all shared spaces after changes, and once a second, if the fleet has any."""

    def __init__(self, ros: RosRuntime, control: MissionControl, now_us: Callable[[], int]) -> None:
        self._control = control
        self._now_us = now_us
        self._fleet = control.fleet()
        self._publisher = ros.node.create_publisher(msg.SharedSpaces, "shared_spaces", qos.STATUS)
        self._throttle = PublishThrottle(self._publish)

    def mark_changed(self) -> None:
        """Have it published soon."""
        self._throttle.mark_changed()

    async def run(self) -> None:
        """Publish until cancelled."""
        if self._fleet.shared_space:
            await self._throttle.run()

    async def _publish(self) -> None:
        now_us = self._now_us()
        spaces = [
            shared_space(self._fleet, each, now_us) for each in await self._control.shared_space()
        ]
        self._publisher.publish(msg.SharedSpaces(stamp=messages.time_of(now_us), spaces=spaces))


def shared_space(fleet: Fleet, state: SharedSpaceState, now_us: int) -> Any:
    """Return a shared space as a message."""
    space = fleet.shared_space[state.name]
    geometry = fleet.geometries[state.name]
    assert isinstance(geometry, Area | Route)
    shape = as_geojson(geometry)["geometry"]
    if shape["type"] == "Polygon":  # the first point of a ring is repeated at its end
        lines = [ring[:-1] for ring in shape["coordinates"]]
    else:
        lines = [shape["coordinates"]]
    outline, *holes = [[_point(*each[:2]) for each in line] for line in lines]
    return msg.SharedSpace(
        name=sendable(state.name),
        capacity=state.capacity,
        domains=[each.value for each in space.domains],
        points=outline,
        holes=[msg.Ring(points=each) for each in holes],
        width_m=math.nan if space.width_m is None else float(space.width_m),
        holders=[
            msg.SpaceHolder(vehicle=each.vehicle, behavior=each.behavior, lost=each.lost)
            for each in state.holders
        ],
        waiting=[waiting_task(each, now_us) for each in state.waiting],
    )


def waiting_task(task: WaitingTask, now_us: int) -> Any:
    """Return a task that waits as a message."""
    return msg.WaitingTask(
        run=task.run,
        allocation=task.allocation,
        element=sendable(task.element),
        task=sendable(task.task),
        behavior=sendable(task.behavior),
        since=messages.time_of(now_us - round(task.waited_s * US_PER_S)),
        left_s=math.nan if task.left_s is None else task.left_s,
        priority=task.priority,
        reason=sendable(task.reason),
    )


def _point(longitude: float, latitude: float) -> Any:
    return msg.GeoPoint(
        latitude_deg=float(latitude), longitude_deg=float(longitude), altitude_m=math.nan
    )
