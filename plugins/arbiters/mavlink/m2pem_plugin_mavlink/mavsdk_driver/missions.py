"""Missions, carried by MAVSDK."""

from typing import TYPE_CHECKING, Any

from m2pem_plugin_mavlink.protocol.transaction import Transaction

if TYPE_CHECKING:
    from m2pem_plugin_mavlink.mavsdk_driver.link import MavsdkLink


async def carried(link: "MavsdkLink", transaction: Transaction[Any]) -> bool:
    """Carry an exchange of a mission; False: it is none."""
    return False
