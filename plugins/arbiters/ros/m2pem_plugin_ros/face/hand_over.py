"""The services `~/take_vehicle` and `~/give_back_vehicle`."""

from collections.abc import Awaitable, Callable
from typing import Any

from m2pem_interfaces import srv

from m2pem.api import MissionControl
from m2pem.errors import M2pemError, OperatorError
from m2pem_plugin_ros.face.behavior_actions import why_no_commands
from m2pem_plugin_ros.face.goals import reason_of
from m2pem_plugin_ros.face.settings import Options
from m2pem_plugin_ros.interfaces.texts import asker, named
from m2pem_plugin_ros.runtime import RosRuntime

AT_ONCE = 20
NAMELESS = "someone"


class HandOver:
    """Serves them. A vehicle that was taken here takes goals of the face until it is given back."""

    def __init__(self, ros: RosRuntime, control: MissionControl, options: Options) -> None:
        self._control = control
        self._options = options
        self._prefix = f"ros {ros.node.get_fully_qualified_name()}"
        self._active = 0
        ros.serve(srv.TakeVehicle, "~/take_vehicle", self._serving(self._take))
        ros.serve(srv.GiveBackVehicle, "~/give_back_vehicle", self._serving(self._give_back))

    def _serving(self, do: Callable[[str, str], Awaitable[None]]) -> Callable[..., Awaitable[Any]]:
        async def serve(request: Any, response: Any) -> Any:
            self._active += 1
            try:
                if self._active > AT_ONCE:
                    raise OperatorError("too many requests at once: ask again")
                vehicle = named(request.vehicle, "vehicle", "evsg1 or evsg2/ptz")
                by = f"{self._prefix} {asker(request.by, NAMELESS)}"
                await do(vehicle, by)
            except M2pemError as refusal:
                response.success, response.message = False, reason_of(refusal)
            else:
                response.success = True
            finally:
                self._active -= 1
            return response

        return serve

    async def _take(self, vehicle: str, by: str) -> None:
        if not self._options.takes_commands(vehicle):
            raise OperatorError(why_no_commands(vehicle))
        await self._control.take(vehicle, by=by)

    async def _give_back(self, vehicle: str, by: str) -> None:
        holder = (await self._control.holders()).get(vehicle, "")  # type: ignore[call-overload]
        if holder and holder != by:
            raise OperatorError(f"{vehicle} is with {holder}, who gives it back")
        await self._control.give_back(vehicle, by=by)
