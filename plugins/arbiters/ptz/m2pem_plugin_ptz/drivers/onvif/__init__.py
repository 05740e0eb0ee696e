"""The driver of ONVIF cameras."""

from m2pem_plugin_ptz.drivers.onvif.driver import OnvifDriver

__all__ = ["OnvifDriver"]
