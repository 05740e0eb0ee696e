"""Behaviors that fly or drive a stored mission: routes, surveys, missions that are on board."""

import math
import zlib
from abc import abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import (
    SURVEY_SPACING_M,
    BehaviorState,
    EastNorth,
    LatLon,
    LocalFrame,
    RemainingRoute,
    RemainingSurvey,
    RemainingWork,
    Route,
    SurveyTracks,
    Value,
    raw_parameters,
)
from m2pem_plugin_mavlink.behaviors.arrival import (
    StillnessTimer,
    arrival_radius_m,
    distance_to_m,
    position_of,
    takeoff_required,
)
from m2pem_plugin_mavlink.behaviors.behavior import (
    MOVES_WITHIN_S,
    Behavior,
    BehaviorContext,
    BehaviorFailedError,
    CheckpointState,
    TakenOverError,
)
from m2pem_plugin_mavlink.behaviors.goto import TOLERANCES_M
from m2pem_plugin_mavlink.behaviors.mission_progress import JUMPS, MissionProgress
from m2pem_plugin_mavlink.behaviors.parameters import VehicleParameters
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem, same_frame
from m2pem_plugin_mavlink.vehicle.driver import FRAMES, RELATIVE, FlightMode
from m2pem_plugin_mavlink.vehicle.fixed_wing import remove_landing
from m2pem_plugin_mavlink.vehicle.other_stations import Act, Meaning, meaning
from m2pem_plugin_mavlink.vehicle.takeover_monitor import PAUSED

_LAST_NAVIGATION_COMMAND: int = dialect.MAV_CMD_NAV_LAST
_HEIGHT_STEP_M = 0.02
"""Autopilots keep altitudes in centimetres, or as short floats."""


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Identifies the items of a mission that have a place: their number, their positions, and the
    sum of their heights."""

    count: int
    places: int
    height_m: float

    def fits(self, other: "Fingerprint") -> bool:
        """Return whether both are of the same mission, apart from what storing it changes."""
        off_m = abs(self.height_m - other.height_m)
        same = (self.count, self.places) == (other.count, other.places)
        return same and off_m <= _HEIGHT_STEP_M * max(1, self.count) + 1e-6 * abs(self.height_m)


def fingerprint(items: Sequence[MissionItem]) -> Fingerprint:
    placed = [item for item in items if is_navigation(item)]
    lines = "\n".join(
        f"{item.command} {same_frame(item.frame)}"
        f" {round(item.latitude_deg * 1e7)} {round(item.longitude_deg * 1e7)}"
        for item in placed
    )
    return Fingerprint(
        len(placed), zlib.crc32(lines.encode()), sum(item.altitude_m for item in placed)
    )


def is_navigation(item: MissionItem) -> bool:
    """Return whether the vehicle moves for the item, and reports that it reached it."""
    return item.command <= _LAST_NAVIGATION_COMMAND


GROUND_SPEED = 1.0
AS_IT_IS = -1.0

CURRENT_WITHIN_S = 3.0
"""Autopilots send MISSION_CURRENT once in a second."""

STANDS_AT_END_S = 2.0
"""The message that the last item was reached comes once, and may be lost."""


def circle_for_ever(last: MissionItem) -> MissionItem:
    """Return an item that circles the place of another item. At the end of its mission an ArduPlane
    would otherwise return home, or continue into a landing that is stored behind it."""
    return replace(last, command=dialect.MAV_CMD_NAV_LOITER_UNLIM)


def speed_item(speed_m_s: float) -> MissionItem:
    """Return an item that sets the speed over ground from here on."""
    params = (GROUND_SPEED, speed_m_s, AS_IT_IS, 0.0)
    return MissionItem(dialect.MAV_CMD_DO_CHANGE_SPEED, dialect.MAV_FRAME_MISSION, params)


class StoredMission(Behavior):
    """Executes a stored mission, which another ground station may pause, or change the item of."""

    modes = frozenset({FlightMode.MISSION})

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._progress: MissionProgress | None = None

    def waits(self) -> str:
        """Return that another station has paused the mission; ArduCopter stays in AUTO then."""
        state = self.vehicle.state
        paused = state.mission_state == dialect.MISSION_STATE_PAUSED
        paused = paused and meaning(Act.PAUSED, self.name) is Meaning.WAITS
        return PAUSED if paused and state.mode is FlightMode.MISSION else ""

    def check_order(self, names: Callable[[], Mapping[int, str]] = dict) -> None:
        """Check that no waypoint was left out; `names`: of items.

        Raises:
            TakenOverError: another station has set the current item.
        """
        if self._progress is None or meaning(Act.ITEM, self.name) is not Meaning.TAKEN_OVER:
            return
        self._progress.look()
        if problem := self._progress.problem(names()):
            raise TakenOverError(problem)


class MissionFlight(StoredMission):
    """Uploads waypoints as a mission and has the vehicle execute it; `loop`: again and again."""

    max_still_s = MOVES_WITHIN_S

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self.parameters = VehicleParameters(context)
        self.loop = False
        self._items: tuple[MissionItem, ...] | None = None
        self._kept: Fingerprint | None = None
        self._end: tuple[int, LatLon] | None = None
        self._already_at: int | None = None
        self._stillness = StillnessTimer(context)
        self._work: RemainingWork | None = None
        self._moves: tuple[int, ...] = ()
        self._speeds: Mapping[int, float] = {}
        self._counts = False

    def work(self, way: Sequence[MissionItem]) -> RemainingWork | None:
        """Return the account of what is left of the waypoints; None: parameters cannot say it."""
        return None

    @abstractmethod
    def way(self) -> Sequence[MissionItem]:
        """Return the waypoints.

        Raises:
            BehaviorFailedError: there can be none; the reason says why.
        """

    def waypoint(self, place: LatLon, altitude_m: float, frame: str) -> MissionItem:
        """Return an item that goes to a place and continues from there. Copters of PX4 turn where
        it says, by themselves 10 m before (NAV_ACC_RAD). Planes cannot come as near."""
        plane = self.vehicle.state.loiter_radius_m is not None
        turns_m = 0.0 if plane else TOLERANCES_M.get(self.vehicle.domain, 2.5)
        params = (0.0, turns_m, 0.0, math.nan)
        return MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, FRAMES[frame], params, *place, altitude_m)

    def named(self, index: int) -> str:
        """Return how messages name a waypoint."""
        return f"waypoint {index + 1}"

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """Return the items to upload: the speed if one was requested, then the waypoints, each with
        its own speed behind it if it has one; for a plane also a circle at the last of them."""
        if self._items is None:
            way = tuple(self.way())
            items = self._with_speeds(way)
            last = items[-1]
            self._learn(items)
            self._work = self.work(way)
            self._end = (len(items) - 1, last.latlon)
            circles = self.vehicle.state.loiter_radius_m is not None
            self._items = (*items, circle_for_ever(last)) if circles else items
            self._kept = fingerprint(self._items)
        return self._items

    def _with_speeds(self, way: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
        """Return waypoints with the items that set speeds; behind the last one nothing is set."""
        speed = self.parameters.speed_m_s
        items = [] if speed is None else [speed_item(speed)]
        own = self.parameters.waypoint_speeds_m_s[: len(way) - 1]
        for item, speed in zip_longest(way, own):
            items += (item,) if speed is None else (item, speed_item(speed))
        return tuple(items)

    def _learn(self, items: Sequence[MissionItem]) -> None:
        """Note which items are waypoints, and which ones set a speed."""
        self._moves = tuple(index for index, item in enumerate(items) if is_navigation(item))
        self._speeds = {
            index: item.params[1]
            for index, item in enumerate(items)
            if item.command == dialect.MAV_CMD_DO_CHANGE_SPEED
        }

    def _speed_towards(self, item: int) -> float | None:
        """Return the speed that the items before one have set, unless it was adjusted since; None:
        the vehicle's own."""
        if self.parameters.adjusted_m_s is not None:
            return self.parameters.adjusted_m_s
        before = [speed for index, speed in self._speeds.items() if index < item]
        return before[-1] if before else self.parameters.speed_m_s

    def refusal(self) -> str:
        """Check that an aircraft is in the air, and that the path, with a loop's way back, is
        inside the fence."""
        if reason := takeoff_required(self.vehicle):
            return reason
        items = self.items
        if self.context.fence is None or self._end is None:
            return ""
        placed = [items[index] for index in self._moves if index <= self._end[0]]
        way = [item.latlon for item in placed]
        return self.context.fence.breach(way, position_of(self.vehicle), self.named, self.loop)

    async def begin(self) -> None:
        self._stillness.forget()
        self._progress = None
        await self.vehicle.driver.upload(self.items)
        await self._start()

    async def _start(self, first: int = 0) -> None:
        await self.vehicle.driver.start_mission(first)
        self._follow(self.items, first)

    def _follow(self, items: Sequence[MissionItem], first: int) -> None:
        self._progress = MissionProgress(self.vehicle, items, self._moves, first)

    def _names(self) -> Mapping[int, str]:
        return {index: self.named(number) for number, index in enumerate(self._moves)}

    async def resume(self) -> None:
        """Restart the mission at the current item."""
        self._stillness.forget()
        last = self._end[0] if self._end else 0
        current = min(self.vehicle.driver.current_item or 0, last)
        self._progress = None
        await self._start(current)
        if (speed := self._speed_towards(current)) is not None:
            await self.vehicle.driver.set_speed(speed)

    def adjust(self, speed_m_s: float) -> bool:
        """Keep the speed for loops and holds; the uploaded mission is not changed: the next
        waypoint with a speed of its own changes it again."""
        self.parameters.adjusted_m_s = speed_m_s
        return True

    def left(self, least_m: float | None = None) -> Mapping[str, Value] | None:
        """Return the rest of the way, by the current item and the position. In a loop, all of it is
        always left."""
        work, driver = self._work, self.vehicle.driver
        if work is None or self.loop:
            return None
        reached, current = driver.reached_item, driver.current_item
        heading = -1 if reached is None else bisect_right(self._moves, reached)
        if current is not None:
            towards = bisect_left(self._moves, current)
            # At first the item of the mission before may still be reported.
            self._counts = self._counts or reached is not None or towards <= 1
            heading = max(heading, towards) if self._counts else heading
        if self._progress is not None and self._progress.skipped:
            heading = min(heading, bisect_left(self._moves, self._progress.skipped[0]))
        last = len(work.line.points) - 1
        if heading > 0:
            work.reached(min(heading - 1, last))
        position = self.vehicle.state.position
        if position is not None and 0 < heading <= last:
            place = work.frame.to_local(position.latlon)
            work.moved(place, heading)
        return work.to_report(least_m)

    async def run_in_background(self) -> None:
        """Restart the mission at the end of each loop."""
        while self.loop:
            await self.vehicle.until(self.at_the_end)
            self._stillness.forget()
            self._progress = None
            await self._start()
            if (speed := self._speed_of_way_back) is not None:
                await self.vehicle.driver.set_speed(speed)
            await self.vehicle.until(lambda: not self.at_the_end())

    @property
    def _speed_of_way_back(self) -> float | None:
        """From the last waypoint to the first, where the mission begins with another speed; None:
        it has that one."""
        if self.parameters.adjusted_m_s is not None or not self.parameters.waypoint_speeds_m_s:
            return self.parameters.adjusted_m_s
        route = self.parameters.route
        return None if route is None else route.speed_from(len(route.waypoints) - 1)

    def at_the_end(self) -> bool:
        """Return whether the last waypoint was reached, by the vehicle's messages or its
        position."""
        if self._end is None:
            return False
        last, place = self._end
        driver = self.vehicle.driver
        reached, current = driver.reached_item, driver.current_item
        # Behind the last item and a plane's circle comes a landing that was not commanded.
        own = range(last, last + (2 if self.vehicle.state.loiter_radius_m is not None else 1))
        if reached is not None and reached in own:
            return True
        if current is None or current not in own:
            return False
        near_m = 2 * TOLERANCES_M.get(self.vehicle.domain, 2.5)
        if distance_to_m(self.vehicle, place) > arrival_radius_m(self.vehicle, near_m):
            return False
        over = self.vehicle.state.mode is FlightMode.HOLD  # PX4 holds at the end of a mission
        return over or self._stillness.seconds(place) >= STANDS_AT_END_S

    def finished(self) -> bool:
        """Return whether the last waypoint was reached; in a loop always False.

        Raises:
            TakenOverError: another station has set the current item.
        """
        self.check_order(self._names)
        return not self.loop and self.at_the_end()

    async def reattach(self) -> BehaviorState:
        """Judge by the stored mission, the mode, the current item and the position. If the vehicle
        flew the same mission when this behavior was requested, it has begun again only if it is at
        an earlier item than then."""
        if self._kept is None or self._end is None:
            return BehaviorState.UNKNOWN
        stored = await self.vehicle.driver.downloaded()
        if not fingerprint(remove_landing(stored)).fits(self._kept):
            return BehaviorState.UNKNOWN
        if self._work is None:
            self._learn(stored[: self._end[0] + 1])
            self._counts = True
            self._work = self.work([stored[index] for index in self._moves])
        before, driver = self._already_at, self.vehicle.driver
        if self.finished() or await self._stands_at_the_end():
            return BehaviorState.SUCCEEDED if before is None else BehaviorState.UNKNOWN
        if before is not None:
            await self.vehicle.until(lambda: driver.current_item is not None, CURRENT_WITHIN_S)
            if driver.current_item is None or driver.current_item >= before:
                return BehaviorState.UNKNOWN
        flies = self.vehicle.state.mode is FlightMode.MISSION and self.vehicle.state.armed
        if flies and driver.current_item is not None:
            self._follow(stored, driver.current_item)
        return BehaviorState.RUNNING if flies else BehaviorState.UNKNOWN

    def _item_before(self) -> int | None:
        """Return at which item of the same mission the vehicle is before this behavior begins; that
        behind the last one if it has completed the mission, None if it flies another one."""
        vehicle, current = self.vehicle, self.vehicle.driver.current_item
        if current is None or self._kept is None or self._end is None:
            return None
        stored = vehicle.commanded.mission  # None: it is not known here after a restart
        if stored is not None and not fingerprint(remove_landing(stored)).fits(self._kept):
            return None
        if self.at_the_end():
            return self._end[0] + 1
        flies = vehicle.state.mode is FlightMode.MISSION and vehicle.state.armed
        return current if flies and current > self._moves[0] else None

    async def _stands_at_the_end(self) -> bool:
        current = self.vehicle.driver.current_item
        if self.loop or self._end is None or current is None or current < self._end[0]:
            return False
        return await self.vehicle.until(self.at_the_end, STANDS_AT_END_S + 0.5)

    def checkpoint(self) -> CheckpointState:
        """Return the mission's fingerprint, its last item and the position of that, and the item of
        the same mission at which the vehicle is already."""
        if not self.items or self._kept is None or self._end is None:
            raise BehaviorFailedError("the mission has no waypoints")
        last, place = self._end
        kept, before = self._kept, self._item_before()
        return {
            "mission": [float(kept.count), float(kept.places), round(kept.height_m, 3)],
            "end": [float(last), *place],
            "already_at": None if before is None else float(before),
        }

    def restore(self, checkpoint: CheckpointState) -> None:
        mission, end = checkpoint.get("mission"), checkpoint.get("end")
        before = checkpoint.get("already_at")
        self._already_at = int(before) if isinstance(before, float) else None
        if isinstance(mission, list) and isinstance(end, list):
            self._kept = Fingerprint(int(mission[0]), int(mission[1]), mission[2])
            self._end = (int(end[0]), (end[1], end[2]))


_FRAME_NAMES = {frame: name for name, frame in FRAMES.items()}


def frame_name(item: MissionItem) -> str:
    """Return the altitude frame of a waypoint, by its name in missions."""
    return _FRAME_NAMES.get(same_frame(item.frame), RELATIVE)


class Routing(MissionFlight):
    """The behavior `single_vehicle_routing`: follow a route once, or in a loop."""

    name = "single_vehicle_routing"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self.loop = self.parameters.loop

    def way(self) -> Sequence[MissionItem]:
        route = self.parameters.route
        if route is None or not route.waypoints:
            raise BehaviorFailedError("parameter 'route': it has no waypoints")
        return [
            self.waypoint(place[:2], *self.parameters.altitude_to_fly(place[2], frame))
            for place, frame in zip(route.waypoints, route.frames, strict=True)
        ]

    def work(self, way: Sequence[MissionItem]) -> RemainingWork:
        """Return the account of the route; after a restart of the one that is stored."""
        own = [self._speeds.get(index + 1) for index in self._moves]
        stored = Route.of(
            ((*item.latlon, item.altitude_m) for item in way),
            map(frame_name, way),
            tuple(own) if any(speed is not None for speed in own) else (),
        )
        route = self.parameters.route or stored
        frame = LocalFrame(route.waypoints[0][:2])
        return RemainingRoute(raw_parameters(self.parameters.given), route, frame)

    def named(self, index: int) -> str:
        return f"waypoint {index + 1} of the route"


class Survey(MissionFlight):
    """The behavior `area_survey`: parallel tracks over an area, from the nearer of their two
    ends."""

    name = "area_survey"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._width_m = self.parameters.spacing_m or SURVEY_SPACING_M
        self._passes: Sequence[tuple[int, float, float, float]] = ()

    def way(self) -> Sequence[MissionItem]:
        """Return the ends of the tracks, and the places on the ways around holes of the area."""
        area = self.parameters.area
        if area is None:
            raise BehaviorFailedError("parameter 'area': there is none")
        frame = LocalFrame(area.rings[0][0][:2])
        rings = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings]
        given = self.parameters
        try:
            tracks = SurveyTracks.over(rings, given.spacing_m, given.yaw_rad, given.overshoot_m)
        except ValueError as error:
            raise BehaviorFailedError(f"parameter {error}") from None
        first, last = (frame.to_latlon(tracks.line.points[index]) for index in (0, -1))
        if distance_to_m(self.vehicle, last) < distance_to_m(self.vehicle, first):
            tracks = tracks.reversed()
        if (here := position_of(self.vehicle)) is not None:
            tracks = tracks.approached_from(frame.to_local(here))
        self._width_m, self._passes = tracks.width_m, tracks.passes
        height = self.parameters.altitude_to_fly(area.rings[0][0][2], area.altitude_frame)
        return [self.waypoint(frame.to_latlon(point), *height) for point in tracks.line.points]

    def work(self, way: Sequence[MissionItem]) -> RemainingWork:
        """Return the account of the tracks; after a restart of those that are stored."""
        frame = LocalFrame(way[0].latlon)
        area = self.parameters.area
        up_m: float | None = way[0].altitude_m
        up_frame = frame_name(way[0])
        holes: list[list[EastNorth]] = []
        if area is not None:
            up_m, up_frame = area.rings[0][0][2], area.altitude_frame
            holes = [[frame.to_local(corner[:2]) for corner in ring] for ring in area.rings[1:]]
        tracks = SurveyTracks(
            [frame.to_local(item.latlon) for item in way],
            self._width_m,
            self.parameters.overshoot_m,
            self._passes,
            holes,
        )
        given = raw_parameters(self.parameters.given)
        return RemainingSurvey(given, tracks, frame, up_m, up_frame)

    def checkpoint(self) -> CheckpointState:
        return {
            **super().checkpoint(),
            "width": self._width_m,
            "passes": [value for each in self._passes for value in each],
        }

    def restore(self, checkpoint: CheckpointState) -> None:
        super().restore(checkpoint)
        width, passes = checkpoint.get("width"), checkpoint.get("passes")
        if isinstance(width, int | float):
            self._width_m = float(width)
        if isinstance(passes, list):
            quads = zip(*[iter(passes)] * 4, strict=True)
            self._passes = [(int(at), *metres) for at, *metres in quads]

    def named(self, index: int) -> str:
        for number, (first, *_) in enumerate(self._passes, 1):
            if index <= first + 1:
                place = {first: "begin of", first + 1: "end of"}.get(index, "the way to")
                return f"{place} pass {number} of the survey"
        return super().named(index)


class RunOnboardMission(StoredMission):
    """Execute the stored mission from an item on; complete at its last waypoint, or after
    landing."""

    name = "run_onboard_mission"

    def __init__(self, context: BehaviorContext) -> None:
        super().__init__(context)
        self._first = int(VehicleParameters(context).number("first") or 0)
        self._last: int | None = None
        self._items: tuple[MissionItem, ...] = ()
        self._flew = False

    async def begin(self) -> None:
        items = await self.vehicle.driver.downloaded()
        if not items:
            raise BehaviorFailedError("no mission is stored")
        if self._first >= len(items):
            raise BehaviorFailedError(
                f"parameter 'first': there is no item {self._first}; the mission has {len(items)}"
            )
        self._see(items)
        await self._start(self._first)

    async def resume(self) -> None:
        await self._start(self.vehicle.driver.current_item or self._first)

    async def _start(self, first: int) -> None:
        self._progress = None
        await self.vehicle.driver.start_mission(first)
        self._follow(first)

    def _follow(self, first: int) -> None:
        """Follow the order of the items, unless the mission has jumps of its own."""
        if not any(item.command in JUMPS for item in self._items):
            moves = [index for index, item in enumerate(self._items) if is_navigation(item)]
            self._progress = MissionProgress(self.vehicle, self._items, moves, first)

    def finished(self) -> bool:
        """Return whether the last waypoint was reached, or the vehicle has landed and disarmed
        after the flight.

        Raises:
            TakenOverError: another station has set the current item.
        """
        self.check_order()
        state = self.vehicle.state
        self._flew = self._flew or state.landed is False
        reached = self.vehicle.driver.reached_item
        if self._last is not None and reached is not None and reached >= self._last:
            return True
        return self._flew and state.landed is True and state.armed is False

    def _see(self, items: tuple[MissionItem, ...]) -> None:
        moves = [index for index, item in enumerate(items) if is_navigation(item)]
        if not moves:
            raise BehaviorFailedError("the stored mission has no waypoint")
        self._last, self._items = moves[-1], items
        if self.context.fence is not None:
            placed = [items[i] for i in moves if items[i].latitude_deg or items[i].longitude_deg]
            way = [item.latlon for item in placed]
            if reason := self.context.fence.breach(way):
                raise BehaviorFailedError(reason)

    async def reattach(self) -> BehaviorState:
        """Judge by the mode."""
        if self.vehicle.state.mode is not FlightMode.MISSION or not self.vehicle.state.armed:
            return BehaviorState.UNKNOWN
        items = await self.vehicle.driver.downloaded()
        if not items:
            return BehaviorState.UNKNOWN
        self._see(items)
        self._follow(self.vehicle.driver.current_item or 0)
        return BehaviorState.SUCCEEDED if self.finished() else BehaviorState.RUNNING
