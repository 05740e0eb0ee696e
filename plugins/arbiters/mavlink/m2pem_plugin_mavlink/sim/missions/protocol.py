"""The mission protocol."""

from m2pem_plugin_mavlink.sim.part import Part


class MissionServer(Part):
    """Takes and gives plans."""
