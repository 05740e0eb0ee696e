"""Arbiters on other hosts, over Zenoh (docs/arbiter-host.md)."""

from m2pem_plugin_zenoh.hooks import m2pem_check_host, m2pem_register_arbiters

__all__ = ["m2pem_check_host", "m2pem_register_arbiters"]
