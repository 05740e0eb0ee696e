"""What another ground station does to a vehicle of m2pem, on simulated autopilots: what operators
read, how soon, and what the vehicle then does."""

import logging
import re
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from m2pem_plugin_mavlink import VehicleLink
from m2pem_plugin_mavlink.arbiter import MavlinkArbiter
from m2pem_plugin_mavlink.microservices.commands import Command, CommandPosition
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from m2pem_plugin_mavlink.simulator.geometry import Location
from m2pem_plugin_mavlink.simulator.simulator import Simulator
from m2pem_plugin_mavlink.simulator.specification import Kind
from m2pem_plugin_mavlink.vehicle.other_stations import Act, meaning
from mavlink_simulated import AMPLE_S, HOME_ALTITUDE_M, Bench, at, connections, ground_station
from mavlink_simulated import specs as of_kinds
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import BehaviorState, Clock, Point, Route
from m2pem.testing.contracts.arbiter_harness import context
from m2pem.testing.loopback import run_on_loopback

PAGE = Path(__file__).parents[4] / "docs/mavlink.md"
COLUMNS = {
    "goto": ("change_altitude",),
    "area_survey": ("single_vehicle_routing",),
    "run_onboard_mission": (),
    "land": ("takeoff", "return_to_launch", "orbit", "hold", "reverse"),
}
"""A behavior of each column of the page's table, and others that it is for."""
TARGET = Address(1, 1)
FORCE = 21196
SPEED = 20.0
WITHIN_S = 2.5
"""Of the vehicle's clock: a message each second, and then two looks."""
SETTLES_S = 4.0
"""What a text may explain is judged 1.5 s later."""
CORNERS = [at(40.0 * (n % 2), 30.0 * n) for n in range(1, 10)]
ROUTE = Route.of([(*corner, 20.0) for corner in CORNERS], ["relative"] * len(CORNERS))
ON_THE_GROUND = Route.of([(*corner, None) for corner in CORNERS], ["relative"] * len(CORNERS))
COPTERS = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


class World:
    """A vehicle that executes behaviors of m2pem, and another ground station's link to it."""

    bench: Bench
    other: VehicleLink

    def __init__(self, log: pytest.LogCaptureFixture) -> None:
        self._log = log

    @property
    def now_s(self) -> float:
        return self.bench.clock.now_us() / 1e6

    @property
    def texts(self) -> str:
        """What operators have read."""
        return "\n".join(record.getMessage() for record in self._log.records)

    async def until(self, true: Callable[[], bool], within_s: float = AMPLE_S) -> None:
        assert await self.bench.until(true, within_s), self.texts

    async def reads(self, pattern: str, within_s: float) -> None:
        """Wait until operators have read a line."""
        end_s = self.now_s + within_s
        while not re.search(pattern, self.texts):
            assert self.now_s < end_s, (pattern, self.texts)
            await self.bench.clock.sleep(0.1)

    async def up(self, height_m: float = 20.0) -> None:
        await self.bench.do("r1.b1", "takeoff", altitude=height_m)

    async def on_the_way(self, east_m: float = 30.0) -> None:
        await self.bench.simulator.until(lambda: self.bench.level()[0] > east_m)

    async def at_item(self, number: int) -> None:
        """Wait until the mission is at a waypoint, counted from 0."""
        mission = self.bench.truth().autopilot.mission
        await self.bench.simulator.until(lambda: mission.current - mission.first >= number)

    async def command(self, command: int, *params: float, place: CommandPosition | None = None):
        await self.other.perform(Command(TARGET, command, params, place=place))

    async def disarm(self) -> None:
        await self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, FORCE)

    async def set_mode(self, *numbers: float) -> None:
        await self.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, *numbers)

    async def ends(self, id_: str, state: BehaviorState, code: str, within_s: float):
        """Wait until a behavior ends; its report."""
        began_s = self.now_s
        end = await self.bench.ended(id_, AMPLE_S)
        assert (end.state, end.code) == (state, code), end
        assert self.now_s - began_s <= within_s, (self.now_s - began_s, end)
        return end

    @property
    def mode(self) -> str:
        return self.bench.truth().autopilot.modes.mode.name


@pytest.fixture
def world(caplog: pytest.LogCaptureFixture):
    """Run a function with a world of one vehicle."""

    def run(
        main: Callable[[World], Awaitable[None]],
        kind: Kind = Kind.COPTER,
        firmware: str = "ardupilot",
    ) -> None:
        async def entry(clock: Clock) -> None:
            async with AsyncExitStack() as stack:
                vehicles = of_kinds(kind, firmware=firmware)
                simulator = Simulator(vehicles, speed=SPEED, to=None)
                await stack.enter_async_context(simulator)
                lent = context(clock)
                arbiter = MavlinkArbiter(connections(simulator), lent)
                made = World(caplog)
                made.bench = await stack.enter_async_context(Bench(arbiter, clock))
                made.bench.simulator, made.bench.bus = simulator, lent.bus
                made.other = await stack.enter_async_context(ground_station(simulator, clock))
                await main(made)

        with caplog.at_level(logging.WARNING):
            run_on_loopback(entry, SPEED)

    return run


# --- disarmed -------------------------------------------------------------------------------------


@COPTERS
@pytest.mark.parametrize("behavior", ["land", "return_to_launch", "single_vehicle_routing", "hold"])
def test_a_copter_that_is_disarmed_in_the_air_has_not_landed(
    world, behavior: str, firmware: str
) -> None:
    async def main(w: World) -> None:
        await w.up(30.0)
        more = {"route": ROUTE} if behavior == "single_vehicle_routing" else {}
        more |= {"duration": 60.0} if behavior == "hold" else {}
        await w.bench.start("r1.b2", behavior, "v1", **more)
        await w.bench.running("r1.b2", AMPLE_S)
        await w.bench.clock.sleep(2.0)
        await w.disarm()
        end = await w.ends("r1.b2", BehaviorState.FAILED, "FAILED", WITHIN_S)
        found = re.search(r"disarmed (\d+) m above its home, in \S+, and falls", end.reason)
        assert found, end
        assert 20 <= int(found[1]) <= 31
        assert w.bench.truth().up_m > 5.0, "it says so before the vehicle hits the ground"
        assert "disarmed" in w.texts

    world(main, firmware=firmware)


@COPTERS
def test_a_copter_that_lands_away_from_home_has_landed(world, firmware: str) -> None:
    async def main(w: World) -> None:
        await w.up(12.0)
        await w.bench.do("r1.b2", "goto", target=Point((*at(60.0, 0.0), 12.0), "relative"))
        await w.bench.do("r1.b3", "land")
        assert not w.bench.truth().armed
        assert "falls" not in w.texts

    world(main, firmware=firmware)


@pytest.mark.parametrize("kind", [Kind.ROVER, Kind.BOAT])
def test_a_rover_that_is_disarmed_in_its_mission_is_taken_over(world, kind: Kind) -> None:
    async def main(w: World) -> None:
        await w.bench.start("r1.b1", "single_vehicle_routing", "v1", route=ON_THE_GROUND)
        await w.at_item(2)
        await w.disarm()
        end = await w.ends("r1.b1", BehaviorState.FAILED, "TAKEN_OVER", SETTLES_S)
        assert end.reason.startswith("it was disarmed in mission: by another ground station")

    world(main, kind)


# --- missions -------------------------------------------------------------------------------------


@COPTERS
@pytest.mark.parametrize("by_message", [True, False])
def test_another_current_item_is_a_takeover_that_names_what_was_not_passed(
    world, firmware: str, by_message: bool
) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.start("r1.b2", "single_vehicle_routing", "v1", route=ROUTE, speed=8.0)
        await w.at_item(3)
        await w.bench.clock.sleep(1.5)
        first = w.bench.truth().autopilot.mission.first
        at_s = w.now_s
        if by_message:
            make = message_type("MISSION_SET_CURRENT").make
            w.other.send(make(**TARGET.as_target, seq=first + 7))
        else:
            await w.command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT, first + 7)
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TAKEN_OVER", WITHIN_S)
        assert w.now_s - at_s <= WITHIN_S
        assert end.reason == (
            "another ground station has set the current item forward; not passed: waypoint 3 of "
            "the route, waypoint 4 of the route, waypoint 5 of the route, waypoint 6 of the route"
        )
        left = [each.remaining for each in w.bench.of("r1.b2") if each.remaining][-1]
        route = left["route"]["geometry"]["coordinates"]
        assert len(route) >= len(CORNERS) - 3, "what was left out is left"
        assert w.mode in ("AUTO", "AUTO.MISSION"), "the vehicle is not commanded"

    world(main, firmware=firmware)


def test_an_item_that_is_set_back_is_a_takeover_too(world) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.start("r1.b2", "single_vehicle_routing", "v1", route=ROUTE, speed=8.0)
        await w.at_item(4)
        await w.bench.clock.sleep(1.5)
        await w.command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT, 2.0)
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TAKEN_OVER", WITHIN_S)
        assert end.reason.startswith("another ground station has set the current item back from")

    world(main)


@COPTERS
def test_a_route_that_others_leave_alone_is_passed_whole(world, firmware: str) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.do("r1.b2", "single_vehicle_routing", route=ROUTE, speed=12.0)
        near = Route.of([(*at(3.0 * n, 2.0), 20.0) for n in range(12)], ["relative"] * 12)
        await w.bench.do("r1.b3", "single_vehicle_routing", route=near, speed=12.0)

    world(main, firmware=firmware)


@COPTERS
def test_a_mission_that_another_station_pauses_goes_on_when_it_continues(
    world, firmware: str
) -> None:
    async def main(w: World) -> None:
        pause = dialect.MAV_CMD_DO_PAUSE_CONTINUE
        await w.up()
        await w.bench.start("r1.b2", "single_vehicle_routing", "v1", route=ROUTE, speed=8.0)
        await w.at_item(3)
        await (w.set_mode(4, 3) if firmware == "px4" else w.command(pause, 0.0))
        await w.reads("v1 paused by another station: single_vehicle_routing goes on", SETTLES_S)
        await w.bench.clock.sleep(90.0)
        assert w.bench.of("r1.b2")[-1].state is BehaviorState.RUNNING
        await (w.set_mode(4, 4) if firmware == "px4" else w.command(pause, 1.0))
        await w.reads("v1 goes on: it was continued", SETTLES_S)
        await w.bench.ended("r1.b2", AMPLE_S)
        assert w.bench.of("r1.b2")[-1].state is BehaviorState.SUCCEEDED

    world(main, firmware=firmware)


def test_a_px4_that_is_sent_away_in_a_pause_is_taken_over(world) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.start("r1.b2", "single_vehicle_routing", "v1", route=ROUTE, speed=8.0)
        await w.at_item(3)
        await w.set_mode(4, 3)
        await w.reads("paused by another station", SETTLES_S)
        await w.bench.clock.sleep(8.0)
        await w.command(dialect.MAV_CMD_DO_REPOSITION, -1.0, 1.0, 0.0, 0.0, place=elsewhere())
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TAKEN_OVER", 15.0)
        assert end.reason == "another ground station has paused it, and moves it"

    world(main, firmware="px4")


# --- places ---------------------------------------------------------------------------------------


def elsewhere(up_m: float = 20.0) -> CommandPosition:
    return CommandPosition(*at(0.0, 150.0), HOME_ALTITUDE_M + up_m, dialect.MAV_FRAME_GLOBAL)


@pytest.mark.parametrize(
    ("kind", "firmware"),
    [(Kind.COPTER, "ardupilot"), (Kind.COPTER, "px4"), (Kind.ROVER, "ardupilot")],
)
def test_a_target_of_another_station_is_a_takeover_and_the_vehicle_goes_there(
    world, kind: Kind, firmware: str
) -> None:
    async def main(w: World) -> None:
        if kind is Kind.COPTER:
            await w.up()
        await w.bench.start("r1.b2", "goto", "v1", target=Point((*at(300.0, 0.0), 20.0)))
        await w.on_the_way()
        await w.command(dialect.MAV_CMD_DO_REPOSITION, -1.0, 1.0, 0.0, 0.0, place=elsewhere())
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TAKEN_OVER", WITHIN_S)
        assert re.match(
            r"another ground station has sent it to [\d., -]+: 3\d\d m from", end.reason
        )
        mode = w.mode
        await w.bench.simulator.until(lambda: w.bench.level()[1] > 140.0)
        assert w.mode == mode, "m2pem does not command against it"

    world(main, kind, firmware)


def test_a_position_setpoint_of_another_station_is_a_takeover(world) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.start("r1.b2", "goto", "v1", target=Point((*at(300.0, 0.0), 20.0)))
        await w.on_the_way()
        place = Location(*at(300.0, 0.0), 60.0).scaled
        make = message_type("SET_POSITION_TARGET_GLOBAL_INT").make
        relative, alone = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0b1101_1111_1000
        w.other.send(
            make(
                **TARGET.as_target,
                coordinate_frame=relative,
                type_mask=alone,
                lat_int=place[0],
                lon_int=place[1],
                alt=60.0,
            )
        )
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TAKEN_OVER", WITHIN_S)
        assert "0 m from its target, +40 m in height" in end.reason

    world(main)


def test_a_goto_in_every_frame_of_heights_is_not_taken_for_that_of_another_station(world) -> None:
    async def main(w: World) -> None:
        await w.up()
        for number, (height_m, frame) in enumerate(
            ((25.0, "relative"), (HOME_ALTITUDE_M + 15.0, "amsl"), (None, "relative"))
        ):
            place = Point((*at(40.0 * (number % 2), 30.0), height_m), frame)
            await w.bench.do(f"r1.b{number + 2}", "goto", target=place)

    world(main)


# --- settings -------------------------------------------------------------------------------------


def test_operators_read_that_the_home_was_moved_and_where_the_vehicle_returned(world) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.do("r1.b2", "goto", target=Point((*at(30.0, 0.0), 20.0)))
        moved = CommandPosition(*at(360.0, 0.0), HOME_ALTITUDE_M, dialect.MAV_FRAME_GLOBAL)
        await w.command(dialect.MAV_CMD_DO_SET_HOME, 0.0, 0.0, 0.0, 0.0, place=moved)
        await w.reads(r"its home was moved by 360 m and \+0 m in height, to 47\.39", WITHIN_S)
        await w.bench.do("r1.b3", "return_to_launch")
        latitude, longitude = at(360.0, 0.0)
        assert f"its home is {latitude:.6f}, {longitude:.6f}" in w.bench.of("r1.b3")[-1].reason

    world(main)


def test_a_home_that_is_set_at_arming_is_no_news(world) -> None:
    async def main(w: World) -> None:
        for number in (0, 2):
            await w.bench.do(f"r1.b{number}", "takeoff", altitude=10.0)
            await w.bench.do(f"r1.b{number}a", "goto", target=Point((*at(30.0, 0.0), 10.0)))
            await w.bench.do(f"r1.b{number + 1}", "land")
        assert "home was moved" not in w.texts

    world(main)


@pytest.mark.parametrize(
    ("firmware", "name", "value"),
    [
        ("ardupilot", "WPNAV_SPEED", 900.0),
        ("ardupilot", "RTL_ALT", 2100.0),
        ("ardupilot", "FENCE_ENABLE", 1.0),
        ("ardupilot", "FS_GCS_ENABLE", 5.0),
    ],
)
def test_operators_read_that_a_parameter_was_set(
    world, firmware: str, name: str, value: float
) -> None:
    async def main(w: World) -> None:
        await w.up()
        read, make = message_type("PARAM_REQUEST_READ").make, message_type("PARAM_SET").make
        named = {**TARGET.as_target, "param_id": name.encode()}
        w.other.send(read(**named, param_index=-1))
        await w.bench.clock.sleep(2.0)
        assert "parameter" not in w.texts, "to read it is no change"
        real = dialect.MAV_PARAM_TYPE_REAL32
        w.other.send(make(**named, param_value=value, param_type=real))
        await w.reads(rf"v1 parameter {name} was set from [\d.]+ to {value:g}", WITHIN_S)

    world(main, firmware=firmware)


# --- uploads and stops ----------------------------------------------------------------------------


@COPTERS
@pytest.mark.parametrize("answer", ["none", "an error"])
def test_a_mission_whose_acknowledgement_is_lost_is_read_back_and_flown(
    world, monkeypatch: pytest.MonkeyPatch, firmware: str, answer: str
) -> None:
    async def main(w: World) -> None:
        await w.up()
        autopilot = w.bench.truth().autopilot
        send, lost = autopilot.send, []

        def lose(message, *to) -> None:
            """The acknowledgement; ArduPilot refuses an item that comes after it."""
            if message.get_type() != "MISSION_ACK":
                send(message, *to)
                return
            lost.append(message)
            if answer == "an error":
                error = dialect.MAV_MISSION_ERROR
                make = dialect.MAVLink_mission_ack_message
                send(make(message.target_system, message.target_component, error), *to)

        monkeypatch.setattr(autopilot, "send", lose)
        await w.bench.do("r1.b2", "single_vehicle_routing", route=ROUTE, speed=12.0)
        assert lost

    world(main, firmware=firmware)


@pytest.mark.parametrize("kind", [Kind.COPTER, Kind.ROVER, Kind.BOAT, Kind.PLANE])
def test_a_cancel_ends_when_the_vehicle_is_seen_at_rest_or_on_its_circle(world, kind: Kind) -> None:
    async def main(w: World) -> None:
        if kind in (Kind.COPTER, Kind.PLANE):
            await w.up(60.0)
        east_m = w.bench.level()[0]
        await w.bench.start("r1.b2", "goto", "v1", target=Point((*at(east_m + 900.0, 0.0), 60.0)))
        await w.on_the_way(east_m + 60.0)
        await w.bench.arbiter.cancel("r1.b2", 1)
        await w.ends("r1.b2", BehaviorState.CANCELLED, "", 10.0)
        body = w.bench.truth().autopilot.body
        assert kind is Kind.PLANE or body.ground_speed_mps < (2.1 if kind is Kind.BOAT else 1.1)

    world(main, kind)


def test_operators_read_of_a_vehicle_that_does_not_stop(
    world, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def main(w: World) -> None:
        await w.up()
        await w.bench.start("r1.b2", "goto", "v1", target=Point((*at(900.0, 0.0), 20.0)))
        await w.on_the_way(60.0)
        drift(w, monkeypatch)
        await w.bench.arbiter.cancel("r1.b2", 1)
        end = await w.ends("r1.b2", BehaviorState.FAILED, "TIMEOUT", 9.0)
        assert re.search(
            r"8 s of the cancel: it does NOT obey the cancel, in BRAKE at 6", end.reason
        )
        await w.bench.arbiter.hold("v1")
        await w.reads(r"v1 it does NOT obey the hold, in BRAKE at 6.* by remote control", 12.0)

    world(main)


def drift(w: World, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the vehicle move to the east at 6 m/s, whatever its autopilot does."""

    class Drift:
        def step(self, body, setpoint, dt_s: float) -> None:
            body.east_mps, body.north_mps, body.up_mps = 6.0, 0.0, 0.0
            body.east_m += 6.0 * dt_s

    monkeypatch.setattr(w.bench.truth().autopilot, "dynamics", Drift())


# --- the page -------------------------------------------------------------------------------------


def test_the_page_has_the_rules() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for act in Act:
        for behavior, alike in COLUMNS.items():
            assert {meaning(act, each) for each in alike} <= {meaning(act, behavior)}
        what, _, shown = act.value.partition(": ")
        cells = [what, shown, *(meaning(act, behavior).value for behavior in COLUMNS)]
        assert f"| {' | '.join(cells)} |\n" in page
