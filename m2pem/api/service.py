"""Service tasks: registered classes that run code (paper, section 4.1)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from m2pem.errors import M2pemError
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value

if TYPE_CHECKING:
    import logging

    from m2pem.api.bus import FleetBus
    from m2pem.api.clock import Clock


class ServiceError(M2pemError):
    """Raised by a service to end its task with an error that the mission may catch."""

    def __init__(self, code: str, reason: str = "") -> None:
        self.code = code
        self.reason = reason
        super().__init__(f"{code}: {reason}" if reason else code)


@dataclass(frozen=True, slots=True)
class ServiceContext:
    """What the executive provides to a service. `detectors`: the fleet's detector payloads.

    `run`, `element`: the run and the service task that it runs for. `service`: names this execution
    of the task, unique in the run; after a restart of the executive it is the same.
    """

    clock: "Clock"
    bus: "FleetBus"
    logger: "logging.Logger"
    detectors: tuple[ResourceId, ...] = ()
    run: str = ""
    element: str = ""
    service: str = ""


class Service(Protocol):
    """Runs a service task; one object for each. It is cancelled when its task is interrupted."""

    writes: Sequence[str]
    """The dotted names that it may write."""

    async def run(
        self,
        context: ServiceContext,
        roles: Mapping[str, ResourceId],
        properties: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        """Do it; the result is written to the data store.

        Raises:
            ServiceError: the task ends with this error.
        """
        ...
