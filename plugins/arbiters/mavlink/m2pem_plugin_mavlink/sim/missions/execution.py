"""AUTO: flying the mission."""

from m2pem_plugin_mavlink.sim.maneuvers.standing import Stay


class Auto(Stay):
    """Flies the mission."""
