"""What a camera does for one request."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from m2pem.api import BehaviorId, BehaviorParameters, BehaviorState, Value
from m2pem_plugin_ptz.camera_model.model import Sight

TICK_S = 0.05
"""So often is a camera told where to look, while something has it look somewhere."""


class BehaviorFailedError(Exception):
    """It cannot be done, or not any more. `code`: an error code of docs/missions.md."""

    def __init__(self, reason: str, code: str = "FAILED") -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be done, with which camera."""

    id: BehaviorId
    parameters: BehaviorParameters
    sight: Sight


class Behavior(ABC):
    """One behavior. It is asked for a `refusal`, then `begin` once, then `step` every `TICK_S`
    until that returns True; not while it is held. `leave` comes last, however it ends, but for a
    camera that is lost. `begin` and `step` raise BehaviorFailedError or CameraError if it failed.

    `turns`: it turns or zooms the camera.
    """

    name: ClassVar[str]
    turns: ClassVar[bool] = True

    def __init__(self, job: Job) -> None:
        self.job = job
        self.sight = job.sight
        self.driver = job.sight.driver

    def refusal(self) -> str:
        """Why it cannot be done; "" if it can. Nothing has been sent yet."""
        return ""

    async def begin(self) -> None:  # noqa: B027  # most begin with their first step
        """The camera is heard, and it is to be done now."""

    @abstractmethod
    async def step(self, elapsed_s: float) -> bool:
        """Go on; whether it is done. `elapsed_s`: since `begin`, without the time in a hold."""

    async def leave(self) -> None:  # noqa: B027  # most leave nothing behind
        """Undo what must not outlive it."""

    def outputs(self) -> Mapping[str, Value]:
        """What it writes to the mission's data store; after `leave`."""
        return {}

    def recognised(self) -> BehaviorState:
        """After a restart, by where the camera looks: RUNNING, SUCCEEDED or UNKNOWN."""
        return BehaviorState.UNKNOWN
