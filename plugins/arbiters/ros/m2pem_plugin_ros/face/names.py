"""Names of topics, actions and frames, and which of them a ROS vehicle has itself.

`/<namespace>/<vehicle>/odom`, frame `<namespace>/<vehicle>/base_link`; a payload is below its
vehicle. Names of a fleet may have characters that names of ROS may not: these become "_".
"""

import re
from collections.abc import Collection, Mapping

from m2pem.api import Connection, Fleet, ResourceId
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.settings import (
    DriverName,
    OdomFrame,
    Settings,
    domain_of,
    in_namespace,
    read_payloads,
    read_settings,
)

EARTH = "earth"
MAP = "map"
ODOM = "odom"
BASE = "base_link"

ACTION = "execute_behavior"
OWN_ACTION = f"m2pem/{ACTION}"
"""Where a vehicle's own node serves `ACTION`."""

ARBITER = "ros"


class Names:
    """The names of a fleet's vehicles and payloads in ROS."""

    def __init__(self, fleet: Fleet, options: Options) -> None:
        self._options = options
        self._paths = _paths([*fleet.vehicles, *fleet.payloads])
        here = _settings_here(fleet, options)
        self._own = frozenset(name for each in here.values() for name in _names_of(each))
        self._odom_frames = {
            resource: settings.odom_frame
            for resource, settings in here.items()
            if resource in fleet.vehicles
        }

    def topic(self, resource: str, leaf: str) -> str:
        """Return the full name of a topic or action of a vehicle or payload."""
        return f"{self._options.namespace}/{self._paths[resource]}/{leaf}"

    def action(self, resource: str) -> str:
        """Return the full name of the action of a vehicle or payload."""
        name = self.topic(resource, ACTION)
        return self.topic(resource, OWN_ACTION) if name in self._own else name

    def left_to_vehicle(self, name: str) -> bool:
        """Whether a ROS vehicle has a topic itself, by its connection in the fleet file."""
        return name in self._own

    def odom_frame(self, vehicle: str) -> str:
        """Return the frame of a vehicle's odometry here. Where `odom` of a ROS vehicle is, only the
        vehicle knows: its odometry is in `map`, as m2pem knows its position."""
        if vehicle in self._odom_frames:
            return self.map_frame
        return self.frame(vehicle, ODOM)

    def tells_frames(self, vehicle: str) -> bool:
        """Whether a ROS vehicle tells on tf itself where it is in `map`."""
        return self._odom_frames.get(ResourceId(vehicle)) is OdomFrame.TF

    def frame(self, resource: str, leaf: str) -> str:
        """Return a frame of a vehicle."""
        return self.topic(resource, leaf).removeprefix("/")

    @property
    def map_frame(self) -> str:
        """The local frame of the fleet: ENU at its origin."""
        return f"{self._options.namespace}/{MAP}".removeprefix("/")

    def joint(self, payload: str, axis: str) -> str:
        """Return the name of a joint of a payload, unique in the fleet."""
        return f"{self._paths[payload].replace('/', '_')}_{axis}"


def _paths(resources: Collection[ResourceId]) -> Mapping[str, str]:
    """Paths without characters that ROS does not allow; a second one of the same name ends in 2."""
    paths: dict[str, str] = {}
    taken: set[str] = set()
    for resource in resources:
        vehicle, slash, payload = resource.partition("/")
        path = f"{paths[vehicle]}/{_token(payload)}" if slash else _token(vehicle)
        unique, number = path, 2
        while unique in taken:
            unique, number = f"{path}_{number}", number + 1
        taken.add(unique)
        paths[resource] = unique
    return paths


def _token(name: str) -> str:
    token = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return token if token[:1].isalpha() else f"n{token}"


def _settings_here(fleet: Fleet, options: Options) -> Mapping[ResourceId, Settings]:
    """The settings of the fleet's ROS vehicles and payloads in the domain of the face."""
    vehicles = [each.id for each in fleet.vehicles.values() if each.arbiter == ARBITER]
    payloads = [each.id for each in fleet.payloads.values() if each.arbiter == ARBITER]
    connections = {each: Connection.of(fleet, each) for each in (*vehicles, *payloads)}
    read = read_settings(connections)
    return {
        resource: settings
        for resource, settings in {**read, **read_payloads(connections, read)}.items()
        if domain_of(settings.domain_id) == domain_of(options.domain_id)
    }


def _names_of(settings: Settings) -> set[str]:
    topics = settings.topics
    names = {settings.topic(name) for name in (topics.odom, topics.fix, topics.battery)}
    if settings.driver is DriverName.NODE:
        names.add(in_namespace(settings.namespace, ACTION))
    return names
