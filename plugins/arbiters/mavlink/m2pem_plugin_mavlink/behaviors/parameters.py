"""The parameters of a behavior of one vehicle, with the altitudes that its autopilot needs."""

from m2pem.api import BehaviorParameters, LatLon, Point, ResourceId, VehiclePosition, VehicleState
from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext, BehaviorFailedError
from m2pem_plugin_mavlink.vehicle.driver import RELATIVE, TargetPosition

TARGET_WITHIN_S = 5.0

_WITH_HEIGHT = frozenset({"air", "subsurface"})


class VehicleParameters(BehaviorParameters):
    """The parameters of a behavior; altitudes are left out where the vehicle's domain has none.

    `adjusted_m_s`: the speed that replaces the requested one on the way; None: none.
    """

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context.parameters)
        self.adjusted_m_s: float | None = None
        self._context = context
        self.has_height = context.vehicle.domain in _WITH_HEIGHT

    @property
    def speed_m_s(self) -> float | None:
        """The adjusted or requested speed, or else the one of `set_speed`; None: the vehicle's
        own."""
        return self.adjusted_m_s or super().speed_m_s or self._context.cruise_m_s

    @property
    def waypoint_speeds_m_s(self) -> tuple[float | None, ...]:
        """The speeds of the route's waypoints; (): they have none, or the task's own replaces
        them."""
        route = self.route
        return route.speeds_m_s if route is not None and super().speed_m_s is None else ()

    def altitude(
        self, own_m: float | None = None, own_frame: str = RELATIVE
    ) -> tuple[float | None, str]:
        """Return the height to move at and its frame: the requested one, else `own_m` (a
        waypoint's).

        None: the present height.
        """
        if not self.has_height:
            return None, RELATIVE
        requested_m = self.altitude_m
        if requested_m is not None:
            return requested_m, self.altitude_frame
        return own_m, own_frame if own_m is not None else RELATIVE

    def altitude_to_fly(
        self, own_m: float | None = None, own_frame: str = RELATIVE
    ) -> tuple[float, str]:
        """Return the same, with the present height instead of None, and the height of home for
        vehicles without heights.

        Raises:
            BehaviorFailedError: the present height is not known.
        """
        altitude_m, frame = self.altitude(own_m, own_frame)
        if altitude_m is not None:
            return altitude_m, frame
        if not self.has_height:
            return 0.0, RELATIVE
        present_m = self._context.vehicle.state.altitude_above_home_m
        if present_m is None:
            raise BehaviorFailedError("its height is not known yet: set the parameter 'altitude'")
        return present_m, RELATIVE

    def target_position(self) -> TargetPosition:
        """Return the present position of `target`.

        Raises:
            BehaviorFailedError: its position is unknown.
        """
        value = self.target
        if isinstance(value, Point):
            latitude, longitude, own_m = value.position
            return TargetPosition(latitude, longitude, *self.altitude(own_m, value.altitude_frame))
        if isinstance(value, VehiclePosition):
            return TargetPosition(*self.position_of_vehicle(value.vehicle), *self.altitude())
        raise BehaviorFailedError("it has no target")

    @property
    def target_is_unknown(self) -> bool:
        """Whether `target` is a vehicle whose position is unknown."""
        name = self.target_vehicle
        if name is None:
            return False
        state = state_of(self._context, name)
        return state is None or state.position is None

    async def wait_for_target(self) -> None:
        """Wait for the first position of a target vehicle: at the beginning of a mission, some
        vehicles are connected before others.

        Raises:
            BehaviorFailedError: its position stays unknown.
        """
        vehicle = self._context.vehicle
        if not await vehicle.until(lambda: not self.target_is_unknown, TARGET_WITHIN_S):
            raise BehaviorFailedError(
                f"parameter 'target': {self.target_vehicle} has sent no position"
            )

    def position_of_vehicle(self, vehicle: str) -> LatLon:
        """Return the last position of another vehicle.

        Raises:
            BehaviorFailedError: it is unknown.
        """
        state = state_of(self._context, vehicle)
        if state is None or state.position is None:
            raise BehaviorFailedError(f"the position of {vehicle} is not known")
        return state.position.latlon


def state_of(context: BehaviorContext, vehicle: str) -> VehicleState | None:
    """Return the last state of another vehicle of the fleet."""
    state = context.bus.latest(ResourceId(vehicle))
    return state if isinstance(state, VehicleState) else None
