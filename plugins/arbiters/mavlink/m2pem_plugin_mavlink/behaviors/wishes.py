"""A request's parameters, as behaviors ask for them."""

from m2pem.api import Area, LatLon, Point, ResourceId, Route, VehiclePosition, VehicleState
from m2pem_plugin_mavlink.behaviors.behavior import BehaviorContext, BehaviorFailedError
from m2pem_plugin_mavlink.vehicle.driver import Place

RELATIVE, AMSL, TERRAIN = "relative", "amsl", "terrain"

HEARD_WITHIN_S = 5.0

_WITH_HEIGHT = frozenset({"air", "subsurface"})


class Wishes:
    """What was asked for; what the vehicle's domain has no use for is left out. `adjusted_m_s`: the
    speed that it was told on its way; None: none."""

    def __init__(self, context: BehaviorContext) -> None:
        self.adjusted_m_s: float | None = None
        self._job = context
        self._values = context.parameters
        self.has_height = context.vehicle.domain in _WITH_HEIGHT

    def number(self, name: str) -> float | None:
        """A number in SI, None if not given."""
        value = self._values.get(name)
        return float(value) if isinstance(value, int | float) else None

    def flag(self, name: str) -> bool:
        """Whether something is wished."""
        return self._values.get(name) is True

    def text(self, name: str) -> str:
        """A text, "" if not given."""
        value = self._values.get(name)
        return value if isinstance(value, str) else ""

    @property
    def speed_m_s(self) -> float | None:
        """As adjusted or asked for, or else as `set_speed` has set it; None: the vehicle's own."""
        return self.adjusted_m_s or self.number("speed") or self._job.cruise_m_s

    @property
    def route(self) -> Route | None:
        """The parameter `route`."""
        value = self._values.get("route")
        return value if isinstance(value, Route) else None

    @property
    def area(self) -> Area | None:
        """The parameter `area`."""
        value = self._values.get("area")
        return value if isinstance(value, Area) else None

    @property
    def target_vehicle(self) -> str | None:
        """The vehicle that `target` names, if it names one."""
        value = self._values.get("target")
        return value.vehicle if isinstance(value, VehiclePosition) else None

    def altitude(
        self, own_m: float | None = None, own_frame: str = RELATIVE
    ) -> tuple[float | None, str]:
        """The height to move at, and its frame: as the parameters say, else `own_m` (a waypoint's).

        None: as it is.
        """
        if not self.has_height:
            return None, RELATIVE
        wished = self.number("altitude")
        if wished is not None:
            return wished, self.text("altitude_frame") or RELATIVE
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

    def target(self) -> Place:
        """Where `target` is now.

        Raises:
            BehaviorFailedError: it is a vehicle that was never heard.
        """
        value = self._values.get("target")
        if isinstance(value, Point):
            latitude, longitude, own_m = value.position
            return Place(latitude, longitude, *self.altitude(own_m, value.altitude_frame))
        if isinstance(value, VehiclePosition):
            return Place(*self.whereabouts(value.vehicle), *self.altitude())
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
