"""Where the vehicle is in its mission."""

from m2pem_plugin_mavlink.sim.part import Part


class MissionProgress(Part):
    """The current item."""
