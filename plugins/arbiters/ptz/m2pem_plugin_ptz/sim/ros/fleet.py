"""The cameras of a fleet file that are to be simulated: of arbiter `ptz` and driver `ros`, on
vehicles marked `sitl: true`."""

from collections.abc import Iterator

from m2pem.api import Connection, Fleet
from m2pem_plugin_ptz.drivers.ros.settings import read_settings as read_own_settings
from m2pem_plugin_ptz.settings import DriverName, read_settings
from m2pem_plugin_ptz.sim.ros.camera import CameraSpec

ARBITER = "ptz"


def read_specs(fleet: Fleet) -> Iterator[CameraSpec]:
    """What to simulate, so that an executive with the same file finds it.

    Raises:
        PluginError: a connection is wrong; the text names the resource and the key.
    """
    for payload in fleet.payloads.values():
        vehicle = fleet.vehicles[payload.vehicle]
        if payload.arbiter != ARBITER or not vehicle.sitl:
            continue
        connection = Connection(payload.id, vehicle.domain.value, payload.settings, sitl=True)
        settings = read_settings({payload.id: connection})[payload.id]
        if settings.driver is DriverName.ROS:
            yield CameraSpec(payload.id, read_own_settings(connection), settings.reach)
