"""What the arbiter has of ROS: for each vehicle, and each payload that is commanded itself, what is
heard of it beside its driver."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from m2pem.api import ArbiterContext, Connection, PayloadState, ResourceId, VehicleState
from m2pem_plugin_ros.localization import Localization
from m2pem_plugin_ros.settings import DetectorSettings, Settings

if TYPE_CHECKING:
    from m2pem_plugin_ros.payload_sight import PayloadSight
    from m2pem_plugin_ros.runtime import RosRuntime


class Senses(Protocol):
    """What a vehicle's sensors say."""

    @property
    def localization(self) -> Localization:
        """Where it is."""
        ...

    @property
    def battery_fraction(self) -> float | None:
        """Of a full one; None: not said."""
        ...

    @property
    def errors(self) -> tuple[str, ...]:
        """What is wrong with its parts, for people."""
        ...

    @property
    def refusal(self) -> str:
        """Why nothing may be commanded, for people: it is not one vehicle, or where it is cannot be
        known; "" if it may."""
        ...

    @property
    def absence(self) -> str:
        """Where what says that it is there is awaited, and who is there, for people."""
        ...

    @property
    def troubles(self) -> tuple[str, ...]:
        """What is missing to know well how it is, for people."""
        ...

    @property
    def changes(self) -> int:
        """Another number whenever something was heard."""
        ...


@dataclass(frozen=True, slots=True)
class Instruments:
    """Of one vehicle, or payload. `show_target` tells it where a vehicle is that it goes to,
    follows or looks at, and a payload where it is carried. `sight`: where a payload looks."""

    ros: "RosRuntime"
    senses: Senses
    show_target: Callable[[VehicleState], None]
    sight: "PayloadSight | None" = None


class Station(Protocol):
    """All connections to ROS of one arbiter."""

    async def open(self) -> Mapping[ResourceId, Instruments]:
        """Listen; returns at once, whoever is there.

        Raises:
            RosError: ROS cannot be used; the text says what would be right.
        """
        ...

    def retry(self) -> None:
        """Tell of detections whose place was not known before, if it is now."""
        ...

    async def close(self) -> None:
        """Let go of everything."""
        ...


@dataclass(frozen=True, slots=True)
class Installation:
    """What a station is made for. `hear` is given the states of payloads that detect. `vehicles`:
    also payloads with a node of their own."""

    connections: Mapping[ResourceId, Connection]
    vehicles: Mapping[ResourceId, Settings]
    detectors: Mapping[ResourceId, DetectorSettings]
    context: ArbiterContext
    hear: Callable[[PayloadState], None]
