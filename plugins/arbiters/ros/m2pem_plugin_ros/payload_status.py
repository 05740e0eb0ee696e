"""Where a payload looks, as m2pem_interfaces/msg/PayloadStatus; needs no ROS itself."""

import math
from typing import Any

from m2pem.api import LinkState, PayloadState

LINKS = {LinkState.CONNECTED: 1, LinkState.DEGRADED: 2, LinkState.LOST: 3}
"""By the constants of the message."""


def write_payload_status(messages: Any, state: PayloadState, *, to_operators: bool = False) -> Any:
    """A message without a stamp. `messages`: m2pem_interfaces.msg. `to_operators`: with what the
    executive alone knows."""
    message = messages.PayloadStatus(
        payload=state.resource,
        pan_rad=_number(state.pan_rad),
        tilt_rad=_number(state.tilt_rad),
        zoom=_number(state.zoom),
        footprint=[
            messages.GeoPoint(
                latitude_deg=corner.latitude_deg,
                longitude_deg=corner.longitude_deg,
                altitude_m=corner.altitude_m,
            )
            for corner in state.footprint
        ],
    )
    if to_operators:
        message.behavior = state.behavior
        message.link = LINKS[state.link]
    return message


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
