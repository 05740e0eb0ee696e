"""Topics of payloads and teams: where payloads look, and how teams march."""

import logging
import re
import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Point32, PolygonStamped
from m2pem_interfaces import msg
from m2pem_plugin_ros import RosRuntime, messages, qos, to_local, write_payload_status

from m2pem.api import (
    GeoPosition,
    LinkState,
    MissionControl,
    PayloadState,
    ResourceId,
    TeamState,
    Telemetry,
)
from m2pem_plugin_mocu.publish_throttle import PublishThrottle

MARCH_FOR_S = 2.0
"""A team of which no state has come for so long marches no more."""

MAP = "map"

log = logging.getLogger("m2pem.ocu.mocu")


class FleetView:
    """`listen` and `run` go on until cancelled. `now_s`: of a clock that never goes back."""

    def __init__(
        self,
        ros: RosRuntime,
        control: MissionControl,
        now_us: Callable[[], int],
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._ros = ros
        self._control = control
        self._now_us = now_us
        self._now_s = now_s
        self._origin = control.fleet().origin
        self._payloads: dict[ResourceId, Any] = {}
        self._teams: dict[str, tuple[Any, float]] = {}
        self._outlines = Outlines(control.fleet().payloads)
        self._footprints: dict[ResourceId, Any] = {}
        self._shown: dict[ResourceId, tuple[GeoPosition, ...]] = {}
        create = ros.node.create_publisher
        self._payload_publisher = create(msg.PayloadStatuses, "payloads", qos.STATUS)
        self._team_publisher = create(msg.TeamStatuses, "teams", qos.STATUS)
        self._throttle = PublishThrottle(self._publish)

    async def listen(self) -> None:
        """Receive telemetry of the fleet."""
        async for state in self._control.telemetry():
            try:
                self._receive(state)
            except Exception:  # a state that no message can carry must not end this
                log.exception("%r cannot be published", state)

    async def run(self) -> None:
        """Publish until cancelled."""
        await self._throttle.run()

    # --- inside ---------------------------------------------------------------------------------

    def _receive(self, state: Telemetry) -> None:
        if isinstance(state, PayloadState):
            message = write_payload_status(msg, state, to_operators=True)
            message.stamp = messages.time_of(self._now_us())
            self._payloads[state.resource] = message
            self._outline(state)
        elif isinstance(state, TeamState):
            message = team_status(state)
            message.stamp = messages.time_of(self._now_us())
            self._teams[state.behavior] = (message, self._now_s())
        else:
            return
        self._throttle.mark_changed()

    async def _publish(self) -> None:
        oldest_s = self._now_s() - MARCH_FOR_S
        self._teams = {id_: team for id_, team in self._teams.items() if team[1] >= oldest_s}
        stamp = messages.time_of(self._now_us())
        payloads, teams = list(self._payloads.values()), [team[0] for team in self._teams.values()]
        self._payload_publisher.publish(msg.PayloadStatuses(stamp=stamp, payloads=payloads))
        self._team_publisher.publish(msg.TeamStatuses(stamp=stamp, teams=teams))

    def _outline(self, state: PayloadState) -> None:
        """Published when it changes; that of a payload which is lost, or sees nothing, is empty."""
        corners = () if state.link is LinkState.LOST else state.footprint
        if self._shown.get(state.resource, ()) == corners:
            return
        self._shown[state.resource] = corners
        if state.resource not in self._footprints:
            topic = self._outlines.topic(state.resource)
            self._footprints[state.resource] = self._ros.node.create_publisher(
                PolygonStamped, topic, qos.STATUS
            )
        message = PolygonStamped()
        message.header.frame_id = MAP
        message.header.stamp = messages.time_of(self._now_us())
        for corner in corners:
            east, north, up = to_local(corner, self._origin)
            message.polygon.points.append(Point32(x=east, y=north, z=up))
        self._footprints[state.resource].publish(message)


class Outlines:
    """Names of the topics of footprints. Names in fleets may have what names in ROS may not."""

    def __init__(self, payloads: Any) -> None:
        self._topics: dict[ResourceId, str] = {}
        for payload in payloads:
            self.topic(payload)

    def topic(self, payload: ResourceId) -> str:
        """`footprints/VEHICLE/NAME`, with "_" for what may not be; a second one of the same name
        ends in 2."""
        if payload not in self._topics:
            parts = [_token(part) for part in payload.split("/")]
            name, taken = "/".join(["footprints", *parts]), set(self._topics.values())
            number = 2
            topic = name
            while topic in taken:
                topic, number = f"{name}{number}", number + 1
            self._topics[payload] = topic
        return self._topics[payload]


def _token(name: str) -> str:
    token = re.sub(r"[^A-Za-z0-9]+", "_", name)
    return token if token[:1].isalpha() or token[:1] == "_" else f"n{token}"


def team_status(state: TeamState) -> Any:
    """A message without a stamp."""
    return msg.TeamStatus(
        behavior=state.behavior,
        name=state.name,
        spacing_m=float(state.spacing_m),
        members=[
            msg.TeamMemberStatus(
                vehicle=member.resource,
                along_m=_number(member.along_m),
                aside_m=_number(member.aside_m),
                gap_m=_number(member.gap_m),
            )
            for member in state.members
        ],
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
