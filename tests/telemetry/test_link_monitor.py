import asyncio
import math

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.telemetry import LinkState, PayloadState, VehicleState
from m2pem.engine.inputs import ResourceFault
from m2pem.mission.catalogue import ResourceId
from m2pem.telemetry.bus import Bus
from m2pem.telemetry.link_monitor import STALL_US, LinkMonitor, monitor_links

UGV, UAV, PTZ = ResourceId("evsg1"), ResourceId("uav1"), ResourceId("evsg1/ptz")
S = 1_000_000


async def stays() -> bool:
    """No other executive may receive what this one does not."""
    return False


def vehicle(
    resource: ResourceId = UGV,
    battery: float | None = None,
    link: LinkState = LinkState.CONNECTED,
) -> VehicleState:
    return VehicleState(resource, time_us=0, battery_fraction=battery, link=link)


def lost(resource: ResourceId, reason: str) -> ResourceFault:
    return ResourceFault(resource, "LINK_LOST", reason, reachable=False)


def run_checks(rules: LinkMonitor, until_us: int) -> list[ResourceFault]:
    """Check whenever the watch asks for it, up to a time."""
    faults = []
    while (due := rules.next_check_us) is not None and due <= until_us:
        faults += rules.check(due)
    return faults


# --- links --------------------------------------------------------------------------------------


def test_silence_beyond_the_bound_is_one_fault() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=0)
    rules.received(vehicle(), 10 * S)
    assert run_checks(rules, 13 * S) == []
    assert run_checks(rules, 60 * S) == [lost(UGV, "no telemetry for 3.0 s")]


def test_a_resource_never_heard_is_lost_only_its_bound_after_connecting() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=100 * S)
    assert rules.next_check_us == 103 * S + 1
    assert run_checks(rules, 103 * S) == []
    assert run_checks(rules, 104 * S) == [lost(UGV, "no telemetry since connecting, for 3.0 s")]


def test_each_resource_has_its_own_bound_and_faults_come_in_the_fleets_order() -> None:
    rules = LinkMonitor({UAV: 5.0, UGV: 1.0, PTZ: 1.0}, since_us=0)
    assert [fault.resource for fault in run_checks(rules, 2 * S)] == [UGV, PTZ]
    assert [fault.resource for fault in run_checks(rules, 6 * S)] == [UAV]


def test_hearing_a_vehicle_is_not_hearing_its_payload() -> None:
    rules = LinkMonitor({UGV: 1.0, PTZ: 1.0}, since_us=0)
    rules.received(vehicle(), 1 * S)
    assert [fault.resource for fault in run_checks(rules, 1 * S + 1)] == [PTZ]
    assert rules.received(PayloadState(PTZ, time_us=0), 2 * S) == []


def test_a_link_that_was_received_again_is_lost_again_however_short_that_was() -> None:
    rules = LinkMonitor({UGV: 2.0}, since_us=0)
    assert len(run_checks(rules, 3 * S)) == 1
    assert run_checks(rules, 9 * S) == []
    rules.received(vehicle(), 10 * S)  # it is free, and may be commanded, from then on
    assert run_checks(rules, 12 * S) == []
    assert run_checks(rules, 40 * S) == [lost(UGV, "no telemetry for 2.0 s")]


def test_an_arbiter_that_lost_the_link_is_believed_at_once_and_once() -> None:
    rules = LinkMonitor({UGV: 30.0}, since_us=0)
    rules.received(vehicle(), 1 * S)
    gone = vehicle(link=LinkState.LOST)
    assert rules.received(gone, 2 * S) == [lost(UGV, "its arbiter lost the link")]
    assert rules.received(gone, 3 * S) == []
    assert run_checks(rules, 90 * S) == []


def test_a_degraded_link_is_no_fault() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=0)
    assert rules.received(vehicle(link=LinkState.DEGRADED), 2 * S) == []
    assert run_checks(rules, 5 * S) == []


def test_a_resource_without_a_bound_may_be_silent_for_ever() -> None:
    rules = LinkMonitor({UGV: math.inf}, since_us=0)
    assert rules.next_check_us is None
    assert rules.check(1000 * S) == []
    assert rules.received(vehicle(UAV), 1 * S) == []


def test_a_check_that_comes_late_first_lets_the_waiting_states_be_heard() -> None:
    rules = LinkMonitor({UGV: 3.0, UAV: 3.0}, since_us=0)
    assert rules.check(20 * S) == []
    rules.received(vehicle(UGV), 20 * S)
    assert run_checks(rules, 22 * S) == []
    rules.received(vehicle(UGV), 22 * S)
    assert [fault.resource for fault in run_checks(rules, 23 * S)] == [UAV]


def test_after_a_check_that_comes_a_little_late_no_bound_begins_again() -> None:
    rules = LinkMonitor({UGV: 3.0, UAV: 3.0}, since_us=0)
    rules.received(vehicle(UGV), 2 * S)
    assert rules.check(4 * S) == []
    assert [fault.resource for fault in rules.check(4 * S + STALL_US)] == [UAV]


def test_checks_that_always_come_late_still_find_who_is_silent() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=0)
    assert rules.check(20 * S) == []
    assert rules.check(40 * S) == [lost(UGV, "no telemetry since connecting, for 40.0 s")]


def test_a_check_before_its_time_changes_nothing() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=0)
    assert rules.check(1 * S) == []
    assert rules.next_check_us == 3 * S + 1


# --- nothing is received ------------------------------------------------------------------------


def test_a_link_that_returns_is_received() -> None:
    rules = LinkMonitor({UGV: 3.0, UAV: 3.0}, since_us=0)
    rules.received(vehicle(UGV), 1 * S)
    rules.received(vehicle(UAV), 3 * S)
    assert [fault.resource for fault in run_checks(rules, 5 * S)] == [UGV]
    rules.received(vehicle(UGV), 6 * S)
    assert [fault.resource for fault in run_checks(rules, 6 * S + 1)] == [UAV]
    assert not rules.receives_nothing(6 * S + 1)
    assert rules.receives_nothing(8 * S)


def test_after_a_stall_it_is_not_known_whether_anything_is_received() -> None:
    rules = LinkMonitor({UGV: 3.0}, since_us=0)
    rules.received(vehicle(), 1 * S)
    assert run_checks(rules, 3 * S + 1) == []
    assert not rules.receives_nothing(20 * S)
    assert rules.check(20 * S) == []
    rules.received(vehicle(link=LinkState.LOST), 20 * S)
    assert not rules.receives_nothing(20 * S)
    run_checks(rules, 23 * S)
    assert rules.receives_nothing(24 * S)


# --- batteries ----------------------------------------------------------------------------------


def test_a_low_battery_is_one_fault_of_a_vehicle_that_can_still_be_reached() -> None:
    rules = LinkMonitor({}, since_us=0)
    assert rules.received(vehicle(battery=0.15), S) == []
    assert rules.received(vehicle(battery=0.14), S) == [
        ResourceFault(UGV, "BATTERY_LOW", "battery at 14%, below 15%", reachable=True)
    ]
    assert rules.received(vehicle(battery=0.10), S) == []


def test_a_battery_is_low_again_only_after_it_rose_above_the_upper_level() -> None:
    rules = LinkMonitor({}, since_us=0, critical=0.3, recovered=0.5)
    levels = [0.29, 0.31, 0.29, 0.5, 0.29, None, 0.29, 0.51, 0.29]
    faults = [len(rules.received(vehicle(battery=level), S)) for level in levels]
    assert faults == [1, 0, 0, 0, 0, 0, 0, 0, 1]


def test_batteries_of_two_vehicles_are_apart() -> None:
    rules = LinkMonitor({}, since_us=0)
    assert len(rules.received(vehicle(UGV, battery=0.1), S)) == 1
    assert len(rules.received(vehicle(UAV, battery=0.1), S)) == 1


@pytest.mark.parametrize(("critical", "recovered"), [(0.3, 0.2), (-0.1, 0.2), (0.5, 1.5)])
def test_levels_that_make_no_sense_are_refused(critical: float, recovered: float) -> None:
    with pytest.raises(ValueError, match="fractions"):
        LinkMonitor({}, since_us=0, critical=critical, recovered=recovered)


def test_a_bound_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="above 0 s: evsg1"):
        LinkMonitor({UGV: 0.0}, since_us=0)


# --- fed from the bus ---------------------------------------------------------------------------


def test_watch_hands_on_faults_at_the_time_they_come_true_until_the_bus_is_closed() -> None:
    async def main(clock: VirtualClock) -> list[tuple[int, str, str]]:
        bus = Bus()
        seen: list[tuple[int, str, str]] = []

        def sink(fault: ResourceFault) -> None:
            seen.append((clock.now_us(), fault.resource, fault.code))

        rules = LinkMonitor({UGV: 3.0, UAV: 3.0}, since_us=clock.now_us())
        watching = asyncio.create_task(monitor_links(bus, clock, sink, rules, stays))
        for second in range(10):
            await clock.sleep_until(second * S)
            bus.publish(vehicle(UAV, battery=0.1 if second == 7 else 0.9))
            if second <= 4:
                bus.publish(vehicle(UGV))
        bus.close()
        await watching
        return seen

    assert run_virtual(main, 0) == [(7 * S, UAV, "BATTERY_LOW"), (7 * S + 1, UGV, "LINK_LOST")]


def test_watch_sees_a_vehicle_that_comes_back_and_is_lost_again() -> None:
    async def main(clock: VirtualClock) -> list[int]:
        bus = Bus()
        seen: list[int] = []
        rules = LinkMonitor({UGV: 2.0}, since_us=0)
        watching = asyncio.create_task(
            monitor_links(bus, clock, lambda _: seen.append(clock.now_us()), rules, stays)
        )
        for second in (0, 1, 10, 11, 12, 13):
            await clock.sleep_until(second * S)
            bus.publish(vehicle())
        await clock.sleep_until(30 * S)
        bus.close()
        await watching
        return seen

    assert run_virtual(main, 0) == [3 * S + 1, 15 * S + 1]


def test_watch_can_be_cancelled() -> None:
    async def main(_: VirtualClock) -> bool:
        rules = LinkMonitor({UGV: 2.0}, since_us=0)
        watching = asyncio.create_task(monitor_links(Bus(), _, lambda _: None, rules, stays))
        await asyncio.sleep(0)
        watching.cancel()
        await asyncio.wait([watching])
        return watching.cancelled()

    assert run_virtual(main, 0)


@pytest.mark.parametrize("leaves", [False, True])
def test_a_lost_link_is_not_handed_over_when_the_runs_are_left_to_another_executive(
    leaves: bool,
) -> None:
    async def main(clock: VirtualClock) -> tuple[list[str], list[bool]]:
        bus = Bus()
        seen: list[str] = []
        nothing: list[bool] = []
        rules = LinkMonitor({UGV: 2.0, UAV: 2.0, PTZ: 2.0}, since_us=0)

        async def left() -> bool:
            nothing.append(rules.receives_nothing(clock.now_us()))
            return leaves and nothing[-1]

        watching = asyncio.create_task(
            monitor_links(bus, clock, lambda fault: seen.append(fault.resource), rules, left)
        )
        for tenth in range(60):
            await clock.sleep_until(tenth * S // 10)
            bus.publish(vehicle(UAV))
            if tenth < 20:
                bus.publish(vehicle(UGV))
        await clock.sleep_until(20 * S)
        bus.close()
        await watching
        return seen, nothing

    # PTZ was never received, and UGV is lost while UAV is received.
    seen = [PTZ, UGV] if leaves else [PTZ, UGV, UAV]
    assert run_virtual(main, 0) == (seen, [False, False, True])
