from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.protocol.messages import Address
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.takeover_monitor import Cause, TakeoverMonitor
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle
from mavlink_vehicle_world import (
    AUTO,
    GUIDED,
    LOITER,
    RTL,
    STABILIZE,
    Playing,
    ScriptedLink,
    copter,
    fly,
    make,
)
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock

Run = Callable[[Callable[[Clock], Any]], Any]

OWN, OTHER = 245, 255
FLYING, ROUTING = frozenset({FlightMode.GUIDED}), frozenset({FlightMode.MISSION, FlightMode.HOLD})
ITEMS = tuple(MissionItem(16, 3, latitude_deg=47.4, longitude_deg=8.5 + n) for n in range(3))


class Watched(Playing):
    """A copter that flies in GUIDED at our wish, with a watch on it."""

    def __init__(self, clock: Clock, *, mode: int = GUIDED) -> None:
        super().__init__(copter(clock))
        self.mode = mode

    async def __aenter__(self) -> tuple[ScriptedLink, Vehicle]:
        link, vehicle = await super().__aenter__()
        fly(link)
        self.watch = TakeoverMonitor(vehicle, OWN)
        self.watch.open()
        await vehicle.driver.set_mode(
            FlightMode.GUIDED if self.mode == GUIDED else FlightMode.MISSION
        )
        assert await vehicle.until(lambda: vehicle.state.armed is True, 5.0)
        return link, vehicle

    async def __aexit__(self, *error: object) -> None:
        await self.watch.close()
        await super().__aexit__(*error)


async def changes_to(link: ScriptedLink, vehicle: Vehicle, mode: int) -> None:
    link.custom_mode = mode
    await vehicle.until(lambda: vehicle.state.custom_mode == mode, 3.0)


def test_our_own_changes_are_nobodys_takeover(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (_, vehicle):
            for mode in (FlightMode.HOLD, FlightMode.RETURN, FlightMode.GUIDED):
                await vehicle.driver.set_mode(mode)
                await vehicle.sleep(5.0)
                assert watched.watch.takeover(FLYING) is None
            await vehicle.driver.disarm()
            await vehicle.sleep(5.0)
            assert watched.watch.takeover(FLYING) is None

    virtual(main)


@pytest.mark.parametrize(
    ("mode", "text", "cause", "words"),
    [
        (
            LOITER,
            "",
            Cause.STATION,
            "another ground station or a switch has taken over: the mode changed from GUIDED to "
            "LOITER, which m2pem did not command",
        ),
        (
            STABILIZE,
            "",
            Cause.PILOT,
            "a person has taken over: the mode changed from GUIDED to STABILIZE, which m2pem "
            "did not command",
        ),
        (
            RTL,
            "Battery 1 is low 10.20V used 900 mAh",
            Cause.FAILSAFE,
            "a failsafe of its own has taken over: the mode changed from GUIDED to RTL: "
            "Battery 1 is low 10.20V used 900 mAh",
        ),
        (
            RTL,
            "GCS Failsafe",
            Cause.FAILSAFE,
            "a failsafe of its own has taken over: the mode changed from GUIDED to RTL: "
            "GCS Failsafe",
        ),
        (
            LOITER,
            "Pilot took over using sticks",
            Cause.PILOT,
            "a person has taken over: the mode changed from GUIDED to LOITER: "
            "Pilot took over using sticks",
        ),
    ],
)
def test_a_change_that_nobody_here_asked_for_is_told_with_its_cause(
    virtual: Run, mode: int, text: str, cause: Cause, words: str
) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            await changes_to(link, vehicle, mode)
            assert watched.watch.takeover(FLYING) is None  # a text may still come
            if text:
                link.say(text)
            else:
                await vehicle.sleep(2.0)
            takeover = watched.watch.takeover(FLYING)
            assert takeover is not None
            assert (takeover.cause, takeover.reason) == (cause, words)

    virtual(main)


def test_a_breach_of_the_fence_is_the_cause_of_a_change_without_a_text(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            boundary = dialect.FENCE_BREACH_BOUNDARY
            link.says["FENCE_STATUS"] = {"breach_status": 1, "breach_type": boundary}
            await vehicle.until(lambda: bool(vehicle.state.fence_breach), 5.0)
            await changes_to(link, vehicle, RTL)
            found = watched.watch.takeover(FLYING)
            assert found is not None
            assert found.cause is Cause.FAILSAFE
            assert found.reason == (
                "a failsafe of its own has taken over: the mode changed from GUIDED to RTL: "
                "fence breached (boundary)"
            )
            # Outside since long, it explains nothing more.
            watched.watch.begin()
            await vehicle.driver.set_mode(FlightMode.GUIDED)
            await vehicle.sleep(5.0)
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            found = watched.watch.takeover(FLYING)
            assert found is not None
            assert found.cause is Cause.STATION

    virtual(main)


def test_a_text_of_long_before_explains_nothing(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            link.say("GCS Failsafe Cleared")
            await vehicle.sleep(10.0)
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            takeover = watched.watch.takeover(FLYING)
            assert takeover is not None
            assert takeover.cause is Cause.STATION

    virtual(main)


def test_another_mode_of_a_behavior_is_a_takeover_too_where_we_asked_for_one(virtual: Run) -> None:
    """A goto goes on in GUIDED or (on PX4) HOLD; but nobody asked for the change between them."""

    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            assert watched.watch.takeover({FlightMode.GUIDED, FlightMode.HOLD}) is not None

    virtual(main)


def test_a_mission_that_is_over_may_end_in_another_mode_and_one_that_is_not_may_not(
    virtual: Run,
) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock, mode=AUTO)
        async with watched as (link, vehicle):
            vehicle.commanded.mission = ITEMS
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            assert watched.watch.takeover(ROUTING) is not None
            link.hear(make("MISSION_ITEM_REACHED", seq=3))
            assert watched.watch.takeover(ROUTING) is None

    virtual(main)


def test_what_is_new_begins_with_the_vehicle_as_it_is(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            watched.watch.begin()
            assert watched.watch.takeover(FLYING) is None
            await changes_to(link, vehicle, STABILIZE)
            await vehicle.sleep(2.0)
            assert watched.watch.takeover(FLYING) is not None

    virtual(main)


def test_a_mode_that_was_there_before_is_a_takeover_when_it_comes_back(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            await changes_to(link, vehicle, LOITER)
            watched.watch.begin()
            await vehicle.driver.set_mode(FlightMode.GUIDED)
            await changes_to(link, vehicle, LOITER)
            await vehicle.sleep(2.0)
            takeover = watched.watch.takeover(FLYING)
            assert takeover is not None
            assert takeover.cause is Cause.STATION

    virtual(main)


def test_after_a_restart_the_modes_of_the_behavior_are_what_counts(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock, mode=AUTO)
        async with watched as (_, vehicle):
            vehicle.commanded.custom_mode = None
            await vehicle.sleep(2.0)
            assert watched.watch.takeover(ROUTING) is None
            assert watched.watch.takeover(FLYING) is not None

    virtual(main)


def test_a_disarming_by_somebody_is_told_and_one_after_landing_is_not(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            link.armed = False
            await vehicle.until(lambda: vehicle.state.armed is False, 3.0)
            await vehicle.sleep(2.0)
            takeover = watched.watch.takeover(FLYING)
            assert takeover is not None
            assert takeover.reason.startswith(
                "it was disarmed in guided: by another ground station"
            )
        watched = Watched(clock)
        async with watched as (link, vehicle):
            await vehicle.driver.land()
            link.says["EXTENDED_SYS_STATE"] = {"landed_state": 1}
            await vehicle.until(lambda: vehicle.state.landed is True, 3.0)
            link.armed = False
            await vehicle.sleep(4.0)
            assert watched.watch.takeover({FlightMode.LAND}) is None

    virtual(main)


def test_a_crash_is_the_cause_of_a_disarming(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock)
        async with watched as (link, vehicle):
            link.say("Crash: Disarming: AngErr=55>30")
            link.armed = False
            await vehicle.sleep(2.0)
            takeover = watched.watch.takeover(FLYING)
            assert takeover is not None
            assert takeover.cause is Cause.FAILSAFE

    virtual(main)


@pytest.mark.parametrize(
    ("total", "words"),
    [
        (3, None),
        (0, None),  # an autopilot that does not say it
        (7, "another ground station has replaced the mission: it has 7 items, not 3"),
        (0xFFFF, "another ground station has cleared the mission"),
    ],
)
def test_a_mission_of_another_length_is_not_ours(
    virtual: Run, total: int, words: str | None
) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock, mode=AUTO)
        async with watched as (link, vehicle):
            vehicle.commanded.mission = ITEMS
            link.says["MISSION_CURRENT"] = {"seq": 0, "total": total}
            await vehicle.sleep(4.0)
            takeover = watched.watch.takeover(ROUTING)
            assert (takeover.reason if takeover else None) == words
            assert watched.watch.takeover({FlightMode.GUIDED}) is None
            vehicle.commanded.mission = ITEMS * 2
            vehicle.state.mission_total = 6
            link.says["MISSION_CURRENT"] = {"seq": 0, "total": 6}
            await vehicle.sleep(4.0)
            assert watched.watch.takeover(ROUTING) is None

    virtual(main)


@pytest.mark.parametrize(
    ("name", "fields", "noticed"),
    [
        ("MISSION_REQUEST", {"seq": 0, "target_system": OTHER}, True),
        ("MISSION_REQUEST_INT", {"seq": 1, "target_system": OTHER}, True),
        ("MISSION_REQUEST_INT", {"seq": 1, "target_system": OWN}, False),
        ("MISSION_REQUEST", {"target_system": OTHER, "mission_type": 1}, False),
        ("MISSION_COUNT", {"count": 9, "target_system": OTHER}, True),
        ("MISSION_COUNT", {"count": 4, "target_system": OTHER}, False),
        ("MISSION_COUNT", {"count": 9, "target_system": OWN}, False),
        ("MISSION_ACK", {"target_system": OTHER}, False),
    ],
)
def test_what_it_says_to_another_station_about_its_mission_is_overheard(
    virtual: Run, name: str, fields: dict[str, int], noticed: bool
) -> None:
    async def main(clock: Clock) -> None:
        watched = Watched(clock, mode=AUTO)
        async with watched as (link, vehicle):
            vehicle.commanded.mission = ITEMS
            await vehicle.sleep(3.0)
            link.hear(make(name, **fields))
            link.hear(make("MISSION_COUNT", count=9, target_system=OTHER), Address(7, 1))
            assert (watched.watch.takeover(ROUTING) is not None) is noticed

    virtual(main)


def test_a_text_that_comes_before_the_first_heartbeat_does_no_harm(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        link, vehicle = copter(clock)
        vehicle.open()
        monitor = TakeoverMonitor(vehicle, OWN)
        monitor.open()
        link.hear(make("STATUSTEXT", text=b"GCS Failsafe Cleared", severity=4))
        assert vehicle.recent_texts() == ("GCS Failsafe Cleared",)
        assert monitor.takeover(FLYING) is None
        await monitor.close()
        await vehicle.close()

    virtual(main)
