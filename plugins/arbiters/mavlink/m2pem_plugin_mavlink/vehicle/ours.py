"""What the vehicle was asked for here, so that what somebody else asks of it can be told apart."""

from dataclasses import dataclass

from m2pem_plugin_mavlink.microservices.mission_items import MissionItem


@dataclass(slots=True)
class Ours:
    """Kept by the driver. None, and False: not since this arbiter was started.

    `custom_mode`: the mode asked for last; `changing`: how many commands that change it are on
    their way. `mission`: what was uploaded last, as the driver's `upload` takes it; `exchanging`:
    how many exchanges of missions go on. `disarming`: it was asked to disarm.
    """

    custom_mode: int | None = None
    changing: int = 0
    mission: tuple[MissionItem, ...] | None = None
    exchanging: int = 0
    disarming: bool = False
