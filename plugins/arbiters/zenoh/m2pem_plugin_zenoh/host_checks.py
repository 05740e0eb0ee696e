"""The checks of `m2pem doctor` for the hosts of a fleet: files of keys and passwords."""

from collections.abc import Sequence

from m2pem.api import Fleet, HealthCheck, HealthStatus
from m2pem.errors import PluginError
from m2pem_plugin_zenoh.link import Endpoints, settings


def check_hosts(fleet: Fleet) -> Sequence[HealthCheck]:
    """Check that the executive of this computer can use the files of each host. Nothing is sent."""
    checks = []
    for host in fleet.hosts.values():
        name = f"host {host.name}"
        try:
            settings(host, Endpoints(host.connect, host.listen))
        except PluginError as error:
            remedy = "each computer needs its own files under the names of the fleet file"
            checks.append(HealthCheck(name, HealthStatus.ERROR, str(error), remedy))
        else:
            secured = "with TLS" if host.ca else "on this computer alone"
            checks.append(HealthCheck(name, HealthStatus.OK, f"can be connected {secured}"))
    return checks
