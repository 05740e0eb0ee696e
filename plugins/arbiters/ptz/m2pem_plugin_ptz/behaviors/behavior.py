"""The interface of behaviors: what a camera does for one request."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from m2pem.api import BehaviorId, BehaviorParameters, BehaviorState, Value
from m2pem_plugin_ptz.camera_model.model import CameraModel
from m2pem_plugin_ptz.drivers.driver import CameraError

TICK_S = 0.05
"""Period of the commands to a camera while a behavior points it."""


REPORTED_SHARE = 0.05
"""What is left is worth its record when that share of the whole was done since the last one."""

LEAST_SHARE = 0.01
"""The same of the last report, when a behavior fails or its camera is lost."""


class BehaviorFailedError(CameraError):
    """The behavior cannot be done, or cannot be continued."""


@dataclass(frozen=True, slots=True)
class BehaviorContext:
    """The arguments of a behavior: the parameters and the camera."""

    id: BehaviorId
    parameters: BehaviorParameters
    model: CameraModel


class Behavior(ABC):
    """One behavior. `refusal` is called first, then `begin` once, then `step` every `TICK_S` until
    it returns True, except during a hold. `leave` is called at the end of any kind, unless the
    camera is lost. `begin` and `step` raise CameraError on failure.

    `turns`: the behavior turns or zooms the camera.
    """

    name: ClassVar[str]
    turns: ClassVar[bool] = True

    def __init__(self, context: BehaviorContext) -> None:
        self.context = context
        self.model = context.model
        self.driver = context.model.driver

    def refusal(self) -> str:
        """Return why the behavior cannot be done; "" if it can. Nothing has been sent yet."""
        return ""

    async def begin(self) -> None:  # noqa: B027  # most begin with their first step
        """Begin. The camera has reported its direction."""

    @abstractmethod
    async def step(self, elapsed_s: float) -> bool:
        """Continue, and return whether the behavior is done. `elapsed_s` counts from `begin`,
        without holds."""

    async def leave(self) -> None:  # noqa: B027  # most leave nothing behind
        """Undo what must not outlast the behavior."""

    def outputs(self) -> Mapping[str, Value]:
        """Return what the behavior writes to the mission's data store. Call it after `leave`."""
        return {}

    def left(self, least: float = REPORTED_SHARE) -> Mapping[str, Value] | None:
        """Return the parameters, of those that differ, by which another camera would do what is
        left; None: the share `least` of the whole has not been done since it was last returned, or
        parameters cannot say it."""
        return None

    def state_after_restart(self) -> BehaviorState:
        """Return RUNNING, SUCCEEDED or UNKNOWN after a restart, by the direction of the camera."""
        return BehaviorState.UNKNOWN
