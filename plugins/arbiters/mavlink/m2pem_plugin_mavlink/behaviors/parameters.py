"""The parameters of a behavior of one vehicle, with the altitudes that its autopilot needs."""

from m2pem.api import BehaviorParameters, LatLon, Point, ResourceId, VehiclePosition, VehicleState
from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext, BehaviorFailedError
from m2pem_plugin_mavlink.vehicle.driver import TargetPosition

RELATIVE, AMSL, TERRAIN = "relative", "amsl", "terrain"

HEARD_WITHIN_S = 5.0

_WITH_HEIGHT = frozenset({"air", "subsurface"})


class VehicleParameters(BehaviorParameters):
    """What a vehicle is to do; its domain may have no use for an altitude.

    `adjusted_m_s`: the speed that replaces the requested one on the way; None: none.
    """

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context.parameters)
        self.adjusted_m_s: float | None = None
        self._job = context
        self.has_height = context.vehicle.domain in _WITH_HEIGHT

    @property
    def speed_m_s(self) -> float | None:
        """As adjusted or asked for, or else as `set_speed` has set it; None: the vehicle's own."""
        return self.adjusted_m_s or super().speed_m_s or self._job.cruise_m_s

    def altitude(
        self, own_m: float | None = None, own_frame: str = RELATIVE
    ) -> tuple[float | None, str]:
        """The height to move at, and its frame: as the parameters say, else `own_m` (a waypoint's).

        None: as it is.
        """
        if not self.has_height:
            return None, RELATIVE
        wished = self.altitude_m
        if wished is not None:
            return wished, self.altitude_frame
        return own_m, own_frame if own_m is not None else RELATIVE

    def altitude_to_fly(
        self, own_m: float | None = None, own_frame: str = RELATIVE
    ) -> tuple[float, str]:
        """The same, with the present height for "as it is", and home's for what has none.

        Raises:
            BehaviorFailedError: the present height is not known.
        """
        altitude_m, frame = self.altitude(own_m, own_frame)
        if altitude_m is not None:
            return altitude_m, frame
        if not self.has_height:
            return 0.0, RELATIVE
        present_m = self._job.vehicle.state.altitude_above_home_m
        if present_m is None:
            raise BehaviorFailedError("its height is not known yet: say the altitude to move at")
        return present_m, RELATIVE

    def target_place(self) -> TargetPosition:
        """Where `target` is now.

        Raises:
            BehaviorFailedError: it is a vehicle that was never heard.
        """
        value = self.target
        if isinstance(value, Point):
            latitude, longitude, own_m = value.position
            return TargetPosition(latitude, longitude, *self.altitude(own_m, value.altitude_frame))
        if isinstance(value, VehiclePosition):
            return TargetPosition(*self.whereabouts(value.vehicle), *self.altitude())
        raise BehaviorFailedError("it has no target")

    @property
    def target_is_unheard(self) -> bool:
        """Whether `target` is a vehicle whose position is not known, not yet or not any more."""
        name = self.target_vehicle
        if name is None:
            return False
        state = state_of(self._job, name)
        return state is None or state.position is None

    async def hear_target(self) -> None:
        """Wait a little for a target that is not heard yet: at the beginning of a mission some
        vehicles are heard before others.

        Raises:
            BehaviorFailedError: it is not heard.
        """
        vehicle = self._job.vehicle
        if not await vehicle.until(lambda: not self.target_is_unheard, HEARD_WITHIN_S):
            raise BehaviorFailedError(
                f"parameter 'target': {self.target_vehicle} has not been heard"
            )

    def whereabouts(self, vehicle: str) -> LatLon:
        """Where another vehicle was heard last.

        Raises:
            BehaviorFailedError: it was never heard.
        """
        state = state_of(self._job, vehicle)
        if state is None or state.position is None:
            raise BehaviorFailedError(f"the position of {vehicle} is not known")
        return state.position.latitude_deg, state.position.longitude_deg


def state_of(context: BehaviorContext, vehicle: str) -> VehicleState | None:
    """What another vehicle of the fleet said last."""
    state = context.bus.latest(ResourceId(vehicle))
    return state if isinstance(state, VehicleState) else None
