"""The checks of `m2pem doctor`: whether the MQTT brokers of the fleet can be connected."""

import socket
from collections.abc import Sequence

from m2pem.api import Connection, Fleet, HealthCheck, HealthStatus
from m2pem.errors import PluginError
from m2pem_plugin_vda5050.broker import tls_context
from m2pem_plugin_vda5050.settings import ARBITER, BrokerSettings, read_password, read_settings

CONNECTED_WITHIN_S = 1.0


def check_brokers(fleet: Fleet) -> Sequence[HealthCheck]:
    """Check each broker of the fleet once. Nothing is sent to it."""
    connections = {
        vehicle.id: Connection.of(fleet, vehicle.id)
        for vehicle in fleet.vehicles.values()
        if vehicle.arbiter == ARBITER
    }
    try:
        brokers = {each.broker for each in read_settings(connections).values()}
    except PluginError:
        return ()  # the check of the fleet itself says it
    return [_check(broker) for broker in sorted(brokers, key=lambda each: each.url)]


def _check(broker: BrokerSettings) -> HealthCheck:
    name = f"broker {broker.url}"
    try:
        read_password(broker)
        tls_context(broker)
        with socket.create_connection((broker.host, broker.port), CONNECTED_WITHIN_S):
            return HealthCheck(name, HealthStatus.OK, "it can be connected")
    except PluginError as error:
        return HealthCheck(name, HealthStatus.ERROR, str(error), "see docs/vda5050.md")
    except OSError as error:
        remedy = "start the broker, such as mosquitto, or correct `url`"
        return HealthCheck(name, HealthStatus.ERROR, f"it cannot be connected: {error}", remedy)
