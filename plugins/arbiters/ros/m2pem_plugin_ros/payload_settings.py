"""What a fleet says of a payload that has an m2pem node of its own (docs/ros.md, "Payloads").

It is one if its `driver` is m2pem and its namespace is not its vehicle's. As a payload inherits
what its vehicle's connection says, a detector is one only if it says so by its own `driver`,
`own_behaviors`, or the `behaviors` that the fleet allows it.
"""

from collections.abc import Mapping
from typing import Any

from m2pem.api import BehaviorType, Connection, ResourceId
from m2pem_plugin_ros.connection_reader import ConnectionReader
from m2pem_plugin_ros.declared_behaviors import read_declared_behaviors
from m2pem_plugin_ros.settings import (
    DETECTOR_KEYS,
    NODE_KEYS,
    DriverName,
    Settings,
    Via,
    inherited,
    own_settings,
)

_KEYS = (*DETECTOR_KEYS, *NODE_KEYS)


def read_payloads(
    connections: Mapping[ResourceId, Connection], vehicles: Mapping[ResourceId, Settings]
) -> dict[ResourceId, Settings]:
    """The settings of all payloads with a node. `vehicles`: those of the vehicles.

    Raises:
        PluginError: something is missing or wrong; the text names the resource and the key.
    """
    reached = {
        (settings.domain_id, settings.namespace): vehicle for vehicle, settings in vehicles.items()
    }
    read: dict[ResourceId, Settings] = {}
    for resource, connection in connections.items():
        if "/" not in resource or not _has_node(connection, connections):
            continue
        settings = read[resource] = _read(connection, inherited(connection, connections))
        other = reached.setdefault((settings.domain_id, settings.namespace), resource)
        if other != resource:
            problem = f"{settings.namespace or '/'} is that of {other}, too"
            raise ConnectionReader(resource, {}).error("namespace", problem)
    return read


def _has_node(connection: Connection, connections: Mapping[ResourceId, Connection]) -> bool:
    values, of_vehicle = connection.settings, inherited(connection, connections)
    own = _own(connection, of_vehicle)
    if values.get("driver") != DriverName.NODE:
        if "driver" in own and of_vehicle is not None:
            problem = f"{own['driver']!r} reaches no payload: one with a node of its own has m2pem"
            raise ConnectionReader(connection.resource, own).error("driver", problem)
        return False
    if "driver" in own or "own_behaviors" in own:
        return True
    detects = connection.detector or "topic" in values
    return "namespace" in own and (connection.behaviors is not None or not detects)


def _read(connection: Connection, of_vehicle: Mapping[str, Any] | None) -> Settings:
    resource, own = connection.resource, _own(connection, of_vehicle)
    reader = ConnectionReader(resource, own)
    reader.refuse_others(_KEYS)
    whole = ConnectionReader(resource, connection.settings)
    return Settings(
        whole.namespace(),
        whole.domain_id(),
        DriverName.NODE,
        whole.choice("via", Via, Via.TOPICS),
        own_behaviors=read_declared_behaviors(
            resource, own.get("own_behaviors"), BehaviorType.PAYLOAD
        ),
    )


def _own(connection: Connection, of_vehicle: Mapping[str, Any] | None) -> dict[str, Any]:
    # Of a vehicle that is another arbiter's nothing is known: what we read is the payload's own.
    return own_settings(connection, of_vehicle, _KEYS if of_vehicle is None else ())
