"""Automated guided vehicles that speak VDA 5050 over MQTT (docs/vda5050.md)."""

from m2pem_plugin_vda5050.hooks import (
    m2pem_check_host,
    m2pem_register_arbiters,
    m2pem_register_commands,
)

__all__ = ["m2pem_check_host", "m2pem_register_arbiters", "m2pem_register_commands"]
