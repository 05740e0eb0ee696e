"""Names of topics, actions and frames, and which of them a ROS vehicle has itself.

`/<namespace>/<vehicle>/odom`, frame `<namespace>/<vehicle>/base_link`; a payload is below its
vehicle. Names of a fleet may have characters that names of ROS may not: these become "_".
"""

import os
import re
from collections.abc import Collection, Mapping

from m2pem.api import Connection, Fleet, ResourceId
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.settings import (
    DriverName,
    Settings,
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
        self._own = _own_names(fleet, options)

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


def _own_names(fleet: Fleet, options: Options) -> frozenset[str]:
    """The topics and actions that the fleet's ROS vehicles have in the domain of the face."""
    vehicles = [each for each in fleet.vehicles.values() if each.arbiter == ARBITER]
    connections = {
        each.id: Connection(each.id, each.domain, each.settings, each.behaviors)
        for each in vehicles
    }
    mounted = [each for each in fleet.payloads.values() if each.arbiter == ARBITER]
    connections |= {
        each.id: Connection(
            each.id,
            fleet.vehicles[each.vehicle].domain,
            each.settings,
            each.behaviors,
            each.detector,
        )
        for each in mounted
    }
    read = read_settings(connections)
    names: set[str] = set()
    for settings in (*read.values(), *read_payloads(connections, read).values()):
        if _domain(settings.domain_id) == _domain(options.domain_id):
            names |= _names_of(settings)
    return frozenset(names)


def _names_of(settings: Settings) -> set[str]:
    topics = settings.topics
    names = {settings.topic(name) for name in (topics.odom, topics.fix, topics.battery)}
    if settings.driver is DriverName.NODE:
        names.add(in_namespace(settings.namespace, ACTION))
    return names


def _domain(domain_id: int | None) -> int:
    if domain_id is not None:
        return domain_id
    said = os.environ.get("ROS_DOMAIN_ID", "")
    return int(said) if said.isdigit() else 0
