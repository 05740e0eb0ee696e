"""The simulated cameras of a fleet file, on vehicles with `sitl: true`: of arbiter `ptz` and driver
`ros`, and payloads of arbiter `ros` with an m2pem node of their own."""

from collections.abc import Iterator, Mapping
from typing import Any

from m2pem_plugin_ros import read_payloads
from m2pem_plugin_ros import read_settings as read_vehicles

from m2pem.api import Connection, Fleet, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.ros.settings import read_settings as read_own_settings
from m2pem_plugin_ptz.settings import DriverName, read_settings
from m2pem_plugin_ptz.simulator.ros.camera import CameraSpec, NodeSpec

ARBITER, NODES = "ptz", "ros"


def read_specs(fleet: Fleet) -> Iterator[CameraSpec]:
    """Yield the specifications, as an executive with the same file expects them.

    Raises:
        PluginError: a connection is wrong; the text names the resource and the key.
    """
    for payload in fleet.payloads.values():
        connection = Connection.of(fleet, payload.id)
        if payload.arbiter != ARBITER or not connection.sitl:
            continue
        settings = read_settings({payload.id: connection})[payload.id]
        if settings.driver is DriverName.ROS:
            yield CameraSpec(payload.id, read_own_settings(connection), settings.reach)
    yield from _with_nodes(fleet)


def _with_nodes(fleet: Fleet) -> Iterator[CameraSpec]:
    vehicles = [each.id for each in fleet.vehicles.values() if each.arbiter == NODES]
    payloads = [each.id for each in fleet.payloads.values() if each.arbiter == NODES]
    connections = {each: Connection.of(fleet, each) for each in (*vehicles, *payloads)}
    for resource, settings in read_payloads(connections, read_vehicles(connections)).items():
        if not connections[resource].sitl:
            continue
        own = {
            **_simulated(resource, connections),
            "driver": DriverName.ROS.value,
            "namespace": settings.namespace or "/",
        }
        if settings.domain_id is not None:
            own["domain_id"] = settings.domain_id
        on_board = Connection(resource, connections[resource].domain, own, sitl=True)
        reach = read_settings({resource: on_board})[resource].reach
        node = NodeSpec(on_board, settings.namespace, fleet.origin)
        yield CameraSpec(resource, read_own_settings(on_board), reach, node)


def _simulated(
    resource: ResourceId, connections: Mapping[ResourceId, Connection]
) -> Mapping[str, Any]:
    """Return the settings `sim`: those of the arbiter `ptz` for the camera on board."""
    said = connections[resource].settings.get("sim", {})
    vehicle = connections.get(ResourceId(resource.partition("/")[0]))
    if vehicle is not None and said == vehicle.settings.get("sim"):
        return {}  # that is what its vehicle is like
    if not isinstance(said, Mapping):
        raise PluginError(
            f"{resource}: connection.sim: {said!r} is no map, such as {{reach: {{}}}}"
        )
    return said
