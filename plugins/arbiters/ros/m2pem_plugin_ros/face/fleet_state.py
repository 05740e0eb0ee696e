"""The latched state of the fleet: who has each vehicle, what it does, and the runs."""

import logging
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from m2pem_interfaces import msg
from rclpy.node import Node

from m2pem.api import (
    Fleet,
    Follower,
    MissionControl,
    PayloadState,
    ResourceId,
    VehicleState,
)
from m2pem_plugin_ros.face.names import Names
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.interfaces.messages import run_status, time_of
from m2pem_plugin_ros.interfaces.texts import sendable
from m2pem_plugin_ros.interfaces.vehicle_status import LINKS, READINESS
from m2pem_plugin_ros.runtime import qos

log = logging.getLogger("m2pem.face.ros")


class FleetStatePublisher:
    """`publish` is called twice a second, and publishes if something has changed."""

    def __init__(
        self,
        node: Node,
        control: MissionControl,
        follower: Follower,
        names: Names,
        options: Options,
    ) -> None:
        self._control = control
        self._follower = follower
        fleet, catalogue = control.fleet(), control.catalogue()
        self._fleet_name = sendable(fleet.name)
        self._resources = _in_order(fleet)
        self._fixed = {
            each: {
                "resource": sendable(each),
                "domain": _domain(fleet, each),
                "arbiter": sendable(_arbiter(fleet, each)),
                "action": names.action(each),
                "behaviors": [sendable(spec.name) for spec in catalogue.get(each, ())],
                "takes_commands": options.takes_commands(each),
            }
            for each in self._resources
        }
        self._publisher = node.create_publisher(msg.FleetState, "~/fleet_state", qos.STATUS)
        self._last: Any = None

    async def publish(
        self, states: Mapping[ResourceId, VehicleState | PayloadState], now_us: int
    ) -> None:
        """Publish the state, if it is not that which was published last."""
        holders = await self._control.holders()
        labels = await self._control.holder_labels()
        summaries = [view.summary for view in self._follower.views.values()]
        resources = []
        for resource in self._resources:
            holder = holders.get(resource, "")
            resources.append(_Seen.of(states.get(resource), holder, labels.get(holder, "")))
        content = (resources, summaries)
        if content == self._last:
            return
        self._last = content
        message = msg.FleetState(
            stamp=time_of(now_us),
            fleet=self._fleet_name,
            resources=[
                msg.FleetResource(**self._fixed[resource], **asdict(seen))
                for resource, seen in zip(self._resources, resources, strict=True)
            ],
            runs=[run_status(each) for each in summaries],
        )
        self._publisher.publish(message)


@dataclass(frozen=True, slots=True)
class _Seen:
    """The fields of a FleetResource that change."""

    holder: str
    holder_label: str
    link: int = msg.FleetResource.NOT_SAID
    behavior: str = ""
    readiness: int = msg.FleetResource.NOT_KNOWN
    not_ready_reasons: tuple[str, ...] = ()
    mode: str = ""
    battery: float = math.nan

    @classmethod
    def of(cls, state: VehicleState | PayloadState | None, holder: str, label: str) -> "_Seen":
        holder, label = sendable(holder), sendable(label)
        if state is None:
            return cls(holder, label)
        link, behavior = LINKS[state.link], sendable(state.behavior)
        if not isinstance(state, VehicleState):
            return cls(holder, label, link, behavior)
        charge = state.battery_fraction
        return cls(
            holder,
            label,
            link,
            behavior,
            READINESS[state.ready],
            tuple(sendable(each) for each in state.not_ready_reasons),
            sendable(state.mode),
            math.nan if charge is None else round(charge, 2),
        )


def _in_order(fleet: Fleet) -> list[ResourceId]:
    return [
        resource
        for vehicle in fleet.vehicles.values()
        for resource in (vehicle.id, *vehicle.payloads)
    ]


def _domain(fleet: Fleet, resource: ResourceId) -> str:
    vehicle = fleet.vehicles.get(resource)
    return vehicle.domain.value if vehicle is not None else ""


def _arbiter(fleet: Fleet, resource: ResourceId) -> str:
    vehicle = fleet.vehicles.get(resource)
    return vehicle.arbiter if vehicle is not None else fleet.payloads[resource].arbiter
