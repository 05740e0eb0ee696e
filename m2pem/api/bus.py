"""The fleet bus: telemetry of all resources and teams, for arbiters, services and OCUs."""

from collections.abc import AsyncIterator
from typing import Protocol

from m2pem.api.telemetry import PayloadState, Telemetry, VehicleState
from m2pem.mission.catalogue import ResourceId


class FleetBus(Protocol):
    """Latest value of every resource, plus bounded subscriptions (the oldest is dropped)."""

    def latest(self, resource: ResourceId) -> VehicleState | PayloadState | None:
        """Return the newest state, or None before the first."""
        ...

    def publish(self, state: VehicleState | PayloadState) -> None:
        """Publish a state; never blocks."""
        ...

    def subscribe(self, size: int = 100) -> AsyncIterator[Telemetry]:
        """States from now on, for one reader; `size` of them wait at most."""
        ...
