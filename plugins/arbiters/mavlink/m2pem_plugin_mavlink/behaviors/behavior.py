"""What a vehicle does for one request."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from m2pem.api import BehaviorState, FleetBus, ResolvedValue
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle


class BehaviorFailedError(Exception):
    """It cannot be done, or not any more. `code`: an error code of docs/missions.md."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be done, by whom, and where: the fleet's bus (positions of other vehicles) and the
    origin of its ENU frame (latitude and longitude in degrees, altitude in metres)."""

    vehicle: Vehicle
    parameters: Mapping[str, ResolvedValue]
    bus: FleetBus
    origin: tuple[float, float, float]


class Behavior(ABC):
    """One behavior. The arbiter calls `begin` once; then `finished` whenever something is heard of
    the vehicle; `go_on` after a hold. `steps`, if it has any, run beside that and are cancelled
    with it (a setpoint that must be repeated).

    `modes`: those in which it goes on; another one, that nobody here asked for, says that somebody
    else has taken the vehicle over.
    """

    name: ClassVar[str]
    modes: ClassVar[frozenset[FlightMode]]

    def __init__(self, job: Job) -> None:
        self.job = job
        self.vehicle = job.vehicle

    @abstractmethod
    async def begin(self) -> None:
        """Have the vehicle do it; returns when it does.

        Raises:
            BehaviorFailedError, ExchangeError: it cannot.
        """

    @abstractmethod
    def finished(self) -> bool:
        """Whether it is done.

        Raises:
            BehaviorFailedError: it has failed.
        """

    @abstractmethod
    async def go_on(self) -> None:
        """Have the vehicle go on after it was held."""

    async def steps(self) -> None:  # noqa: B027  # most have none
        """What must be done over and over while it goes on and is not held."""

    @abstractmethod
    async def recognised(self) -> BehaviorState:
        """After a restart, by looking at the vehicle and asking it nothing but what it has: RUNNING
        (it does just this), SUCCEEDED (it has done it) or UNKNOWN."""
